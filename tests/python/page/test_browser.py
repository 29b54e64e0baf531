"""The whole loop with the hand, in each browser: what is read here is what a person sees."""

import re

import numpy as np
import pytest

import allanite as al
from page_browser import READY, give, on_allan, saved

pytestmark = [pytest.mark.browser, pytest.mark.slow]

#: What a tab asks the server again and again.
NEWS = re.compile(r"[?]seen=")


@pytest.fixture(scope="module")
def page(hidden):
    page = al.explore(hidden, open_browser=False)
    yield page
    page.close()


@pytest.fixture
def tab(browser, page):
    """A browser tab on the page that sends nothing to other computers and logs no error."""
    asked, said = [], []
    tab = browser.new_page(viewport={"width": 1280, "height": 720})
    tab.set_default_timeout(60_000)
    tab.on("request", lambda request: asked.append(request.url))
    tab.on("console", lambda message: said.append(message.text))
    tab.on("pageerror", lambda error: said.append(str(error)))
    tab.goto(page.url)
    tab.wait_for_selector(READY)
    on_allan(tab)
    yield tab
    tab.close()
    # That a request was refused is said by the browser; the page says why.
    said = [text for text in said if "status of 400" not in text]
    outside = [url for url in asked if not url.startswith(("http://127.0.0.1:", "data:", "blob:"))]
    assert outside == []
    assert said == []


def chi2(tab):
    """χ²/dof of each step, from its tooltip."""
    texts = tab.locator("#ladder [data-rung]").evaluate_all("rungs => rungs.map(r => r.title)")
    return [float(re.search(r"χ²/dof ([\d.]+)", t)[1]) for t in texts]


def add_first(tab):
    rungs = tab.locator("#ladder li").count()
    tab.locator(".card").first.get_by_role("button", name="add").click()
    tab.wait_for_selector(f"#ladder li:nth-child({rungs + 1})")
    tab.wait_for_selector(READY)


@pytest.mark.slow
def test_the_loop(tab):
    # Measured points, model and its band, and a shaded range where the model fails, with titles that have units.
    traces = tab.locator("#plot .scatterlayer .trace").count()
    assert traces >= 5
    assert tab.locator("#plot .scatterlayer .points path.point").count() > 40
    assert tab.locator("#plot .shapelayer path, #plot .layer-below path").count() >= 1
    assert "°/h" in tab.locator("#plot .ytitle").text_content()
    assert "τ (s)" in tab.locator("#plot .x2title").text_content()
    assert "Fails" in tab.locator("#verdict").inner_text()
    card = tab.locator(".card").first
    assert card.locator("h3").inner_text()
    # One bar with words, the whole text, the evidence among the details.
    bar = card.locator(".measure")
    assert bar.count() == 1
    assert re.match(r"Removes \d+\xa0% of the unexplained misfit at 1\.7\xa0Hz", bar.inner_text())
    assert card.inner_text().lower().count(card.locator("h3").inner_text().lower()) == 1
    assert card.locator(".why").evaluate("p => p.scrollHeight <= p.clientHeight + 1")
    assert "ΔlogL" in card.locator("details").text_content()
    add_first(tab)
    first = chi2(tab)
    assert first[1] < first[0]
    add_first(tab)
    assert tab.locator("#verdict").inner_text() == "✓ Adequate: 0\xa0% unexplained"
    assert "0\xa0% unexplained ✓" in tab.locator("#ladder [aria-current]").inner_text()
    kinds = tab.locator(".chip").evaluate_all("chips => chips.map(c => c.dataset.kind)")
    assert {"gauss_markov", "sinusoid"} <= set(kinds)
    told = re.compile(r"(This record cannot distinguish N\+|The record favors|No other model).*\.$")
    assert told.search(tab.get_by_label("Alternative explanations").inner_text())
    tab.keyboard.press("Control+z")
    tab.wait_for_selector("#ladder li:nth-child(3)", state="detached")
    assert chi2(tab) == first
    tab.keyboard.press("Control+Shift+z")
    tab.wait_for_selector("#ladder li:nth-child(3)")
    tab.locator("#ladder button").first.click()
    tab.wait_for_selector("#ladder button[data-rung='0'][aria-current=step]")
    assert tab.locator(".chip").count() == 3


