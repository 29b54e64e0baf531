"""Deviations against published numbers: NBS14 (SP 1065 p. 107-109), Stable32, real clocks."""

import numpy as np
import pytest

import allanite as al

TEN = np.array([892, 809, 823, 798, 671, 644, 883, 903, 677])


def thousand():
    """The 1000-point set: a multiplicative congruential generator."""
    n = [1234567890]
    for _ in range(999):
        n.append(16807 * n[-1] % 2147483647)
    return np.array(n) / 2147483647


def test_thousand_point_set_is_the_published_one():
    y = thousand()
    assert y.mean() == pytest.approx(0.4897744629, abs=5e-11)
    assert y.std(ddof=1) == pytest.approx(0.2884663647, abs=5e-11)


@pytest.mark.parametrize("samples", [TEN, TEN.astype(float), TEN.astype(np.uint16), list(TEN)])
def test_nbs14_ten(samples):
    curve = al.oadev(samples, factors=[1, 2])
    np.testing.assert_allclose(curve.deviation, [91.2294497, 85.9528698], rtol=1e-9)
    curve = al.adev(samples, factors=[1, 2])
    np.testing.assert_allclose(curve.deviation, [91.2294497, 115.808211], rtol=1e-8)


def test_nbs14_thousand():
    curve = al.oadev(thousand(), factors=[1, 10, 100])
    np.testing.assert_allclose(
        curve.deviation, [0.292231878, 0.0915995342, 0.0324134303], rtol=3e-9
    )
    assert curve.n.tolist() == [999, 981, 801]
    curve = al.adev(thousand(), factors=[1, 10, 100])
    np.testing.assert_allclose(
        curve.deviation, [0.292231878, 0.0996573606, 0.0389780433], rtol=3e-9
    )
    assert curve.n.tolist() == [999, 99, 9]


def test_octave_of_the_thousand():
    expected = (
        "0.2922318781 0.2010160422 0.1447913072 0.1057038501 0.06191477842 0.04808214262"
        " 0.03623721299 0.02767385582 0.01028221764"
    )
    curve = al.oadev(thousand())
    np.testing.assert_allclose(curve.deviation, np.array(expected.split(), float), rtol=1e-9)


def test_phase_gives_what_its_rates_give():
    phase = np.concatenate([[0.0], np.cumsum(TEN - TEN.mean())])
    curve = al.oadev(phase, quantity="angle", factors=[1, 2])
    np.testing.assert_allclose(curve.deviation, [91.2294497, 85.9528698], rtol=1e-9)


def test_stable32_limits_where_its_edf_is_right():
    # Stable32 prints 68.3 % limits for white FM. At m = 1 it uses edf 782 where the exact value of
    # sampled white noise is 2(n - 1)/3 = 666 (4000 simulated records: 662): it starts at 8 here.
    from allanite.deviation.confidence import degrees_of_freedom, interval

    factors = np.array([8, 16, 32, 64, 128])
    curve = al.oadev(thousand(), factors=factors)
    edf = np.array([degrees_of_freedom(0.0, m, n) for m, n in zip(factors, curve.n, strict=True)])
    low, high = interval(curve.deviation, edf, 0.683)
    # Two formulas of edf differ by some per cent; its square root divides by √2 edf in the width.
    np.testing.assert_allclose(low, [0.10038, 0.057696, 0.043654, 0.031755, 0.023045], rtol=0.01)
    np.testing.assert_allclose(high, [0.11198, 0.067217, 0.054202, 0.043377, 0.037027], rtol=0.01)


@pytest.mark.data
def test_caesium_clock_against_stable32(data):
    with np.load(data("clock_cs5071a_phase.npz")) as content:
        phase = np.ravel(content["data"])
    curve = al.oadev(phase, quantity="angle", factors=[1, 10, 100, 1000, 10000])
    expected = [3.3171e-10, 3.2118e-11, 3.4040e-12, 4.7341e-13, 1.0126e-13]
    np.testing.assert_allclose(curve.deviation, expected, rtol=2e-5)  # printed to five digits
