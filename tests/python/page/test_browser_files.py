"""As a new user with files that others measured: from the file to the filter's file, a part of it, and everything back."""

import base64
import re

import pytest

import allanite as al
from allanite.page.server import Page
from page_browser import READY, give, saved

pytestmark = [pytest.mark.browser, pytest.mark.data]

#: Clicks from the file to the filter's file of all axes, at most.
CLICKS = 8
#: Every click of a hand is counted, and every key; the page's own clicks on a link are none.
COUNT = """for (const kind of ['click', 'keydown'])
  addEventListener(kind, e => { if (e.isTrusted) window[`${kind}s`] = (window[`${kind}s`] || 0) + 1; }, true)"""
#: A file is dropped on the page.
DROP = """([name, content]) => {
  const files = new DataTransfer();
  files.items.add(new File([Uint8Array.from(atob(content), c => c.charCodeAt(0))], name));
  for (const kind of ["dragenter", "dragover", "drop"])
    dispatchEvent(new DragEvent(kind, { dataTransfer: files, bubbles: true, cancelable: true }));
}"""


@pytest.fixture(scope="module")
def server():
    page = Page([]).start()
    yield page
    page.close()


@pytest.fixture
def tab(context, server):
    context.add_init_script(COUNT)
    tab = context.new_page()
    tab.goto(server.url)
    tab.wait_for_selector(".welcome")
    return tab


def start_with(tab, path):
    tab.get_by_role("button", name="Open a log …").first.click()
    tab.set_input_files("#pick", path)
    tab.wait_for_selector("[data-axis='0']")
    tab.wait_for_selector(READY)


def improve_all(tab):
    tab.locator("#improve-all").click()
    tab.wait_for_selector("body[data-busy=true]")
    # Six axes take more than a minute on a busy machine.
    tab.wait_for_selector("body[data-busy=false]", timeout=300_000)


def numbers(text):
    """Names of a file's lines and their numbers."""
    found = re.findall(r"^\s*(\w+):.*?([-+\d.]+e[-+]\d+)", text, re.MULTILINE)
    return {name: float(value) for name, value in found}


@pytest.mark.long
@pytest.mark.parametrize("name", ["mpu6050_raw_7min.npz", "hfi_10hz.npz"])
def test_from_the_file_to_the_filters_file_in_eight_clicks(tab, data, name):
    path = data(name)
    start_with(tab, path)
    recording = al.read(path)
    # What the time column says is a button beside the doubt.
    doubt = tab.locator("#offers button", has_text="Use ")
    if doubt.count():
        doubt.first.click()
        tab.wait_for_selector("#offers button", state="detached")
        tab.wait_for_selector(READY)
        found = next(f for f in recording.audit if "measured_hz" in f.values)
        recording = al.read(path, rate=f"{found.values['measured_hz']!r}!")
    improve_all(tab)
    assert tab.locator(".axis.adequate").count() == 6
    exported = saved(tab, "#export")
    assert exported.name == f"{path.stem}-kalibr.yaml"
    assert tab.evaluate("window.clicks") <= CLICKS
    # It is what the library makes of all axes.
    expected = numbers(al.characterize(recording).export("kalibr"))
    assert len(expected) >= 4
    assert numbers(exported.body.decode()) == pytest.approx(expected, rel=1e-3)


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "axes", "target"),
    [
        ("hfi_10hz.npz", 6, "kalibr.yaml"),
        ("phone_gyro_b.npz", 3, "kalibr.yaml"),
        ("clock_tic_noisefloor_phase.npz", 1, "state-space.json"),
        ("logs/sample_log_small.ulg", 6, "kalibr.yaml"),
    ],
)
def test_a_dropped_file_becomes_a_filters_file_without_typing(tab, data, name, axes, target):
    path = data(name)
    tab.evaluate(DROP, [path.name, base64.b64encode(path.read_bytes()).decode()])
    tab.wait_for_selector(READY)
    improve = "#improve-all" if axes > 1 else "#improve"
    tab.wait_for_selector(f"{improve}:visible")
    if tab.locator(improve).get_attribute("aria-disabled") == "false":
        tab.locator(improve).click()
        tab.wait_for_selector("body[data-busy=true]")
        tab.wait_for_selector("body[data-busy=false]", timeout=300_000)
    assert tab.locator(".axis:not(.new)").count() == (axes if axes > 1 else 0)
    exported = saved(tab, "#export")
    assert exported.name == f"{path.stem}-{target}"
    assert len(exported.body) > 300
    assert tab.evaluate("window.clicks") <= CLICKS
    assert tab.evaluate("window.keydowns || 0") == 0


