"""Theo1 and TheoH deviations: averaging times up to three quarters of the record."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from allanite.common.errors import TooShortError
from allanite.deviation.averaging import Samples, Taus, averaging_factors, samples_of
from allanite.deviation.estimation import kernel_results
from allanite.deviation.estimators import OADEV, THEO1, THEOH
from allanite.deviation.gaps import gap_notes
from allanite.deviation.result import Deviation

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

#: Most pairs (m = 9 + 3i, 12 + 4i) over which the bias of Theo1 is averaged.
MAX_BIAS_PAIRS = 30
#: Fewest phase points from which the bias is averaged over at least two pairs, i = 0 and 1: NIST SP 1065 eq. 33 averages
#: over i = 0 … points/30 − 3.
MIN_BIAS_POINTS = 30 * (3 + 1)


def theo1(
    x: object,
    rate: float = 1.0,
    taus: Taus = "octave",
    factors: ArrayLike | None = None,
    quantity: str = "rate",
) -> Deviation:
    """Theo1 deviation (NIST SP 1065 eq. 30) at effective averaging times τ = 0.75 m / rate with m even.

    No bias is removed (`theoh` does). `n` counts the terms (L − m) m/2. O(n m). Parameters as of
    `allanite.oadev`; `taus` in seconds are effective averaging times, odd `factors` are omitted.

    Returns
    -------
    Deviation
        Shape (k,), in the unit of the rate; 95 % intervals from the noise identified at each τ.

    Raises
    ------
    InputError
        As of `allanite.oadev`.
    TooShortError
        Fewer than 3 samples, no averaging time fits, or no even factor.

    Examples
    --------
    >>> x = al.AngleRandomWalk(N=0.1).simulate(duration=100, rate=10, seed=1)
    >>> print(al.theo1(x).tau[-1])  # s, where oadev ends at 25.6
    38.4
    """
    src = samples_of(x, rate, quantity)
    if factors is None and not isinstance(taus, (str, int, np.integer)):
        factors = 2 * np.maximum(np.round(np.asarray(taus, float) * src.rate / 1.5), 1.0)
        factors = np.unique(factors)
    m, notes = averaging_factors(src, taus, factors, src.points - 1)
    even = m % 2 == 0
    if not even.all():
        notes = (*notes, f"{np.count_nonzero(~even)} odd averaging factors were not used")
    if not even.any():
        raise TooShortError("Theo1 needs an even averaging factor: at least 3 samples and m = 2")
    return _theo1_at_factors(src, m[even], notes)


def _theoh_edf(
    alpha: NDArray[np.float64],
    allan_factors: NDArray[np.int64],
    theo1_factors: NDArray[np.int64],
    counts: NDArray[np.int64],
    points: int,
) -> NDArray[np.float64]:
    """Degrees of freedom of TheoH: of the Allan deviation at `allan_factors`, then of Theo1 at `theo1_factors`."""
    split = allan_factors.size
    first = OADEV.edf_at(alpha[:split], allan_factors, counts[:split], points)
    second = THEOH.edf_at(alpha[split:], theo1_factors, counts[split:], points)
    return np.concatenate([first, second])


def _theo1_at_factors(src: Samples, m: NDArray[np.int64], notes: tuple[str, ...]) -> Deviation:
    """`Deviation` of kind theo1 at the even averaging factors m; the averaging time is 0.75 m / rate.

    Each start in the record gives m/2 squared differences, which `n` and `lost` count.
    """
    variance, n, alpha, gaps, step = kernel_results(THEO1, src.samples, m, src.angle)
    lost = THEO1.max_terms(m, src.points) - n
    tau = np.asarray(0.75 * m / src.rate)
    notes += gap_notes(gaps, src.samples.size, tau, n, lost)
    return Deviation(
        THEO1.name,
        tau,
        m,
        n * (m // 2),
        np.sqrt(variance) * step * src.scale,
        alpha,
        src.rate,
        src.unit,
        notes,
        partial(THEO1.edf_at, alpha, m, n, src.points),
        lost=lost * (m // 2),
    )


def theoh(x: object, rate: float = 1.0, taus: Taus = "octave", quantity: str = "rate") -> Deviation:
    """TheoH deviation: overlapping Allan deviation up to a tenth of the record, then Theo1 without its bias.

    The bias is the mean ratio of the Allan variance at m = 9 + 3i to the Theo1 variance at m = 12 + 4i, which has the
    same effective τ (NIST SP 1065 eq. 33). The mean is over at most 30 values of i, spread evenly. `factors` of the
    result hold m of the Allan variance, then m of Theo1. Parameters as of `allanite.oadev`.

    Returns
    -------
    Deviation
        Shape (k,), in the unit of the rate; 95 % intervals from the noise identified at each τ.

    Raises
    ------
    InputError
        Samples, rate, taus or quantity that cannot be used.
    TooShortError
        Fewer than `MIN_BIAS_POINTS` phase points: 120 angles, or 119 rates or increments.

    Examples
    --------
    The longest τ is beyond half of the record, where `oadev` ends:

    >>> x = al.AngleRandomWalk(N=0.1).simulate(duration=100, rate=10, seed=1)
    >>> bool(al.theoh(x).tau[-1] > 50.0)
    True
    """
    src = samples_of(x, rate, quantity)
    if src.points < MIN_BIAS_POINTS:
        # Rates and increments have one sample less than phase points.
        needed = MIN_BIAS_POINTS - (src.points - src.samples.size)
        raise TooShortError(
            f"TheoH needs at least {needed} samples for its bias, found {src.samples.size}"
        )
    last = src.points // 30 - 3
    i = np.unique(np.round(np.linspace(0, last, MAX_BIAS_PAIRS)).astype(np.int64))
    near, notes = averaging_factors(src, taus, None, src.points // 10)
    pairs = np.union1d(near, 9 + 3 * i)
    variance, n, alpha, gaps, step = kernel_results(OADEV, src.samples, pairs, src.angle)
    samples = src.samples if step == 1.0 else src.samples / step
    whole, _ = averaging_factors(src, taus, None, src.points - 1)
    far = 2 * np.unique(np.round(whole / 1.5).astype(np.int64))
    far = far[(0.75 * far > near[-1]) & (far <= src.points - 1)]
    theo = THEOH.kernel(samples, np.union1d(far, 12 + 4 * i), src.angle)
    of = dict(zip(np.union1d(far, 12 + 4 * i).tolist(), zip(*theo[:3], strict=True), strict=True))
    allan = dict(zip(pairs.tolist(), zip(variance, n, alpha, strict=True), strict=True))
    bias = float(np.mean([allan[9 + 3 * j][0] / of[12 + 4 * j][0] for j in i.tolist()]))
    rows = [allan[m] for m in near.tolist()]
    rows += [(bias * of[m][0], of[m][1], of[m][2]) for m in far.tolist()]
    values, counts, laws = (np.array(column) for column in zip(*rows, strict=True))
    m = np.concatenate([near, far])
    edf = partial(_theoh_edf, laws, near, far, counts, src.points)  # which can be pickled
    tau = np.concatenate([near, 0.75 * far]) / src.rate
    whole_n = [OADEV.max_terms(near, src.points), THEOH.max_terms(far, src.points)]
    lost = np.concatenate(whole_n) - counts
    notes += gap_notes(gaps, src.samples.size, tau, counts, lost)
    beyond = f"beyond {near[-1] / src.rate:g} s"
    remark = (
        f"Theo1 {beyond}, its bias {bias:.4g} removed"
        if np.isfinite(bias)
        else f"nothing {beyond}: no bias of Theo1 could be estimated, as gaps leave too few samples at some"
        " averaging times"
    )
    return Deviation(
        THEOH.name,
        tau,
        m,
        counts,
        np.sqrt(values) * step * src.scale,
        laws,
        src.rate,
        src.unit,
        (*notes, remark),
        edf,
        lost=lost,
    )