#: The axis shows a range and little beside it.
ZOOMED = """([low, high]) => {
  const [a, b] = document.getElementById("plot")._fullLayout.xaxis.range.map(v => 10 ** v);
  return a < low && high < b && a > low / 12 && b < high + 3 * (high - low);
}"""


@pytest.mark.slow
def test_a_sentence_leads_to_the_place_that_it_speaks_of(tab):
    link = tab.locator("#verdict .link", has_text="Over frequency")
    low, high = map(float, re.search(r"at ([\d.]+)–([\d.]+)\xa0Hz", link.inner_text()).groups())
    tab.locator("[data-tab=samples]").click()
    tab.wait_for_selector("body[data-drawn*=' samples ']")
    link.click()
    tab.wait_for_selector("[data-tab=psd][aria-selected=true]")
    tab.wait_for_selector("body[data-drawn*=' psd '][data-drawn*='from=']")
    tab.wait_for_function(ZOOMED, arg=[low, high])
    # The single frequencies of the range, and ticks that can be read.
    assert tab.get_by_text("Single frequencies").count() == 1
    assert tab.locator("#plot .x2tick text, #plot .xtick text").count() >= 2
    tab.keyboard.press("Escape")
    tab.wait_for_function(f"() => !({ZOOMED})({[low, high]})")


#: Words of the figure that lie outside its frame.
OUTSIDE = """() => {
  const box = document.getElementById("figure").getBoundingClientRect();
  const outside = r => r.left < box.left || r.right > box.right || r.top < box.top || r.bottom > box.bottom;
  const texts = [...document.querySelectorAll("#plot text")].filter(t => t.textContent && t.getBoundingClientRect().width);
  return texts.filter(t => outside(t.getBoundingClientRect())).map(t => t.textContent);
}"""
SIZE = "[document.documentElement.scrollWidth, document.documentElement.scrollHeight]"


@pytest.mark.long
def test_every_view_fits_in_both_themes(tab):
    for _ in range(2):
        for name in ("psd", "map", "samples", "compare", "error", "nis", "allan"):
            tab.locator(f"[data-tab={name}]").click()
            tab.wait_for_selector(f"body[data-drawn*=' {name} ']")
            assert tab.locator("#plot .main-svg").count() >= 1
            assert tab.locator("#empty").inner_text() == ""
            assert tab.evaluate(OUTSIDE) == []
            assert tab.evaluate(SIZE) == [1280, 720]
        tab.keyboard.press("t")
    # A long ladder scrolls by itself.
    tab.evaluate(
        "const l = document.getElementById('ladder'); for (let i = 0; i < 9; i++) l.append(l.firstChild.cloneNode(true))"
    )
    assert tab.evaluate(SIZE) == [1280, 720]


def grip(tab, effect):
    """Position on the screen at which a component's line can be dragged."""
    return tab.evaluate(
        """name => {
          const plot = document.getElementById("plot"), axes = plot._fullLayout, box = plot.getBoundingClientRect();
          const line = plot.data.find(t => t.meta === name), k = 6, { xaxis, yaxis } = axes;
          return [box.left + xaxis._offset + xaxis.d2p(line.x[k]), box.top + yaxis._offset + yaxis.d2p(line.y[k])];
        }""",
        effect,
    )


