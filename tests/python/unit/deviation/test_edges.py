"""Numbers at the edge of doubles, and the same bits whatever the number of threads."""

import os
import subprocess
import sys
from fractions import Fraction
from itertools import pairwise
from math import comb

import numpy as np
import pytest

import allanite as al

X = np.random.default_rng(3).standard_normal(2000)


@pytest.mark.parametrize("scale", [1e-200, 1e-160, 1e-120, 1e120, 1e150])
@pytest.mark.parametrize("kind", ["oadev", "mdev", "ohdev", "totdev"])
def test_a_scale_is_kept_or_refused(kind, scale):
    """Squares beyond doubles are 0 or infinite: the result is right to 1e-9, or refused."""
    deviation = getattr(al, kind)
    one = deviation(X, factors=[1, 4, 16]).deviation
    try:
        found = deviation(X * scale, factors=[1, 4, 16]).deviation
    except al.AllaniteError:
        return
    np.testing.assert_allclose(found / scale, one, rtol=1e-9)


@pytest.fixture(scope="module")
def ramp():
    """A ramp of a million times its noise at the ends, and its phase in long doubles."""
    n = 2_000_000
    noise = np.round(np.random.default_rng(1).standard_normal(n) * 2**20) / 2**30
    x = np.linspace(-500.0, 500.0, n) + noise
    wide = x.astype(np.longdouble)
    return x, np.concatenate([[np.longdouble(0)], np.cumsum(wide - wide.mean())])


def _differences(theta, m, order):
    weights = [(-1) ** k * comb(order, k) for k in range(order + 1)]
    count = theta.size - order * m
    return sum(w * theta[k * m : k * m + count] for k, w in enumerate(weights))


def _averages(theta, m):
    total = np.concatenate([[np.longdouble(0)], np.cumsum(_differences(theta, m, 2))])
    return (total[m:] - total[:-m]) / m


def _slopes(theta, m):
    if m == 1:  # a line through two phases is its ends
        return _differences(theta, 1, 2)
    steps = theta[m:] - theta[:-m]
    weights = (m - 1) / 2 - np.arange(m)
    count = theta.size - 2 * m
    return sum(w * steps[k : k + count] for k, w in enumerate(weights)) * 12 / m**2


def _reflected(theta, m):
    around = np.concatenate(
        [2 * theta[0] - theta[m:0:-1], theta, 2 * theta[-1] - theta[-2 : -m - 2 : -1]]
    )
    return _differences(around, m, 2)[1:-1]


RAMPED = {
    "oadev": (lambda theta, m: _differences(theta, m, 2), 2),
    "adev": (lambda theta, m: _differences(theta, m, 2)[::m], 2),
    "mdev": (_averages, 2),
    "ohdev": (lambda theta, m: _differences(theta, m, 3), 6),
    "hdev": (lambda theta, m: _differences(theta, m, 3)[::m], 6),
    "totdev": (_reflected, 2),
    "pdev": (_slopes, 2),
}


@pytest.mark.skipif(np.finfo(np.longdouble).nmant < 63, reason="long doubles are doubles here")
@pytest.mark.parametrize("name", RAMPED)
def test_a_ramp_hides_no_noise(name, ramp):
    """With a ramp a million times the noise, the shortest τ is exact to 1e-10."""
    x, theta = ramp
    terms, divisor = RAMPED[name]
    found = getattr(al, name)(x, factors=[1, 2, 3]).deviation
    for m, value in zip((1, 2, 3), found, strict=True):
        exact = np.sqrt(np.mean(terms(theta, m) ** 2) / (divisor * m * m))
        assert abs(value / float(exact) - 1) < 1e-10


def test_a_unit_of_npz_that_is_no_text_is_refused(tmp_path):
    np.savez(tmp_path / "x.npz", data=X, rate_hz=10.0, unit=5)
    with pytest.raises(al.InputError, match="'unit' must be text"):
        al.read(tmp_path / "x.npz")


SAME_BITS = """
import os, sys
processors = int(sys.argv[1])
if hasattr(os, "sched_setaffinity"):
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:processors])
import hashlib, json
import numpy as np, allanite as al
x = np.random.default_rng(3).standard_normal(20000).cumsum() * 1e-3
x += np.random.default_rng(4).standard_normal(20000)
recording = al.Recording(x, rate=100)
fit = al.fit_model(recording, 'N+B+K')
check = fit.check()
curve = recording.oadev()
for value in (fit.band.low, fit.band.high, curve.deviation, curve.low):
    print(hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest())
for result in (fit, check):
    print(json.dumps(result.to_dict()))
"""


@pytest.mark.long
def test_fits_are_the_same_bits_with_any_number_of_threads():
    """The core's threads follow the processors; those of its pool and of the linear algebra follow the environment."""
    said = {
        subprocess.run(
            [sys.executable, "-c", SAME_BITS, str(processors)],
            env={**os.environ, **{f"{name}_NUM_THREADS": str(threads) for name in ("RAYON", "OPENBLAS")}},
            capture_output=True, text=True, check=True,
        ).stdout
        for processors, threads in ((1, 1), (1, 7), (2, 2), (2, 7))
    }  # fmt: skip
    assert len(said) == 1


def _exact(angle, m, order):
    """Deviation of differences of this order over m intervals, in fractions."""
    x = [Fraction(float(v)) for v in angle]
    weights = [(-1) ** k * comb(order, k) for k in range(order + 1)]
    terms = [
        sum(w * x[first + k * m] for k, w in enumerate(weights))
        for first in range(len(x) - order * m)
    ]
    square = sum(t * t for t in terms) / len(terms)
    return float(square / (comb(2 * order - 2, order - 1) * m * m)) ** 0.5


@pytest.mark.parametrize(("offset", "step"), [(1e6, 1e-3), (1e9, 1e-6), (-1e15, 3.0)])
@pytest.mark.parametrize(("name", "order"), [("oadev", 2), ("ohdev", 3)])
def test_angles_near_rounding(name, order, offset, step):
    """Increments of a few units in the last place of the angle, whose differences are exact in doubles."""
    angle = offset + np.cumsum(np.random.default_rng(1).standard_normal(1000) + 1.0) * step
    factors = [1, 2, 10, 100]
    found = getattr(al, name)(angle, rate=1.0, quantity="angle", factors=factors)
    exact = [_exact(angle, m, order) for m in factors]
    np.testing.assert_allclose(found.deviation, exact, rtol=1e-13)


def test_mean_and_variance_of_angles_near_rounding():
    angle = 1e9 + np.cumsum(np.random.default_rng(1).standard_normal(5000) + 1.0) * 1e-6
    recording = al.Recording(angle, rate=10.0, quantity="angle", unit="deg")
    x = [Fraction(float(v)) for v in angle]
    rate = [10 * (after - before) for before, after in pairwise(x)]
    mean = sum(rate) / len(rate)
    variance = sum((r - mean) ** 2 for r in rate) / len(rate)
    samples = recording.rate_samples()
    assert samples.mean() == pytest.approx(float(mean), rel=1e-13)
    assert samples.var() == pytest.approx(float(variance), rel=1e-12)
