"""One physical effect hidden in two hours of a gyroscope's noise: is it named first, measured, and is that the end?

2 h at 100 Hz, N = 0.0126, B = 0.002, K = 9.07e-5 (rad/s); the hidden effect is worth ΔlogL of about 30 or more over
the model without it. Ten seeds each; the counts asked for (9 named, 8 inside the 95 % interval) fail by chance for a
true rate of 99 % and 95 % in 0.4 % and 1.2 %. Where the first five are all named and four of them inside, they are enough:
a true rate of 70 % of names passes in 23 % instead of 15, one of 50 % in 4 % (1 %); intervals that hold 70 % of truths
pass in 58 % (38 %), 50 % in 20 % (5 %). How many they hold is counted in hundreds by test_coefficient_intervals.py.
"""

import numpy as np
import pytest

import allanite as al
import generators as g
from counts import halves, nightly

RATE, LENGTH, SEEDS = 100.0, 720_000, range(10)
N, B, K = 0.0126, 0.002, 9.07e-5
START = {"rate_random_walk": "N+B", "bias_instability": "N+K"}


def _rest(rng, kind):
    """The noise in which an effect hides; a hidden process takes the place of its weaker like."""
    samples = g.white(rng, LENGTH, RATE, N)
    if kind != "bias_instability":
        samples += g.flicker(rng, LENGTH, RATE, B)
    if kind != "rate_random_walk":
        samples += g.walk(rng, LENGTH, RATE, K)
    return samples


HIDDEN = {
    "gauss_markov": lambda rng: g.gauss_markov(rng, LENGTH, RATE, 1.9e-3, 30.0),
    "quantization": lambda rng: g.quantization(rng, LENGTH, RATE, 1.3e-4),
    "sinusoid": lambda rng: g.sinusoid(LENGTH, RATE, 3.1, 2.4e-3, rng.uniform(0, 2 * np.pi)),
    "rate_ramp": lambda rng: g.ramp(LENGTH, RATE, 8e-5),
    "rate_random_walk": lambda rng: g.walk(rng, LENGTH, RATE, 6e-4),
    "bias_instability": lambda rng: g.flicker(rng, LENGTH, RATE, 4e-3),
}
TRUTH = {
    "gauss_markov": {"q_c": 1.9e-3, "correlation_time": 30.0},
    "quantization": {"Q": 1.3e-4},
    "sinusoid": {"frequency": 3.1, "amplitude": 2.4e-3},
    "rate_ramp": {"R": 8e-5},
    "rate_random_walk": {"K": 6e-4},
    "bias_instability": {"B": 4e-3},
}


def _study(kind, seed):
    """The ladder of one record."""
    rng = np.random.default_rng([seed, *kind.encode()])
    samples = _rest(rng, kind) + HIDDEN[kind](rng)
    recording = al.Recording(samples, rate=RATE, unit="rad/s")
    return al.improve(recording, START.get(kind, "N+B+K"))


def _named(kind, found):
    return sum(len(s.ladder) > 1 and s.ladder[1].added.kind == kind for s in found)


def _outside(kind, found):
    """Of every study whose intervals miss a true value: which, and by what."""
    missed = {}
    for seed, study in enumerate(found):
        effects = dict(zip([e.kind for e in study.fit.model], study.fit.estimates, strict=True))
        estimates = effects.get(kind, {})
        for name, true in TRUTH[kind].items():
            low, high = estimates[name].interval if estimates else (np.nan, np.nan)
            if not low <= true <= high:
                missed.setdefault(seed, []).append(f"{name} {low:.5g} … {high:.5g}, not {true:g}")
    return missed


def _told(study):
    """What a failing test says of a ladder."""
    rungs = " → ".join(r.added.kind for r in study.ladder[1:]) or "nothing"
    scores = ", ".join(f"{r.fit.error.predictive.score:.4f}" for r in study.ladder)
    first = [
        f"{s.kind} {s.delta_log_likelihood:.1f}{'*' if s.significant else ''}"
        for s in study.check.suggestions[:3]
    ]
    return f"added {rungs}; predictive {scores}; {study.stopped_because}; left {first}"


def _clean(kind, found):
    return _named(kind, found) == len(found) and len(_outside(kind, found)) <= 1


@pytest.mark.statistical
@pytest.mark.parametrize(
    "kind",
    nightly(
        HIDDEN, "gauss_markov", "rate_ramp", "bias_instability", "quantization", "rate_random_walk"
    ),
)
def test_hidden_effect(kind):
    found = halves(lambda seed: _study(kind, seed), SEEDS, lambda first: _clean(kind, first))
    told = "\n".join(f"seed {i}: {_told(s)}" for i, s in enumerate(found))
    named, outside = _named(kind, found), _outside(kind, found)
    assert named >= len(found) - 1, f"named first in {named} of {len(found)}\n{told}"
    assert len(outside) <= 2, f"outside the interval: {outside}"
    assert all(s.adequate for s in found), told
    for study in found:
        scores = np.array([r.fit.error.predictive.score for r in study.ladder])
        assert (np.diff(scores) < 0.0).all(), told
