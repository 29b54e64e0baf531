"""The noise generator: declared spectrum and Allan variance, determinism, chunks, errors."""

from __future__ import annotations

import numpy as np
import pytest

import allanite as al
from allanite import _core

SECTION = (0.02, 0.04, 0.02, -1.56, 0.64)


def section_gain(w):
    z = np.exp(-1j * w)
    b0, b1, b2, a1, a2 = SECTION
    return np.abs((b0 + b1 * z + b2 * z**2) / (1 + a1 * z + a2 * z**2)) ** 2


def lag(w, sigma, phi):
    return sigma**2 * (1 - phi**2) / (1 - 2 * phi * np.cos(w) + phi**2)


def boxcar(w, length):
    return (np.sin(length * w / 2) / (length * np.sin(w / 2))) ** 2


# name, values, declared two-sided spectrum of w in (0, pi]
PROCESSES = {
    "white": (("white", [1.5]), lambda w: 2.25 * np.ones_like(w)),
    "blue": (("blue", [1.5]), lambda w: 9.0 * np.sin(w / 2) ** 2),
    "random_walk": (("random_walk", [1.5]), lambda w: 2.25 / (4 * np.sin(w / 2) ** 2)),
    "flicker": (("flicker", [1.5]), lambda w: 2.25 / (2 * np.sin(w / 2))),
    "power_law+1": (("power_law", [1.0, 1.5]), lambda w: 2.25 * (2 * np.sin(w / 2))),
    "power_law+0.4": (("power_law", [0.4, 1.5]), lambda w: 2.25 * (2 * np.sin(w / 2)) ** 0.4),
    "power_law-0.6": (("power_law", [-0.6, 1.5]), lambda w: 2.25 * (2 * np.sin(w / 2)) ** -0.6),
    "power_law-1.7": (("power_law", [-1.7, 1.5]), lambda w: 2.25 * (2 * np.sin(w / 2)) ** -1.7),
    "power_law-2.5": (("power_law", [-2.5, 1.5]), lambda w: 2.25 * (2 * np.sin(w / 2)) ** -2.5),
    "gauss_markov": (("gauss_markov", [1.5, 0.97]), lambda w: lag(w, 1.5, 0.97)),
    "gauss_markov-": (("gauss_markov", [1.5, -0.5]), lambda w: lag(w, 1.5, -0.5)),
    "filtered": (("filtered", [1.5, *SECTION]), lambda w: 2.25 * section_gain(w)),
    "filtered twice": (
        ("filtered", [1.5, 0.3, 0.0, 0.0, -0.7, 0.0, *SECTION]),
        lambda w: 0.2025 * section_gain(w) / np.abs(1 - 0.7 * np.exp(-1j * w)) ** 2,
    ),
    "finite": (
        ("finite", [0.5, 0.9, 0.2]),
        lambda w: np.abs(0.5 + 0.9 * np.exp(-1j * w) + 0.2 * np.exp(-2j * w)) ** 2,
    ),
    "moving_average": (("moving_average", [1.5, 7]), lambda w: 2.25 * boxcar(w, 7)),
    "telegraph": (("telegraph", [1.5, 0.02]), lambda w: lag(w, 1.5, 0.96)),
}


def allan_variance(x, m):
    """Overlapping Allan variance at a rate of 1 Hz, averaged over the last axis."""
    theta = np.concatenate([np.zeros((*x.shape[:-1], 1)), np.cumsum(x, axis=-1)], axis=-1)
    difference = theta[..., 2 * m :] - 2 * theta[..., m:-m] + theta[..., : -2 * m]
    return (difference**2).mean(axis=-1) / (2 * m * m)


