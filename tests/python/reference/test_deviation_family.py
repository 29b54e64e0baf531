"""The family against published numbers: NBS14 (NIST SP 1065 p. 107-109) and Stable32 1.60."""

from functools import partial

import numpy as np
import pytest

import allanite as al
from allanite import deviation
from allanite.deviation.confidence import interval

TEN = np.array([892, 809, 823, 798, 671, 644, 883, 903, 677])


def thousand():
    """The 1000-point set: a multiplicative congruential generator."""
    n = [1234567890]
    for _ in range(999):
        n.append(16807 * n[-1] % 2147483647)
    return np.array(n) / 2147483647


SHORT = {
    "mdev": [91.2294497, 74.7884934],
    "tdev": [52.6713474, 86.3583136],
    "hdev": [70.8060732, 116.797992],
    "ohdev": [70.8060732, 85.6148717],
    "totdev": [91.2294497, 93.9037905],
    "mtotdev": [75.50203, 75.83606],
    "ttotdev": [43.59112, 87.56794],
    "htotdev": [70.80607, 91.16396],
    "tierms": [95.2020593, 135.469787],
    "mtie": [144.888889, 262.777778],
    "pdev": [91.2294497, 87.605383],
}
LONG = {
    "mdev": [0.292231878, 0.0617237638, 0.0217092091],
    "tdev": [0.168720153, 0.356362317, 1.25338177],
    "hdev": [0.294388329, 0.105275419, 0.0391086056],
    "ohdev": [0.294388329, 0.0958108317, 0.0323763825],
    "totdev": [0.292231878, 0.0913474326, 0.0340653025],
    "mtotdev": [0.2418528, 0.06499161, 0.02287774],
    "ttotdev": [0.1396338, 0.3752293, 1.320847],
    "htotdev": [0.2943883, 0.09614787, 0.03058103],
    "tierms": [0.288322095, 0.87588296, 2.74844167],
    "mtie": [0.505970831, 2.6988151, 6.75090859],
    "pdev": [0.292231878, 0.103390067, 0.0359914621],
}


def test_every_estimator_has_published_numbers():
    elsewhere = {"oadev", "adev"}  # test_deviation_published.py
    below = {"theo1", "theoh"}
    missing = set(deviation.ESTIMATORS) - set(SHORT) - elsewhere - below
    assert not missing, f"add published numbers to SHORT and LONG: {missing}"
    assert set(SHORT) == set(LONG)


@pytest.mark.parametrize("kind", SHORT)
def test_nbs14(kind):
    estimator = getattr(deviation, kind)
    if "tot" in kind:
        estimator = partial(estimator, unbiased=True)
    digits = 5e-7 if "tot" in kind else 2e-8  # as many as are printed
    np.testing.assert_allclose(estimator(TEN, factors=[1, 2]).deviation, SHORT[kind], rtol=digits)
    np.testing.assert_allclose(
        estimator(TEN / 7.0, factors=[1, 2]).deviation, np.array(SHORT[kind]) / 7, rtol=digits
    )
    curve = estimator(thousand(), factors=[1, 10, 100])
    np.testing.assert_allclose(curve.deviation, LONG[kind], rtol=digits)
    phase = np.concatenate([[0.0], np.cumsum(TEN - TEN.mean())])
    again = estimator(phase, factors=[1, 2], quantity="angle")
    np.testing.assert_allclose(again.deviation, SHORT[kind], rtol=digits)


def test_bias_is_a_choice_and_said():
    # Stable32 1.60 leaves the bias of the modified total in, and so does the default.
    curve = deviation.mtotdev(thousand(), factors=[1, 10, 100])
    expected = [0.206639143, 0.0555288598, 0.0195467513]
    np.testing.assert_allclose(curve.deviation, expected, rtol=1e-8)
    assert any("bias of mtotdev left in" in note for note in curve.diagnostics)
    curve = deviation.mtotdev(thousand(), factors=[1, 10, 100], unbiased=True)
    np.testing.assert_allclose(curve.deviation * np.sqrt(0.73), expected, rtol=1e-8)
    assert any("divided out" in note for note in curve.diagnostics)
    # That of the Hadamard total is removed by default, from m = 2 on.
    raw = deviation.htotdev(thousand(), factors=[1, 10, 100], unbiased=False)
    np.testing.assert_allclose(raw.deviation, [0.294388329, 0.0959072041, 0.0305044788], rtol=1e-8)
    assert any("divided out" in note for note in deviation.htotdev(thousand()).diagnostics)


def test_theo1():
    curve = al.theo1(thousand(), factors=[10, 100, 1000])
    np.testing.assert_allclose(
        curve.deviation, [0.107573989, 0.0317893126, 0.00505239963], rtol=1e-8
    )
    assert curve.n.tolist() == [4955, 45050, 500]
    np.testing.assert_array_equal(curve.tau, [7.5, 75.0, 750.0])


def test_theoh_joins_both():
    curve = al.theoh(thousand())
    near = deviation.oadev(thousand())
    np.testing.assert_allclose(curve.deviation[:7], near.deviation[:7], rtol=1e-14)
    assert curve.tau[-1] > 500
    assert (np.diff(curve.tau) > 0).all()
    assert np.isfinite(curve.high).all()


OCTAVE = {
    "mdev": "0.2922318781 0.1582071983 0.1077973745 0.07419220013 0.04137594628 0.03425498087 0.02787105115"
    " 0.01866932874 0.004254511495",
    "ohdev": "0.2943883291 0.2012483296 0.1436803306 0.1098722637 0.06063762921 0.04509503283 0.03382370898"
    " 0.02914663224 0.01013781915",
}


@pytest.mark.parametrize("kind", OCTAVE)
def test_octave_of_the_thousand(kind):
    expected = np.array(OCTAVE[kind].split(), float)
    curve = getattr(deviation, kind)(thousand(), factors=2 ** np.arange(expected.size))
    np.testing.assert_allclose(curve.deviation, expected, rtol=1e-9)


def test_parabolic_of_sigmatheta():
    expected = "0.29223188 0.21445234 0.15618112 0.11709746 0.06902959 0.04974971 0.03894742 0.03086239 0.01244741"
    curve = deviation.pdev(thousand(), factors=2 ** np.arange(9))
    np.testing.assert_allclose(curve.deviation, np.array(expected.split(), float), rtol=5e-7)


@pytest.mark.parametrize(
    ("kind", "factors", "low", "high", "tolerance"),
    [
        (
            "mdev",
            [8, 32, 128],
            [0.069840, 0.030466, 0.014874],
            [0.079481, 0.039933, 0.028584],
            0.01,
        ),
        ("ohdev", [8, 32, 128], [0.10388, 0.040664, 0.023761], [0.11704, 0.051382, 0.041367], 0.01),
        ("adev", [16, 128], [0.056510, 0.026481], [0.070567, 0.055744], 0.02),
        ("hdev", [16, 128], [0.053296, 0.028841], [0.068811, 0.073807], 0.02),
        ("totdev", [32, 256], [0.044255, 0.010734], [0.054484, 0.019924], 0.01),
    ],
)
def test_limits_of_stable32(kind, factors, low, high, tolerance):
    # 68.3 %, white FM. At m = 1 Stable32's edf of white FM is not that of sampled noise (782 for 666).
    curve = getattr(deviation, kind)(thousand(), factors=factors)
    edf = deviation.estimator_named(kind).edf_at(
        np.zeros(len(factors)), curve.factors, curve.n, 1001
    )
    found = interval(curve.deviation, edf, 0.683)
    np.testing.assert_allclose(found, [low, high], rtol=tolerance)
