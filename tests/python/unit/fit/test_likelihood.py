"""The likelihood with a discrepancy and its maximum against a naive twin: full sums, SciPy's least squares."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import nnls
from scipy.special import gammaln

import allanite as al
from allanite.fit.likelihood import discrepancy, whittle
from allanite.fit.likelihood.discrepancy import MIN_DISCREPANCY_DELTA_LOGL, SCALES
from allanite.spectrum.spectrum import cells_of

EDGES = np.exp(np.linspace(-2.0, 11.5, 15))
NODES = np.sqrt(EDGES[1:] * EDGES[:-1])
WEIGHTS = np.diff([0.0, *np.exp(-1.0 / EDGES[1:-1]), 1.0])


def cells(count):
    """First bin of each cell, its number of bins, and its degrees of freedom."""
    first = np.array(cells_of(count.size))
    return first, np.diff([*first, count.size]), np.add.reduceat(count, first)


def means(count, values):
    """Means over each cell, weighted by the degrees of freedom."""
    first, _, total = cells(count)
    return (np.add.reduceat((count * values.T).T, first).T / total).T


def judge(power, count, spectrum, scale):
    """Marginal logL and weight from a sum over all nodes, with one discrepancy for the bins of a cell."""
    _, sizes, total = cells(count)
    mean = means(count, power / spectrum)
    y = np.log(mean) - mean
    # What no discrepancy changes: the bins' spectrum, and the norm of the mean of their cell.
    plain = -0.5 * float(total @ np.log(mean) + count @ np.log(spectrum))
    if scale is None:
        return 0.5 * float(total @ y) + plain, count
    half = total[:, None] / 2.0
    k = half / (1.0 + half * SCALES[scale] ** 2 * NODES)
    norm = np.log(WEIGHTS) + k * np.log(k) - gammaln(k) - (half * np.log(half) - gammaln(half))
    log = k * y[:, None] + norm
    top = log.max(axis=1)
    share = np.exp(log - top[:, None])
    sums = share.sum(axis=1)
    left = 2.0 * (share * k).sum(axis=1) / sums
    return float(np.sum(top + np.log(sums))) + plain, count * np.repeat(left / total, sizes)


def better_scale(power, count, spectrum, scale, best):
    for step in (1, -1):
        while 0 <= scale + step < SCALES.size:
            found = judge(power, count, spectrum, scale + step)
            if found[0] <= best[0]:
                break
            scale, best = scale + step, found
    return scale, best


def climb(power, count, columns, theta, scale, offset, rounds):
    """θ, marginal logL and scale by SciPy's non-negative least squares."""
    base = np.zeros_like(power) if offset is None else offset
    floor = 1e-24 * float(np.max(power)) + 1e-300
    units = 1.0 / np.max(columns / power[:, None], axis=0)
    unit, theta = columns * units, theta / units
    spectrum = np.maximum(unit @ theta + base, floor)
    best = judge(power, count, spectrum, scale)
    first, sizes, total = cells(count)
    for _ in range(rounds):
        # Newton's least squares in ln S: bins against their cell, then cells with what the discrepancy leaves them.
        share = np.add.reduceat(best[1], first) / total
        ratio, slopes, held = power / spectrum, unit / spectrum[:, None], base / spectrum
        mean, middle, middle_held = (means(count, v) for v in (ratio, slopes, held))
        apart = (1.0 + share * (mean - 1.0)).repeat(sizes) * (ratio / mean.repeat(sizes) - 1.0)
        # Towards S itself: slopes · goal = slopes · θ + residual, and slopes · θ is 1 less the share of what is held.
        inside = apart - (held - middle_held.repeat(sizes))
        root, left = np.sqrt(count), np.sqrt(share * total)
        rows = [(slopes - middle.repeat(sizes, axis=0)) * root[:, None], middle * left[:, None]]
        goal, _ = nnls(
            np.vstack(rows),
            np.concatenate([inside * root, (mean - middle_held) * left]),
            maxiter=1000,
        )
        before = best[0]
        for step in (1.0, 0.5, 0.25, 0.1, 0.03, 0.01):
            tried = theta + step * (goal - theta)
            moved = np.maximum(unit @ tried + base, floor)
            found = judge(power, count, moved, scale)
            if found[0] > best[0]:
                theta, spectrum, best = tried, moved, found
                break
        if scale is not None:
            scale, best = better_scale(power, count, spectrum, scale, best)
        if best[0] - before < 1e-6:
            break
    return theta * units, best[0], scale


