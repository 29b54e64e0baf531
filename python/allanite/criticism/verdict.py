"""Residuals of a fit over averaging time, frequency and time, and sentences about where it fails."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.arrays import run_at
from allanite.common.documents import rows_of
from allanite.common.former import Former
from allanite.common.numbers import time_scale, with_readable_numbers
from allanite.common.showing import brief
from allanite.criticism.over_time import time_map
from allanite.fit.curve import MIN_EDF, MIN_FAILING_SCORE

if TYPE_CHECKING:
    from allanite.fit.curve import Curve
    from allanite.fit.likelihood.whitened import Whitened
    from allanite.fit.result import Fit

Range = tuple[float, float] | None

#: Minimum |Σz|/√k of an interval of k bins that counts as a failure, standard deviations. About 0.2 % of true models have
#: an interval above this limit, among all intervals of some 500 independent scores.
MIN_INTERVAL_SCORE = 5.2


@dataclass(frozen=True, slots=True)
class Where:
    """Residuals of a fit over τ, frequency and time, and the worst interval of each.

    `tau`, `frequency` and `time` have one record for each averaging time, bin or cell, as in the JSON form. The worst
    intervals are in s, Hz and s; None if the fit fails nowhere. `largest` is (model over measured deviation, τ in s), the
    ratio furthest from 1 among τ with at least 10 degrees of freedom. `few` are the other τ, s, which the Allan error of a
    fit omits.
    """

    tau: list[dict[str, Any]]
    frequency: list[dict[str, Any]]
    time: list[dict[str, Any]]
    worst_tau: Range
    worst_frequency: Range
    worst_time: Range
    largest: tuple[float, float] | None = None
    few: tuple[float, ...] = ()

    __repr__ = brief

    def worst(self) -> dict[str, list[float] | None]:
        """Dict with keys ``tau``, ``frequency``, ``time``: the worst interval [low, high] in s, Hz, s, or None."""
        found = {"tau": self.worst_tau, "frequency": self.worst_frequency, "time": self.worst_time}
        return {k: None if v is None else list(v) for k, v in found.items()}

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON: residuals over ``tau``, ``frequency`` and ``time``, and ``worst``, the worst interval of each."""
        views = {"tau": self.tau, "frequency": self.frequency, "time": self.time}
        return {**views, "worst": self.worst()}

    @property
    def fails(self) -> bool:
        """True if the fit fails in at least one view: Allan deviation (τ), spectrum (frequency) or power over time."""
        return any(self.worst().values())

    def sentences(self) -> list[str]:
        """List of one sentence per failure: over τ (up to two), frequency and time; empty if nothing fails."""
        return [sentence for _, _, sentence in self.failures()]

    places = Former("failures")

    def failures(self) -> list[tuple[str, tuple[float, float], str]]:
        """List of (view, interval, sentence), one for each failure of the fit; empty if nothing fails.

        The view is ``"tau"`` (Allan deviation), ``"frequency"`` (spectrum) or ``"time"`` (power over time). The interval is
        (low, high) in s, Hz or s. ``"tau"`` has a second entry if the largest error of the Allan deviation lies outside of
        the worst interval.
        """
        out = []
        if self.worst_tau is not None:
            low, high = self.worst_tau
            inside = [r for r in self.tau if low <= r["tau_s"] <= high]
            peak = max(inside, key=lambda r: abs(r["z"]))
            # The fit's summary names the worst τ with enough degrees of freedom, which may be another one.
            left_out = f"; fewer than {MIN_EDF:g} degrees of freedom, so not in the Allan error"
            words = (
                f"over τ: {_ratio_text(1.0 / peak['ratio'])} at {peak['tau_s']:.3g} s"
                f"{_range_text(low, high, 's')} ({_score_text(peak['z'])}"
                f"{left_out if peak['tau_s'] in self.few else ''})"
            )
            out.append(("tau", self.worst_tau, words))
            if self.largest is not None and not low <= self.largest[1] <= high:
                factor, tau = self.largest
                words = (
                    f"over τ: {_ratio_text(factor)} at {tau:.3g} s, the most where there are"
                    f" {MIN_EDF:g} degrees of freedom or more"
                )
                out.append(("tau", (tau, tau), words))
        if self.worst_frequency is not None:
            low, high = self.worst_frequency
            inside = [r for r in self.frequency if low <= r["low_hz"] and r["high_hz"] <= high]
            peak = max(inside, key=lambda r: abs(r["z"]))
            span = f"{low:.3g}–{high:.3g} Hz"
            at = f"{peak['low_hz']:.3g}–{peak['high_hz']:.3g} Hz"
            # A single ordinate can have nearly no power by chance: the mean over the span is a reliable ratio.
            widths = [r["high_hz"] - r["low_hz"] for r in inside]
            ratio = float(np.average([r["ratio"] for r in inside], weights=widths))
            words = (
                f"over frequency: at {span} the power is {ratio:.3g} × the model's "
                f"({_score_text(peak['z'])}{'' if at == span else f' at {at}'})"
            )
            out.append(("frequency", self.worst_frequency, words))
        if self.worst_time is not None:
            low, high = self.worst_time
            inside = [
                r for r in self.time if low <= r["start_s"] and r["end_s"] <= high
            ] or self.time
            # Ratio and score of a cell may differ in sign with heavy tails: quote a cell in which they agree.
            inside = [r for r in inside if (r["ratio"] > 1.0) == (r["z"] > 0.0)] or inside
            peak = max(inside, key=lambda r: abs(r["z"]))
            # The unit of the map of time and frequency.
            size, unit = time_scale(self.time[-1]["end_s"])
            words = (
                f"over time: at {low / size:.3g}–{high / size:.3g} {unit},"
                f" {peak['low_hz']:.3g}–{peak['high_hz']:.3g} Hz the power is"
                f" {peak['ratio']:.3g} × that of the rest of the record ({_score_text(peak['z'])})"
            )
            out.append(("time", self.worst_time, words))
        return [(view, place, with_readable_numbers(words)) for view, place, words in out]


