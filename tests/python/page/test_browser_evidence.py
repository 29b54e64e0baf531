"""The evidence in the first figure after a check: what is missing is seen there, and a click leads to its place."""

import re

import numpy as np
import pytest

from allanite import Recording
from allanite.page.server import Page
from allanite.page.source import Source
from generators import sinusoid, walk, white
from page_browser import READY, on_allan

pytestmark = [pytest.mark.browser, pytest.mark.long]

RATE, N = 100.0, 40_000
#: Places on the screen of the largest single ordinate and of the measured points near the given frequency, px.
PEAK = """f => {
  const plot = document.getElementById("plot"), { xaxis, yaxis } = plot._fullLayout;
  const box = plot.getBoundingClientRect(), at = (trace, i) =>
    [box.left + xaxis._offset + xaxis.d2p(trace.x[i]), box.top + yaxis._offset + yaxis.d2p(trace.y[i])];
  const single = plot.data.find(t => t.meta === "single");
  const measured = plot.data.find(t => t.meta === "measured");
  const top = single.y.reduce((best, y, i) => y > single.y[best] ? i : best, 0);
  const off = x => Math.abs(Math.log(x / f));
  const near = measured.x.reduce((best, x, i) => off(x) < off(measured.x[best]) ? i : best, 0);
  return { frequency: single.x[top], peak: at(single, top), point: at(measured, near) };
}"""
#: Places on the screen of the shaded ranges, px.
SHADED = """() => [...document.querySelectorAll("#plot .layer-below .shapelayer path, #plot .shapelayer path")]
  .map(p => p.getBoundingClientRect()).filter(r => r.height > 60).map(r => [r.left, r.right])"""
#: Dash patterns of the lines that are drawn, as texts.
DASHES = """() => [...document.querySelectorAll("#plot .scatterlayer path.js-line")]
  .map(p => getComputedStyle(p).strokeDasharray)"""
#: Points per decade of the model's curve and of each effect's.
DENSITY = """() => document.getElementById("plot").data
  .filter(t => /^(model|effect-|limit-)/.test(t.meta || "") && t.x.length > 2)
  .map(t => (t.x.length - 1) / Math.log10(t.x[t.x.length - 1] / t.x[0]))"""


def lined():
    """White noise and a line at 38 Hz that no bin of the spectrum shows."""
    rng = np.random.default_rng(11)
    x = white(rng, N, RATE, 0.01) + sinusoid(N, RATE, 38.0, 0.02)
    return Recording(x, RATE, unit="deg/s", columns=["gyro_x"])


def warm():
    """White noise, a random walk, and a response to a logged temperature."""
    rng, n = np.random.default_rng(3), 5000
    t = 20 + 5 * np.tanh((np.arange(n) - 3000) / 500)
    x = white(rng, n, 1.0, 1.0) + walk(rng, n, 1.0, 1e-4) + 0.4 * t
    return Recording(
        x,
        1.0,
        unit="mrad/s",
        covariates={"temperature": t},
        covariate_units={"temperature": "degC"},
    )


@pytest.fixture
def first_figure(context):
    """Function that opens a log and returns its tab as shown after the check, without any click."""
    pages = []

    def opened(source):
        pages.append(Page([source]).start())
        tab = context.new_page()
        tab.goto(pages[-1].url)
        tab.wait_for_selector(READY, timeout=300_000)
        return tab

    yield opened
    for page in pages:
        page.close()


def settled(tab, view):
    """Wait until a view is chosen and drawn."""
    tab.wait_for_selector(f"[data-tab={view}][aria-selected=true]")
    tab.wait_for_selector(f"body[data-drawn*=' {view} ']")


def test_a_line_is_a_peak_in_a_shaded_range_that_says_its_factor(first_figure):
    tab = first_figure(Source("lined.npz", recording=lined()))
    settled(tab, "psd")
    found = tab.evaluate(PEAK, 38.0)
    assert found["frequency"] == pytest.approx(38.0, abs=0.01)
    # The peak is far above the measured point of its bin; heights on the screen count downwards.
    assert found["point"][1] - found["peak"][1] > 100
    assert any(left - 1 < found["peak"][0] < right + 1 for left, right in tab.evaluate(SHADED))
    labels = tab.locator("#plot .annotation-text").all_text_contents()
    assert any(re.fullmatch(r"[\d.]+ × the model at 3[78](\.\d)? Hz", text) for text in labels)
    under = tab.inner_text("#key")
    assert "Single frequencies" in under
    assert "Fails" in under


