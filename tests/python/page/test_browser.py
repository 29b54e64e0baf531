"""The whole loop with the hand, in Chromium: what is read here is what a person sees."""

from pathlib import Path

import pytest

from allanite.page import explore

CHROMIUM = Path("/usr/bin/chromium")
READY = "body[data-busy=false][data-drawn] #verdict b"
pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(
        not CHROMIUM.exists(), reason="no /usr/bin/chromium (apt-get install chromium)"
    ),
]


@pytest.fixture
def tab(hidden):
    """A browser tab on the page; nothing may leave this computer, and the console stays clean."""
    sync_playwright = pytest.importorskip("playwright.sync_api").sync_playwright
    page = explore(hidden, open_browser=False)
    asked, said = [], []
    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=str(CHROMIUM))
        tab = browser.new_page(viewport={"width": 1280, "height": 720})
        tab.set_default_timeout(60_000)
        tab.on("request", lambda request: asked.append(request.url))
        tab.on("console", lambda message: said.append(message.text))
        tab.on("pageerror", lambda error: said.append(str(error)))
        tab.goto(page.url)
        tab.wait_for_selector(READY)
        yield tab
        browser.close()
    page.close()
    outside = [url for url in asked if not url.startswith(("http://127.0.0.1:", "data:", "blob:"))]
    assert outside == []
    assert said == []


def chi2(tab):
    """χ²/dof on each rung, as written."""
    texts = tab.locator("#ladder button").all_inner_texts()
    return [float(t.split("χ²/dof")[1].split()[0]) for t in texts]


def add_first(tab):
    rungs = tab.locator("#ladder li").count()
    tab.locator(".card").first.get_by_role("button", name="add").click()
    tab.wait_for_selector(f"#ladder li:nth-child({rungs + 1})")
    tab.wait_for_selector(READY)


def test_the_loop(tab):
    # Measured points, model and its band, and a shaded range where the model fails, with titles that have units.
    traces = tab.locator("#plot .scatterlayer .trace").count()
    assert traces >= 5
    assert tab.locator("#plot .scatterlayer .points path.point").count() > 40
    assert tab.locator("#plot .shapelayer path, #plot .layer-below path").count() >= 1
    assert "rad/s" in tab.locator("#plot .ytitle").text_content()
    assert "τ (s)" in tab.locator("#plot .x2title").text_content()
    assert "fails" in tab.locator("#verdict").inner_text()
    card = tab.locator(".card").first
    assert card.locator("h3").inner_text()
    assert "ΔlogL" in card.inner_text()
    add_first(tab)
    first = chi2(tab)
    assert first[1] < first[0]
    add_first(tab)
    assert "adequate" in tab.locator("#verdict").inner_text()
    kinds = tab.locator(".chip").evaluate_all("chips => chips.map(c => c.dataset.kind)")
    assert {"gauss_markov", "sinusoid"} <= set(kinds)
    tab.keyboard.press("Control+z")
    tab.wait_for_selector("#ladder li:nth-child(3)", state="detached")
    assert chi2(tab) == first
    tab.keyboard.press("Control+Shift+z")
    tab.wait_for_selector("#ladder li:nth-child(3)")
    tab.locator("#ladder button").first.click()
    tab.wait_for_selector("#ladder button[data-rung='0'][aria-current=step]")
    assert tab.locator(".chip").count() == 3


def test_every_view_is_drawn_in_both_themes(tab):
    for _ in range(2):
        for name in ("psd", "map", "samples", "compare", "allan"):
            tab.locator(f"[data-tab={name}]").click()
            tab.wait_for_selector(f"body[data-drawn*=' {name} ']")
            assert tab.locator("#plot .main-svg").count() >= 1
            assert tab.locator("#empty").inner_text() == ""
        tab.keyboard.press("t")


def test_a_value_is_tried_by_keyboard(tab):
    tab.locator(".chip .text").first.focus()
    tab.keyboard.press("Enter")
    tab.keyboard.type("0.05")
    tab.keyboard.press("Enter")
    tab.wait_for_selector("#tried:not([hidden])")
    assert "not fitted" in tab.locator("#tried").inner_text()