def spectra(seed, bins, p, misfit):
    """Power laws over frequency, some with peaks, in odd units, and a random power around their sum."""
    rng = np.random.default_rng(seed)
    f = np.geomspace(1e-4, 0.5, bins)
    slopes = rng.choice(np.linspace(-3.0, 2.0, 21), size=p, replace=False)
    columns = f[:, None] ** slopes * 10.0 ** rng.uniform(-6.0, 6.0, p)
    count = np.ceil(np.geomspace(1.0, 10.0 ** rng.uniform(0.0, 5.0), bins))
    middle = np.exp(np.log(columns).mean(axis=0))
    offset = f**-1.0 * rng.uniform(0.0, 1.0)
    true = columns @ (rng.exponential(1.0, p) / middle) + offset
    power = true * rng.chisquare(count) / count * np.exp(misfit * rng.standard_t(2, bins))
    start = rng.exponential(1.0, p) / middle
    return power, count, columns, start, offset


cases = st.tuples(
    st.integers(0, 2**32),
    st.integers(5, 130),
    st.integers(1, 10),
    st.sampled_from([0.0, 0.03, 0.5]),
)
scales = st.one_of(st.none(), st.integers(0, SCALES.size - 1))


@given(cases, scales)
@settings(max_examples=60)
def test_judges_as_the_full_sum(case, scale):
    power, count, columns, start, _ = spectra(*case)
    spectrum = columns @ start
    value, weight = judge(power, count, spectrum, scale)
    found = discrepancy.marginal_likelihood(power, count, spectrum, scale)
    # 1e-9 of the terms, which are larger than what is left of them.
    size = 1e-9 * float(count @ (1.0 + np.abs(np.log(power)) + power / spectrum))
    assert found[0] == pytest.approx(value, rel=1e-9, abs=size)
    np.testing.assert_allclose(found[1], weight, rtol=1e-7)
    assert np.all(found[1] <= count * (1.0 + 1e-12))
    chosen = 0 if scale is None else scale
    near = discrepancy.likelihood(count).best_scale(power, spectrum, chosen)
    twin = better_scale(power, count, spectrum, chosen, judge(power, count, spectrum, chosen))
    assert near[1] == pytest.approx(twin[1][0], abs=size)
    level = discrepancy.bin_levels(power, count, spectrum, scale)
    mean = means(count, power / spectrum).repeat(cells(count)[1])
    np.testing.assert_allclose(level, mean ** (1.0 - weight / count), rtol=1e-6)


def test_profile_and_best_scale_are_those_of_single_judgements():
    power, count, columns, start, _ = spectra(7, 61, 3, 0.2)
    many = np.array([columns @ start, 2.0 * (columns @ start)])
    for spectrum in many:
        value = discrepancy.profile_likelihood(power, count, spectrum)[::5]
        each = [judge(power, count, spectrum, i)[0] for i in range(0, SCALES.size, 5)]
        np.testing.assert_allclose(value, each, rtol=1e-9)
    every = discrepancy.profile_likelihood(power, count, many[0])
    scale, best = discrepancy.best_scale(power, count, many[0])
    assert every.shape == (SCALES.size,)
    assert scale == np.argmax(every)
    assert best == pytest.approx(every.max(), rel=1e-12)


