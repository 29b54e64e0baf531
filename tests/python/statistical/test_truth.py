"""What a true model must survive: nothing is invented, p-values are uniform, suggestions rare."""

import numpy as np
import pytest
from scipy.stats import kstest

import allanite as al
import generators as g

RATE = 100.0

pytestmark = pytest.mark.statistical


def test_white_noise_of_three_hours_is_white_noise_alone():
    inside = no_walk = no_flicker = silent = 0
    for seed in range(10):
        rng = np.random.default_rng([seed, 3])
        samples = g.white(rng, 1_080_000, RATE, 0.0126)
        fit = al.fit_model(al.Recording(samples, rate=RATE, unit="rad/s"), "N+B+K")
        low, high = fit["N"].interval
        inside += low <= 0.0126 <= high
        no_walk += not fit["K"].detected
        no_flicker += not fit["B"].detected
        silent += not fit.check().significant
    # 95 % intervals: two misses in ten have a chance of 9 %; detection and suggestion are at 1 %.
    assert inside >= 8
    assert min(no_walk, no_flicker, silent) >= 9


TRUE = {
    "N": lambda rng, n: g.white(rng, n, RATE, 0.01),
    "N+B": lambda rng, n: g.white(rng, n, RATE, 0.01) + g.flicker(rng, n, RATE, 2e-3),
    "N+B+K": lambda rng, n: (
        g.white(rng, n, RATE, 0.01) + g.flicker(rng, n, RATE, 2e-3) + g.walk(rng, n, RATE, 3.5e-4)
    ),
    "Q+N+B+K": lambda rng, n: (
        g.quantization(rng, n, RATE, 3e-4)
        + g.white(rng, n, RATE, 0.01)
        + g.flicker(rng, n, RATE, 2e-3)
        + g.walk(rng, n, RATE, 3.5e-4)
    ),
    "N+B+GM": lambda rng, n: (
        g.white(rng, n, RATE, 0.01)
        + g.flicker(rng, n, RATE, 5e-4)
        + g.gauss_markov(rng, n, RATE, 4e-3, 10.0)
    ),
}
RECORDS, CHECKED, LENGTH = 80, 16, 60_000


def test_true_models_have_uniform_p_values_and_no_suggestions():
    p_values, significant = [], []
    for name, make in TRUE.items():
        for seed in range(RECORDS):
            rng = np.random.default_rng([seed, *name.encode()])
            recording = al.Recording(make(rng, LENGTH), rate=RATE, unit="rad/s")
            fit = al.fit_model(recording, name)
            p_values.append(fit.misfit.p_value)
            if seed < CHECKED:
                significant += [(name, seed, s.kind) for s in fit.check().significant]
    # Kolmogorov–Smirnov at 1 % over all 400 records.
    assert kstest(p_values, "uniform").pvalue > 0.01
    # 80 checks at a false-alarm rate of 1 %: more than three have a chance of 1 %.
    assert len({s[:2] for s in significant}) <= 3, significant