@pytest.mark.long
def test_a_line_is_dragged_and_the_misfit_seen_before_fitting(tab):
    before = tab.locator(".chip .text").first.inner_text()
    x, y = grip(tab, "effect-0")
    tab.mouse.move(x, y)
    assert "grip" in tab.locator("#plot").get_attribute("class")
    tab.mouse.down()
    tab.mouse.move(x, y - 30, steps=3)
    tab.wait_for_selector("#readout[data-misfit]")
    tab.wait_for_timeout(100)
    live = float(tab.locator("#readout").get_attribute("data-misfit"))
    tab.mouse.up()
    tab.wait_for_selector("#tried:not([hidden])")
    tried = [float(part) for part in re.findall(r"[\d.]+(?=\s|$)", tab.inner_text("#tried span"))]
    assert tried[-1] > tried[0]
    # The misfit seen while dragging is the one that the server finds.
    assert live == pytest.approx(tried[-1], rel=0.02)
    assert float(tab.locator(".chip .text").first.inner_text().split()[0]) > float(
        before.split()[0]
    )
    assert tab.locator("#ladder li").count() == 1
    tab.get_by_role("button", name="discard").click()
    tab.wait_for_selector("#tried", state="hidden")
    assert tab.locator(".chip .text").first.inner_text() == before


@pytest.mark.long
def test_the_loop_by_keyboard_alone(tab):
    # A value is tried.
    tab.locator(".chip .text").first.focus()
    tab.keyboard.press("Enter")
    tab.keyboard.type("0.05")
    tab.keyboard.press("Enter")
    tab.wait_for_selector("#tried:not([hidden])")
    assert "not fitted" in tab.inner_text("#tried")
    tab.get_by_role("button", name="discard").focus()
    tab.keyboard.press("Enter")
    tab.wait_for_selector("#tried", state="hidden")
    # Views by the arrows.
    tab.locator("[data-tab=allan]").focus()
    tab.keyboard.press("ArrowRight")
    tab.wait_for_selector("body[data-drawn*=' psd ']")
    # The first suggestion is added; the focus is not lost.
    tab.locator(".card .add").first.focus()
    tab.keyboard.press("Enter")
    tab.wait_for_selector("#ladder li:nth-child(2)")
    tab.wait_for_selector(READY)
    assert tab.evaluate("document.activeElement !== document.body")
    # Another step, and improve.
    tab.locator("#ladder button").first.focus()
    tab.keyboard.press("Enter")
    tab.wait_for_selector("#ladder button[data-rung='0'][aria-current=step]")
    tab.keyboard.press("i")
    tab.wait_for_selector("#verdict .good")
    assert tab.locator("#ladder li").count() >= 2
    kinds = tab.locator(".chip").evaluate_all("all => all.map(one => one.dataset.kind)")
    assert {"sinusoid", "gauss_markov"} <= set(kinds)


@pytest.mark.long
def test_a_log_without_a_rate_is_asked_about(tab, hidden, tmp_path):
    """The page shows the role of each column (a counter is no sensor), and the user chooses the unit."""
    samples = np.asarray(hidden.samples[:5000])
    rows = np.column_stack([np.arange(samples.size), samples])
    np.savetxt(
        tmp_path / "bare.csv",
        rows,
        fmt=("%d", "%.6f"),
        delimiter=",",
        header="index,gyro",
        comments="",
    )
    give(tab, "[data-pick=log]", tmp_path / "bare.csv")
    tab.wait_for_selector("dialog[open] #form-columns table")
    assert "no sampling rate" in tab.inner_text("#form-problem")
    assert "--" not in tab.inner_text("#form-problem")
    boxes = tab.locator("#form-columns [data-use]")
    assert [boxes.nth(i).is_checked() for i in range(2)] == [False, True]
    assert tab.locator("#form-columns .spark").count() == 2
    tab.fill("#form-rate", "20")
    tab.locator("#form-columns [data-unit]").nth(1).select_option("deg/s")
    tab.click("#form-read")
    tab.wait_for_selector("text=5 000 samples".replace(" ", "\u202f", 1))
    tab.wait_for_selector(READY)
    assert "°/h" in tab.locator("#plot .ytitle").text_content()
    # What is no log says so, and what was open stays.
    (tmp_path / "letter.txt").write_text("dear reader\n")
    give(tab, "[data-pick=log]", tmp_path / "letter.txt")
    tab.wait_for_selector("#message >> text=letter.txt: no rows of numbers")
    assert tab.locator("#ladder li").count() == 1