@given(cases, scales, st.booleans())
@settings(max_examples=60)
def test_climbs_as_the_naive_one(case, scale, held):
    power, count, columns, start, offset = spectra(*case)
    offset = offset if held else None
    # A few rounds: where two ways part by rounding, none is the better one.
    theta, value, place = climb(power, count, columns, start, scale, offset, 3)
    found = whittle.climb(power, count, columns, start, scale, offset, 3)
    assert np.all(found.theta >= 0.0)
    size = 1e-9 * float(count @ (1.0 + np.abs(np.log(power)) + power / found.spectrum))
    claimed = value - (MIN_DISCREPANCY_DELTA_LOGL if scale is not None else 0.0)
    assert found.log_likelihood == pytest.approx(claimed, rel=1e-9, abs=size)
    assert found.scale == place
    floor = 1e-24 * power.max() + 1e-300
    base = 0.0 if offset is None else offset
    np.testing.assert_allclose(
        found.spectrum, np.maximum(columns @ found.theta + base, floor), rtol=1e-12
    )
    # Apart by less than a climb stops at, a thousandth of a standard error: its last step may be one of rounding.
    moved = columns @ (found.theta - theta) / found.spectrum
    assert 0.25 * count @ moved**2 < 1e-6


@pytest.mark.parametrize("scale", [None, 20])
def test_many_climbs_are_single_climbs(scale):
    power, count, columns, start, _ = spectra(3, 80, 4, 0.1)
    rng = np.random.default_rng(4)
    matrices = columns * rng.uniform(0.5, 2.0, (50, 80, 1))
    starts = start * rng.uniform(0.5, 2.0, (50, 4))
    thetas, values, places = whittle.climb_many(power, count, matrices, starts, scale, rounds=7)
    for i in range(50):
        one = whittle.climb(power, count, matrices[i], starts[i], scale, rounds=7)
        np.testing.assert_array_equal(thetas[i], one.theta)
        assert (values[i], places[i]) == (one.log_likelihood, one.scale)


def test_maximize_is_no_worse_than_any_of_its_starts():
    power, count, columns, start, offset = spectra(12, 120, 3, 0.3)
    best = whittle.maximize(power, count, columns, offset=offset)
    assert best.scale is not None
    for scale in (None, 0, 30, 56):
        other = whittle.climb(power, count, columns, best.theta, scale, offset)
        # The last rounds of two climbs may each leave something below 1e-5.
        assert best.log_likelihood > other.log_likelihood - 1e-4
    none = whittle.climb(power, count, columns[:, :0], start[:0], 30, offset)
    assert (none.theta.size, none.scale) == (0, 30)


def test_what_does_not_fit_together_is_refused():
    power, count, columns, start, _ = spectra(1, 20, 2, 0.0)
    with pytest.raises(al.InputError, match="scale 57 of 57"):
        discrepancy.marginal_likelihood(power, count, power, SCALES.size)
    with pytest.raises(al.InputError, match="for 20 bins"):
        discrepancy.marginal_likelihood(power[1:], count, power[1:], 3)
    with pytest.raises(al.InputError, match="for 2 coefficients and 20 bins"):
        whittle.climb(power, count, columns[1:], start, None)
    with pytest.raises(al.InputError, match="degrees of freedom"):
        discrepancy.marginal_likelihood(power, -count, power, 3)


def test_a_cell_that_a_regression_fits_exactly_tells_nothing_about_the_level():
    """Its power is a rounding error, which changes with an offset of the record."""
    power, count, _, _, _ = spectra(6, 40, 2, 0.3)
    power[0], count[0] = 0.0, 0.05
    exact = discrepancy.bin_levels(power, count, np.ones(40), 40)
    power[0] = 1e-30
    rounded = discrepancy.bin_levels(power, count, np.ones(40), 40)
    assert cells_of(40)[1] == 1  # the first bin is a cell
    assert exact[0] == rounded[0] == 1.0
    assert exact[1:].min() > 0.0