def exact_allan_variance(spectrum, m):
    """Integral of the discrete spectrum against 2 sin^4(mw/2)/(m sin(w/2))^2."""
    # Midpoint rule in w = pi v^2, which resolves an integrable pole at zero.
    count = 200_000
    v = (np.arange(count) + 0.5) / count
    w = np.pi * v**2
    kernel = 2 * np.sin(m * w / 2) ** 4 / (m * np.sin(w / 2)) ** 2
    return float(np.mean(spectrum(w) * kernel * 2 * v))


@pytest.mark.parametrize("name", PROCESSES)
def test_spectrum_is_the_declared_one(name):
    process, spectrum = PROCESSES[name]
    length, count = 4096, 128
    x = _core.simulate([process], length * count, seed=11).reshape(count, length)
    if name in ("random_walk", "power_law-1.7", "power_law-2.5"):
        # A Hann window leaks what is steeper than its own side lobes: difference, and declare so.
        x = np.diff(x, axis=1, append=x[:, -1:])
        flat = lambda w: spectrum(w) * 4 * np.sin(w / 2) ** 2  # noqa: E731
    else:
        flat = spectrum
    window = np.sin(np.pi * (np.arange(length) + 0.5) / length) ** 2
    power = np.abs(np.fft.rfft(x * window)) ** 2 / np.sum(window**2)
    w = 2 * np.pi * np.arange(length // 2 + 1) / length
    mean = power.mean(axis=0)
    # What the window makes of the declared spectrum: (1, 4, 1)/6 of the neighbours' power.
    inside = np.arange(8, length // 2 - 8)
    smooth = (flat(w[inside - 1]) + 4 * flat(w[inside]) + flat(w[inside + 1])) / 6
    keep = smooth > 1e-3 * np.max(smooth) if name == "moving_average" else smooth > 0
    ratio = mean[inside][keep] / smooth[keep]
    for band in np.array_split(ratio, np.geomspace(8, ratio.size - 1, 9).astype(int)):
        if band.size == 0:
            continue
        # An ordinate of one segment has relative spread 1; Hann correlates at most 2 bins.
        spread = np.sqrt(2.0 / (count * band.size))
        # The telegraph's ordinates are nearly but not quite exponential, hence the 6.
        assert abs(band.mean() - 1) < 6 * spread + 2e-3


@pytest.mark.parametrize(
    ("name", "n", "factors"),
    [
        ("white", 256, (1, 16, 64)),
        ("blue", 256, (1, 16, 64)),
        ("random_walk", 256, (1, 16, 64)),
        ("flicker", 256, (1, 2, 4, 16, 64)),
        ("power_law-1.7", 256, (1, 16, 64)),
        ("power_law+1", 256, (1, 16, 64)),
        ("gauss_markov", 256, (1, 16, 64)),
        ("filtered", 256, (1, 16, 64)),
        ("filtered twice", 256, (1, 16, 64)),
        ("finite", 256, (1, 16, 64)),
        ("moving_average", 256, (1, 16, 64)),
        ("telegraph", 256, (1, 16, 64)),
    ],
)
def test_allan_variance_is_unbiased_to_a_quarter_of_the_record(name, n, factors):
    process, spectrum = PROCESSES[name]
    runs = 2000
    x = np.array([_core.simulate([process], n, seed=5, replicate=r) for r in range(runs)])
    for m in factors:
        found = allan_variance(x, m)
        error = found.std() / np.sqrt(runs)
        # Five standard errors of this very sample; 0.3 % for ripple and below 1/(20 n).
        expected = exact_allan_variance(spectrum, m)
        assert abs(found.mean() - expected) < 5 * error + 3e-3 * expected, m


def test_flicker_plateau_and_short_end():
    # Ratios to the plateau 2 ln 2/pi B^2 of the half-order fractional difference.
    x = _core.simulate([("flicker", [1.0])], 1 << 22, seed=2)
    plateau = 2 * np.log(2) / np.pi
    for m, ratio in ((1, 1.443), (2, 1.154), (4, 1.049), (16, 1.007)):
        # Relative spread of the variance at m: below sqrt(2 m/n), 0.3 % at m = 16.
        spread = np.sqrt(2 * m / x.size)
        assert abs(allan_variance(x, m) / plateau / ratio - 1) < 5 * spread + 1e-3


def test_random_walk_starts_at_zero_and_telegraph_has_two_levels():
    walk = _core.simulate([("random_walk", [2.0])], 100, seed=1)
    assert walk[0] == 0.0
    assert walk[1] != 0.0
    levels = _core.simulate([("telegraph", [3.0, 0.1])], 10_000, seed=1)
    assert set(np.unique(levels)) == {-3.0, 3.0}
    switches = np.mean(np.diff(levels) != 0)
    assert abs(switches - 0.1) < 5 * np.sqrt(0.1 * 0.9 / 9999)


@pytest.mark.slow
def test_initial_state_is_stationary():
    # The variance of the first sample equals that of the rest: 4000 runs, spread sqrt(2/4000).
    for name in ("gauss_markov", "filtered", "moving_average", "power_law-0.6", "flicker"):
        process, _ = PROCESSES[name]
        runs = np.array([_core.simulate([process], 16, 9, replicate=r) for r in range(4000)])
        first, later = runs[:, 0].var(), runs[:, 8].var()
        assert abs(first / later - 1) < 5 * np.sqrt(2 * 2 / 4000)


def test_streams_of_names_are_different_and_uncorrelated():
    process = [("white", [1.0])]
    n = 100_000
    base = _core.simulate(process, n, 1)
    two = _core.simulate([("white", [0.0]), ("white", [1.0])], n, 1)
    others = [
        _core.simulate(process, n, 2),
        _core.simulate(process, n, 1, replicate=1),
        _core.simulate(process, n, 1, axis=1),
        two,
    ]
    np.testing.assert_array_equal(base, _core.simulate(process, n, 1))
    for other in others:
        assert abs(np.corrcoef(base, other)[0, 1]) < 5 / np.sqrt(n)


def test_any_chunks_and_threads_give_the_same_bits():
    processes = [process for process, _ in PROCESSES.values()]
    n = 300_000
    whole = _core.simulate(processes, n, 3, 1, 2)
    for threads in (1, 2, 7):
        np.testing.assert_array_equal(whole, _core.simulate(processes, n, 3, 1, 2, threads=threads))
    rng = np.random.default_rng(0)
    for _ in range(3):
        stream = _core.Simulator(processes, 3, 1, 2, n)
        chunks, left = [], n
        while left:
            size = min(left, int(10 ** rng.uniform(0, 5)))
            chunks.append(stream.next(size))
            left -= size
        np.testing.assert_array_equal(whole, np.concatenate(chunks))


def test_nothing_and_no_samples():
    assert _core.simulate([], 5, 1).tolist() == [0.0] * 5
    assert _core.simulate([("flicker", [1.0])], 0, 1).size == 0


@pytest.mark.parametrize(
    ("process", "message"),
    [
        (("pink", [1.0]), "unknown"),
        (("white", [1.0, 2.0]), "needs 1"),
        (("white", [np.nan]), "not finite"),
        (("power_law", [-3.0, 1.0]), "outside"),
        (("power_law", [1.1, 1.0]), "outside"),
        (("gauss_markov", [1.0, 1.0]), "between -1 and 1"),
        (("filtered", [1.0, 1.0, 0.0, 0.0, -2.0, 1.0]), "unstable"),
        (("filtered", [1.0, 1.0]), "5 a section"),
        (("finite", []), "at least 1"),
        (("moving_average", [1.0, 2.5]), "whole number"),
        (("telegraph", [1.0, 1.5]), "outside"),
    ],
)
def test_errors_are_one_line_and_name_the_thing(process, message):
    with pytest.raises(al.InputError, match=message) as caught:
        _core.simulate([process], 10, 1)
    assert process[0] in str(caught.value)
    assert "\n" not in str(caught.value)
