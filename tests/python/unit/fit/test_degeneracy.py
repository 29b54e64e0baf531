"""What a record cannot tell is said."""

import json

import numpy as np
import pytest

import allanite as al


def fit(truth, model, n=20_000, seed=1):
    recording = al.parse_model(truth).simulate(n=n, rate=10, seed=seed, unit="deg/s")
    return al.fit_model(recording, model)


def test_a_long_correlation_time_is_a_random_walk():
    found = fit("N(N=0.1)+K(K=0.005)", "N+GM")
    assert any("cannot be distinguished from a rate random walk" in s for s in found.degeneracies)
    assert "! GM: a correlation time" in str(found)


def test_two_effects_of_one_shape():
    # Two processes of nearly one time constant: their information is that of one.
    found = fit(
        "N(N=0.1)+GM(q_c=0.02,T=5)",
        "N+GM(q_c=0.014,T=5!)+GM(q_c=0.014,T=5.02!)",
    )
    if found["GM.q_c"] > 0 and found["GM2.q_c"] > 0:
        assert any("cannot be distinguished" in s for s in found.degeneracies)


@pytest.mark.slow
def test_correlations_of_a_clear_model():
    found = fit("N(N=0.1)+B(B=0.05)+K(K=0.02)", "N+B+K")
    assert found.correlations.names == ("N", "B", "K")
    matrix = found.correlations.matrix
    np.testing.assert_allclose(np.diag(matrix), 1.0)
    # More flicker in the middle leaves less room for both neighbours.
    assert matrix[0, 1] < 0 > matrix[1, 2]
    assert found.degeneracies == []
    document = found.to_dict()
    json.dumps(document, allow_nan=False)
    assert document["correlations"]["names"] == ["N", "B", "K"]
    assert document["degeneracies"] == []


def test_correlation_is_that_of_simulated_refits():
    found = fit("N(N=0.1)+K(K=0.02)", "N+K", n=4096)
    check = found.simulate_check(100, seed=3)
    seen = np.corrcoef(check.simulated["N"], check.simulated["K"])[0, 1]
    # 100 replicates know a correlation to 0.1.
    assert seen == pytest.approx(found.correlations.matrix[0, 1], abs=0.3)
