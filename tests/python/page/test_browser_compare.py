"""Logs of several sensors, rates and units on one page of curves, and what of them is not shown."""

import numpy as np
import pytest

import allanite as al
from allanite import Recording
from generators import white

pytestmark = [pytest.mark.browser, pytest.mark.long]

N = 20_000
#: Colors of the drawn points, and of the effects beside their names, as CSS colors.
COLORS = """() => ({
  curves: [...document.querySelectorAll("#plot .scatterlayer .trace")].map(t => t.querySelector("path.point"))
    .filter(Boolean).map(p => getComputedStyle(p).fill),
  effects: [...document.querySelectorAll(".chip")].map(chip => {
    const probe = document.createElement("i");
    probe.style.color = getComputedStyle(chip).getPropertyValue("--own");
    chip.append(probe);
    const color = getComputedStyle(probe).color;
    probe.remove();
    return color;
  }),
})"""
#: Averaging times and heights of a curve whose name contains a text.
CURVE = """name => {
  const { data } = document.getElementById("plot"), t = data.find(t => t.mode === "markers" && t.name.includes(name));
  return [t.x, t.y, t.yaxis]; }"""


@pytest.fixture(scope="module")
def server():
    """A gyroscope of 20 Hz in rad/s."""
    x = white(np.random.default_rng(1), N, 20.0, 0.01)
    page = al.explore(
        Recording(x, 20.0, unit="rad/s", columns=["gyro"], path="slow.npz"), open_browser=False
    )
    yield page
    page.close()


@pytest.fixture
def tab(tab):
    tab.locator("[data-tab=compare]").click()
    tab.wait_for_selector("body[data-drawn*=' compare ']")
    return tab


def add(tab, button, path, name, curve=None):
    """Add a log or data sheet by its button, and wait for its curve."""
    tab.get_by_role("button", name=button).click()
    tab.set_input_files("#pick", path)
    tab.wait_for_selector(f"#beside >> text={name}")
    tab.wait_for_function(
        "name => document.getElementById('plot').data.some(t => (t.name || '').includes(name))",
        arg=curve or name,
    )


def test_logs_of_other_rates_units_and_sensors_share_the_averaging_times(tab, tmp_path):
    rng, degrees = np.random.default_rng(2), np.degrees(0.01)
    quick = np.column_stack([white(rng, N, 100.0, degrees), white(rng, N, 100.0, 0.002)])
    np.savez(
        tmp_path / "quick.npz",
        data=quick,
        rate_hz=100.0,
        unit=["deg/s", "m/s^2"],
        channels=["gyro", "acc"],
    )
    add(tab, "+ A log …", tmp_path / "quick.npz", "quick.npz")
    tau, size, axis = tab.evaluate(CURVE, "gyro, measured")
    fast, other, same = tab.evaluate(CURVE, "quick.npz gyro")
    # The sensors are equally noisy, whatever the rate and unit of their logs: σ(τ) √τ = 0.01 rad/s √s.
    assert fast[0] == pytest.approx(0.01)
    assert tau[0] == pytest.approx(0.05)
    own = size[0] * np.sqrt(tau[0])
    assert other[0] * np.sqrt(fast[0]) == pytest.approx(own, rel=0.05)
    assert axis == same
    # The accelerometer has an axis of its own below the same averaging times.
    _, _, apart = tab.evaluate(CURVE, "quick.npz acc")
    assert apart != axis
    titles = tab.locator("#plot .ytitle, #plot .y2title").all_text_contents()
    assert [t.rpartition("(")[2] for t in titles] == ["°/h)", "µg)"]
    ranges = tab.evaluate(
        "(l => [l.xaxis.range, l.xaxis2.range])(document.getElementById('plot')._fullLayout)"
    )
    assert ranges[0] == pytest.approx(ranges[1])
    found = tab.evaluate(COLORS)
    assert len(found["effects"]) == 3
    assert len(set(found["curves"])) == len(found["curves"]) >= 3
    assert not set(found["curves"]) & set(found["effects"])


def test_values_of_a_data_sheet_are_lines_and_what_is_not_shown_is_said(tab, tmp_path):
    sheet = tmp_path / "part.toml"
    sheet.write_text(
        'name = "ACME"\n[gyroscope]\nangle_random_walk = "60 deg/sqrt(h)"\n'
        '[accelerometer]\nnoise_density = "240 ug/sqrt(Hz)"\n'
    )
    add(tab, "+ A data sheet …", sheet, "ACME", "ACME: angle random walk")
    line = tab.evaluate(
        "() => { const t = document.getElementById('plot').data.find(t => t.name === 'ACME: angle random walk');"
        "return [t.mode, t.x, t.y]; }"
    )
    assert line[0] == "lines"
    # 60 °/√h are 1 °/√s: 3600 °/h at 1 s.
    assert line[2][0] * np.sqrt(line[1][0]) == pytest.approx(3600.0, rel=0.01)
    rows = tab.locator("#sheet tr", has_text="angle random walk")
    assert rows.count() == 1
    # More curves than colors: the others are named below the figure.
    many = np.random.default_rng(3).standard_normal((2000, 9)) * 0.01
    np.savez(tmp_path / "nine.npz", data=many, rate_hz=50.0, unit="rad/s")
    tab.get_by_role("button", name="+ A log …").click()
    tab.set_input_files("#pick", tmp_path / "nine.npz")
    tab.wait_for_selector("#readout >> text=too many curves")
    said = tab.inner_text("#readout")
    assert "Not shown:" in said
    shown = tab.evaluate("document.getElementById('plot').data.map(t => t.name).join('|')")
    missing = [f"nine.npz x{i}" for i in range(9) if f"nine.npz x{i}" not in shown]
    assert missing
    assert all(name in said for name in missing)
