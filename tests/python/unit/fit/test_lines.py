"""The classical reading says what is there, and nothing of what is not."""

import runpy
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import allanite as al
from allanite.fit.classical.lines import read_lines

RATE = 100.0


def white(seed, n=720_000, level=0.01):
    return np.random.default_rng(seed).standard_normal(n) * level * np.sqrt(RATE)


def curve(x):
    return al.oadev(x, rate=RATE)


@pytest.mark.parametrize("seed", range(5))
def test_white_noise_has_one_line(seed):
    lines = read_lines(curve(white(seed)))
    assert [line.name for line in lines.lines if line.present] == ["N"]
    n = lines["N"]
    # Half the width of the interval is 1.96 standard errors; five are beyond chance.
    assert abs(n.value - 0.01) < 2.6 * (n.high - n.low) / 2
    assert n.tau_low_s == pytest.approx(0.01)


@pytest.mark.parametrize("seed", range(5))
def test_white_and_gauss_markov_have_no_random_walk(seed):
    rng = np.random.default_rng(100 + seed)
    n, phi, sigma = 720_000, np.exp(-1 / (RATE * 20.0)), 0.02
    from scipy.signal import lfilter

    steps = rng.standard_normal(n) * sigma * np.sqrt(1 - phi**2)
    steps[0] = rng.standard_normal() * sigma
    lines = read_lines(curve(white(seed) + lfilter([1.0], [1.0, -phi], steps)))
    assert lines["N"].present
    assert not lines["K"].present
    assert lines["K"].value is None
    assert lines["K"].reason


def test_three_lines_where_three_are():
    rng = np.random.default_rng(3)
    n = 2_000_000
    walk = np.cumsum(rng.standard_normal(n)) * 1e-3 / np.sqrt(RATE)
    step = np.diff(rng.standard_normal(n + 1)) * 1e-3 * RATE
    lines = read_lines(curve(walk + step + white(4, n, 1e-3)))
    for name, truth in (("Q", 1e-3), ("K", 1e-3)):
        line = lines[name]
        assert line.present, line
        # The slope's tolerance lets a tenth of the variance come from the neighbours; chance adds five errors.
        assert abs(line.value - truth) < 0.05 * truth + 2.6 * (line.high - line.low) / 2
        assert line.low < line.value < line.high
    assert lines["Q"].tau_high_s <= lines["K"].tau_low_s


def test_ramp_is_read_at_root_two():
    t = np.arange(360_000) / RATE
    lines = read_lines(curve(white(8, t.size, 1e-4) + 1e-3 * t))
    assert lines["R"].present
    assert lines["R"].value == pytest.approx(1e-3, rel=0.02)
    assert not lines["K"].present


@given(st.floats(1e-6, 1e6))
@settings(max_examples=20)
def test_readings_scale_with_the_samples(scale):
    x = white(1, 20_000)
    a, b = read_lines(curve(x)), read_lines(curve(x * scale))
    for one, two in zip(a.lines, b.lines, strict=True):
        assert one.present == two.present
        if one.present:
            assert two.value == pytest.approx(one.value * scale, rel=1e-9)


def test_too_few_times():
    few = SimpleNamespace(
        tau=np.array([1.0, 2.0]),
        factors=np.array([1, 2]),
        n=np.array([9, 7]),
        deviation=np.array([1.0, 0.7]),
        edf=np.array([6.0, 3.0]),
    )
    with pytest.raises(al.TooShortError, match="2 averaging times"):
        read_lines(few)


def test_json_form():
    form = read_lines(curve(white(0, 10_000))).to_dict()
    assert [line["name"] for line in form["lines"]] == ["Q", "N", "B", "K", "R"]
    with pytest.raises(KeyError, match="no line 'X'"):
        read_lines(curve(white(0, 10_000)))["X"]


def published(omega, rate):
    """The published recipe, line by line."""
    t0 = 1 / rate
    theta = np.cumsum(omega) * t0
    length = theta.size
    top = 2 ** np.floor(np.log2(length / 2))
    m = np.unique(np.ceil(np.logspace(np.log10(1), np.log10(top), 100)).astype(int))
    m = m[2 * m < length]
    tau = m * t0
    avar = np.array(
        [np.sum((theta[2 * k :] - 2 * theta[k:-k] + theta[: -2 * k]) ** 2) for k in m]
    ) / (2 * tau**2 * (length - 2 * m))
    adev = np.sqrt(avar)
    logtau, logadev = np.log10(tau), np.log10(adev)
    slopes = np.diff(logadev) / np.diff(logtau)

    def read(slope, at):
        i = np.argmin(np.abs(slopes - slope))
        return 10 ** (slope * np.log10(at) + logadev[i] - slope * logtau[i])

    return read(-0.5, 1), read(0.5, 3), read(0, 1) / np.sqrt(2 * np.log(2) / np.pi)


def test_published_recipe():
    rng = np.random.default_rng(6)
    x = white(6, 30_000) + np.cumsum(rng.standard_normal(30_000)) * 1e-3
    example = Path(__file__).parents[4] / "examples" / "mathworks.py"
    found = runpy.run_path(str(example), run_name="example")["nearest_slopes"](x, RATE)
    # A slope nearest to the wanted one is picked out of 100: equal to rounding unless two tie.
    np.testing.assert_allclose(found, published(x, RATE), rtol=1e-6)
