"""A telegraph signal and a Gauss-Markov process of the same spectrum, distinguished by their levels.

Half an hour at 50 Hz of N, B and K with ±0.02 rad/s that stays 20 s on a level, or with a Gauss-Markov process of that
variance and correlation time. No failure in 12 records limits the rate to 22 %, in 30 (benches/claims/full_counts.py)
to 10 % (95 %); docs/validation.md has the smallest odds of 40 and more.
"""

import numpy as np
import pytest

import allanite as al
import generators as g
from counts import records

pytestmark = pytest.mark.statistical

RATE, LENGTH, RECORDS = 50.0, 90_000, records(12, 30)
AMPLITUDE, DWELL = 0.02, 20.0


def _suggestions(seed, hidden, amplitude=AMPLITUDE):
    rng = np.random.default_rng([seed, 33, *hidden.encode()])
    samples = g.white(rng, LENGTH, RATE, 0.0126) + g.flicker(rng, LENGTH, RATE, 0.002)
    samples += g.walk(rng, LENGTH, RATE, 9.07e-5)
    if hidden == "telegraph":
        samples += g.telegraph(rng, LENGTH, RATE, amplitude, DWELL)
    else:
        # ⟨xx⟩ = A² e^{−2t/D}: q_c²T/2 = A² at T = D/2.
        samples += g.gauss_markov(rng, LENGTH, RATE, amplitude * np.sqrt(4.0 / DWELL), DWELL / 2.0)
    return al.fit_model(al.Recording(samples, rate=RATE, unit="rad/s"), "N+B+K").check().suggestions


def test_two_levels_are_burst_noise():
    for seed in range(RECORDS):
        first = _suggestions(seed, "telegraph")[0]
        assert first.kind == "burst_noise", (seed, first)
        assert first.significant, (seed, first)
        assert first.rivals == (), (seed, first)
        # The scatter is √(D/T) of the number of dwells: 90 of them know the dwell time to 11 %, four of these.
        assert first.effect.values["amplitude"] == pytest.approx(AMPLITUDE, rel=0.2), seed
        assert first.effect.values["dwell_time"] == pytest.approx(DWELL, rel=0.5), seed


@pytest.mark.long
def test_a_bell_is_never_burst_noise():
    for seed in range(RECORDS):
        found = _suggestions(seed, "gauss_markov")
        assert found[0].kind == "gauss_markov", (seed, found[:3])
        assert found[0].significant, (seed, found[:3])
        # Not even as a rival: it is refuted and does not stand in the list.
        assert "burst_noise" not in [s.kind for s in found], (seed, found[:3])


def test_a_bell_at_the_edge_of_what_is_seen_is_not_burst_noise_either():
    """At half that size, ΔlogL is about 16, and the levels are as large as the noise of a block."""
    seen, count = 0, records(10, 20)
    for seed in range(count):
        kinds = [s.kind for s in _suggestions(seed, "gauss_markov", 0.5 * AMPLITUDE)]
        seen += "gauss_markov" in kinds
        if "burst_noise" in kinds:
            assert kinds.index("gauss_markov") < kinds.index("burst_noise"), (seed, kinds)
    assert seen > count / 2


def test_a_bell_beside_quantization_is_not_burst_noise():
    """Blue noise is aliased into the means of blocks: its power is multiplied by the samples of a block."""
    for seed in range(records(3, 10)):
        rng = np.random.default_rng([seed, 34])
        samples = g.quantization(rng, 20_000, 1.0, 4.2) + g.gauss_markov(rng, 20_000, 1.0, 0.15, 66)
        check = al.fit_model(al.Recording(samples, rate=1.0, unit="deg/s"), "N+Q").check()
        kinds = [s.kind for s in check.suggestions]
        assert kinds[0] == "gauss_markov", (seed, kinds)
        assert "burst_noise" not in kinds, (seed, kinds)
