"""Several axes, a model made by hand, samples and columns, at every width."""

import re

import numpy as np
import pytest

import allanite as al
from allanite import Recording
from allanite.page.shown.deviations import KINDS
from generators import gauss_markov, sinusoid, walk, white
from page_browser import READY, on_allan, saved

RATE, N = 20.0, 24_000
WIDTHS = [(390, 844), (820, 1180), (1280, 720), (1920, 1080)]
pytestmark = [pytest.mark.browser, pytest.mark.slow]


@pytest.fixture(scope="module")
def six():
    """Two gyroscopes, one of which has a line, and an accelerometer, with a temperature."""
    rng = np.random.default_rng(5)
    x = white(rng, N, RATE, 0.01) + sinusoid(N, RATE, 1.7, 0.006)
    y = white(rng, N, RATE, 0.01) + walk(rng, N, RATE, 2e-5)
    z = white(rng, N, RATE, 0.02) + gauss_markov(rng, N, RATE, 1e-2, 8.0)
    return Recording(
        np.column_stack([x, y, z]),
        RATE,
        unit=["rad/s", "rad/s", "m/s^2"],
        columns=["gyro_x", "gyro_y", "acc_x"],
        covariates={"temperature": 20.0 + np.arange(N) / N},
        path="six.npz",
    )


@pytest.fixture(scope="module")
def server(six):
    page = al.explore(six, open_browser=False)
    yield page
    page.close()


def opened(context, server):
    tab = context.new_page()
    tab.goto(server.url)
    tab.wait_for_selector(READY)
    on_allan(tab)
    return tab


@pytest.fixture
def tab(context, server):
    said = []
    tab = context.new_page()
    tab.on("console", lambda message: said.append(message.text))
    tab.on("pageerror", lambda error: said.append(str(error)))
    tab.goto(server.url)
    tab.wait_for_selector(READY)
    on_allan(tab)
    yield tab
    tab.close()
    assert [text for text in said if "status of 400" not in text] == []


def brush(tab, a, b):
    """Drag over the samples from one part of their width to another."""
    box = tab.locator("#plot .nsewdrag").first.bounding_box()
    middle = box["y"] + box["height"] / 2
    drawn = tab.locator("body").get_attribute("data-drawn")
    tab.mouse.move(box["x"] + a * box["width"], middle)
    tab.mouse.down()
    tab.mouse.move(box["x"] + b * box["width"], middle, steps=4)
    tab.mouse.up()
    tab.wait_for_function("was => document.body.dataset.drawn !== was", arg=drawn)


def steps(tab):
    return tab.locator("#ladder li").count()


@pytest.mark.long
def test_every_axis_keeps_its_ladder_and_all_are_improved_and_exported(tab, context, server):
    states = ".axis .state > span"
    assert tab.locator("[data-axis='1']").get_attribute("class") == "axis new"
    # Without the others, which the file says.
    assert saved(tab, "#export").name == "six-kalibr.yaml"
    tab.wait_for_selector("#message >> text=Without gyro_y, acc_x")
    tab.keyboard.press("a")
    tab.wait_for_selector("body[data-busy=true]")
    tab.wait_for_selector("body[data-busy=false]")
    assert tab.locator(states).all_inner_texts() == ["Adequate"] * 3
    assert steps(tab) == 2
    tab.locator("[data-axis='2']").click()
    tab.wait_for_selector("[data-axis='2'][aria-current]")
    assert "Gauss" in tab.inner_text("#chips")
    assert "Velocity random walk" in tab.inner_text("#chips")
    # Undo crosses axes: the last change was here, the one before on the first axis.
    tab.keyboard.press("Control+z")
    tab.wait_for_selector("#ladder li:nth-child(2)", state="detached")
    tab.keyboard.press("Control+z")
    tab.wait_for_selector("[data-axis='0'][aria-current]")
    tab.keyboard.press("Control+Shift+z")
    tab.wait_for_selector("#ladder li:nth-child(2)")
    tab.keyboard.press("Control+Shift+z")
    tab.wait_for_selector("[data-axis='2'][aria-current]")
    tab.wait_for_selector("#ladder li:nth-child(2)")
    tab.locator("[data-tab=axes]").click()
    tab.wait_for_selector("#table tbody tr:nth-child(3)")
    assert tab.inner_text("#table").count("Adequate") == 3
    # Nothing is lost: loaded again, and in another page of this browser.
    tab.locator("[data-tab=allan]").click()
    tab.wait_for_timeout(900)
    tab.reload()
    tab.wait_for_selector(READY)
    assert tab.locator(states).all_inner_texts() == ["Adequate"] * 3
    assert tab.locator("#undo").is_enabled()
    other = opened(context, server)
    assert other.locator(states).all_inner_texts() == ["Adequate"] * 3
    other.locator("[data-axis='2']").click()
    other.wait_for_selector("[data-axis='2'][aria-current]")
    other.wait_for_selector(READY)
    assert steps(other) == 2
    other.close()


