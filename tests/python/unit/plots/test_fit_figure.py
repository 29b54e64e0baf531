"""The figure of a fit: curve, band, effects, spectrum."""

import numpy as np
import pytest

import allanite as al
from allanite.plots import plot_fit
from allanite.plots.curves import component_styles
from allanite.plots.spec import Band, Line, Points, Rule, label_of
from allanite.plots.themes import COMPONENTS
from allanite.plots.words import values_text
from allanite.spectrum.spectrum import cells_of
from generators import resonance, white


def marks(panel, kind, color=None):
    return [m for m in panel.find(kind) if color in (None, m.color)]


def test_fit_shows_measured_model_band_and_every_effect(fits):
    fit = fits[2]
    figure = plot_fit(fit)
    allan = figure.panels[0]
    (measured,) = marks(allan, Points, "measured")
    np.testing.assert_array_equal(measured.x, fit.curve.tau)
    scale = 3600.0 * 180.0 / np.pi  # from rad/s to °/h
    np.testing.assert_allclose(measured.y, scale * fit.curve.measured)
    assert np.all(measured.low < measured.y)
    assert np.all(measured.y < measured.high)
    (model,) = marks(allan, Line, "model")
    at_curve = np.searchsorted(model.x, fit.curve.tau)
    np.testing.assert_allclose(model.x[at_curve], fit.curve.tau)
    np.testing.assert_allclose(model.y[at_curve], scale * fit.curve.model)
    # Lines of any shape are smooth: up to 32 averaging times a decade.
    assert model.x.size > 2 * fit.curve.tau.size
    everywhere, band = allan.find(Band)
    np.testing.assert_allclose(band.low, scale * fit.band.low)
    assert np.all(everywhere.low < band.low)
    assert np.all(everywhere.high > band.high)
    effects = [m for m in allan.find(Line) if m.color in COMPONENTS]
    assert [m.label.split(":")[0] for m in effects] == [
        "angle random walk",
        "bias instability",
        "Gauss-Markov process",
        "sinusoid",
    ]
    assert len({m.color for m in effects}) == 4


def test_fit_strips_share_the_axis_and_hold_the_residuals(fits):
    figure = plot_fit(fits[0])
    allan, below, spectrum, under = figure.panels
    assert (allan.row, below.row, spectrum.row, under.row) == (0, 1, 0, 1)
    assert below.x == allan.x
    assert under.x == spectrum.x
    (points,) = below.find(Points)
    np.testing.assert_array_equal(points.y, fits[0].curve.z)
    assert sorted(r.value for r in below.find(Rule)) == [-3.5, -2.0, 0.0, 2.0, 3.5]
    assert below.y.low == -below.y.high


def test_spectrum_is_two_sided_in_units_per_hertz(fits):
    # White noise of 0.1 per sample at 50 Hz: 0.1² / 50 = 2e-4 at high frequency.
    spectrum = plot_fit(fits[0]).panels[2]
    (points,) = marks(spectrum, Points, "measured")
    # About 15 000 ordinates above 10 Hz: the mean is known to √(2/15 000) ≈ 1.2 %; 4 of these.
    scale = 3600.0 * 180.0 / np.pi  # from rad/s to °/h
    assert np.mean(points.y[points.x > 10.0]) == pytest.approx(2e-4 * scale**2, rel=0.05)
    assert "(°/h)²/Hz" in spectrum.y.label
    assert points.x[-1] == pytest.approx(fits[0].recording.rate / 2, rel=0.1)


def test_a_spectrum_has_a_point_a_cell_not_a_bin(fits):
    fit = fits[2]
    (measured,) = marks(plot_fit(fit).panels[2], Points, "measured")
    bins = fit.data.bins
    assert measured.x.size < len(cells_of(bins.count.size)) < bins.count.size
    # 24 a decade, and a last cell that the record cuts short.
    above = measured.x[measured.x > 0.1 * measured.x[-1]]
    assert 20 <= above.size <= 26
    assert np.all(np.diff(measured.x) > 0.0)


def test_spectrum_components_add_up_to_the_model(fits):
    spectrum = plot_fit(fits[1]).panels[2]
    (model,) = marks(spectrum, Line, "model")
    effects = [m for m in spectrum.find(Line) if m.color in COMPONENTS]
    # What is not detected is drawn, dashed, at the 95 % limit of its coefficient.
    parts = component_styles(fits[1])
    assert [m.dash == "dash" for m in effects] == [part.limit is not None for part in parts]
    total = 0.0
    for mark, part in zip(effects, parts, strict=True):
        effect = fits[1].model.effects[part.place]
        value = fits[1].estimates[part.place][effect.coefficient]
        total += mark.y * (1.0 if part.limit is None else value / part.limit) ** 2
    np.testing.assert_allclose(total, model.y, rtol=1e-9)


