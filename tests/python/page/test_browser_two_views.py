"""Two views beside each other, whose cursors show the same averaging time and frequency."""

import pytest

import allanite as al
from page_browser import READY, on_allan

pytestmark = [pytest.mark.browser, pytest.mark.long]

#: Quantity on the horizontal axis at the cursor's line of a figure.
AT = """id => {
  const plot = document.getElementById(id), axis = plot._fullLayout.xaxis;
  const line = plot.parentElement.querySelector(":scope > .cursor:not(.level)");
  return axis.p2d(line.getBoundingClientRect().left - plot.getBoundingClientRect().left - axis._offset);
}"""
#: Pixels that a figure reaches beyond its half of the frame.
OVER = """() => {
  const box = id => document.getElementById(id).querySelector(".main-svg").getBoundingClientRect();
  const [a, b] = [box("plot"), box("plot2")];
  return [a.right - b.left > 1 && a.bottom - b.top > 1];
}"""


@pytest.fixture(scope="module")
def page(hidden):
    page = al.explore(hidden, open_browser=False)
    yield page
    page.close()


def test_two_views_share_their_cursor(context, page):
    tab = context.new_page()
    tab.goto(page.url)
    tab.wait_for_selector(READY)
    on_allan(tab)
    tab.keyboard.press("v")
    tab.wait_for_selector("#second[data-drawn*=' psd ']")
    assert tab.locator("#two").get_attribute("aria-pressed") == "true"
    assert tab.locator("#plot2").get_attribute("aria-label").startswith("Power spectral density")
    assert tab.evaluate(OVER) == [False]
    box = tab.locator("#plot2").bounding_box()
    tab.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 0.4 * box["height"])
    tab.wait_for_selector("#figure > .cursor")
    f, tau = tab.evaluate(AT, "plot2"), tab.evaluate(AT, "plot")
    # The Allan curve is read at its measured averaging times, ten or fewer per decade.
    assert 0.371 / 1.3 < f * tau < 0.371 * 1.3
    # The second view takes the place of one that the first figure shows.
    tab.locator("[data-tab=psd]").click()
    tab.wait_for_selector("#second[data-drawn*=' allan ']")
    assert tab.locator("#second-view").evaluate("s => s.value") == "allan"
    assert tab.evaluate(OVER) == [False]
    tab.keyboard.press("v")
    tab.wait_for_selector("#second", state="hidden")
    assert tab.locator("#figure").bounding_box()["width"] == pytest.approx(
        tab.locator("#plot").bounding_box()["width"], abs=3
    )


@pytest.mark.parametrize("width", [390, 820, 1280, 1920])
def test_two_views_fit_at_each_width(context, page, width):
    tab = context.new_page()
    tab.set_viewport_size({"width": width, "height": 844})
    tab.goto(page.url)
    tab.wait_for_selector(READY)
    tab.locator("#two").click()
    tab.wait_for_selector("#second[data-drawn]")
    tab.wait_for_timeout(400)
    assert tab.evaluate(OVER) == [False]
    assert tab.locator("#plot2").bounding_box()["height"] > 150
    assert tab.evaluate("document.documentElement.scrollWidth") <= width