@pytest.mark.long
def test_the_model_is_the_users(tab):
    # From the catalogue, with pictures.
    tab.keyboard.press("e")
    tab.wait_for_selector("#catalogue[open] .effect")
    kinds = tab.locator("#effects .effect").evaluate_all("all => all.map(e => e.dataset.kind)")
    assert {"quantization", "gauss_markov", "sinusoid", "bias_step"} <= set(kinds)
    assert tab.locator("#effects svg.picture .own").count() >= 2 * len(kinds) - 2
    assert tab.locator("[data-kind=angle_random_walk] button.main").is_disabled()
    tab.locator("#effects [data-kind=quantization] button").click()
    tab.wait_for_selector(".chip[data-kind=quantization]")
    # Taken out it waits, and comes back.
    tab.wait_for_selector(READY)
    tab.get_by_role("button", name="Remove rate random walk").click()
    tab.wait_for_selector(".chip[data-kind=rate_random_walk]", state="detached")
    tab.wait_for_selector("#tray >> text=Rate random walk")
    tab.get_by_role("button", name="Bring back rate random walk").click()
    tab.wait_for_selector(".chip[data-kind=rate_random_walk]")
    assert tab.locator("#tray").is_hidden()
    # A colour stays with its effect. A chip that is drawn again while it is read has none.
    color = "e => getComputedStyle(e).getPropertyValue('--own')"
    tab.wait_for_selector(READY)
    white = tab.locator(".chip[data-kind=angle_random_walk]").evaluate(color)
    # A lock is a lock.
    lock = tab.locator(".chip[data-kind=angle_random_walk] .lock")
    lock.click()
    tab.wait_for_selector(".chip[data-kind=angle_random_walk] .lock[aria-pressed=true]")
    # Typed, with what is held.
    tab.wait_for_selector(READY)
    tab.keyboard.press("m")
    typed = tab.input_value("#typed-model")
    assert "!" in typed
    tab.fill("#typed-model", "K + N + SIN")
    tab.keyboard.press("Enter")
    tab.wait_for_selector(".chip[data-kind=sinusoid]")
    tab.wait_for_selector(READY)
    assert tab.locator(".chip").count() == 3
    assert tab.locator(".chip[data-kind=angle_random_walk]").evaluate(color) == white
    # What cannot be is one line, and nothing is lost.
    tab.keyboard.press("m")
    tab.fill("#typed-model", "N + ZZ")
    tab.keyboard.press("Enter")
    tab.wait_for_selector("#message >> text=ZZ")
    assert tab.locator(".chip").count() == 3


