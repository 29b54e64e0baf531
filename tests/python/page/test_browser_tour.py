"""The tour of an empty page: what it points at is there, in view and not covered, with the keyboard alone."""

import pytest

from allanite.page.server import Page
from page_browser import READY, serious_violations

pytestmark = pytest.mark.browser

STEPS = 7
#: Whether the frame lies around what is on the screen, and the words are on the screen and beside it.
PLACED = """() => {
  const of = id => document.getElementById(id).getBoundingClientRect();
  const tour = of("tour"), frame = of("tour-frame");
  const within = r => r.left >= -5 && r.top >= -5 && r.right <= innerWidth + 5 && r.bottom <= innerHeight + 5;
  const on = r => within(r) && r.width > 20 && r.height > 20;
  const beside = tour.right <= frame.left || tour.left >= frame.right;
  const apart = beside || tour.bottom <= frame.top || tour.top >= frame.bottom;
  return [on(tour), on(frame), apart];
}"""


@pytest.fixture(scope="module")
def server():
    page = Page([]).start()
    yield page
    page.close()


def begun(context, server, size):
    tab = context.new_page()
    said = []
    tab.on("console", lambda message: said.append(message.text))
    tab.on("pageerror", lambda error: said.append(str(error)))
    tab.set_viewport_size({"width": size[0], "height": size[1]})
    tab.emulate_media(reduced_motion="reduce")
    tab.goto(server.url)
    tab.wait_for_selector(".welcome")
    tab.get_by_role("button", name="Take a one-minute tour").focus()
    tab.keyboard.press("Enter")
    tab.wait_for_selector("#tour[open]")
    tab.wait_for_selector(READY)
    return tab, said


@pytest.mark.long
@pytest.mark.parametrize("size", [(390, 844), (820, 1180), (1280, 720), (1920, 1080)])
def test_the_tour_points_at_each_part_and_covers_none(context, server, size):
    tab, said = begun(context, server, size)
    titles = []
    for number in range(1, STEPS + 1):
        assert tab.locator("#tour-count").inner_text() == f"{number} of {STEPS}"
        text = tab.locator("#tour-text").inner_text()
        assert text.endswith(".")
        assert ". " not in text
        titles.append(tab.locator("#tour-title").inner_text())
        tab.wait_for_timeout(250)
        assert tab.evaluate(PLACED) == [True, True, True], titles[-1]
        tab.keyboard.press("ArrowRight")
    assert len(set(titles)) == STEPS
    assert not tab.locator("#tour").is_visible()
    # What the tour was started by is gone with the empty page.
    assert tab.evaluate("document.activeElement.id") == "keys"
    assert said == []


@pytest.mark.long
def test_the_tour_goes_back_and_ends_by_keys_and_starts_from_the_help(context, server):
    tab, _ = begun(context, server, (1280, 720))
    assert tab.evaluate("document.activeElement.id") == "tour-next"
    tab.keyboard.press("ArrowLeft")
    assert tab.locator("#tour-count").inner_text() == f"1 of {STEPS}"
    tab.keyboard.press("Enter")
    tab.keyboard.press("ArrowRight")
    tab.keyboard.press("ArrowLeft")
    assert tab.locator("#tour-title").inner_text() == "Residual"
    # The keys of the page are not pressed by the way.
    tab.keyboard.press("i")
    assert tab.locator("body").get_attribute("data-busy") == "false"
    tab.keyboard.press("Escape")
    assert not tab.locator("#tour").is_visible()
    assert tab.evaluate("document.activeElement.id") == "keys"
    tab.keyboard.press("Shift+?")
    tab.get_by_role("button", name="Take the tour").click()
    tab.wait_for_selector("#tour[open]")
    assert tab.locator("#tour").get_attribute("aria-describedby") == "tour-text"
    # The page beneath is alive.
    tab.locator(".card").first.get_by_role("button", name="add").click()
    tab.wait_for_selector("#ladder li:nth-child(2)")
    tab.keyboard.press("Escape")
    assert not tab.locator("#tour").is_visible()


@pytest.mark.long
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing_in_the_tour(context, server, scheme):
    tab, _ = begun(context, server, (390, 844))
    tab.emulate_media(color_scheme=scheme)
    assert serious_violations(tab) == []
