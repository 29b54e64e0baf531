"""Classical slope method: read coefficients from straight lines on the log-log Allan curve."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite import _kernels
from allanite.common.arrays import Array, run_at
from allanite.common.errors import TooShortError
from allanite.common.parameters import NORMAL, Estimate
from allanite.effects import StraightLine, standard
from allanite.fit.likelihood.data import TAUS_PER_DECADE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from allanite.deviation import Deviation

#: Ratio of the longest to the shortest averaging time of a window in which a local slope is estimated.
#: Chosen by judgment; not measured.
WINDOW_TAU_RATIO = 4.0
#: Maximum deviation of a local slope from the slope of a line, in addition to two standard errors. Lines differ by ½ in
#: slope; a tenth of that may come from neighboring lines.
SLOPE_TOLERANCE = 0.05
#: Maximum standard error of a local slope: a quarter of the difference ½ between lines.
MAX_SLOPE_ERROR = 0.125
#: Probability with which the true deviation is below the upper limit that a line must not exceed at any τ.
#: Chosen by judgment; not measured.
CURVE_PROBABILITY = 0.999


@dataclass(frozen=True, slots=True)
class LineReading:
    """One straight line ``Q``, ``N``, ``B``, ``K`` or ``R`` with this log-log `slope`, read from an Allan curve.

    It is read at `read_at_s`, s; None for the plateau, which is divided by 0.664. It is `present` if the curve has this
    slope somewhere, from `tau_low_s` to `tau_high_s`, and the line is nowhere above the curve; otherwise `reason` says why
    not. `value`, `low` and `high` are the coefficient with its 95 % interval, in SI units of the samples. These and the
    ends of the range are None if the line is not present.
    """

    name: str
    slope: float
    read_at_s: float | None
    present: bool
    value: float | None = None
    low: float | None = None
    high: float | None = None
    tau_low_s: float | None = None
    tau_high_s: float | None = None
    reason: str = ""

    def estimate(self, unit: str) -> Estimate:
        """`Estimate` of the coefficient that was read, in SI units, labeled with `unit`; 0 if the line is not present."""
        interval = None if self.low is None or self.high is None else (self.low, self.high)
        return Estimate(self.value or 0.0, None, interval, unit, self.present, self.name)

    def to_dict(self) -> dict[str, Any]:
        """Dict of the attributes, for JSON."""
        return asdict(self)


@dataclass(frozen=True, slots=True)
class LineReadings:
    """Readings of the five lines, in the order of their slopes from −1 to +1."""

    lines: tuple[LineReading, ...]

    def __getitem__(self, name: str) -> LineReading:
        for line in self.lines:
            if line.name == name:
                return line
        raise KeyError(f"no line {name!r}: Q, N, B, K, R")

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON with the key ``lines``: a list of the readings."""
        return {"lines": [line.to_dict() for line in self.lines]}


def read_lines(deviation: Deviation) -> LineReadings:
    """`LineReadings` of lines of slope −1, −½, 0, +½, +1 on an overlapping Allan deviation.

    The local slope is a generalized least-squares fit over a factor of 4 in τ, with the covariance that noise of this slope
    would have. A line is present under three conditions. The local slope differs from that of the line by less than 0.05
    plus twice its standard error. The standard error is at most 0.125. The line, extended over all τ, nowhere exceeds the
    measured curve significantly, because a part of the variance cannot be larger than the total. The line is read where its
    slope fits best. `TooShortError` for fewer than three averaging times with an estimate.
    """
    tau, sigma, edf, m = deviation.tau, deviation.deviation, deviation.edf, deviation.factors
    good = np.isfinite(sigma) & (sigma > 0) & np.isfinite(edf)
    if np.count_nonzero(good) < 3:
        raise TooShortError(
            f"found {np.count_nonzero(good)} averaging times with an estimate; a slope needs at least 3"
        )
    first = int(np.flatnonzero(good)[0])
    n = int(deviation.n[first] + 2 * m[first] - 1)
    keep = _thinned(np.where(good & (2 * m <= n), m, 0))
    return LineReadings(
        tuple(
            _read(e.standard, tau[keep], m[keep], sigma[keep], edf[keep], n)
            for e in standard().values()
            if e.standard is not None
        )
    )


def _thinned(m: NDArray[np.int64]) -> NDArray[np.int64]:
    """Indices of averaging factors that grow by at least 20 % each; factors of 0 are skipped.

    20 % is 1/8 of a decade, less 10 % for rounding.
    """
    out: list[int] = []
    step = 10.0 ** (1.0 / TAUS_PER_DECADE) * 0.9
    for k in np.flatnonzero(m > 0):
        if not out or m[k] >= m[out[-1]] * step:
            out.append(int(k))
    return np.array(out, dtype=np.int64)


