"""Each view at each width: every tab in sight, no words over each other, a sentence's case."""

import pytest

import allanite as al
from allanite.page import open_page
from page_browser import READY
from six_axes import six_axes

pytestmark = pytest.mark.browser

WIDTHS = {390: 844, 820: 1180, 1280: 720, 1920: 1080}
VIEWS = ("allan", "psd", "map", "samples", "compare", "error", "nis")

#: Words of the figure that lie over others, as pairs; a legend that lies over curves.
OVER = """() => {
  const box = n => n.getBoundingClientRect(), out = [], apart = 1.5;
  const texts = [...document.querySelectorAll("#plot text")].filter(t => t.textContent.trim() && box(t).width);
  const meet = (a, b) => a.left + apart < b.right && b.left + apart < a.right
    && a.top + apart < b.bottom && b.top + apart < a.bottom;
  texts.forEach((one, i) => texts.slice(i + 1).forEach(other => {
    if (meet(box(one), box(other))) out.push([one.textContent, other.textContent]);
  }));
  const legend = document.querySelector("#plot .legend .bg"), curves = document.querySelector("#plot .nsewdrag");
  if (legend && curves && box(legend).bottom > box(curves).top + 2) out.push(["legend", "curves"]);
  return out;
}"""
#: Tabs that are not, or not wholly, to be seen.
HIDDEN = """() => {
  const box = n => n.getBoundingClientRect(), list = box(document.querySelector("[role=tablist]"));
  const seen = r => r.left >= list.left - 1 && r.right <= Math.min(list.right, innerWidth) + 1;
  return [...document.querySelectorAll("[role=tab]:not([hidden])")].filter(t => !seen(box(t))).map(t => t.textContent);
}"""
#: What is cut off without a sign of it, or reaches beyond the column of the model.
CUT = """() => {
  const aside = document.querySelector("aside"), seen = n => n.getClientRects().length;
  const right = aside.getBoundingClientRect().right - parseFloat(getComputedStyle(aside).paddingRight) + 1;
  const cut = n => ["hidden", "clip"].includes(getComputedStyle(n).overflowX) && n.scrollWidth > n.clientWidth + 1
    && !getComputedStyle(n).textOverflow.includes("ellipsis") && !n.closest("svg, #plot, .track");
  const all = what => [...document.querySelectorAll(what)].filter(seen);
  const over = n => n.getBoundingClientRect().right > right;
  const found = [...all("body *").filter(cut), ...all("aside button, aside select, aside p").filter(over)];
  return found.map(n => `${n.id || n.className || n.tagName}: ${n.textContent.slice(0, 60)}`);
}"""
#: Words of the figure that reach beyond it.
BEYOND = """() => {
  const edge = document.querySelector("#plot").getBoundingClientRect(), box = n => n.getBoundingClientRect();
  const beyond = r => r.width && (r.left < edge.left || r.right > edge.right || r.top < edge.top || r.bottom > edge.bottom);
  return [...document.querySelectorAll("#plot text")].filter(t => beyond(box(t))).map(t => t.textContent);
}"""
LOWER = """names => [...document.querySelectorAll("option, #plot .legendtext, #readout, label, button, th")]
  .map(n => n.textContent.trim()).filter(t => /^[a-z]/.test(t) && !names.some(n => t.startsWith(n)))"""


@pytest.fixture(scope="module")
def server():
    page = al.explore(six_axes(), open_browser=False)
    yield page
    page.close()


@pytest.mark.long
def test_no_view_hides_or_covers_its_words(context, server):
    tab = context.new_page()
    tab.goto(server.url)
    tab.wait_for_selector(READY)
    # One whose card is a suggestion (that of an adequate axis has no title), the verdict and its choices.
    tab.locator("[data-axis='2']").click()
    tab.wait_for_selector(".card h3")
    tab.wait_for_selector(READY)
    names = [
        *tab.locator(".axis .label").all_inner_texts(),
        "recording",
        "rad",
        "mrad",
        "deg",
        "g",
        "mg",
        "m/s",
        # Names of filters.
        "cuVSLAM",
        "robot_localization",
        "fuse",
    ]
    wrong = []
    for view in VIEWS:
        tab.locator(f"[data-tab={view}]").click()
        tab.wait_for_selector(f"body[data-drawn*=' {view} ']")
        for width, height in WIDTHS.items():
            tab.set_viewport_size({"width": width, "height": height})
            tab.wait_for_timeout(400)
            for what, script in (
                ("over", OVER),
                ("hidden", HIDDEN),
                ("cut", CUT),
                ("beyond", BEYOND),
            ):
                wrong += [(view, width, what, one) for one in tab.evaluate(script)]
            wrong += [(view, width, "case", one) for one in tab.evaluate(LOWER, names)]
    assert sorted({str(one) for one in wrong}) == []


