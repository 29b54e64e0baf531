"""Lines and resonances that several axes see, named once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.parameters import Estimate

if TYPE_CHECKING:
    from collections.abc import Mapping

    from allanite.fit.result import Fit

__all__ = ["CommonLine", "common_lines"]

#: Standard errors within which two frequencies are one: 1 % for the difference of two, over some ten pairs.
ONE = 3.3


@dataclass(frozen=True, slots=True)
class CommonLine:
    """A line or resonance at one frequency on several columns.

    Attributes
    ----------
    frequency, std_error : float
        Weighted mean of what the columns say, Hz.
    columns, kinds : tuple of str
        Who sees it, and as what.
    p_value : float
        Of frequencies as different as these if they are one.
    """

    frequency: float
    std_error: float
    columns: tuple[str, ...]
    kinds: tuple[str, ...]
    p_value: float

    def to_dict(self) -> dict[str, Any]:
        """JSON form."""
        return {
            "frequency_hz": self.frequency,
            "std_error_hz": self.std_error,
            "columns": list(self.columns),
            "kinds": list(self.kinds),
            "p_value": self.p_value,
        }

    def __str__(self) -> str:
        what = " or ".join(dict.fromkeys(kind.replace("_", " ") for kind in self.kinds))
        return f"{self.frequency:.6g} Hz ({what}): {', '.join(self.columns)}"


@dataclass(frozen=True, slots=True)
class _Seen:
    frequency: float
    error: float
    column: str
    kind: str


def common_lines(fits: Mapping[str, Fit]) -> tuple[CommonLine, ...]:
    """Frequencies that several columns have within their errors, lowest first."""
    seen = sorted(
        (s for column, fit in fits.items() for s in _frequencies(column, fit)),
        key=lambda s: s.frequency,
    )
    groups: list[list[_Seen]] = []
    for line in seen:
        if groups and _same(groups[-1], line):
            groups[-1].append(line)
        else:
            groups.append([line])
    return tuple(_common(group) for group in groups if len({s.column for s in group}) > 1)


def _frequencies(column: str, fit: Fit) -> list[_Seen]:
    out = []
    for effect, values in zip(fit.model, fit.estimates, strict=True):
        found = values.get("frequency")
        if isinstance(found, Estimate) and found.std_error and found.unit == "Hz":
            out.append(_Seen(float(found), float(found.std_error), column, effect.kind))
    return out


def _mean(group: list[_Seen]) -> tuple[float, float]:
    weights = np.array([s.error**-2 for s in group])
    mean = float(weights @ [s.frequency for s in group] / weights.sum())
    return mean, float(weights.sum() ** -0.5)


def _same(group: list[_Seen], line: _Seen) -> bool:
    if line.column in {s.column for s in group}:
        return False
    mean, error = _mean(group)
    return abs(line.frequency - mean) <= ONE * float(np.hypot(error, line.error))


def _common(group: list[_Seen]) -> CommonLine:
    from scipy.special import chdtrc

    mean, error = _mean(group)
    chi2 = float(sum(((s.frequency - mean) / s.error) ** 2 for s in group))
    return CommonLine(
        mean,
        error,
        tuple(s.column for s in group),
        tuple(s.kind for s in group),
        float(chdtrc(len(group) - 1, chi2)),
    )