def _read(
    line: StraightLine, tau: Array, m: NDArray[np.int64], sigma: Array, edf: Array, n: int
) -> LineReading:
    """`LineReading` of one line on an Allan curve of n samples, under the conditions of `read_lines`."""
    name, slope, where = line.name, line.slope, line.read_at

    def absent(reason: str) -> LineReading:
        """`LineReading` that the line is not present, with the text `reason` and no value."""
        return LineReading(name, slope, where, present=False, reason=reason)

    expected, covariance = _kernels.allan_covariance([(line.scatter, [1.0])], n, m)
    # Of ln σ̂ = ½ ln σ̂².
    relative = covariance / np.outer(expected, expected) / 4.0
    x, y = np.log(tau), np.log(sigma)
    windows = [w for a in range(tau.size) if (w := _window(tau, a)) is not None]
    if not windows:
        return absent("the curve spans less than a factor of 4 in averaging time")
    fits = [_slope(x[w], y[w], relative[w, w]) for w in windows]
    sharp = [f[0] for f in fits if f[1] <= MAX_SLOPE_ERROR]
    if not sharp:
        return absent("no local slope is accurate enough")
    holds = [e <= MAX_SLOPE_ERROR and abs(f - slope) < SLOPE_TOLERANCE + 2.0 * e for f, e in fits]
    if not any(holds):
        nearest = min(sharp, key=lambda v: abs(v - slope))
        return absent(f"no part of the curve has this slope (nearest {nearest:+.2f})")
    # Use the larger of two scatters, so that a misjudged noise type does not make long τ look certain.
    largest = _largest_values(y, np.minimum(edf, 0.5 / np.diag(relative)))
    reason = ""
    for k in sorted(
        np.flatnonzero(holds).tolist(), key=lambda k: abs(fits[k][0] - slope) + fits[k][1]
    ):
        w = windows[k]
        level, error = _fitted_level(x[w], y[w], relative[w, w], slope)
        over = level + slope * x - 3.0 * error > largest
        if not over.any():
            at = level + (slope * np.log(where) if where is not None else 0.0) - np.log(line.level)
            value, low, high = (float(np.exp(at + s * error)) for s in (0.0, -NORMAL, NORMAL))
            first, last = run_at(np.array(holds), k)
            ends = float(tau[windows[first]][0]), float(tau[windows[last]][-1])
            return LineReading(name, slope, where, True, value, low, high, *ends)
        worst = int(np.argmax(np.where(over, level + slope * x - largest, -np.inf)))
        reason = reason or (
            f"the slope holds near {tau[w][0]:.3g} s, but the curve lies below its line at {tau[worst]:.3g} s"
        )
    return absent(reason)


def _largest_values(log_deviation: Array, edf: Array) -> Array:
    """Upper limits of ln of the true deviation at each τ, exceeded with the probability 1 − `CURVE_PROBABILITY`."""
    from scipy.special import chdtri

    return np.asarray(log_deviation + 0.5 * np.log(edf / chdtri(edf, CURVE_PROBABILITY)))


def _window(tau: Array, a: int) -> slice | None:
    """Slice of the averaging times from index `a` to the first one at or above `WINDOW_TAU_RATIO` times `tau[a]`.

    None if the curve ends before, or for fewer than three times.
    """
    b = int(np.searchsorted(tau, tau[a] * WINDOW_TAU_RATIO * (1 - 1e-9)))
    return slice(a, b + 1) if b < tau.size and b - a >= 2 else None


def _slope(x: Array, y: Array, covariance: Array) -> tuple[float, float]:
    """Pair: generalized least-squares slope of y against x for a `covariance` of y, and the standard error of the slope."""
    design = np.column_stack([np.ones_like(x), x])
    weighted = np.linalg.solve(covariance, design)
    inverse = np.linalg.inv(design.T @ weighted)
    return float((inverse @ (weighted.T @ y))[1]), float(np.sqrt(inverse[1, 1]))


def _fitted_level(x: Array, y: Array, covariance: Array, slope: float) -> tuple[float, float]:
    """Pair: ln deviation at τ = 1 s of a line with given slope, and its standard error."""
    weights = np.linalg.solve(covariance, np.ones_like(x))
    total = float(weights.sum())
    return float(weights @ (y - slope * x)) / total, total**-0.5
