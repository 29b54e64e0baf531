"""Lines, resonances and events that several axes see, named once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.parameters import Estimate
from allanite.effects import Away, Deterministic, Modifier, Moving, Stochastic
from allanite.fit.solution import Regressed

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from allanite.fit.result import Fit

__all__ = ["CommonEvent", "CommonLine", "common_events", "common_lines"]

#: Standard errors within which two frequencies or times are one: 1 % for the difference of two, over some ten pairs.
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
class CommonEvent:
    """What happened to the bias of several columns at one time.

    Attributes
    ----------
    time, std_error : float
        When it began: weighted mean of what the columns say, from the first sample, s.
    columns, kinds : tuple of str
        Who sees it, and as what.
    """

    time: float
    std_error: float
    columns: tuple[str, ...]
    kinds: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """JSON form."""
        return {
            "time_s": self.time,
            "std_error_s": self.std_error,
            "columns": list(self.columns),
            "kinds": list(self.kinds),
        }

    def __str__(self) -> str:
        what = " or ".join(dict.fromkeys(kind.replace("_", " ") for kind in self.kinds))
        return f"{self.time:.6g} s ({what}): {', '.join(self.columns)}"


@dataclass(frozen=True, slots=True)
class _Seen:
    """A frequency, Hz, or a time, s, of one column."""

    at: float
    error: float
    column: str
    kind: str


def common_lines(fits: Mapping[str, Fit]) -> tuple[CommonLine, ...]:
    """Frequencies that several columns have within their errors, of what comes and goes too, lowest first."""
    return tuple(_common(group) for group in _groups(fits, _frequencies))


def common_events(fits: Mapping[str, Fit]) -> tuple[CommonEvent, ...]:
    """Times at which the bias of several columns did something, within their errors, first to last."""
    return tuple(
        CommonEvent(*_mean(group), tuple(s.column for s in group), tuple(s.kind for s in group))
        for group in _groups(fits, _times)
    )


def _groups(
    fits: Mapping[str, Fit], seen_by: Callable[[str, Fit], list[_Seen]]
) -> list[list[_Seen]]:
    """What several columns see, each at one place."""
    seen = sorted((s for pair in fits.items() for s in seen_by(*pair)), key=lambda s: s.at)
    groups: list[list[_Seen]] = []
    for one in seen:
        if groups and _same(groups[-1], one):
            groups[-1].append(one)
        else:
            groups.append([one])
    return [group for group in groups if len({s.column for s in group}) > 1]


def _frequencies(column: str, fit: Fit) -> list[_Seen]:
    """Of lines and bands (the mean of one that moves); of what comes and goes the rate, one over the period of a level."""
    out: list[_Seen] = []
    coming: list[_Seen] = []
    for effect, values in zip(fit.model, fit.estimates, strict=True):
        if isinstance(effect, Moving) and effect.stretches:
            bands = np.array([p.occupies for p in effect.stretches])
            # In each part a band is placed within half its width.
            error = 0.5 * float(np.ptp(bands, axis=1).mean()) / np.sqrt(len(bands))
            out.append(_Seen(float(np.mean(effect.middles)), error, column, effect.kind))
        companions = effect.companions if isinstance(effect, Stochastic) else ()
        for name in ("frequency", *companions):
            found = values.get(name)
            if isinstance(found, Estimate) and found.std_error and found.unit == "Hz":
                seen = _Seen(float(found), float(found.std_error), column, effect.kind)
                (coming if name in companions else out).append(seen)
        period = effect.values.get("period")
        if period is not None and isinstance(effect, Modifier):
            # The last stretch is where it is to half of one.
            coming.append(_Seen(1.0 / period, 0.5 / fit.data.duration, column, effect.kind))
    # Several harmonics come and go together.
    for one in sorted(coming, key=lambda s: s.error):
        if not any(_near(other, one) for other in out):
            out.append(one)
    return out


def _times(column: str, fit: Fit) -> list[_Seen]:
    out = []
    for effect, values in zip(fit.model, fit.estimates, strict=True):
        if not isinstance(effect, Deterministic) or not effect.happens_once:
            continue
        if isinstance(effect, Away):
            out += _visits(column, fit, effect)
            continue
        first = next((p.name for p in effect.parameters if p.role == "shape"), "")
        found = values.get(first)
        if isinstance(found, Estimate) and found.std_error and found.unit == "s":
            out.append(_Seen(float(found), float(found.std_error), column, effect.kind))
    return out


def _visits(column: str, fit: Fit, effect: Away) -> list[_Seen]:
    own = next(own for own in fit.solution.effects if own.effect == effect)
    out = []
    if isinstance(own, Regressed):
        for one, variance in zip(effect.singly, np.diag(own.covariance), strict=True):
            first = one.free_shapes[0]
            error = one.shape_error(first, float(variance), fit.data.duration)
            if error:
                out.append(_Seen(float(one.values[first]), error, column, one.kind))
    return out


def _mean(group: list[_Seen]) -> tuple[float, float]:
    weights = np.array([s.error**-2 for s in group])
    mean = float(weights @ [s.at for s in group] / weights.sum())
    return mean, float(weights.sum() ** -0.5)


def _same(group: list[_Seen], line: _Seen) -> bool:
    if line.column in {s.column for s in group}:
        return False
    mean, error = _mean(group)
    return _near(_Seen(mean, error, line.column, line.kind), line)


def _near(one: _Seen, other: _Seen) -> bool:
    return abs(one.at - other.at) <= ONE * float(np.hypot(one.error, other.error))


def _common(group: list[_Seen]) -> CommonLine:
    from scipy.special import chdtrc

    mean, error = _mean(group)
    chi2 = float(sum(((s.at - mean) / s.error) ** 2 for s in group))
    return CommonLine(
        mean,
        error,
        tuple(s.column for s in group),
        tuple(s.kind for s in group),
        float(chdtrc(len(group) - 1, chi2)),
    )
