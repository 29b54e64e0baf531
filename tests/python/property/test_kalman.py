"""The core's filter and smoother beside the textbook, matrix by matrix."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import allanite as al
from allanite import _kernels


def twin(y, F, Q, H, R, P):
    """Textbook Kalman filter and Rauch-Tung-Striebel smoother."""
    d = len(H)
    a, before, after, values, variances = np.zeros(d), [], [], [], []
    for sample in y:
        before.append((a, P))
        S = H @ P @ H + R
        values.append(sample - H @ a)
        variances.append(S)
        if not np.isnan(sample):
            K = P @ H / S
            a = a + K * values[-1]
            P = (np.eye(d) - np.outer(K, H)) @ P @ (np.eye(d) - np.outer(K, H)).T + R * np.outer(
                K, K
            )
        after.append((a, P))
        a, P = F @ a, F @ P @ F.T + Q
    mean, _ = after[-1]
    smooth = [H @ mean]
    for k in range(len(y) - 2, -1, -1):
        gain = after[k][1] @ F.T @ np.linalg.pinv(before[k + 1][1])
        mean = after[k][0] + gain @ (mean - before[k + 1][0])
        smooth.append(H @ mean)
    return np.array(values), np.array(variances), np.array(smooth[::-1])


def system(rng, blocks):
    """Independent lags and rotating pairs; a random walk where a block is 0."""
    d = sum(max(b, 1) for b in blocks)
    F, Q, P = np.zeros((3, d, d))
    at = 0
    for b in blocks:
        size = max(b, 1)
        part = slice(at, at + size)
        if b == 2:
            angle, r = rng.uniform(0.1, 3.0), rng.uniform(0.5, 0.99)
            F[part, part] = r * np.array(
                [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
            )
        else:
            F[part, part] = 1.0 if b == 0 else rng.uniform(-0.5, 0.999)
        root = rng.standard_normal((size, size))
        Q[part, part] = root @ root.T
        P[part, part] = 100.0 * np.eye(size)
        at += size
    return F, Q, rng.standard_normal(d), rng.uniform(0.1, 3.0), P


@settings(max_examples=40)
@given(
    st.lists(st.integers(0, 2), min_size=1, max_size=4),
    st.integers(2, 60),
    st.floats(0.0, 0.7),
    st.integers(0, 2**32 - 1),
)
# A gain that had stayed over a run of missing samples was taken for settled.
@example(blocks=[1], n=18, missing=0.5, seed=30)
def test_filter_and_smoother_equal_the_textbook(blocks, n, missing, seed):
    rng = np.random.default_rng(seed)
    F, Q, H, R, P = system(rng, blocks)
    y = 3.0 * rng.standard_normal(n)
    y[rng.random(n) < missing] = np.nan
    expected = twin(y, F, Q, H, R, P)
    values, variances = _kernels.kalman_filter(y, F, Q, H, R, P)
    # Rounding: covariances of 100 and variances of 0.1 lose three digits of sixteen, products of n steps some more.
    np.testing.assert_allclose(variances, expected[1], rtol=1e-8)
    np.testing.assert_allclose(values, expected[0], rtol=1e-7, atol=1e-7)
    found = _kernels.kalman_smooth(y, F, Q, H, R, P)
    np.testing.assert_allclose(found, expected[2], rtol=1e-6, atol=1e-6)


def test_a_settled_gain_is_that_of_every_step():
    """5000 samples of a local level: the gain is constant after a hundred, until a gap."""
    rng = np.random.default_rng(1)
    y = np.cumsum(rng.standard_normal(5000)) + rng.standard_normal(5000)
    y[3000:3010] = np.nan
    one = np.ones((1, 1))
    expected = twin(y, one, one, np.ones(1), 1.0, 100.0 * one)
    values, variances = _kernels.kalman_filter(y, one, one, np.ones(1), 1.0, 100.0 * one)
    np.testing.assert_allclose(variances, expected[1], rtol=1e-10)
    np.testing.assert_allclose(values, expected[0], rtol=1e-8, atol=1e-8)


def test_refusals():
    one = np.ones((1, 1))
    with pytest.raises(al.InputError, match="F has 4 elements"):
        _kernels.kalman_filter(np.ones(3), np.eye(2), one, np.ones(1), 1.0, one)
    with pytest.raises(al.InputError, match="Q holds NaN"):
        _kernels.kalman_smooth(np.ones(3), one, np.nan * one, np.ones(1), 1.0, one)
    with pytest.raises(al.InputError, match="R is -1"):
        _kernels.kalman_filter(np.ones(3), one, one, np.ones(1), -1.0, one)
    with pytest.raises(al.InputError, match="no noise"):
        _kernels.kalman_filter(np.ones(3), one, 0 * one, np.ones(1), 0.0, 0 * one)
