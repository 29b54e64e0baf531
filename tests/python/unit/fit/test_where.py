"""What a fit and its check say of the worst places of a curve."""

import pytest

import allanite as al
from allanite.criticism import Where
from allanite.fit.table import misfit_line


@pytest.fixture(scope="module")
def check():
    """Check of white noise and flicker whose curve is too low because of a line."""
    truth = al.parse_model("N(N=1)+SIN(f=0.05,A=1)")
    return al.fit_model(truth.simulate(n=2000, rate=1.0, seed=1), "N+B").check()


def test_the_worst_place_is_no_bound(check):
    factor, tau = check.fit.error.adev_worst
    line = misfit_line(check.fit)
    assert factor < 1.0
    assert f"= {factor:.3g}" in line
    assert f"τ = {tau:.3g} s" in line


def test_what_the_error_leaves_out_is_said_beside_it(check):
    curve = check.fit.curve
    assert check.where.few == tuple(curve.tau[curve.edf < 10.0])
    rows = [
        {"tau_s": tau, "measured": 1.0, "model": 1.0, "ratio": ratio, "z": z}
        for tau, ratio, z in ((84.3, 1 / 3.52, -3.0), (267.0, 1 / 6.67, -9.0))
    ]
    where = Where(rows, [], [], (267.0, 267.0), None, None, (3.52, 84.3), (267.0,))
    first, second = where.sentences()
    assert first == (
        "over τ: the model is ×6.67 too high at 267 s"
        " (z = −9.0; fewer than 10 degrees of freedom, so not in the Allan error)"
    )
    assert second == (
        "over τ: the model is ×3.52 too high at 84.3 s,"
        " the most where there are 10 degrees of freedom or more"
    )
