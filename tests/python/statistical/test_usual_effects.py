"""Usual effects, hidden at the limit of what a record can show: named first, measured, and adequate once added.

One hour at 50 Hz of N, B and K (rad/s) with one more effect made by independent code, at the strength where it gains a
ΔlogL of about 30. Five seeds each, five more if one of these fails; twenty with ALLANITE_FULL=1.

With a true coverage of 95 %, an interval covers fewer than 7 of 10 with a probability of 0.1 %; for at least one of the
23 intervals it is 2.4 %. A true coverage of 80 % would pass with 88 %, one of 50 % with 17 %: the test finds only
intervals that are plainly wrong. Hundreds of records are simulated in test_hard_intervals.py and
test_coefficient_intervals.py, and every effect of the catalog in test_confusion.py.
"""

import numpy as np
import pytest

import allanite as al
import generators as g
from counts import halves, nightly, records

RATE, LENGTH, SEEDS = 50.0, 180_000, range(records(10, 20))
#: Of the records: how many may be named otherwise, left inadequate or predicted worse; and how many intervals may miss.
ODD, OUTSIDE = (1, 3) if len(SEEDS) <= 10 else (2, 4)
DURATION = LENGTH / RATE
N, B, K = 0.0126, 0.002, 9.07e-5


def _rest(rng, flicker=B, walk=K):
    return (
        g.white(rng, LENGTH, RATE, N)
        + g.flicker(rng, LENGTH, RATE, flicker)
        + g.walk(rng, LENGTH, RATE, walk)
    )


def _recording(samples, **covariates):
    return al.Recording(samples, rate=RATE, unit="rad/s", covariates=covariates)


def _quantization(rng):
    return _recording(_rest(rng) + g.quantization(rng, LENGTH, RATE, 2.5e-4))


def _angle_random_walk(rng):
    others = g.quantization(rng, LENGTH, RATE, 1e-3) + g.walk(rng, LENGTH, RATE, 9e-4)
    return _recording(others + g.white(rng, LENGTH, RATE, 2.7e-4))


def _bias_instability(rng):
    return _recording(_rest(rng, flicker=4.3e-3))


def _rate_random_walk(rng):
    return _recording(_rest(rng, walk=4.9e-4))


def _rate_ramp(rng):
    return _recording(_rest(rng) + g.ramp(LENGTH, RATE, 5.3e-5))


def _gauss_markov(rng):
    return _recording(_rest(rng) + g.gauss_markov(rng, LENGTH, RATE, 3.1e-3, 20.0))


def _sinusoid(rng):
    phase = rng.uniform(0.0, 2.0 * np.pi)
    return _recording(_rest(rng) + g.sinusoid(LENGTH, RATE, 3.1, 2.45e-3, phase))


def _bandwidth(rng):
    drift = g.flicker(rng, LENGTH, RATE, B) + g.walk(rng, LENGTH, RATE, K)
    return _recording(g.low_passed(rng, LENGTH, RATE, N, 33.0) + drift)


def _resonance(rng):
    return _recording(_rest(rng) + g.resonance(rng, LENGTH, RATE, 8.0, 0.05, 8.7e-3))


def _power_law(rng):
    coloured = g.power_law(rng, LENGTH, RATE, -0.5, 4.8e-3)
    return _recording(g.white(rng, LENGTH, RATE, N) + coloured)


def _covariate(rng):
    true = g.temperature(LENGTH, RATE, 1800.0)
    thermometer = true + 0.02 * rng.standard_normal(LENGTH)
    effect = 3.5e-3 * g.lagged(true - true.mean(), RATE, 60.0)
    return _recording(_rest(rng) + effect, temperature=thermometer)


def _bias_step(rng):
    return _recording(_rest(rng) + g.step(LENGTH, RATE, rng.uniform(0.2, 0.8) * DURATION, 0.0205))


def _warm_up(rng):
    return _recording(_rest(rng) + g.settling(LENGTH, RATE, 200.0, 0.06))


def _burst_noise(rng):
    return _recording(_rest(rng) + g.telegraph(rng, LENGTH, RATE, 9e-3, 20.0))


def _noise_level_change(rng):
    loud = g.louder(g.white(rng, LENGTH, RATE, N), RATE, 1000.0, 1600.0, 1.032)
    drift = g.flicker(rng, LENGTH, RATE, B) + g.walk(rng, LENGTH, RATE, K)
    return _recording(loud + drift)


def _outliers(rng):
    size = 8.0 * N * np.sqrt(RATE)
    return _recording(_rest(rng) + g.spikes(rng, LENGTH, 12, size))