@pytest.mark.long
def test_limits_are_typed_beside_a_number(tab):
    chip = ".chip[data-kind=angle_random_walk]"
    before = float(tab.locator(f"{chip} .text").first.inner_text().split()[0])
    tab.locator(f"{chip} button.text").first.click()
    tab.get_by_label("Highest N").fill(str(0.5 * before))
    tab.keyboard.press("Enter")
    tab.wait_for_selector(f"{chip} .spread >> text=at its limit")
    assert "at most" in tab.inner_text(f"{chip} .limits")
    tab.wait_for_selector(READY)
    # A typed model and what is copied have them.
    tab.keyboard.press("m")
    assert re.search(r"N=[\d.e-]+\[,[\d.e-]+\]", tab.input_value("#typed-model"))
    tab.keyboard.press("Escape")
    # Looked at and left, they stay; one that is emptied is lifted.
    tab.locator(f"{chip} button.text").first.click()
    tab.keyboard.press("Tab")
    tab.keyboard.press("Tab")
    assert tab.evaluate("document.activeElement.getAttribute('aria-label')").startswith("Highest N")
    tab.keyboard.press("Escape")
    tab.wait_for_selector(f"{chip} .limits")
    tab.locator(f"{chip} button.text").first.click()
    tab.get_by_label("Highest N").fill("")
    tab.keyboard.press("Enter")
    tab.wait_for_selector(f"{chip} .limits", state="detached")
    tab.wait_for_selector(READY)
    tab.keyboard.press("Control+z")
    tab.wait_for_selector(f"{chip} .limits")
    # What cannot be is one line, and nothing is lost.
    tab.locator(f"{chip} button.text").first.click()
    tab.get_by_label("Lowest N").fill("1000")
    tab.keyboard.press("Enter")
    tab.wait_for_selector("#message >> text=is above the upper one")
    tab.wait_for_selector(f"{chip} .limits")


@pytest.mark.slow
def test_another_deviation_at_other_averaging_times(tab):
    def choose(name, value, shown):
        """Wait for the requested figure, because others may be drawn when a check ends."""
        tab.locator(f"[data-option={name}]").select_option(value, force=True)
        tab.wait_for_function(f"() => {shown}")

    def titled(words):
        return f"document.querySelector('#plot .ytitle')?.textContent.includes('{words}')"

    menu = tab.locator("[data-option=kind] option")
    assert menu.all_text_contents() == list(KINDS.values())
    values = [option.get_attribute("value") for option in menu.all()]
    assert values == ["", *list(KINDS)[1:]]
    points = "document.getElementById('plot').data.find(t => /^measured/.test(t.name)).x.length"
    fitted = tab.evaluate(points)
    choose("kind", "ohdev", titled("Hadamard deviation"))
    names = tab.evaluate("document.getElementById('plot').data.map(t => t.name)")
    assert any("Simulated sensor" in name for name in names)
    choose("grid", "octave", f"{points} < {fitted}")
    assert tab.evaluate(points) > 8
    # The numbers are those of the figure.
    tab.keyboard.press("n")
    tab.wait_for_selector("#table tbody tr")
    assert tab.locator("#table table").last.locator("tbody tr").count() == tab.evaluate(points)
    tab.keyboard.press("n")
    choose("kind", "tdev", titled("Time deviation"))
    choose("kind", "", titled("Allan deviation"))
    choose("grid", "", f"{points} === {fitted}")


@pytest.mark.long
def test_two_models_side_by_side(tab):
    assert tab.locator("[data-beside]").count() == 0
    tab.keyboard.press("i")
    tab.wait_for_selector("#ladder li:nth-child(2)")
    tab.wait_for_selector(READY)
    # From the ladder: the step that is looked at, and another.
    tab.locator("[data-beside='0']").click()
    tab.wait_for_selector("body[data-drawn*=' compare ']")
    tab.wait_for_selector("#sheet tr.differs")
    table = tab.inner_text("#sheet")
    assert "Step 1" in table
    assert "Step 0" in table
    line = tab.locator("#sheet tr", has_text="Sinusoid").first
    assert "Only in step 1" in line.inner_text()
    white = tab.locator("#sheet tr", has_text="Angle random walk").first
    assert white.inner_text().count("°/√h") == 2
    better = tab.locator("#sheet tr", has_text="Unseen data").inner_text()
    assert "Step 1 better by" in better
    names = tab.evaluate("document.getElementById('plot').data.map(t => t.name)")
    assert any("step 1" in str(n) for n in names)
    assert any("step 0" in str(n) for n in names)
    # Looked at the other way round, and ended.
    tab.locator("#ladder [data-rung='0']").click()
    tab.wait_for_selector("#sheet tr:has-text('Only in step 1')")
    tab.get_by_role("button", name="Stop comparing with step 1").click()
    tab.wait_for_selector("#sheet", state="hidden")
    assert tab.locator("#ladder li").count() == 2


