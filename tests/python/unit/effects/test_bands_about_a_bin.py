"""Bands about as wide as a bin: what single ordinates say of them does not depend on which side of it a fit puts them."""

import numpy as np
import pytest

import allanite as al
import generators as g
from allanite.effects import Stochastic
from allanite.fit.likelihood.data import prepare
from allanite.fit.shapes.narrow import ordinates_delta_logl
from allanite.study.moves.drop import without_needless_effects
from allanite.study.state import State

RATE, LENGTH = 100.0, 180_000


def _recording(seed, *dampings):
    rng = np.random.default_rng([seed, *(round(1e5 * d) for d in dampings)])
    x = g.white(rng, LENGTH, RATE, 0.0126)
    for place, damping in enumerate(dampings):
        x += g.resonance(rng, LENGTH, RATE, 20.0 * 1.29**place, damping, 0.04 * 0.5**place)
    return al.Recording(x, rate=RATE, unit="rad/s")


@pytest.mark.long
@pytest.mark.parametrize("damping", [0.005, 0.0058, 0.0062, 0.0066, 0.008])
def test_nothing_is_missing_beside_them(damping):
    """Some of these bands count as narrow; a candidate must gain nothing by moving one across this limit."""
    study = al.improve(_recording(2, damping, damping), "N")
    assert [e.kind for e in study.fit.model.effects[1:]] == ["resonance"] * 2, study
    assert study.adequate, study
    # Chance raises logL of the fit with any other process by a few.
    processes = [s for s in study.check.suggestions if isinstance(s.effect, Stochastic)]
    assert all(s.delta_log_likelihood < 10.0 for s in processes)


def test_its_evidence_is_the_same_on_both_sides():
    data = prepare(_recording(0, 0.006))
    one, other = (
        ordinates_delta_logl(
            al.parse_model(f"N(N=0.0126)+RES(f=20,damping={damping},rms=0.04)"),
            data,
            data.ordinates,
            data.bins.count,
        )
        for damping in (0.00599, 0.00601)
    )
    assert one > 50.0
    # The share that counts falls by 0.003/ln 4, logL itself hardly changes with the width where it is right.
    assert one == pytest.approx(other, rel=0.01)


def test_what_is_taken_out_again_was_not_asked_for():
    """Dropping added effects does not change the number of the start's effects that are left."""
    recording = _recording(1, 0.03)
    before = al.fit_model(recording, "N+GM(T=2)")
    fit = before.add(al.effects.Resonance(frequency=20.0, damping=0.03))
    # Only the white noise is the user's.
    start = State.of(before, 1)
    less = without_needless_effects(start, start.after(fit), ())
    assert less.numbers == (0, 2)
    assert less.fit.model.name == "N+RES"
    assert less.is_given(0)
    assert not less.is_given(1)
