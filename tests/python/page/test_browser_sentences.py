"""Error growth, NIS and the map begin with a sentence, and show units, intervals, tooltips and verdicts."""

import re

import numpy as np
import pytest

import allanite as al
from allanite import Recording
from generators import walk, white
from page_browser import READY

pytestmark = [pytest.mark.browser, pytest.mark.long]

RATE, N = 20.0, 24_000


@pytest.fixture(scope="module")
def server():
    """A gyroscope with an adequate model, and one whose noise doubles in the middle."""
    rng = np.random.default_rng(8)
    calm = white(rng, N, RATE, 0.01) + walk(rng, N, RATE, 2e-4)
    louder = white(rng, N, RATE, 0.01) * np.where(np.arange(N) < N // 2, 1.0, 2.0)
    columns = np.column_stack([calm, louder])
    log = Recording(columns, RATE, unit="deg/s", columns=["gyro_x", "gyro_y"], path="two.npz")
    page = al.explore(log, open_browser=False)
    yield page
    page.close()


@pytest.fixture
def show(tab):
    """Function that opens a view of an axis, and returns the tab and the sentence above the figure."""

    def shown(view, axis=0):
        tab.locator(f"[data-axis='{axis}']").click()
        tab.wait_for_selector(f"[data-axis='{axis}'][aria-current]:not(.new):not(.fitted)")
        tab.wait_for_selector(READY)
        tab.locator(f"[data-tab={view}]").click()
        tab.wait_for_selector(f"[data-tab={view}][aria-selected=true]")
        tab.wait_for_selector(f"body[data-drawn*=' {view} ']")
        tab.wait_for_selector("#headline:visible")
        return tab, tab.inner_text("#headline")

    return shown


def over(tab, selector):
    """Words of the tooltip at the middle of an element of the figure."""
    box = tab.locator(selector).bounding_box()
    tab.mouse.move(box["x"] + box["width"] / 2 - 8, box["y"] + box["height"] / 2)
    tab.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    return tab.locator("#plot .hoverlayer .hovertext").first.text_content()


def test_error_growth(show):
    tab, sentence = show("error")
    number = r"[\d.]+(·10[⁻⁰-⁹]+)?"
    assert re.match(
        rf"After \d+\xa0(s|min) without a fix, the angle error is {number}°, ", sentence
    )
    assert re.search(rf"velocity error by tilt {number}\xa0m/s, ", sentence)
    assert sentence.endswith(": the measured errors agree.")
    titles = tab.locator("#plot .ytitle, #plot .y2title, #plot .y3title").all_text_contents()
    assert [t.rpartition("(")[2] for t in titles] == ["°)", "m/s)", "m)"]
    # Each measured point has its interval.
    points = tab.locator("#plot .scatterlayer .points path.point").count()
    assert points >= 15
    assert tab.locator("#plot .errorbar path.yerror").count() >= 0.8 * points
    assert "Measured ± 95 %" in tab.inner_text("#plot")
    words = over(tab, "#plot .scatterlayer .points path.point >> nth=5")
    assert re.search(r"^Measured.*s since the fix", words)
    # Another time without a fix is another sentence.
    tab.get_by_label("Then without a fix for").click()
    tab.keyboard.type("30")
    tab.keyboard.press("Enter")
    tab.wait_for_selector("#headline >> text=After 30 s without a fix")


def test_nis(show):
    tab, sentence = show("nis")
    consistent = r"The filter is consistent with the record: \d of \d+ points lie outside the 95\xa0% interval\."
    assert re.fullmatch(consistent, sentence)
    words = over(tab, "#plot .scatterlayer .points path.point >> nth=5")
    assert re.search(r"^Measured.*τ = [\d.]+ s", words)
    assert "95 % if the filter is consistent" in tab.inner_text("#plot")


def test_map(show):
    _, sentence = show("map")
    assert sentence.startswith("The noise is constant over the record")
    tab, sentence = show("map", 1)
    found = re.match(
        r"Over time: at .*Hz the power is ([\d.]+) × that of the rest of the record", sentence
    )
    assert found
    # The second half has four times the power of the first.
    assert 0.2 < float(found[1]) < 5.0
    words = over(tab, "#plot .nsewdrag")
    assert re.search(r"[\d.]+ × the expected power", words)