def _score_text(z: float) -> str:
    """Text of a standard normal score with its sign: ``z = +3.9``; from 100 on without decimals, ``z = -200``."""
    return f"z = {z:+.{0 if abs(z) >= 99.95 else 1}f}"


def _ratio_text(factor: float) -> str:
    """Text such as ``the model is ×1.2 too high``; `factor` is model over measured deviation."""
    if factor > 1.0:
        return f"the model is ×{factor:.3g} too high"
    return f"the model is ×{1.0 / factor:.3g} too low"


def _range_text(low: float, high: float, unit: str) -> str:
    """Clause on a misfit: ``, and differs beyond its expected scatter at 2–9 s``; empty if `low` equals `high`."""
    return (
        ""
        if low == high
        else f", and differs beyond its expected scatter at {low:.3g}–{high:.3g} {unit}"
    )


def _rows_over_tau(curve: Curve) -> list[dict[str, Any]]:
    """List of dicts, one per averaging time: measured and model deviation, their ratio, standard normal score z."""
    ratio = curve.measured / curve.model
    return rows_of(
        tau_s=curve.tau, measured=curve.measured, model=curve.model, ratio=ratio, z=curve.z
    )


def _worst_over_tau(curve: Curve) -> Range:
    """Pair (shortest, longest) of the averaging times, s, around the worst misfit of the Allan deviation.

    The pair spans the largest |z| and its neighbors in which z has the same sign and exceeds 2 in magnitude. None if no
    |z| reaches `MIN_FAILING_SCORE`.
    """
    z = np.where(np.isfinite(curve.z), curve.z, 0.0)
    top = int(np.argmax(np.abs(z)))
    if abs(z[top]) < MIN_FAILING_SCORE:
        return None
    low, high = run_at(z * np.sign(z[top]) > 2.0, top)
    return float(curve.tau[low]), float(curve.tau[high])


def _rows_over_frequency(fit: Fit) -> list[dict[str, Any]]:
    """List of dicts, one per frequency bin: limits in Hz, ratio of measured to expected power, standard normal score z."""
    low, high = fit.data.bins.limits(fit.data.rate)
    ratio = fit.solution.power / fit.solution.spectrum
    return rows_of(low_hz=low, high_hz=high, ratio=ratio, z=fit.z)


def _worst_over_frequency(fit: Fit) -> Range:
    """Pair (lowest, highest frequency), Hz, of the interval in which the fit fails most; None if it fails nowhere.

    Among all intervals of k neighboring bins, this one has the largest |Σz|/√k, where z is the score of a bin.
    """
    z = fit.z
    total = np.concatenate([[0.0], np.cumsum(z)])
    first, last = np.triu_indices(z.size + 1, 1)
    size = np.abs(total[last] - total[first]) / np.sqrt(last - first)
    top = int(np.argmax(size))
    if size[top] < MIN_INTERVAL_SCORE:
        return None
    low, high = fit.data.bins.limits(fit.data.rate)
    return float(low[first[top]]), float(high[last[top] - 1])


def criticize(fit: Fit, whitened: Whitened) -> Where:
    """`Where`: residuals of the Allan deviation, the spectrum and the power over time, each with its worst interval."""
    times = time_map(fit.data, whitened)
    return Where(
        tau=_rows_over_tau(fit.curve),
        frequency=_rows_over_frequency(fit),
        time=times.rows(),
        worst_tau=_worst_over_tau(fit.curve),
        worst_frequency=_worst_over_frequency(fit),
        worst_time=times.worst(),
        largest=fit.curve.worst,
        few=tuple(fit.curve.tau[~fit.curve.is_counted].tolist()),
    )
