"""A bias filter with the numbers of a file is not overconfident: exact covariances of NumPy, no part of the package."""

import re

import numpy as np
import pytest

import allanite as al
from allanite.effects.files import model_to_dict
from allanite.exports import axes_of

N, STEP, AIDED = 1e-3, 1.0, 300
#: Model, and q_c and T of its lag, B or K of the truth.
TRUTHS = {
    "lag of 10 s": ("GM(q_c=3e-4,T=10)", (3e-4, 10.0), 0.0),
    "lag of 120 s": ("GM(q_c=2e-4,T=120)", (2e-4, 120.0), 0.0),
    "lag of 120 s and a small walk": ("GM(q_c=2e-4,T=120)+K(K=1e-7)", (2e-4, 120.0), 1e-7),
    "lag of 10 s and a small walk": ("GM(q_c=3e-4,T=10)+K(K=1e-6)", (3e-4, 10.0), 1e-6),
    "walk": ("K(K=2e-5)", (0.0, 1.0), 2e-5),
}


def written(model, horizon=None, **how):
    document = model_to_dict(al.parse_model(f"N(N={N})+{model}"))
    document["recording"] = {
        "column": "gyro_x",
        "unit": "rad/s",
        "rate_hz": 1 / STEP,
        "duration_s": 7200.0,
    }
    text = al.export(axes_of([document]), "kalibr", horizon=horizon, **how)
    keys = ("gyroscope_noise_density", "gyroscope_random_walk")
    return [float(re.search(rf"^{key}: (\S+)", text, re.MULTILINE).group(1)) for key in keys], text


def covariance(lag, walk, count):
    """Covariance of samples at 1 Hz: white noise, a first-order lag and a random walk."""
    q_c, T = lag
    k = np.arange(count)
    apart = np.abs(np.subtract.outer(k, k))
    out = N**2 / STEP * np.eye(count) + q_c**2 * T / 2 * np.exp(-apart * STEP / T)
    return out + walk**2 * STEP * np.minimum.outer(k, k)


def nees(white, walk, true, times, fix):
    """True over predicted variance of the angle, after 300 s of fixes each second with a variance of `fix`."""
    F = np.array([[1.0, -STEP], [0.0, 1.0]])
    cross = -(walk**2) * STEP**2 / 2
    Q = np.array([[white**2 * STEP + walk**2 * STEP**3 / 3, cross], [cross, walk**2 * STEP]])
    P = np.diag([0.0, 1e6 * white**2])
    count = AIDED + max(times)
    # The estimate as a sum over samples and over fixes.
    of_samples, of_fixes = np.zeros((2, count)), np.zeros((2, AIDED))
    out = []
    for k in range(count):
        P = F @ P @ F.T + Q
        of_samples, of_fixes = F @ of_samples, F @ of_fixes
        of_samples[0, k] += STEP
        if k < AIDED:
            gain = P[:, 0] / (P[0, 0] + fix)
            P = P - np.outer(gain, P[0])
            of_samples -= np.outer(gain, of_samples[0])
            of_fixes -= np.outer(gain, of_fixes[0])
            of_fixes[:, k] += gain
        elif k + 1 - AIDED in times:
            w, v = of_samples[0], of_fixes[0]
            out.append((w @ true[:count, :count] @ w + fix * v @ v) / P[0, 0])
    return np.array(out)


@pytest.mark.parametrize("fix", [0.0, 10.0, 1000.0])
@pytest.mark.parametrize("truth", TRUTHS)
def test_a_filter_with_the_default_numbers_is_consistent(truth, fix):
    model, lag, walk = TRUTHS[truth]
    (white, slow), text = written(model)
    assert "\n# Use: yes." in text
    true = covariance(lag, walk, AIDED + 100)
    found = nees(white, slow, true, (10, 60, 100), fix * N**2)
    # 1.02 with exact fixes; fixes with an error change the weights a little.
    assert found.max() <= 1.06
    assert found[-1] >= 0.75


@pytest.mark.parametrize("horizon", [10.0, 60.0, 1000.0])
def test_the_horizon_is_where_the_numbers_are_closest(horizon):
    model, lag, walk = TRUTHS["lag of 120 s and a small walk"]
    (white, slow), text = written(model, horizon)
    assert f"up to {horizon:g} s" in text
    true = covariance(lag, walk, AIDED + int(horizon))
    times = [round(t) for t in np.geomspace(1, horizon, 8) if t > horizon / 10]
    found = nees(white, slow, true, times, 0.0)
    assert found.max() <= 1.05
    assert found[-1] >= 0.75


def test_fitted_numbers_are_overconfident_and_the_file_says_so():
    model, lag, walk = TRUTHS["lag of 120 s and a small walk"]
    (white, slow), text = written(model, as_fitted=True)
    assert (white, slow) == (N, 1e-7)
    found = nees(white, slow, covariance(lag, walk, AIDED + 100), (10, 100), 0.0)
    assert found.max() > 5.0
    first = text.partition("# Details:")[0]
    assert "\n# Use: no. gyro_x: a bias filter is overconfident" in first
    assert "GM" in first


def test_an_overbound_is_never_overconfident():
    for model, lag, walk in TRUTHS.values():
        (white, slow), _ = written(model, overbound=True)
        found = nees(white, slow, covariance(lag, walk, AIDED + 100), (1, 10, 60, 100), 0.0)
        assert found.max() <= 1.01


def test_a_walk_that_is_all_there_is_stays_as_it_is():
    (white, slow), _ = written("K(K=2e-5)")
    assert (white, slow) == (1e-3, 2e-5)


def test_options_that_exclude_each_other():
    with pytest.raises(al.InputError, match="overbound or as_fitted"):
        written("K(K=2e-5)", as_fitted=True, overbound=True)
    with pytest.raises(al.InputError, match="horizon = -1 s"):
        written("K(K=2e-5)", -1.0)
