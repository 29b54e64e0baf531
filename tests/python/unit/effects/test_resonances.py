"""Resonances of any width."""

import numpy as np
import pytest

import allanite as al
import generators as g
from allanite.fit.rivals.alternatives import is_removable
from allanite.fit.table import fit_table

RATE, LENGTH, N = 50.0, 60_000, 0.0126


def recording(seed, frequency, damping):
    """A peak some 25 times as high as the white noise, whatever the width."""
    rng = np.random.default_rng([seed, round(1000 * damping), 0])
    rms = 2.5 * N * np.sqrt(4.0 * np.pi * damping * frequency)
    x = g.white(rng, LENGTH, RATE, N)
    x += g.resonance(rng, LENGTH, RATE, frequency, damping, rms)
    return al.Recording(x, rate=RATE, unit="rad/s"), {
        "N": N,
        "frequency": frequency,
        "damping": damping,
        "rms": rms,
    }


BROAD = (0.22, 0.3, 0.4, 0.5, 0.6)


@pytest.mark.slow
def test_a_broad_one_has_its_own_width():
    inside = 0
    for seed, damping in enumerate(BROAD):
        record, truth = recording(seed, 1.0, damping)
        fit = al.fit_model(record, "N+RES")
        held = f"N+RES(f=1,damping={damping}!)"
        there = al.fit_model(record, held).solution.log_likelihood
        # What is free is not below what is held at the truth.
        assert fit.solution.log_likelihood > there - 0.01, damping
        assert not fit.model.effects[1].at_limit
        inside += sum(
            e.interval[0] < truth[e.name] < e.interval[1] for e in map(fit.__getitem__, truth)
        )
    # 95 % each, frequency, width and strength together: of 20 fewer than 15 in 1 of 3000 if they were independent.
    assert inside >= 15


@pytest.mark.long
def test_nothing_else_is_added_beside_a_broad_one():
    """Three of four displacements with ζ > 0.2 once had a second, false process."""
    for seed, damping in enumerate(BROAD[1:4]):
        record, _ = recording(20 + seed, 1.0, damping)
        study = al.improve(record, "N")
        assert [e.kind for e in study.fit.model] == ["angle_random_walk", "resonance"], study
        assert study.adequate, study


def test_started_at_the_truth_a_fit_stays_there():
    record, _ = recording(3, 1.0, 0.3)
    best = al.fit_model(record, "N+RES")
    for given in ("N+RES(f=1)", "N+RES(f=1,damping=0.3)"):
        found = al.fit_model(record, given)
        lost = best.solution.log_likelihood - found.solution.log_likelihood
        assert abs(lost) < 0.01
        assert found["RES.damping"] == pytest.approx(best["RES.damping"], rel=1e-3)


@pytest.mark.slow
def test_one_without_a_peak_is_at_its_limit():
    record, _ = recording(5, 1.0, 0.9)
    fit = al.fit_model(record, "N+RES")
    assert fit.model.effects[1].at_limit == ("damping",)
    assert fit["RES.damping"] == 0.7
    assert fit["RES.damping"].interval is None
    assert fit.to_dict()["effects"][1]["at_limit"] == ["damping"]
    assert "at its limit" in fit_table(fit)
    # It has no peak, and is a low-pass of second order: a search may put that there.
    assert is_removable(fit.model.effects[1])
    assert "resonance" not in {e.kind for e in al.improve(record, "N").fit.model}
