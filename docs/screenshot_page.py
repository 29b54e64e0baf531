"""Photograph the page (make screenshots): two pictures for the docs, and every tab at four widths in both themes."""

import sys
from pathlib import Path

import numpy as np
from playwright.sync_api import sync_playwright

from allanite import Recording
from allanite.effects import parse_model
from allanite.page import explore, open_page
from allanite.page.source import Source

#: Pictures of the docs.
SHOWN = Path(__file__).parent / "screenshots"
#: Every tab at every width in both themes, to be looked at and not kept.
LOOKED_AT = Path(__file__).parents[1] / "target" / "screenshots"
CHROMIUM = "/usr/bin/chromium"
READY = "body[data-busy=false][data-drawn] #verdict b"
WIDTHS = {390: 844, 820: 1180, 1280: 720, 1920: 1080}
VIEWS = ("allan", "psd", "map", "samples", "compare", "axes", "error", "nis", "accept")
#: Tabs of logs with a temperature, and of several units.
JOBS = ("thermal", "average")
#: Columns of the log that is shown: the axes hide a lag, a line and nothing.
MODELS = {
    "gyro_x": "N(N=1e-4)+B(B=1e-5)+K(K=2e-7)+GM(q_c=3e-5,correlation_time=20)+SIN(frequency=1.7,amplitude=4e-5)",
    "gyro_y": "N(N=1.1e-4)+B(B=1.2e-5)+K(K=1e-7)+SIN(frequency=1.7,amplitude=3e-5)",
    "gyro_z": "N(N=1e-4)+B(B=1e-5)+K(K=2e-7)",
}


def recording() -> Recording:
    """Recording of three simulated axes of a gyroscope."""
    columns = [
        parse_model(text).simulate(duration=3600.0, rate=50.0, seed=i, unit="rad/s").samples
        for i, text in enumerate(MODELS.values(), 1)
    ]
    return Recording(
        np.column_stack(columns), 50.0, unit="rad/s", columns=list(MODELS), path="gyroscope.npz"
    )


def warmed(seed: int) -> Source:
    """Simulated gyroscope whose bias follows its temperature."""
    temperature = 25.0 + 20.0 * (1.0 - np.exp(-np.arange(4000) / 800.0))
    noise = parse_model("N(N=0.05)").simulate(n=4000, rate=1.0, seed=seed, unit="deg/s").samples
    log = Recording(
        0.01 * temperature + noise,
        1.0,
        unit="deg/s",
        columns=["gyro"],
        covariates={"temperature": temperature},
        covariate_units={"temperature": "degC"},
    )
    return Source(f"unit{seed}.npz", recording=log)


def main() -> None:
    """Take two pictures for the docs; with --every, pictures of all tabs at all widths."""
    SHOWN.mkdir(exist_ok=True)
    LOOKED_AT.mkdir(parents=True, exist_ok=True)
    page = explore(recording(), open_browser=False)
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=CHROMIUM)
        for theme in ("light", "dark") if "--every" in sys.argv else ("light",):
            size = {"width": 1280, "height": 720}
            tab = browser.new_page(viewport=size, color_scheme=theme)
            tab.set_default_timeout(240_000)
            tab.goto(page.url)
            tab.wait_for_selector(READY)
            if theme == "light":
                show(tab, "allan")
                tab.keyboard.press("v")
                tab.wait_for_selector("#second[data-drawn*=' psd ']")
                picture(tab, SHOWN / "page-two-views.png")
                tab.keyboard.press("v")
                tab.wait_for_selector("#second", state="hidden")
            if "--every" in sys.argv:
                every_view(tab, f"before-{theme}")
            tab.keyboard.press("a")
            tab.wait_for_selector("body[data-busy=true]")
            tab.wait_for_selector("body[data-busy=false] #verdict .good")
            if theme == "light":
                show(tab, "allan")
                picture(tab, SHOWN / "page-after-light.png")
            if "--every" in sys.argv:
                every_view(tab, f"after-{theme}")
            tab.close()
            if "--every" in sys.argv:
                job_views(browser, theme)
        browser.close()
    page.close()


def job_views(browser, theme: str) -> None:
    """Photograph the tabs of two units with a temperature, at each width."""
    page = open_page([warmed(1), warmed(2)]).start()
    tab = browser.new_page(viewport={"width": 1280, "height": 720}, color_scheme=theme)
    tab.set_default_timeout(240_000)
    tab.goto(page.url)
    tab.wait_for_selector(READY)
    tab.click("[data-tab=compare]")
    tab.get_by_role("button", name="+ unit2.npz").click()
    every_view(tab, f"jobs-{theme}", JOBS)
    tab.close()
    page.close()


def show(tab, view: str) -> None:
    """Open a tab and wait until it is drawn."""
    tab.click(f"[data-tab={view}]")
    tab.wait_for_selector(f"body[data-drawn*=' {view} ']")
    tab.mouse.move(640, 700)


def every_view(tab, name: str, views: tuple[str, ...] = VIEWS) -> None:
    """Photograph each tab at each width, with the parts to which one must scroll."""
    for view in views:
        show(tab, view)
        for width, height in WIDTHS.items():
            tab.set_viewport_size({"width": width, "height": height})
            tab.wait_for_timeout(400)
            tab.screenshot(path=LOOKED_AT / f"{name}-{view}-{width}.png", full_page=True)
        tab.set_viewport_size({"width": 1280, "height": 720})


def picture(tab, path: Path) -> None:
    """Photograph the window once animations have ended."""
    tab.wait_for_timeout(600)
    tab.screenshot(path=path)


if __name__ == "__main__":
    sys.exit(main())
