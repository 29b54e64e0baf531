"""From the first moment something is seen: the measured curve before its model, and the state of each axis at work."""

import threading

import pytest

import allanite as al
import allanite.page.tab_state
from page_browser import READY
from six_axes import six_axes

pytestmark = [pytest.mark.browser, pytest.mark.long]

#: Counts how often in a row the frame of the figure has neither curve nor words nor table; largest count in `window.blank`.
WATCH = """(() => {
  window.blank = 0; let row = 0;
  const there = id => document.getElementById(id);
  setInterval(() => {
    if (!there("figure")) return;
    const curve = document.querySelector("#plot .scatterlayer .trace, #plot .heatmaplayer image, #plot .hm");
    const empty = !curve && !there("empty").textContent.trim() && there("table").hidden;
    row = empty && document.body.dataset.busy === "true" ? row + 1 : 0;
    window.blank = Math.max(window.blank, row);
  }, 20);
})()"""
POINTS = "#plot .scatterlayer .points path.point"


@pytest.fixture
def held_fits(monkeypatch):
    """Event that delays the first fits of all logs."""
    release, fit = threading.Event(), allanite.page.tab_state.fit_model

    def fit_later(*given, **more):
        release.wait(120)
        return fit(*given, **more)

    monkeypatch.setattr(allanite.page.tab_state, "fit_model", fit_later)
    yield release
    release.set()


def test_the_curve_is_seen_before_the_model_and_the_canvas_is_never_empty(context, held_fits):
    page = al.explore(six_axes(n=4000), open_browser=False)
    try:
        context.add_init_script(WATCH)
        tab = context.new_page()
        tab.goto(page.url)
        tab.wait_for_selector(POINTS)
        tab.wait_for_selector("#work-name >> text=Fitting")
        # The words of the progress are not cut off.
        progress = tab.locator("#work-name")
        assert progress.evaluate(
            "e => e.scrollWidth <= e.clientWidth && e.scrollHeight <= e.clientHeight"
        )
        assert tab.locator(POINTS).count() > 5
        assert tab.locator("#plot .errorbar").count() > 5
        assert "Allan deviation (°/h)" in tab.locator("#plot .ytitle").text_content()
        # No model yet, and each axis of the strip has its curve.
        assert tab.locator(".chip").count() == 0
        tab.wait_for_function("() => document.querySelectorAll('#strip svg path').length === 6")
        # A view that needs the model says what it waits for.
        tab.locator("[data-tab=psd]").click()
        tab.wait_for_selector("#empty #stage >> text=Fitting")
        waiting = tab.locator("#empty")
        assert "recording" in waiting.locator("h2").inner_text()
        assert waiting.inner_text().replace("\u202f", " ").count("✓ Read: 4 000 samples") == 1
        assert waiting.locator("progress").is_visible()
        tab.locator("[data-tab=allan]").click()
        tab.wait_for_selector(POINTS)
        held_fits.set()
        tab.wait_for_selector(".chip")
        tab.wait_for_selector(READY)
        assert "Model" in tab.inner_text("#key")
        # Three ticks of the clock at most, between words and curve.
        assert tab.evaluate("window.blank") <= 3
    finally:
        page.close()


def test_each_axis_says_what_is_done_with_it_while_all_are_improved(context):
    page = al.explore(six_axes(n=4000), open_browser=False)
    try:
        tab = context.new_page()
        tab.goto(page.url)
        tab.wait_for_selector(READY)
        tab.get_by_role("button", name="Improve all", exact=True).click()
        # One is improved, the others wait; a finished one shows its verdict beside those that wait.
        words = "[...document.querySelectorAll('.axis .state > span')].map(n => n.textContent)"
        tab.wait_for_function(
            f"() => {{ const w = {words}; return w.includes('Improving …') && w.includes('Waiting'); }}"
        )
        tab.wait_for_function(
            f"() => {{ const w = {words}; return w.includes('Adequate') && w.includes('Waiting'); }}"
        )
        tab.wait_for_selector("body[data-busy=false]", timeout=300_000)
        assert set(tab.evaluate(words)) <= {"Adequate", "Fails"}
    finally:
        page.close()