def test_all_tabs_are_in_one_row_from_1280_pixels_on(context):
    page = open_page([]).start()
    tab = context.new_page()
    tab.goto(page.url)
    tab.wait_for_selector(".welcome")
    # The tabs of a log with a temperature, and of one that is compared with others.
    tab.evaluate("document.querySelectorAll('[role=tab]').forEach(t => { t.hidden = false; })")
    for width in (1280, 1920):
        tab.set_viewport_size({"width": width, "height": 720})
        tops = tab.locator(".bar button").evaluate_all(
            "all => [...new Set(all.map(b => Math.round(b.getBoundingClientRect().top / 8)))]"
        )
        assert len(tops) == 1
        assert tab.evaluate(HIDDEN) == []
    page.close()


@pytest.mark.long
def test_the_whole_table_of_axes_is_seen_on_a_small_screen(context, server):
    tab = context.new_page()
    tab.goto(server.url)
    tab.wait_for_selector(READY)
    tab.locator("[data-tab=axes]").click()
    tab.wait_for_selector("#table tbody")
    assert (
        tab.evaluate("table => table.scrollWidth - table.clientWidth", tab.query_selector("#table"))
        <= 0
    )
    # It is the table itself: nothing is behind it.
    assert not tab.locator("#numbers").is_visible()


@pytest.mark.long
def test_the_name_of_the_log_is_read_on_a_phone(context, server):
    tab = context.new_page()
    tab.set_viewport_size({"width": 390, "height": 844})
    tab.goto(server.url)
    tab.wait_for_selector(READY)
    assert tab.locator("#logs").bounding_box()["width"] >= 200
    # Nor is anything cut off of the page without a log.
    page = open_page([]).start()
    tab.goto(page.url)
    tab.wait_for_selector(".welcome")
    assert tab.evaluate("e => e.scrollHeight - e.clientHeight", tab.query_selector("#empty")) <= 0
    page.close()


@pytest.mark.long
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_print_is_dark_on_white_and_names_what_is_missing(context, server, scheme):
    tab = context.new_page()
    tab.emulate_media(color_scheme=scheme)
    tab.goto(server.url)
    tab.wait_for_selector(READY)
    tab.locator("[data-axis='2']").click()
    tab.wait_for_selector(".card h3")
    tab.wait_for_selector(READY)
    tab.set_viewport_size({"width": 794, "height": 1123})
    tab.emulate_media(media="print", color_scheme=scheme)
    if not tab.evaluate("matchMedia('print').matches"):
        pytest.skip("this browser, driven by WebDriver BiDi, does not show how it prints")
    assert tab.locator(".card h3").first.is_visible()
    assert not tab.locator("#enough").is_visible()
    color = tab.evaluate("getComputedStyle(document.body).color.match(/\\d+/g).map(Number)")
    assert max(color) < 100
    # Every axis of the strip is on the sheet.
    ends = tab.locator(".axis").evaluate_all("all => all.map(a => a.getBoundingClientRect().right)")
    assert max(ends) <= 794
    # A browser leaves backgrounds out: that of the figure, whose words are of the theme, stays.
    figure = tab.evaluate("getComputedStyle(document.getElementById('figure')).printColorAdjust")
    assert scheme == "light" or figure == "exact"


@pytest.mark.data
@pytest.mark.long
def test_a_unit_to_be_chosen_is_seen_at_once_and_said_in_the_words_of_the_page(context, data):
    page = open_page([]).start()
    tab = context.new_page()
    tab.goto(page.url)
    tab.get_by_role("button", name="Open a log …").first.click()
    tab.set_input_files("#pick", data("logs/Gyroscope.csv"))
    tab.wait_for_selector("#form-columns [data-unit=x]")
    assert "=" not in tab.inner_text("#form-offers")
    right = tab.locator("#form-columns").bounding_box()
    doubts = tab.locator("#form-columns .doubt", has_text="choose it")
    assert doubts.count() == 3
    box = doubts.first.bounding_box()
    assert box["x"] + box["width"] <= right["x"] + right["width"]
    # A clock's nanoseconds are no row of zeros.
    assert "000000000" not in tab.inner_text("#form-columns")
    page.close()


@pytest.mark.data
@pytest.mark.long
def test_a_card_with_many_alternatives_stays_in_its_column(context, data):
    page = open_page([]).start()
    tab = context.new_page()
    tab.goto(page.url)
    tab.get_by_role("button", name="Open a log …").first.click()
    tab.set_input_files("#pick", data("logs/Gyroscope.csv"))
    tab.wait_for_selector("#form[open]")
    tab.locator("#form [value=no]").click()
    tab.wait_for_selector(READY)
    tab.wait_for_selector(".card summary:has-text('Alternative')")
    for width, height in WIDTHS.items():
        tab.set_viewport_size({"width": width, "height": height})
        tab.wait_for_timeout(400)
        assert tab.evaluate(CUT) == []
    page.close()