@pytest.mark.long
def test_samples_down_to_single_ones_and_a_part_taken(tab):
    tab.locator("[data-tab=samples]").click()
    tab.wait_for_selector("body[data-drawn*=' samples ']")
    assert "temperature" in tab.locator("#plot .y2title").text_content()
    brush(tab, 0.25, 0.75)
    start, end = re.findall(r"[\d.]+", tab.inner_text("#beside"))
    assert (float(start), float(end)) == pytest.approx((300, 900), abs=1)  # a pixel is 1.5 s
    tab.get_by_role("button", name="Analyze only this").click()
    tab.wait_for_selector("text=Use the whole record")
    tab.wait_for_selector(READY)
    kept = tab.evaluate("document.getElementById('recording').textContent")
    assert int(re.sub(r"\s", "", kept.split("samples")[0])) == pytest.approx(12_000, abs=100)
    brush(tab, 0.5, 0.52)
    points = "document.querySelectorAll('#plot .points path.point').length"
    assert 0 < tab.evaluate(points) <= 300
    box = tab.locator("#plot .nsewdrag").first.bounding_box()
    tab.mouse.dblclick(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    tab.wait_for_function(f"() => {points} === 0")
    tab.get_by_role("button", name="Use the whole record").click()
    tab.wait_for_selector("text=24 000 samples".replace(" ", "\u202f", 1))


@pytest.mark.long
def test_a_stretch_is_left_out_by_a_brush_and_the_model_is_fitted_again(tab):
    tab.keyboard.press("m")
    tab.fill("#typed-model", "N + SIN")
    tab.keyboard.press("Enter")
    tab.wait_for_selector(".chip[data-kind=sinusoid]")
    tab.wait_for_selector(READY)
    before = tab.inner_text("#chips")
    white = tab.locator(".chip .text").first.inner_text()
    tab.locator("[data-tab=samples]").click()
    tab.wait_for_selector("body[data-drawn*=' samples ']")
    brush(tab, 0.5, 0.75)
    tab.get_by_role("button", name="Exclude this").click()
    tab.wait_for_selector("text=Excluded:")
    tab.wait_for_selector(READY)
    # The same model of what is left, and said on the page.
    assert tab.locator(".chip").count() == 2
    assert tab.inner_text("#chips") != before
    # Each end of the brush is as exact as a pixel, 0.025 min.
    assert re.search(r" (4\.9[5-9]|5|5\.0[1-5])\xa0min excluded$", tab.inner_text("#recording"))
    shaded = "document.getElementById('plot').layout.shapes.filter(s => s.type === 'rect').length"
    assert tab.evaluate(shaded) == 1
    tab.keyboard.press("Control+z")
    tab.wait_for_selector("#recording:not(:has-text('excluded'))")
    tab.wait_for_selector(READY)
    assert tab.inner_text("#chips") == before
    tab.keyboard.press("Control+Shift+z")
    tab.wait_for_selector("#recording:has-text('excluded')")
    tab.get_by_role("button", name="Include").click()
    tab.wait_for_selector("#recording:not(:has-text('excluded'))")
    tab.wait_for_selector(READY)
    assert tab.locator(".chip .text").first.inner_text() == white


@pytest.mark.long
def test_the_catalogue_is_searched_and_closed(tab):
    tab.keyboard.press("e")
    tab.wait_for_selector("#catalogue[open] .effect")
    groups = tab.locator("#effects section h3").all_inner_texts()
    assert groups[0] == "Noise and drift"
    assert {"Lines and bands", "Filters", "Events", "Noise level"} <= set(groups)
    # Common effects at once, rare ones behind "more".
    assert tab.locator("#effects [data-kind=sinusoid]").is_visible()
    assert not tab.locator("#effects [data-kind=drifting_line]").is_visible()
    assert "over τ" in tab.locator("#effects [data-kind=sinusoid] figcaption").first.inner_text()
    tab.get_by_label("Search the effects").fill("vibration")
    shown = tab.locator("#effects .effect:visible").evaluate_all(
        "all => all.map(e => e.dataset.kind)"
    )
    assert "modulated_vibration" in shown
    assert "quantization" not in shown
    tab.get_by_label("Search the effects").fill("no such thing")
    assert tab.locator("#no-effects").is_visible()
    tab.keyboard.press("Escape")
    tab.keyboard.press("Escape")
    tab.wait_for_selector("#catalogue:not([open])", state="attached")
    tab.keyboard.press("e")
    tab.wait_for_selector("#catalogue[open] .effect")
    box = tab.locator("#catalogue-close").bounding_box()
    assert box["y"] < tab.locator("#effects").bounding_box()["y"]
    tab.locator("#catalogue-close").click()
    tab.wait_for_selector("#catalogue:not([open])", state="attached")


@pytest.mark.slow
def test_a_file_says_whether_to_use_it_before_it_is_saved(tab, tmp_path):
    tab.locator(".menu summary").click()
    tab.wait_for_selector("#export-verdict p:not(.faint)")
    said = tab.inner_text("#export-verdict")
    assert re.match(r"Use: (yes|no)\.", said)
    assert "Without gyro_y, acc_x: not yet checked" in said
    assert tab.get_by_role("button", name="Improve all axes first").is_visible()
    tab.locator("h1").click()
    # The data sheet is a line on the compared curves, and each of its figures is judged.
    sheet = tmp_path / "part.toml"
    sheet.write_text('name = "ACME"\n[figures]\nangle_random_walk = "60 deg/sqrt(h)"\n')
    tab.keyboard.press("9")
    tab.get_by_role("button", name="Open a data sheet …").click()
    tab.set_input_files("#pick", sheet)
    tab.wait_for_selector("body[data-drawn*=' compare ']")
    tab.wait_for_function(
        "() => document.getElementById('plot').data.some(t => t.name === 'ACME: angle random walk')"
    )
    tab.locator("[data-tab=accept]").click()
    tab.locator("#acceptance tbody tr", has_text="angle random walk").wait_for()
    assert "✓ Meets" in tab.inner_text("#acceptance")


@pytest.mark.slow
def test_numbers_hover_and_copies(tab):
    tab.keyboard.press("n")
    tab.wait_for_selector("#table table")
    head = tab.locator("#table thead th").all_inner_texts()
    columns = [
        "τ (s)",
        "Measured (°/h)",
        "Low (95\u00a0%)",
        "High (95\u00a0%)",
        "Edf",
        "Model (°/h)",
        "Residual (σ)",
    ]
    assert head[:8] == [*columns, "Angle random walk (°/h)"]
    # One switch to SI.
    tab.locator("#unit").select_option(label="SI: rad/s", force=True)
    tab.locator("#table thead >> text=Measured (rad/s)").wait_for()
    tab.keyboard.press("n")
    labels = tab.locator("#plot .annotation-text").all_text_contents()
    assert any(text.startswith("N 0.0") and "rad/√s" in text for text in labels)
    box = tab.locator("#plot .nsewdrag").first.bounding_box()
    tab.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] * 0.8)
    tab.wait_for_selector("#readout >> text=measured")
    assert "τ = " in tab.inner_text("#readout")
    tab.get_by_role("button", name="Unit of the cursor").click()
    assert "°/" in tab.inner_text("#readout")
    tab.locator(".menu summary").click()
    tab.locator("#as-command").click()
    tab.wait_for_selector("#message >> text=Copied")
    copied = tab.inner_text("#message").partition("\n")[2]
    assert copied.startswith('allanite check "six.npz" --column "gyro_x"')
    tab.keyboard.press("Shift+?")
    tab.wait_for_selector("#help[open]")


OVERFLOW = """() => {
  const width = document.documentElement.clientWidth, out = [];
  if (document.documentElement.scrollWidth > width) out.push(`page ${document.documentElement.scrollWidth}`);
  return out;
}"""


@pytest.mark.long
def test_it_fits_every_width(tab):
    for width, height in WIDTHS:
        tab.set_viewport_size({"width": width, "height": height})
        tab.wait_for_timeout(150)
        assert tab.evaluate(OVERFLOW) == [], width
        figure = tab.locator("#figure").bounding_box()
        assert figure["height"] >= 300, width
        assert figure["width"] >= 0.6 * width
        assert tab.locator("#plot .main-svg").count() >= 1
    tab.set_viewport_size({"width": 1280, "height": 720})
    tops = tab.locator(".card").evaluate_all(
        "all => all.map(c => c.getBoundingClientRect().bottom)"
    )
    assert sum(top < 640 for top in tops) >= min(2, len(tops))