# Kind: (generator, the model it is hidden from, the truth).
CASES = {
    "quantization": (_quantization, "N+B+K", {"Q": 2.5e-4}),
    "angle_random_walk": (_angle_random_walk, "Q+K", {"N": 2.7e-4}),
    "bias_instability": (_bias_instability, "N+K", {"B": 4.3e-3}),
    "rate_random_walk": (_rate_random_walk, "N+B", {"K": 4.9e-4}),
    "rate_ramp": (_rate_ramp, "N+B+K", {"R": 5.3e-5}),
    "gauss_markov": (_gauss_markov, "N+B+K", {"q_c": 3.1e-3, "correlation_time": 20.0}),
    "sinusoid": (_sinusoid, "N+B+K", {"frequency": 3.1, "amplitude": 2.45e-3}),
    "bandwidth": (_bandwidth, "N+B+K", {"cutoff": 33.0}),
    "resonance": (_resonance, "N+B+K", {"frequency": 8.0, "damping": 0.05}),
    "power_law": (_power_law, "N", {"exponent": -0.5}),
    "covariate": (_covariate, "N+B+K", {"coefficient": 3.5e-3, "lag": 60.0}),
    "bias_step": (_bias_step, "N+B+K", {"height": 0.0205}),
    "warm_up": (_warm_up, "N+B+K", {"amplitude": 0.06, "time_constant": 200.0}),
    "burst_noise": (_burst_noise, "N+B+K", {"amplitude": 9e-3, "dwell_time": 20.0}),
    "noise_level_change": (
        _noise_level_change,
        "N+B+K",
        {"start": 1000.0, "end": 1600.0, "factor": 1.032},
    ),
    "outliers": (_outliers, "N+B+K", {}),
}


def _one(kind, seed):
    """First suggestion, whether the true values lie inside, adequacy and scores once the true effect is added."""
    make, start, truth = CASES[kind]
    fit = al.fit_model(make(np.random.default_rng([seed, *kind.encode()])), start)
    check = fit.check()
    first = check.suggestions[0]
    hit = next((s for s in check.suggestions if s.kind == kind), None)
    if hit is None:
        return first, None, {}, False, False
    added = fit.add(hit)
    kinds = [e.kind for e in added.model]
    estimates = added.estimates[kinds.index(kind)]
    inside = {
        name: bool(estimates[name].interval[0] <= true <= estimates[name].interval[1])
        for name, true in truth.items()
    }
    scores = (added.error.predictive.score, fit.error.predictive.score)
    return first, hit, inside, added.check().adequate, scores[0] < scores[1]


#: Hidden effect → the effect that a check may name first in its place, because it describes the record nearly as well.
OFTEN_FIRST = {
    "angle_random_walk": "bias_instability",
    "power_law": "bias_instability",
    # The same spectrum; two levels are not always visible.
    "burst_noise": "gauss_markov",
}


def _named(kind, found):
    """Number of records in which the first suggestion is significant and of the hidden kind (or `OFTEN_FIRST`)."""
    names = (kind, OFTEN_FIRST.get(kind))
    return sum(first.significant and first.kind in names for first, *_ in found)


def _inside(found, name):
    return sum(estimates.get(name, False) for _, _, estimates, *_ in found)


def _clean(kind, found):
    """True if all are named, adequate and better predicted, and each interval misses at most once."""
    return (
        _named(kind, found) == len(found)
        and all(adequate and falls for *_, adequate, falls in found)
        and all(_inside(found, name) >= len(found) - 1 for name in CASES[kind][2])
    )


@pytest.mark.statistical
@pytest.mark.parametrize(
    "kind", nightly(CASES, "covariate", "bandwidth", "warm_up", "rate_random_walk")
)
def test_usual_effects_at_the_edge(kind):
    found = halves(lambda seed: _one(kind, seed), SEEDS, lambda first: _clean(kind, first))
    gains = [0.0 if hit is None else hit.delta_log_likelihood for _, hit, *_ in found]
    told = f"ΔlogL {np.mean(gains):.1f} ± {np.std(gains):.1f}; first: " + ", ".join(
        f"{first.kind}{'*' if first.significant else ''}" for first, *_ in found
    )
    assert _named(kind, found) >= len(found) - 1, told
    for name in CASES[kind][2]:
        inside = _inside(found, name)
        assert inside >= len(found) - OUTSIDE, f"{name} inside its interval in {inside}; {told}"
    assert sum(adequate for *_, adequate, _ in found) >= len(found) - ODD, told
    assert sum(falls for *_, falls in found) >= len(found) - ODD, told