def test_a_line_is_marked_at_its_frequency_and_shown_before_it_was_taken_out(fits):
    spectrum = plot_fit(fits[2]).panels[2]
    (rule,) = [r for r in spectrum.find(Rule) if r.axis == "x"]
    assert rule.value == pytest.approx(3.0, abs=0.01)
    (raw,) = marks(spectrum, Points, "raw")
    assert np.any(np.abs(np.log(raw.x / 3.0)) < 0.1)
    assert spectrum.y.high > raw.y.max()


def test_a_band_narrower_than_a_bin_is_drawn_on_single_ordinates():
    rate, n, f, damping, rms = 100.0, 40_000, 38.0, 1e-4, 0.02
    rng = np.random.default_rng(3)
    samples = white(rng, n, rate, 0.01) + resonance(rng, n, rate, f, damping, rms)
    log = al.Recording(samples, rate, unit="deg/s")
    fit = al.fit_model(log, f"N+RES(frequency={f}, damping={damping})")
    spectrum = plot_fit(fit).panels[2]
    (model,) = marks(spectrum, Line, "model")
    floor, band = [m for m in spectrum.find(Line) if m.color in COMPONENTS]
    np.testing.assert_allclose(floor.y + band.y, model.y, rtol=1e-9)
    # Two-sided density at the center of a narrow band: rms² / (2π f damping), here a hundred times the floor.
    own = {name: fit[f"RES.{name}"].value for name in ("rms", "frequency", "damping")}
    top = (3600.0 * own["rms"]) ** 2 / (2 * np.pi * own["frequency"] * own["damping"])
    # A record of L correlation times 1/(2π f damping) resolves the center to 1/L, and an ordinate is at most π/2L
    # half-widths away from it.
    lengths = n / rate * 2 * np.pi * own["frequency"] * own["damping"]
    least = (1.0 - 1.0 / lengths) * (1.0 - (0.5 * np.pi / lengths) ** 2)
    assert least * top < band.y.max() < top
    assert model.x[model.y.argmax()] == pytest.approx(f, abs=0.01)
    assert np.all(np.diff(model.x) > 0.0)
    # No point of a line is the mean of a range that holds the band: 1 % away from the center the density has fallen by
    # (damping / 1 %)²; the mean of the next range is that of its near end at most.
    away = np.abs(model.x / f - 1.0) > 0.01
    assert band.y[away].max() < top * (own["damping"] / 0.01) ** 2
    # The single ordinates scatter about this line: their sum is that of the density to 4 standard deviations.
    (single,) = marks(spectrum, Line, "raw")
    drawn = np.interp(single.x, model.x, model.y)
    scatter = np.sqrt(2.0 * np.sum(drawn**2))
    assert np.sum(single.y) == pytest.approx(np.sum(drawn), abs=4.0 * scatter)
    assert spectrum.y.high > single.y.max()


def test_legend_gives_the_values_that_say_most():
    def estimate(value, unit, interval=None, detected=True):
        return al.Estimate(value, None, interval, unit, detected)

    lag = {"correlation_time": estimate(30.0, "s"), "q_c": estimate(0.002, "rad/s/s^½")}
    assert (
        values_text(al.GaussMarkov, lag | {"sigma": estimate(0.0077, "rad/s")})
        == "σ = 1590 °/h, T = 30 s"
    )
    nothing = estimate(0.0, "rad/s/s^½", (0.0, 0.001), detected=False)
    limit = lag | {"q_c": nothing, "sigma": estimate(0.0, "rad/s")}
    assert values_text(al.GaussMarkov, limit).startswith("q_c < ")
    line = {
        "frequency": estimate(3.0, "Hz", (2.9, 3.1), detected=False),
        "amplitude": estimate(0.1, "deg/s", (0.0, 0.2), detected=False),
    }
    assert values_text(al.Sinusoid, line) == "f = 3 Hz, a < 720 °/h"


def test_a_covariate_is_named_by_its_column():
    rng = np.random.default_rng(4)
    temperature = 20.0 + np.cumsum(rng.standard_normal(4000)) * 0.01
    samples = rng.standard_normal(4000) + 5.0 * temperature
    log = al.Recording(samples, rate=10.0, unit="mg", covariates={"temperature": temperature})
    figure = plot_fit(al.fit_model(log, "N+COV(column=temperature)"))
    labels = [label_of(m) for m in figure.legend()]
    assert any("temperature: c " in label for label in labels)


def test_the_shortest_record_has_a_figure():
    samples = np.random.default_rng(5).standard_normal(40)
    figure = plot_fit(al.fit_model(al.Recording(samples, rate=1.0, unit="1"), "N"))
    spectrum = figure.panels[2]
    (points,) = marks(spectrum, Points, "measured")
    assert np.all((spectrum.y.low < points.y) & (points.y < spectrum.y.high))
    # The interval of the best known point is seen whole.
    best = np.argmin(points.high / points.low)
    assert spectrum.y.low < points.low[best]
    assert points.high[best] < spectrum.y.high
