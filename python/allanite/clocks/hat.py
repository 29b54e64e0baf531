"""The noise of each of three or more clocks, from their differences.

Let z_i be the Allan differences of clock i: the differences of adjacent mean frequencies over τ. A comparison of clocks i
and j measures z_i − z_j. For independent clocks, E (z_i − z_j)(z_i − z_k) is the variance of z_i alone (Groslambert, Fest,
Olivier & Gagnepain 1981). If one counter measures all clocks at once, this is the three-cornered hat (Gray & Allan 1974).
If each pair has its own counter, the noise of the counters cancels.

The intervals come from the posterior of the variances. The measured covariances have a Wishart distribution, whose degrees
of freedom are those of the overlapping Allan variance at this τ (Vernotte & Lantz 2017, Metrologia 54, 264).
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.documents import finite_or_none, rows_of
from allanite.common.errors import InputError
from allanite.common.numbers import number
from allanite.common.printing import printed
from allanite.common.several import Several
from allanite.common.showing import text_html
from allanite.common.threads import stop_if_unwanted
from allanite.common.validation import require_recording
from allanite.deviation import oadev

if TYPE_CHECKING:
    from allanite.recording import Recording

Array = NDArray[np.float64]
#: Chains of the sampler, discarded first steps, and used steps. Errors of the quantiles are then 1 % of the interval.
CHAINS, WARMUP_STEPS, STEPS = 64, 200, 400
#: Minimum number of degrees of freedom. With fewer, three clocks cannot be separated.
MIN_EDF = 2.0
#: Scatter of the sum of three columns, relative to the scatter of the quietest column. Below this ratio the columns are
#: differences of pairs: the sum contains only rounding. Chosen by judgment; not measured.
MAX_RELATIVE_SUM = 1e-3


@dataclass(frozen=True, eq=False)
class ClockDeviation:
    """Allan deviation of one clock.

    Attributes
    ----------
    name : str
    tau : ndarray, shape (k,)
        s.
    variance : ndarray, shape (k,)
        Groslambert covariance, an unbiased estimate. It can be negative if the other clocks are much noisier.
    deviation : ndarray, shape (k,)
        Square root of `variance`; NaN where it is negative.
    low, high : ndarray, shape (k,)
        95 % interval of the deviation. If `detected` is False, low is 0 and high is the 95 % limit.
    detected : ndarray of bool, shape (k,)
        True if the noise of this clock can be distinguished from 0.
    edf : ndarray, shape (k,)
        Degrees of freedom.
    unit : str
        Unit of the deviation, that of the samples as a rate: ``1`` (fractional frequency) for a phase in s.

    Examples
    --------
    >>> x = np.cumsum(np.random.default_rng(1).standard_normal((500, 3)), axis=0)
    >>> log = al.Recording(x, rate=1.0, quantity="angle", columns=["a", "b", "c"])
    >>> one = al.three_cornered_hat(log)["b"]
    >>> one.name, one.tau[:3], one.to_dict()["points"][0]["detected"]
    ('b', array([1., 2., 4.]), True)
    """

    name: str
    tau: Array
    variance: Array
    deviation: Array
    low: Array
    high: Array
    detected: NDArray[np.bool_]
    edf: Array
    unit: str = "1"

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON: name of the clock, unit, and a list of its values at each averaging time; null for NaN."""
        points = rows_of(
            tau_s=self.tau,
            variance=self.variance,
            deviation=finite_or_none(self.deviation),
            low=self.low,
            high=self.high,
            detected=self.detected,
            edf=self.edf,
        )
        return {"clock": self.name, "unit": self.unit, "points": points}


