"""Names that are code somewhere are names on the page: read as they are, and nothing that they ask for happens."""

import numpy as np
import pytest

import allanite as al
from allanite import Recording
from page_browser import READY, launched

NAMES = [
    "</script><img src=x onerror=alert(1)>",
    "\"'><svg onload=alert(2)> &lt;b&gt;",
    "<b>gz</b> ${alert(3)}",
]
PATH = "<img src=x onerror=alert(4)>.npz"
VIEWS = ("psd", "map", "samples", "compare", "error", "nis", "axes", "allan")


@pytest.mark.long
@pytest.mark.browser
def test_names_are_read_and_do_nothing():
    x = np.random.default_rng(1).standard_normal((4000, 3))
    recording = Recording(x, 20.0, unit="deg/s", columns=NAMES, path=PATH)
    page, happened = al.explore(recording, open_browser=False), []
    try:
        with launched("chromium") as browser:
            tab = browser.new_page(viewport={"width": 1280, "height": 720})
            tab.set_default_timeout(60_000)
            tab.on("dialog", lambda dialog: (happened.append(dialog.message), dialog.dismiss()))
            tab.on("console", lambda message: happened.append(message.text))
            tab.on("pageerror", lambda error: happened.append(str(error)))
            tab.goto(page.url)
            tab.wait_for_selector(READY)
            for axis, name in enumerate(recording.columns):
                tab.locator(f"[data-axis='{axis}']").click()
                tab.wait_for_selector(f"[data-axis='{axis}'][aria-current]:not(.new):not(.fitted)")
                tab.wait_for_selector(READY)
                assert name in tab.evaluate("document.body.textContent")
                for view in VIEWS:
                    tab.locator(f"[data-tab={view}]").click()
                    drawn = f"body[data-drawn*=' {view} ']"
                    tab.wait_for_selector("#table tbody tr" if view == "axes" else drawn)
            assert PATH in tab.evaluate("document.body.textContent")
            assert tab.locator("img[src=x], body b > b, [onerror], [onload]").count() == 0
    finally:
        page.close()
    assert happened == []
