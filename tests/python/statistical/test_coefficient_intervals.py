"""Intervals of coefficients have their coverage; agreement of recordings is tested at its level.

benches/claims/interval_coverage.py does the same with a thousand records of each; its table is in docs/validation.md.
"""

import numpy as np
import pytest
from scipy.stats import kstest

import allanite as al
import generators as g
from counts import records

pytestmark = pytest.mark.statistical
N = 4096


def near_zero(rng):
    return g.white(rng, N, 1.0, 1.0) + g.flicker(rng, N, 1.0, 0.15) + g.walk(rng, N, 1.0, 0.01)


def walk(rng):
    return g.white(rng, N, 1.0, 1.0) + g.walk(rng, N, 1.0, 0.03)


def markov(rng):
    return g.white(rng, N, 1.0, 1.0) + g.gauss_markov(rng, N, 1.0, 0.09, 50.0)


CASES = {
    "N+B+K": ({"N": 1.0, "B": 0.15, "K": 0.01}, near_zero),
    "N+K": ({"N": 1.0, "K": 0.03}, walk),
    "N+GM": ({"N": 1.0, "GM.q_c": 0.09, "GM.correlation_time": 50.0}, markov),
}


@pytest.mark.parametrize("method", ["whittle", "gls"])
@pytest.mark.parametrize("name", CASES)
def test_coverage(name, method):
    # Least squares take three times as long.
    count = records(200 if method == "gls" else 500, 500)
    truth, make = CASES[name]
    rng = np.random.default_rng([21, *name.encode()])
    inside = dict.fromkeys(truth, 0)
    over = dict.fromkeys(truth, 0)
    limits = {key: [] for key in truth}
    for _ in range(count):
        fit = al.fit_model(al.Recording(make(rng), rate=1.0, unit="1"), name, method=method)
        for key, value in truth.items():
            low, high = fit[key].interval
            inside[key] += low <= value <= high
            over[key] += value > high
            if not fit[key].detected:
                limits[key].append(value <= high)
    # A share of 95 % of 200 records is known to 1.5 %, of 500 to 1: three of these about the 93–97 % asked for would let
    # anything pass, so two and a half about 95 %. A true 90 % fails in 72 % of such tests (97 % of 500), 85 % in all.
    slack = 2.5 * np.sqrt(0.95 * 0.05 / count)
    share = {key: held / count for key, held in inside.items()}
    assert all(0.95 - slack <= s <= 0.95 + slack for s in share.values()), share
    # What lies above the upper end or limit: 2.5 %, two and a half of its error.
    assert all(c / count <= 0.025 + 2.5 * np.sqrt(0.024 / count) for c in over.values()), over
    # Of the records that give nothing but a limit, 94 % keep it: 100 of them know that to 2.4 %, two and a half of these.
    for key, kept in limits.items():
        if len(kept) > count / 5:
            error = np.sqrt(0.94 * 0.06 / len(kept))
            assert np.mean(kept) >= 0.94 - 2.5 * error, (key, np.mean(kept), len(kept))


def test_recordings_of_one_sensor_agree_at_the_level_of_the_test():
    p_values, common = {"N": [], "K": []}, {"N": 0, "K": 0}
    sets = records(80, 150)
    for seed in range(sets):
        rng = np.random.default_rng([22, seed])
        recordings = [al.Recording(walk(rng), rate=1.0, unit="1") for _ in range(3)]
        many = al.fit_many(recordings, "N+K")
        for key, truth in (("N", 1.0), ("K", 0.03)):
            row = many[key]
            p_values[key].append(row.p_value)
            low, high = row.interval
            common[key] += low <= truth <= high
    for key in p_values:
        assert kstest(p_values[key], "uniform").pvalue > 0.01, key
        # 80 sets know 95 % to 2.4 %, 150 to 1.8.
        assert common[key] / sets > 0.95 - 3 * np.sqrt(0.95 * 0.05 / sets)


def test_lines_of_one_machine_agree_at_the_level_of_the_test():
    """A line of 9 times its standard error in three recordings with different phases."""
    truth, sets = {"SIN.frequency": 0.0713, "SIN.amplitude": 0.2}, records(60, 100)
    p_values, common = {key: [] for key in truth}, dict.fromkeys(truth, 0)
    for seed in range(sets):
        rng = np.random.default_rng([23, seed])
        recordings = []
        for _ in range(3):
            line = g.sinusoid(N, 1.0, 0.0713, 0.2, rng.uniform(0.0, 2.0 * np.pi))
            recordings.append(al.Recording(g.white(rng, N, 1.0, 1.0) + line, rate=1.0, unit="1"))
        many = al.fit_many(recordings, "N+SIN")
        assert "SIN.phase" not in [row.name for row in many.pooled]
        for key, value in truth.items():
            p_values[key].append(many[key].p_value)
            low, high = many[key].interval
            common[key] += low <= value <= high
    for key in truth:
        assert kstest(p_values[key], "uniform").pvalue > 0.01, key
        # 60 sets know 95 % to 2.8 %, 100 to 2.2.
        assert common[key] / sets > 0.95 - 3 * np.sqrt(0.95 * 0.05 / sets), (key, common)


@pytest.mark.parametrize("noise", ["B", "K"])
def test_the_time_of_a_step_in_slow_noise(noise):
    """The interval covers the time, and is not that of white noise with the density at the lowest frequencies (60 s)."""
    n, rate, inside, widths = 20_000, 10.0, 0, []
    height = {"B": 0.02, "K": 0.035}[noise]
    count = records(40, 400)
    for seed in range(count):
        rng = np.random.default_rng([seed, *noise.encode()])
        time = rng.uniform(500.0, 1500.0)
        samples = g.white(rng, n, rate, 0.01) + g.step(n, rate, time, height)
        samples += g.flicker(rng, n, rate, 0.003) if noise == "B" else g.walk(rng, n, rate, 4e-4)
        fit = al.fit_model(al.Recording(samples, rate, unit="rad/s"), f"N+{noise}+STEP")
        low, high = fit.estimates[-1]["time"].interval
        inside += low <= time <= high
        widths.append(high - low)
    # The fitted amplitude and noise count as known, so that a little less than 95 % cover.
    assert inside / count > 0.92 - 3.0 * np.sqrt(0.92 * 0.08 / count)
    assert np.median(widths) < 10.0