class Clocks(Several[ClockDeviation]):
    """Mapping from the name of a clock to its `ClockDeviation`.

    Examples
    --------
    >>> x = np.cumsum(np.random.default_rng(1).standard_normal((500, 3)), axis=0)
    >>> found = al.three_cornered_hat(al.Recording(x, rate=1.0, quantity="angle"))
    >>> list(found), found.to_dict()["schema"]
    (['x0', 'x1', 'x2'], 'allanite/hat/1')
    """

    def _missing(self, name: str) -> str:
        """Message of the KeyError for an unknown clock `name`; it lists the clocks."""
        return f"no clock {name!r}: choose one of {', '.join(self)}"

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON, schema ``allanite/hat/1``, with a list of the results of all clocks."""
        return {
            "schema": "allanite/hat/1",
            "version": _kernels.version(),
            "clocks": [one.to_dict() for one in self.values()],
        }

    def __str__(self) -> str:
        lines = []
        for one in self.values():
            unit = "of the fractional frequency" if one.unit == "1" else f"in {printed(one.unit)}"
            lines.append(f"{one.name}: Allan deviation {unit}, with its 95 % interval")
            lines.append(f"{'τ / s':>12} {'deviation':>12} {'low':>12} {'high':>12}")
            columns = (one.tau, one.deviation, one.low, one.high, one.detected)
            for t, *values, seen in zip(*columns, strict=True):
                texts = [number(v, power=True) for v in values]
                value = f" not detected (95 % limit {texts[-1]})"
                if seen:
                    value = " ".join(f"{text:>12}" for text in texts)
                lines.append(f"{t:12.6g} {value}")
        return "\n".join(lines)

    _repr_html_ = text_html


def three_cornered_hat(
    recording: Recording, pairs: list[tuple[str, str]] | None = None, seed: int = 0
) -> Clocks:
    """`Clocks`: the Allan deviation of each of three or more independent clocks by name, with 95 % intervals.

    Averaging times with fewer than two degrees of freedom are left out.

    Parameters
    ----------
    recording : Recording
        Three or more columns: the phase (or frequency) of each clock against one common reference, at the same times.
        The noise of the reference cancels. With `pairs`, each column is the difference of two clocks.
    pairs : list of (str, str), optional
        The clocks that each column compares: ``("a", "b")`` means a − b. Every pair of clocks must be present.
    seed : int
        Seed of the random numbers for the intervals.

    Returns
    -------
    Clocks
        A mapping from the name of a clock to its `ClockDeviation`.

    Raises
    ------
    InputError
        There are fewer than three clocks, a pair is missing, the columns are differences of pairs without `pairs`, or
        the record is too short.

    References
    ----------
    Gray, J. E. & Allan, D. W. (1974). 28th Frequency Control Symposium, 243. Groslambert, J. et al. (1981). 35th, 458.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> x = np.cumsum(rng.standard_normal((20000, 3)) * [1e-9, 2e-9, 3e-9], axis=0)
    >>> found = al.three_cornered_hat(al.Recording(x, rate=1.0, quantity="angle", columns=["a", "b", "c"]))
    >>> [bool(one.low[0] < true < one.high[0]) for one, true in zip(found.values(), [1e-9, 2e-9, 3e-9])]
    [True, True, True]
    """
    require_recording(recording)
    names, differences = _differences_of_clocks(recording, pairs)
    curves = [oadev(one) for one in differences.values()]
    freedom = [dict(zip(c.factors.tolist(), c.edf.tolist(), strict=True)) for c in curves]
    rng = np.random.default_rng(seed)
    rows: list[tuple[float, float, Array, Array, Array, NDArray[np.bool_]]] = []
    phases = {pair: _phase_of(one) for pair, one in differences.items()}
    for m in sorted(set.intersection(*map(set, freedom))):
        stop_if_unwanted()
        edf = min(each[m] for each in freedom)
        if not edf >= MIN_EDF:
            continue
        allan = {
            pair: _allan_differences(phase, m, recording.rate) for pair, phase in phases.items()
        }
        allan |= {(b, a): -values for (a, b), values in allan.items() if (b, a) not in allan}
        variance = _variances_of_clocks(names, allan)
        if variance is None:
            continue
        # If one counter measures all clocks, the differences against the first clock contain all information.
        own = np.array([allan[name, names[0]] for name in names[1:]])
        good = ~np.isnan(own).any(axis=0)
        scatter = 0.5 * own[:, good] @ own[:, good].T / np.count_nonzero(good)
        rows.append(
            (m / recording.rate, edf, variance, *_deviation_intervals(scatter, edf, variance, rng))
        )
    if not rows:
        raise InputError(
            "the record is too short for three clocks: no averaging time has two degrees of freedom"
        )
    tau, edf_of_tau, variances, lows, highs, detected = map(np.array, zip(*rows, strict=True))
    with np.errstate(invalid="ignore"):
        deviations = np.sqrt(variances)
    columns = (names, variances.T, deviations.T, lows.T, highs.T, detected.T)
    unit = curves[0].unit
    return Clocks(
        {
            name: ClockDeviation(name, tau, variance, deviation, low, high, seen, edf_of_tau, unit)
            for name, variance, deviation, low, high, seen in zip(*columns, strict=True)
        }
    )


def _differences_of_clocks(
    recording: Recording, pairs: list[tuple[str, str]] | None
) -> tuple[list[str], dict[tuple[str, str], Recording]]:
    """(names of the clocks, dict from a pair of names (a, b) to the `Recording` of clock a minus clock b).

    If `pairs` is None, each column is a clock, and the columns are subtracted. Otherwise the columns are already the
    differences that `pairs` names. Raises `InputError` for fewer than three clocks, for a pair of clocks without a
    column, or if columns of clocks seem to be differences.
    """
    if pairs is None:
        names = list(recording.columns)
        if len(names) < 3:
            raise InputError(f"{len(names)} clocks ({', '.join(names)}): three or more are needed")
        samples = np.asarray(recording.samples, dtype=np.float64)
        _require_no_differences(names, samples)
        first = recording.column(0)
        return names, {
            (names[i], names[j]): first.with_samples(samples[:, i] - samples[:, j])
            for i, j in combinations(range(len(names)), 2)
        }
    if len(pairs) != len(recording.columns):
        raise InputError(
            f"{len(pairs)} pairs for {len(recording.columns)} columns: give one pair for each column"
        )
    names = list(dict.fromkeys(name for pair in pairs for name in pair))
    measured = {(a, b): one for (a, b), one in zip(pairs, recording, strict=True)}
    for a, b in combinations(names, 2):
        if (a, b) not in measured and (b, a) not in measured:
            raise InputError(f"no column compares {a} and {b}: every pair of clocks is needed")
    if len(names) < 3:
        raise InputError(f"{len(names)} clocks: three or more are needed")
    return names, measured


def _require_no_differences(names: list[str], samples: Array) -> None:
    """Raise `InputError` if three columns of `samples`, shape (n, clocks), are differences of clocks: A − B, B − C, C − A.

    With suitable signs, the sum of three such columns is constant. It counts as constant if its increments scatter less
    than `MAX_RELATIVE_SUM` times those of the quietest of the three columns. Nothing is tested with fewer than three
    rows without NaN.
    """
    changes = np.diff(samples[np.isfinite(samples).all(axis=1)], axis=0)
    if len(changes) < 2:
        return
    covariance = np.atleast_2d(np.cov(changes, rowvar=False))
    for columns in map(list, combinations(range(len(names)), 3)):
        three = covariance[np.ix_(columns, columns)]
        for signs in np.array([(1, 1, 1), (1, 1, -1), (1, -1, 1), (-1, 1, 1)]):
            if signs @ three @ signs < MAX_RELATIVE_SUM**2 * np.diag(three).min():
                listed = ", ".join(names[i] for i in columns)
                raise InputError(
                    f"columns {listed}: the columns sum to zero, so they are differences of pairs of clocks; give"
                    " the phase of each clock against the same reference"
                )


def _phase_of(one: Recording) -> Array:
    """Phase in s of a recording of the difference of two clocks, shape (n,); NaN where samples are missing.

    Frequencies are integrated to a phase of shape (n + 1,) that begins at 0; missing frequencies count as 0 in the sum.
    """
    if one.quantity == "angle":
        return np.asarray(one.samples, dtype=np.float64)
    y = np.asarray(one.rate_samples(), dtype=np.float64) / one.rate
    total = np.cumsum(np.where(np.isnan(y), 0.0, y))
    return np.concatenate([[0.0], np.where(np.isnan(y), np.nan, total)])


def _allan_differences(phase: Array, m: int, rate: float) -> Array:
    """Second differences of the phase over m samples, divided by m/`rate`: changes of the mean frequency, shape (n − 2m,).

    Half of their mean square is the overlapping Allan variance at τ = m/`rate`.
    """
    return np.asarray((phase[2 * m :] - 2.0 * phase[m:-m] + phase[: -2 * m]) * (rate / m))


def _variances_of_clocks(names: list[str], allan: dict[tuple[str, str], Array]) -> Array | None:
    """Allan variance of each clock, shape (clocks,), from the Allan differences `allan` of all pairs of clocks.

    It is half the mean product of the differences a − b and a − c (Groslambert covariance), averaged over all b and c.
    None if two differences have no common samples.
    """
    out = []
    for own in names:
        found = []
        for a, b in combinations([n for n in names if n != own], 2):
            product = allan[own, a] * allan[own, b]
            product = product[~np.isnan(product)]
            if product.size == 0:
                return None
            found.append(0.5 * float(product.mean()))
        out.append(float(np.mean(found)))
    return np.array(out)


def _deviation_intervals(
    scatter: Array, edf: float, variance: Array, rng: np.random.Generator
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """(low, high, detected), shape (clocks,): 95 % interval of each Allan deviation; is it detected?

    If a deviation is not detected, `low` is 0 and `high` is its 95 % upper limit. The ends are quantiles of Monte Carlo
    draws of the clock variances v from their posterior distribution. `scatter`, shape (clocks − 1, clocks − 1), is the
    covariance of the Allan differences against the first clock. Its likelihood is a Wishart distribution with `edf`
    degrees of freedom. The prior density is 1/(v + e), where e is the standard error of the estimate at v = 0.
    """
    size = float(np.trace(scatter)) / len(scatter)
    s = scatter / size
    k = len(variance)
    # Standard error at v = 0, from the product of the differences to two other clocks.
    floor = (np.trace(s) / len(s)) / np.sqrt(edf)
    place = np.log(np.maximum(variance / size, 0.3 * floor))
    place = place + 0.3 * rng.standard_normal((CHAINS, k))

    def log_posterior(log_v: Array) -> Array:
        """Log-posterior (nats, up to a constant) of each row of log-variances, shape (chains,)."""
        v = np.exp(log_v)
        inverse = 1.0 / v[:, 1:]
        whole = 1.0 / v[:, 0] + inverse.sum(axis=1)
        # Σ = diag(v₁ …) + v₀: determinant and inverse by Sherman and Morrison.
        determinant = log_v.sum(axis=1) + np.log(whole)
        own = (inverse * s.diagonal()).sum(axis=1)
        cross = np.einsum("ci,ij,cj->c", inverse, s, inverse) / whole
        likelihood = -0.5 * edf * (determinant + own - cross)
        prior = (log_v - np.log(v + floor)).sum(axis=1)
        return np.asarray(likelihood + prior)

    at = log_posterior(place)
    step = 2.4 / np.sqrt(k) * min(1.0, np.sqrt(4.0 / edf))
    kept = []
    for turn in range(WARMUP_STEPS + STEPS):
        # Each step is along the difference of two other chains, so that it matches their spread in every direction.
        a, b = rng.integers(CHAINS, size=(2, CHAINS))
        width = 2.38 / np.sqrt(2.0 * k) if turn % 10 else 1.0
        move = width * (place[a] - place[b]) + 1e-3 * step * rng.standard_normal((CHAINS, k))
        tried = place + move
        new = log_posterior(tried)
        taken = np.log(rng.random(CHAINS)) < new - at
        place = np.where(taken[:, None], tried, place)
        at = np.where(taken, new, at)
        if turn >= WARMUP_STEPS:
            kept.append(place.copy())
    v = np.exp(np.concatenate(kept)) * size
    low, high, limit = np.quantile(v, [0.025, 0.975, 0.95], axis=0)
    # Detected: values below 0.1 times the standard error at 0 have a probability under 2.5 %.
    seen = np.quantile(v, 0.025, axis=0) > 0.1 * floor * size
    return (
        np.sqrt(np.where(seen, low, 0.0)),
        np.sqrt(np.where(seen, high, limit)),
        np.asarray(seen),
    )
