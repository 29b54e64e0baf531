"""What numbers cost in evidence, and what may stand for two."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

import allanite as al
import generators as g
from allanite.fit.curve import compare_curves
from allanite.fit.rivals.evidence import (
    PRIOR_LOG_RANGE,
    bic_cost,
    parameter_cost,
    parameters_cost,
)
from allanite.fit.rivals.pairs import alternative_pairs, can_be_split

RATE, LENGTH = 50.0, 60_000


def _recording(seed, *more):
    rng = np.random.default_rng(seed)
    x = g.white(rng, LENGTH, RATE, 0.0126)
    return al.Recording(x + sum(f(rng) for f in more), rate=RATE, unit="rad/s")


def _unit_times_second(fit, place):
    """ln of the mean likelihood over the logarithm of a coefficient, with the others at their best, minus the best ln."""
    solution = fit.solution
    own = solution.processes[place].power
    rest = solution.spectrum - own
    steps = np.linspace(-4.0, 4.0, 4001)
    spectrum = rest + own * np.exp(2.0 * steps)[:, None]
    log_l = -0.5 * (np.log(spectrum) + solution.power / spectrum) @ solution.count
    top = log_l.max()
    return float(np.log(np.trapezoid(np.exp(log_l - top), steps) / PRIOR_LOG_RANGE))


@pytest.mark.parametrize(
    ("model", "make"),
    [
        ("N+K", lambda rng: g.walk(rng, LENGTH, RATE, 1e-3)),
        ("N+B", lambda rng: g.flicker(rng, LENGTH, RATE, 4e-3)),
    ],
)
def test_a_strength_costs_what_integration_gives(model, make):
    # Laplace's approximation is good to 1/z² in ln: z is 8 and more here.
    fit = al.fit_model(_recording(1, make), model)
    own = fit.solution.effects[1]
    assert -parameters_cost(own, fit.solution) == pytest.approx(
        _unit_times_second(fit, 1), abs=0.15
    )


@pytest.mark.parametrize(
    ("seed", "frequency", "damping", "rms"),
    [(2, 7.0, 0.01, 0.008), (5, 7.0, 0.001, 0.004), (7, 20.0, 0.01, 0.01), (4, 12.0, 0.1, 0.02)],
)
def test_a_band_costs_what_integration_over_its_parameters_gives(seed, frequency, damping, rms):
    """½ ln n for each of the three parameters would be 3 to 6 nats too much, and more in longer records."""
    recording = _recording(
        seed, lambda rng: g.resonance(rng, LENGTH, RATE, frequency, damping, rms)
    )
    fit = al.fit_model(recording, f"N+RES(frequency={frequency})")
    band, white = fit.model.effects[1], fit.model.effects[0]
    x = np.asarray(recording.samples).ravel()
    f = np.fft.rfftfreq(LENGTH, 1.0 / RATE)
    near = (f > 0.0) & (np.abs(f - band.frequency) < max(1.0, 8.0 * band.damping * band.frequency))
    f, power = f[near], np.abs(np.fft.rfft(x)[near]) ** 2 / (LENGTH * RATE)
    floor = white.psd(f, RATE)
    half = band.damping * band.frequency
    frequencies = band.frequency + half * np.linspace(-1.5, 1.5, 31)
    dampings = np.minimum(band.damping * np.exp(np.linspace(-2.5, 2.5, 25)), 0.69)
    sizes = band.rms * np.exp(np.linspace(-1.2, 1.2, 31))
    log_l = np.empty((31, 25, 31))
    for i, middle in enumerate(frequencies):
        for k, width in enumerate(dampings):
            shape = al.effects.Resonance(frequency=middle, damping=width, rms=1.0).psd(f, RATE)
            spectrum = floor + sizes[:, None] ** 2 * shape
            log_l[i, k] = -(np.log(spectrum) + power / spectrum).sum(axis=1)
    inner = np.trapezoid(np.exp(log_l - log_l.max()), np.log(sizes), axis=2)
    inner = np.trapezoid(inner, np.log(dampings), axis=1)
    mean = np.trapezoid(inner, frequencies) / (0.5 * RATE * PRIOR_LOG_RANGE**2)
    cost = parameters_cost(fit.solution.effects[1], fit.solution)
    assert cost == pytest.approx(-np.log(mean), abs=1.0)
    assert 3.0 < 3.0 * bic_cost(fit.solution) + np.log(mean) < 6.0


def test_a_number_that_is_not_there_costs_something():
    assert 0.0 < parameter_cost(0.0) == parameter_cost(1.0) < parameter_cost(60.0)


def test_what_has_a_place_among_all_ordinates_pays_more():
    fit = al.fit_model(_recording(2, lambda rng: g.sinusoid(LENGTH, RATE, 3.1, 4e-3)), "N+SIN")
    assert parameters_cost(fit.solution.effects[1], fit.solution) == pytest.approx(
        1.5 * np.log(fit.solution.weight.sum())
    )


def test_what_may_stand_for_two():
    model = al.parse_model("N+B+K+R+SIN+BW+GM")
    found = [effect.kind for effect in model if can_be_split(effect)]
    assert {"bias_instability", "rate_random_walk", "rate_ramp"} <= set(found)
    assert not {"angle_random_walk", "sinusoid", "bandwidth"} & set(found)


def test_nothing_stands_for_a_walk_that_is_there():
    fit = al.fit_model(_recording(3, lambda rng: g.walk(rng, LENGTH, RATE, 1e-3)), "N+K")
    assert alternative_pairs(fit, 0) == ()
    # 20 : 1 at most speaks for a pair beside the truth.
    assert all(-3.0 < pair.evidence < 3.0 for pair in alternative_pairs(fit, 1))


@pytest.mark.long
@pytest.mark.parametrize("seed", [11, 12, 13])
def test_flicker_stands_for_a_step_and_a_lag(seed):
    recording = _recording(
        seed,
        lambda rng: g.step(LENGTH, RATE, 700.0, 2.5e-2),
        lambda rng: g.gauss_markov(rng, LENGTH, RATE, 5e-3, 3.0),
    )
    fit = al.fit_model(recording, "N+B")
    pairs = alternative_pairs(fit, 1)
    assert {"bias_step", "gauss_markov"} == set(pairs[0].kinds)
    # The ladder finds the step and the lag, or flicker, which the record may not tell from it.
    found = {e["kind"]: e["rivals"] for e in al.improve(recording, "N").fit.body()["effects"]}
    others = set(found) - {"angle_random_walk", "bias_step"}
    assert "bias_step" in found
    assert len(others) == 1
    assert others == {"gauss_markov"} or "gauss_markov" in found["bias_instability"]


def test_an_error_at_short_times_is_not_excused_by_chance_at_long_ones():
    fit = al.fit_model(_recording(4), "N")
    wrong = compare_curves(fit.data, al.parse_model("N(N=0.0132)"))
    # 5 % too high at every τ: 0.0025, where the scatter is smaller.
    assert 0.001 < wrong.error_increase(fit.curve, 2.0) < 0.003
    assert fit.curve.error_increase(fit.curve, 2.0) == 0.0
    assert fit.curve.error_increase(wrong, 2.0) < -0.001


@pytest.mark.parametrize("high", [1.05, 1.6])
def test_a_rise_below_the_worst_error_of_before_is_no_increase(high):
    """A missing band hid 5 % of another one: the error at the first τ was larger, and is gone."""
    curve = al.fit_model(_recording(4), "N").curve

    def with_ratios(*ratios):
        model = curve.measured.copy()
        model[: len(ratios)] *= ratios
        return replace(curve, model=model)

    assert with_ratios(1.0, 1.05).error_increase(with_ratios(1.0, 1.0), 2.0) > 0.0
    assert (with_ratios(1.0, high).error_increase(with_ratios(1.5, 1.0), 2.0) > 0.0) == (high > 1.5)


@pytest.mark.parametrize("seed", [0, 1])
def test_a_high_pass_without_a_pass_band_stands_for_no_phase_noise(seed):
    """For slightly blue phase noise, a high-pass at a quarter of the rate is 20 nats better, but it filters nothing."""
    rng = np.random.default_rng(seed)
    phase = rng.standard_normal(5001)
    phase[1:] -= 0.15 * phase[:-1]
    x = np.diff(phase) + g.white(rng, 5000, 1.0, 0.02)
    fit = al.fit_model(al.Recording(x, 1.0, unit="1"), "N+Q")
    assert "high_pass" not in {other.effect.kind for other in fit.alternatives(1)}


@pytest.mark.parametrize("seed", [1, 3])
def test_a_lag_stands_for_two_processes_of_which_neither_is_detected(seed):
    """Without either of the two the other explains the record; without both, nothing does."""
    rng = np.random.default_rng([seed, 6])
    x = g.white(rng, 3000, 10.0, 0.01) + g.gauss_markov(rng, 3000, 10.0, 0.006, 8.0)
    fit = al.fit_model(al.Recording(x, rate=10.0, unit="deg/s"), "N+B+K")
    assert not fit["B"].detected
    assert not fit["K"].detected
    names = {solution.model.name: lead for lead, _, solution in fit.alternatives_to_pairs}
    assert names["N+GM"] > 3.0


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_transition_stands_for_a_walk_that_only_one_rise_shows(seed):
    """A rise of 50 s in a record of 300 s looks like a random walk; the list of alternatives must name it."""
    rng, time = np.random.default_rng([seed, 21]), np.arange(30_000) / 100.0
    x = g.white(rng, 30_000, 100.0, 0.01) + 0.04 * np.clip((time - 100.0) / 50.0, 0.0, 1.0)
    fit = al.fit_model(al.Recording(x, rate=100.0, unit="rad/s"), "N+K")
    leads = {other.effect.kind: other.evidence for other in fit.alternatives(1)}
    assert leads["transition"] > 2.0


def test_a_walk_is_no_transition():
    """In none of twenty random walks does a transition have 3 nats more evidence than the walk."""
    for seed in range(20):
        rng = np.random.default_rng([seed, 22])
        x = g.white(rng, 20_000, 10.0, 0.1) + g.walk(rng, 20_000, 10.0, [1e-2, 1e-3][seed % 2])
        fit = al.fit_model(al.Recording(x, rate=10.0, unit="rad/s"), "N+K")
        leads = {other.effect.kind: other.evidence for other in fit.alternatives(1)}
        assert leads.get("transition", -np.inf) < 3.0


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_flicker_behind_a_filter_stands_for_quantization(seed):
    """Both fill the stop band of a low-pass filter; the record has flicker."""
    rng = np.random.default_rng([seed, 23])
    white = g.white(rng, 38_192, 100.0, 0.01)
    x = signal.lfilter(*signal.butter(2, 25.0, fs=100.0), white)[8192:]
    x += g.flicker(rng, 30_000, 100.0, 2e-3)
    fit = al.fit_model(al.Recording(x, rate=100.0, unit="deg/s"), "N+K+Q+BW")
    place = [e.kind for e in fit.model].index("quantization")
    leads = {other.effect.kind: other.evidence for other in fit.alternatives(place)}
    assert leads["bias_instability"] > -1.0
