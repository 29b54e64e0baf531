"""Where a model fails, on every view, in numbers and in words."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from allanite.common.numbers import tidy
from allanite.common.showing import brief
from allanite.criticism import over_frequency, over_tau
from allanite.criticism.over_time import Whitened, time_map

if TYPE_CHECKING:
    from allanite.fit.result import Fit

__all__ = ["Where", "criticise"]

Range = tuple[float, float] | None


@dataclass(frozen=True, slots=True)
class Where:
    """Residuals of a fit over τ, frequency and time, and the worst interval of each (None: nowhere beyond chance).

    Attributes
    ----------
    tau, frequency, time : list of dict
        Records as in the contract's JSON.
    worst_tau, worst_frequency, worst_time : (low, high) or None
        s, Hz, s.
    """

    tau: list[dict[str, Any]]
    frequency: list[dict[str, Any]]
    time: list[dict[str, Any]]
    worst_tau: Range
    worst_frequency: Range
    worst_time: Range

    __repr__ = brief

    def worst(self) -> dict[str, list[float] | None]:
        """The contract's ``where.worst``."""
        found = {"tau": self.worst_tau, "frequency": self.worst_frequency, "time": self.worst_time}
        return {k: None if v is None else list(v) for k, v in found.items()}

    def to_dict(self) -> dict[str, Any]:
        """The contract's ``where``."""
        return {
            "tau": self.tau,
            "frequency": self.frequency,
            "time": self.time,
            "worst": self.worst(),
        }

    def sentences(self) -> list[str]:
        """One sentence for each view on which the model fails."""
        out = []
        if self.worst_tau is not None:
            low, high = self.worst_tau
            inside = [r for r in self.tau if low <= r["tau_s"] <= high]
            peak = max(inside, key=lambda r: abs(r["z"]))
            out.append(
                f"over τ: at {low:.3g}–{high:.3g} s the deviation is up to {100 * (peak['ratio'] - 1):+.1f} % "
                f"off the model (z = {peak['z']:+.1f} at {peak['tau_s']:.3g} s)"
            )
        if self.worst_frequency is not None:
            low, high = self.worst_frequency
            inside = [r for r in self.frequency if low <= r["low_hz"] and r["high_hz"] <= high]
            peak = max(inside, key=lambda r: abs(r["z"]))
            out.append(
                f"over frequency: at {low:.3g}–{high:.3g} Hz the power is {peak['ratio']:.2f} × the model "
                f"(z = {peak['z']:+.1f} at {peak['low_hz']:.3g}–{peak['high_hz']:.3g} Hz)"
            )
        if self.worst_time is not None:
            low, high = self.worst_time
            inside = [
                r for r in self.time if low <= r["start_s"] and r["end_s"] <= high
            ] or self.time
            peak = max(inside, key=lambda r: abs(r["z"]))
            out.append(
                f"over time: {low:.5g}–{high:.5g} s, {peak['low_hz']:.3g}–{peak['high_hz']:.3g} Hz: "
                f"{peak['ratio']:.2f} × the expected power (z = {peak['z']:+.1f})"
            )
        return [tidy(sentence) for sentence in out]


def criticise(fit: Fit, whitened: Whitened) -> Where:
    """All views of one fit."""
    times = time_map(fit.solution, fit.data, whitened)
    return Where(
        over_tau.rows(fit.curve),
        over_frequency.rows(fit),
        times.rows(),
        over_tau.worst(fit.curve),
        over_frequency.worst(fit),
        times.worst(),
    )
