"""What axe-core finds on the page: nothing serious in any view at any width in either theme, nor in what opens over it."""

import pytest

import allanite as al
from allanite.page import open_page
from page_browser import READY, give, serious_violations
from six_axes import six_axes

pytestmark = [pytest.mark.browser, pytest.mark.long]

WIDTHS = {390: 844, 820: 1180, 1280: 720, 1920: 1080}
VIEWS = ("allan", "psd", "map", "samples", "compare", "axes", "error", "nis", "accept")


@pytest.fixture(scope="module")
def server():
    page = al.explore(six_axes(), open_browser=False)
    yield page
    page.close()


@pytest.fixture(params=["light", "dark"])
def tab(context, request):
    """A tab of either theme."""
    tab = context.new_page()
    tab.emulate_media(color_scheme=request.param)
    return tab


def test_no_view_at_any_width(tab, server):
    tab.goto(server.url)
    tab.wait_for_selector(READY)
    # An axis whose model fails, so that a card is a suggestion.
    tab.locator("[data-axis='2']").click()
    tab.wait_for_selector(".card h3")
    tab.wait_for_selector(READY)
    wrong = []
    for view in VIEWS:
        tab.locator(f"[data-tab={view}]").click()
        drawn = {"axes": "#table tbody", "accept": "#acceptance button"}.get(view)
        drawn = drawn or f"body[data-drawn*=' {view} ']"
        tab.wait_for_selector(drawn)
        for width, height in WIDTHS.items():
            tab.set_viewport_size({"width": width, "height": height})
            tab.wait_for_timeout(300)
            wrong += serious_violations(tab, view, width)
    assert wrong == []


def test_nothing_that_opens_over_it(tab, server):
    tab.goto(server.url)
    tab.wait_for_selector(READY)
    wrong = []
    for width in (390, 1280):
        tab.set_viewport_size({"width": width, "height": WIDTHS[width]})
        for key, shown in (
            ("n", "#table table"),
            ("e", "#catalogue[open] .effect"),
            ("Shift+?", "#help[open]"),
        ):
            tab.keyboard.press(key)
            tab.wait_for_selector(shown)
            wrong += serious_violations(tab, key, width)
            tab.keyboard.press("n" if key == "n" else "Escape")
            if key != "n":
                tab.wait_for_selector(shown, state="hidden")
        tab.locator(".menu summary").click()
        wrong += serious_violations(tab, "menu", width)
        tab.locator(".menu summary").click()
        # A value that is typed with its limits; one that was tried; one that is at its limit.
        first = tab.locator(".chip button.text").first
        value = float(first.inner_text().split()[0])
        first.click()
        tab.get_by_label("Highest N").wait_for()
        wrong += serious_violations(tab, "typed", width)
        tab.locator(".chip input").first.fill(str(2 * value))
        tab.keyboard.press("Enter")
        tab.wait_for_selector("#tried:not([hidden])")
        wrong += serious_violations(tab, "tried", width)
        tab.get_by_role("button", name="Discard").click()
        tab.wait_for_selector("#tried", state="hidden")
        tab.wait_for_selector(READY)
        tab.locator(".chip button.text").first.click()
        tab.get_by_label("Highest N").fill(str(0.5 * value))
        tab.keyboard.press("Enter")
        tab.wait_for_selector(".chip .limits")
        tab.wait_for_selector(READY)
        wrong += serious_violations(tab, "limited", width)
        tab.keyboard.press("m")
        wrong += serious_violations(tab, "typed model", width)
        tab.keyboard.press("Escape")
        tab.keyboard.press("Control+z")
        tab.wait_for_selector(".chip .limits", state="detached")
        tab.wait_for_selector(READY)
    assert wrong == []


def test_neither_the_first_page_nor_the_tour_nor_the_form(tab, tmp_path):
    page = open_page([]).start()
    tab.goto(page.url)
    tab.wait_for_selector(".welcome")
    wrong = []
    for width, height in WIDTHS.items():
        tab.set_viewport_size({"width": width, "height": height})
        wrong += serious_violations(tab, "welcome", width)
    tab.locator("#keys").click()
    tab.locator("#help-tour").click()
    tab.wait_for_selector("#tour[open]")
    wrong += serious_violations(tab, "tour")
    tab.keyboard.press("Escape")
    rows = "\n".join(f"{k},{(k * 7919) % 101}" for k in range(3000))
    (tmp_path / "bare.csv").write_text(f"index,gyro\n{rows}\n")
    give(tab, "[data-pick=log]", tmp_path / "bare.csv")
    tab.wait_for_selector("dialog[open] #form-columns table")
    for width, height in WIDTHS.items():
        tab.set_viewport_size({"width": width, "height": height})
        wrong += serious_violations(tab, "form", width)
    # Of a log that is not read there is nothing to show, and the page says so.
    tab.keyboard.press("Escape")
    tab.locator("#keys").click()
    tab.locator("#help-tour").click()
    tab.wait_for_selector("#message >> text=The tour needs a log that can be read")
    page.close()
    assert wrong == []


def test_two_views(tab, server):
    tab.goto(server.url)
    tab.wait_for_selector(READY)
    tab.locator("#two").click()
    tab.wait_for_selector("#second[data-drawn]")
    wrong = []
    for width, height in WIDTHS.items():
        tab.set_viewport_size({"width": width, "height": height})
        tab.wait_for_timeout(300)
        wrong += serious_violations(tab, width)
    assert wrong == []
