"""Photograph the page in both themes, before and after the loop: docs/screenshots/page-*.png (make screenshots)."""

import sys
from pathlib import Path

from playwright.sync_api import sync_playwright

from allanite.cli.commands.demo import HIDDEN, SHOWN
from allanite.effects import parse_model
from allanite.page import explore

HERE = Path(__file__).parent / "screenshots"
CHROMIUM = "/usr/bin/chromium"
READY = "body[data-busy=false][data-drawn] #verdict b"


def main() -> None:
    HERE.mkdir(exist_ok=True)
    recording = parse_model(f"{SHOWN}+{HIDDEN}").simulate(
        duration=7200.0, rate=100.0, seed=1, unit="rad/s"
    )
    page = explore(recording.called("gyroscope.npz"), open_browser=False)
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=CHROMIUM)
        for theme in ("light", "dark"):
            tab = browser.new_page(viewport={"width": 1280, "height": 720}, color_scheme=theme)
            tab.goto(page.url)
            tab.wait_for_selector(READY, timeout=120_000)
            shoot(tab, f"page-before-{theme}")
            tab.hover(".card")
            shoot(tab, f"page-card-{theme}")
            tab.click("#improve")
            tab.wait_for_selector("body[data-busy=false] #verdict .good", timeout=240_000)
            tab.mouse.move(640, 700)
            shoot(tab, f"page-after-{theme}")
            for view in ("psd", "map", "samples", "compare") if theme == "light" else ():
                tab.click(f"[data-tab={view}]")
                tab.mouse.move(640, 700)
                shoot(tab, f"page-{view}-{theme}")
            tab.close()
        browser.close()
    page.close()


def shoot(tab, name: str) -> None:
    tab.wait_for_selector(READY, timeout=120_000)
    tab.wait_for_timeout(600)
    tab.screenshot(path=HERE / f"{name}.png")


if __name__ == "__main__":
    sys.exit(main())
