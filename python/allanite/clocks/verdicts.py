"""Checks of a clock against the limits of a mask, and the length of record that each limit needs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite import deviation
from allanite.common.documents import fields_dict
from allanite.common.errors import TooShortError
from allanite.effects import lagged
from allanite.spectrum import bridge_gaps

if TYPE_CHECKING:
    from allanite.clocks.masks import Limit, Mask
    from allanite.deviation import Deviation

Array = NDArray[np.float64]
#: Minimum ratio of the length of a record to τ: for a time deviation (ITU-T O.172), and for a time interval error.
MIN_LENGTH_OVER_TAU = {"tdev": 12.0, "mtie": 1.0}
#: Time over which a constant time error is averaged, s (G.8273.2 clause 7.1.2).
AVERAGING_TIME = 1000.0
#: Averaging times per decade; the corners of the limits are added to them.
POINTS_PER_DECADE = 10


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """Result for one limit of a mask.

    Attributes
    ----------
    mask, kind : str
        Name of the mask; ``mtie``, ``tdev``, ``time error`` or ``constant time error``.
    result : str
        ``passes``, ``fails`` or ``undecided``.
    tau : float or None
        Averaging time at which the measured value is closest to its limit, or exceeds it most, s.
    measured, limit : float or None
        Measured value and limit at `tau`, s.
    low, high : float or None
        95 % interval of a time deviation, s.
    checked : (float, float) or None
        Shortest and longest averaging time that was checked, s.
    needs : float
        Length of record that the mask needs, s.
    source : str
        Standard and clause of the limit.
    """

    mask: str
    kind: str
    result: str
    tau: float | None = None
    measured: float | None = None
    limit: float | None = None
    low: float | None = None
    high: float | None = None
    checked: tuple[float, float] | None = None
    needs: float
    source: str

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON with all attributes; names of times end with ``_s``."""
        times = ("tau", "measured", "limit", "low", "high", "checked", "needs")
        return fields_dict(self, **{name: f"{name}_s" for name in times})


def verdicts(mask: Mask, phase: Array, rate: float) -> list[Verdict]:
    """One `Verdict` for each limit of a mask: MTIE and TDEV, then time error and constant time error, if it limits them.

    `phase` is the time error in s on a regular grid, NaN where missing. MTIE and TDEV are those of the phase after the
    low-pass of the mask, if it has one.
    """
    filtered = phase if mask.filter_hz is None else low_pass_filtered(phase, rate, mask.filter_hz)
    out = [
        _verdict_on_deviation(mask.name, kind, limit, filtered, rate)
        for kind, limit in mask.limits.items()
    ]
    if mask.time_error is not None:
        out.append(_verdict_on_error(mask, "time error", phase, mask.time_error, phase.size / rate))
    if mask.constant is not None:
        means = window_means(phase, rate)
        out.append(
            _verdict_on_error(mask, "constant time error", means, mask.constant, phase.size / rate)
        )
    return out


def _verdict_on_error(
    mask: Mask, kind: str, errors: Array, limit: float, duration: float
) -> Verdict:
    """`Verdict` on the largest of |`errors`| (s) against its limit (s), for a record of this duration (s).

    ``undecided`` for a record shorter than 1000 s or no `errors`.
    """
    largest = float(np.nanmax(np.abs(errors))) if errors.size else None
    result = "undecided"
    if largest is not None and largest > limit:
        result = "fails"
    elif largest is not None and duration >= AVERAGING_TIME:
        result = "passes"
    return Verdict(
        mask=mask.name,
        kind=kind,
        result=result,
        measured=largest,
        limit=limit,
        needs=AVERAGING_TIME,
        source=mask.source,
    )