@pytest.mark.long
def test_units_that_a_log_does_not_say_are_chosen_once_a_sensor(tab, data):
    start_with(tab, data("logs/imu_static_test.csv"))
    # The page asks for the missing units.
    tab.wait_for_selector("#form-columns [data-unit=ax]")
    for kind, unit in (("acceleration", "g"), ("angular rate", "deg/s")):
        tab.locator(f"[data-kind='{kind}']").select_option(unit, force=True)
    units = tab.locator("#form-columns [data-unit]").evaluate_all(
        "all => Object.fromEntries(all.map(s => [s.dataset.unit, s.value]))"
    )
    assert [units[f"a{k}"] for k in "xyz"] == ["g"] * 3
    assert [units[f"g{k}"] for k in "xyz"] == ["deg/s"] * 3
    tab.locator("#form-read").click()
    tab.wait_for_selector(".chip:has-text('m/s/√h')")
    tab.wait_for_selector(READY)
    assert saved(tab, "#export").name == "imu_static_test-kalibr.yaml"
    # Two to choose each of two units and one to improve all; a file that is dropped needs no button to open it.
    assert tab.evaluate("window.clicks") + 5 - 1 <= CLICKS


@pytest.mark.long
def test_a_stretch_is_taken_refitted_and_all_of_it_comes_back(tab, data):
    start_with(tab, data("mpu6050_raw_7min.npz"))
    tab.keyboard.press("4")
    tab.wait_for_selector("body[data-drawn*=' samples ']")
    box = tab.locator("#plot .nsewdrag").first.bounding_box()
    middle = box["y"] + box["height"] / 2
    tab.mouse.move(box["x"] + 0.1 * box["width"], middle)
    tab.mouse.down()
    tab.mouse.move(box["x"] + 0.6 * box["width"], middle, steps=4)
    tab.mouse.up()
    before = tab.locator(".chip .text").first.inner_text()
    tab.get_by_role("button", name="Analyze only this").click()
    tab.wait_for_selector("text=Use the whole record")
    tab.wait_for_selector(READY)
    assert tab.locator(".chip .text").first.inner_text() != before
    # Made by hand, with an effect taken out: a reload brings the model, the part and the tray back.
    tab.get_by_role("button", name="Remove bias instability").click()
    tab.wait_for_selector("#tray >> text=Bias instability")
    tab.wait_for_selector(READY)
    said, values = tab.inner_text("#recording"), tab.inner_text("#chips")
    tab.wait_for_timeout(900)
    tab.reload()
    tab.wait_for_selector(READY)
    assert tab.inner_text("#recording") == said
    assert tab.inner_text("#chips") == values
    assert "Bias instability" in tab.inner_text("#tray")


@pytest.mark.long
def test_a_study_brings_the_tray_back(tab, data, tmp_path):
    path = data("mpu6050_raw_7min.npz")
    start_with(tab, path)
    tab.get_by_role("button", name="Remove bias instability").click()
    tab.wait_for_selector("#tray >> text=Bias instability")
    tab.wait_for_selector(READY)
    study = saved(tab, "[data-file='study.json']")
    (tmp_path / study.name).write_bytes(study.body)
    tab.keyboard.press("Control+z")
    tab.wait_for_selector(".chip[data-kind=bias_instability]")
    give(tab, "[data-pick=log]", path)
    tab.wait_for_selector("#logs option:nth-child(2)", state="attached")
    tab.wait_for_selector(READY)
    give(tab, "[data-pick=study]", tmp_path / study.name)
    tab.wait_for_selector(".chip[data-kind=bias_instability]", state="detached")
    tab.wait_for_selector("#tray >> text=Bias instability")