@pytest.mark.long
def test_files_go_out_and_a_study_comes_back(tab, tmp_path):
    add_first(tab)
    assert saved(tab, "[data-view=svg]").body.lstrip().startswith(b"<?xml")
    assert saved(tab, "[data-view=png]").body.startswith(b"\x89PNG")
    assert b"<!doctype html" in saved(tab, "[data-file='report.html']").body.lower()
    tab.locator("#target").select_option("parameters.json", force=True)
    parameters = saved(tab, "#export")
    assert parameters.name == "hidden-parameters.json"
    assert len(parameters.body) > 100
    study = saved(tab, "[data-file='study.json']")
    assert study.name == "hidden-study.json"
    (tmp_path / study.name).write_bytes(study.body)
    rungs = tab.locator("#ladder button .what").all_inner_texts()
    # Undone, and opened again from the file.
    tab.keyboard.press("Control+z")
    tab.wait_for_selector("#ladder li:nth-child(2)", state="detached")
    give(tab, "[data-pick=study]", tmp_path / study.name)
    tab.wait_for_selector("#ladder li:nth-child(2)")
    tab.wait_for_selector(READY)
    assert tab.locator("#ladder button .what").all_inner_texts() == rungs


@pytest.mark.long
def test_improving_is_watched_and_stopped(tab):
    tab.keyboard.press("i")
    tab.wait_for_selector("#work:not([hidden])")
    tab.wait_for_selector("#ladder li:nth-child(2)")
    tab.locator("#cancel").click()
    tab.wait_for_selector("body[data-busy=false]")
    stopped = tab.locator("#ladder li").count()
    # Cancelled before its check, behind it, or at the end.
    assert re.search("canceled|fails|adequate", tab.inner_text("#verdict"), re.IGNORECASE)
    tab.wait_for_timeout(2000)
    assert tab.locator("#ladder li").count() == stopped


@pytest.mark.long
def test_what_was_answered_is_not_asked_again_while_it_is_read(tab, hidden, tmp_path):
    """States from before the answer arrive while the log is read; the form must stay closed."""
    samples = np.asarray(hidden.samples[:5000])
    np.savetxt(tmp_path / "bare.csv", samples, fmt="%.6f", header="gyro", comments="")
    give(tab, "[data-pick=log]", tmp_path / "bare.csv")
    tab.wait_for_selector("dialog[open] #form-columns table")
    tab.fill("#form-rate", "20")
    orders, told, late = [], [], []

    def as_it_was(route):
        return route.fetch(url=re.sub(r"seen=-?[0-9]+", "seen=-1", route.request.url)).json()

    def again(route):
        found = as_it_was(route)
        route.fulfill(json={**found, "version": found["version"] + 1000 + len(told)})
        told.append(found["problem"])

    tab.route("**/act", lambda route: orders.append(route))
    tab.route(NEWS, again)
    tab.click("#form-read")
    tab.wait_for_timeout(2000)
    assert any(told)
    assert tab.locator("dialog[open]").count() == 0
    # What was asked for before the log is read may arrive after the log.
    tab.unroute(NEWS)
    tab.route(NEWS, lambda route: late.append((route, as_it_was(route))))
    while not late:
        tab.wait_for_timeout(100)
    with tab.expect_response("**/act") as read:
        orders[0].continue_()
    read.value.finished()
    tab.wait_for_timeout(500)
    tab.unroute(NEWS)
    route, found = late[0]
    assert found["problem"]
    route.fulfill(json=found)
    tab.wait_for_selector(READY)
    tab.wait_for_selector("text=5 000 samples".replace(" ", "\u202f", 1))
    assert tab.locator("dialog[open]").count() == 0