def _verdict_on_deviation(mask: str, kind: str, limit: Limit, phase: Array, rate: float) -> Verdict:
    """`Verdict`: does the deviation `kind` (``tdev`` or ``mtie``) of a phase stay below its limit at all averaging times?

    ``fails`` if the lower end of a 95 % interval exceeds the limit. ``passes`` needs a record as long as the mask
    requires. In addition no upper end may exceed the limit at τ up to 1/12 of the record (MTIE: the record). Otherwise
    ``undecided``. A deviation without an interval is compared itself.
    """
    _, high_tau = limit.span
    last = high_tau if np.isfinite(high_tau) else limit.pieces[-1].low
    needs = MIN_LENGTH_OVER_TAU[kind] * last
    undecided = Verdict(mask=mask, kind=kind, result="undecided", needs=needs, source=limit.source)
    try:
        found = _measured_deviation(kind, limit, phase, rate)
    except TooShortError:
        return undecided
    bounds = limit.at(found.tau)
    usable = np.isfinite(bounds) & np.isfinite(found.deviation)
    if not usable.any():
        return undecided
    tau, bounds, value = found.tau[usable], bounds[usable], found.deviation[usable]
    known = found.has_interval
    low = np.where(np.isfinite(found.low[usable]), found.low[usable], 0.0) if known else value
    high = np.where(np.isfinite(found.high[usable]), found.high[usable], np.inf) if known else value
    if (low > bounds).any():
        result, at = "fails", int(np.argmax(low / bounds))
    else:
        # At the longest averaging times the intervals are too wide, so that only times with a long enough record count.
        inside = tau * MIN_LENGTH_OVER_TAU[kind] <= phase.size / rate
        whole = phase.size / rate >= needs
        result = "passes" if whole and (high[inside] <= bounds[inside]).all() else "undecided"
        at = int(np.argmax(np.where(inside, high / bounds, -1.0))) if inside.any() else 0
    return replace(
        undecided,
        result=result,
        tau=float(tau[at]),
        measured=float(value[at]),
        limit=float(bounds[at]),
        low=float(low[at]) if known else None,
        high=float(high[at]) if known and np.isfinite(high[at]) else None,
        checked=(float(tau[0]), float(tau[-1])),
    )


def _measured_deviation(kind: str, limit: Limit, phase: Array, rate: float) -> Deviation:
    """TDEV or MTIE of a phase (s) at ten τ per decade in the range of the limit, and where its formula changes.

    Raises `TooShortError` if no averaging time of the limit fits into the record.
    """
    estimator = getattr(deviation, kind)
    low, high = limit.span
    longest = phase.size / (3.0 if kind == "tdev" else 1.0)
    top = min(high * rate, longest)
    first = max(1.0, low * rate)
    if top < first:
        raise TooShortError("no averaging time of the limit fits into the record")
    count = max(2, int(POINTS_PER_DECADE * np.log10(top / first)) + 1)
    corners = [piece.high * rate for piece in limit.pieces if piece.high * rate <= top]
    factors = np.unique(np.floor([*np.geomspace(first, top, count), *corners]).astype(np.int64))
    most = phase.size // 3 if kind == "tdev" else phase.size - 1
    factors = factors[(factors >= 1) & (factors <= most)]
    found: Deviation = estimator(phase, rate=rate, quantity="angle", factors=factors)
    return found


def low_pass_filtered(phase: Array, rate: float, cutoff: float) -> Array:
    """Phase after a first-order low-pass filter with this cutoff (Hz), which interpolates missing samples."""
    there = np.isfinite(phase)
    return np.where(there, lagged(bridge_gaps(phase), rate / (2.0 * np.pi * cutoff)), np.nan)


def window_means(phase: Array, rate: float) -> Array:
    """Moving average of the phase over 1000 s, shape (k,): the mean of the finite samples in each window.

    A window with more than half of its samples missing is left out. Empty for a record shorter than one window.
    """
    m = round(AVERAGING_TIME * rate)
    if m < 1 or m > phase.size:
        return np.zeros(0)
    there = np.isfinite(phase)
    total = np.concatenate([[0.0], np.cumsum(np.where(there, phase, 0.0))])
    count = np.concatenate([[0], np.cumsum(there)])
    some = count[m:] - count[:-m]
    sums = total[m:] - total[:-m]
    return np.asarray(sums[2 * some >= m] / some[2 * some >= m])
