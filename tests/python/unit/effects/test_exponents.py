"""Intervals of the exponent of a power law."""

import numpy as np
import pytest

import allanite as al
import generators as g


@pytest.mark.parametrize("exponent", [-1.4, -0.7])
def test_the_interval_of_an_exponent_excludes_what_the_record_refutes(exponent):
    """Exponents inside the interval lose little logL, and exponents well outside lose much."""
    rng = np.random.default_rng([3, 55])
    n, rate = 12_000, 10.0
    x = g.white(rng, n, rate, 0.01) + g.power_law(rng, n, rate, exponent, 2e-2)
    recording = al.Recording(x, rate, unit="rad/s")
    fit = al.fit_model(recording, "N+PL")
    found = fit["exponent"]
    low, high = found.interval
    assert found.std_error is not None
    assert -2.9 < low < exponent < high < 0.0

    def lost(held):
        other = al.fit_model(recording, f"N+PL(exponent={held}!)")
        return fit.solution.log_likelihood - other.solution.log_likelihood

    # Half of χ² with one degree of freedom at 95 % is 1.92; the likelihood is not quite normal.
    assert max(lost(low), lost(high)) < 4.0
    assert lost(2.0 * low - found.value) > 3.0