def test_the_bar_of_a_card_leads_to_its_place(first_figure):
    tab = first_figure(Source("lined.npz", recording=lined()))
    on_allan(tab)
    bar = tab.locator(".card").first.get_by_role(
        "button", name="of the unexplained misfit at 38 Hz"
    )
    bar.click()
    settled(tab, "psd")
    tab.wait_for_function(
        """() => { const [a, b] = document.getElementById("plot")._fullLayout.xaxis.range.map(v => 10 ** v);
          return 36 < a && a < 38 && 38 < b && b < 40; }"""
    )
    assert tab.evaluate(PEAK, 38.0)["frequency"] == pytest.approx(38.0, abs=0.01)
    # The strip below shows the residuals of the same ordinates, the largest at the line.
    at = tab.evaluate(
        """() => { const { data, _fullLayout } = document.getElementById("plot");
          const { x, y } = data.find(t => t.xaxis === "x2" && t.name.startsWith("single"));
          const [a, b] = _fullLayout.xaxis2.range.map(v => 10 ** v);
          return [x.filter(v => a < v && v < b).length, x[y.indexOf(Math.max(...y))]]; }"""
    )
    assert at[0] > 100
    assert at[1] == pytest.approx(38.0, abs=0.01)


def test_what_is_not_detected_is_dashed_and_every_line_is_smooth(first_figure):
    tab = first_figure(Source("lined.npz", recording=lined()))
    chip = tab.locator(".chip[data-kind=rate_random_walk]")
    assert "not detected (95\xa0% limit)" in chip.inner_text()
    for view in ("allan", "psd"):
        tab.locator(f"[data-tab={view}]").click()
        settled(tab, view)
        assert any(dash not in ("none", "") for dash in tab.evaluate(DASHES))
        assert "Not detected: 95\xa0% limit" in tab.inner_text("#key")
    on_allan(tab)
    # 24 points in all looked jagged; whole numbers of samples are fewer at the left end.
    assert min(tab.evaluate(DENSITY)) > 15


def test_a_temperature_is_seen_beside_the_samples(first_figure):
    tab = first_figure(Source("warm.npz", recording=warm()))
    settled(tab, "samples")
    assert "logged column temperature" in tab.inner_text("#key")
    assert "temperature" in tab.locator("#plot .y2title").text_content()
    # The known part is a line through the samples: it rises by 0.4 mrad/s/°C · 10 °C, drawn in °/s.
    rise = tab.evaluate(
        """() => { const traces = document.getElementById("plot").data;
          const { y } = traces.find(t => t.mode === "lines" && /temperature/.test(t.name));
          return y[y.length - 1] - y[0]; }"""
    )
    assert rise == pytest.approx(np.degrees(4e-3), rel=0.1)


def test_a_clock_starts_with_phase_noise_and_its_axes_say_what_is_drawn(first_figure):
    frequency = white(np.random.default_rng(5), 4000, 1.0, 1e-11)
    tab = first_figure(Source("clock.npz", recording=Recording(frequency, 1.0, unit="1")))
    chips = tab.inner_text("#chips")
    names = ("White PM", "Flicker PM", "White FM", "Flicker FM", "Random-walk FM")
    assert [name for name in names if name not in chips] == []
    on_allan(tab)
    assert "σ_y(τ)" in tab.locator("#plot .ytitle").text_content()
    tab.locator("[data-tab=samples]").click()
    settled(tab, "samples")
    assert "fractional frequency" in tab.locator("#plot .ytitle").text_content()


@pytest.mark.data
@pytest.mark.parametrize(
    ("name", "column", "view", "label", "card"),
    [
        ("mpu6050_raw_7min.npz", "gyro_y", "psd", r"[\d.]+ × the model at 38 Hz", "at 38\xa0Hz"),
        (
            "adis16405_imu3.npz",
            "gyro_z",
            "psd",
            r"[\d.]+ × the model at 19\.\d Hz",
            "between 18 and 21\xa0Hz",
        ),
        ("cats_thermal_b.npz", "gyro_y", "samples", None, "of the unexplained misfit"),
    ],
)
def test_recordings_show_what_is_missing_in_the_first_figure(
    first_figure, data, name, column, view, label, card
):
    tab = first_figure(Source(name, data(name)))
    tab.locator(".axis", has_text=column).click()
    tab.wait_for_selector(
        f".axis[aria-current]:has-text('{column}'):not(.new):not(.fitted)", timeout=300_000
    )
    tab.wait_for_selector(READY)
    settled(tab, view)
    assert card in tab.locator(".card").first.inner_text()
    if label is None:
        assert "logged column temperature" in tab.inner_text("#key")
    else:
        labels = tab.locator("#plot .annotation-text").all_text_contents()
        assert any(re.fullmatch(label, text) for text in labels)
    tab.locator("#verdict .link").first.click()
    tab.wait_for_selector("body[data-drawn]")
