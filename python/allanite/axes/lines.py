"""Lines, resonances and events that several axes have in common."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.documents import fields_dict
from allanite.common.parameters import Estimate
from allanite.effects import Deterministic, Modifier, Stochastic
from allanite.fit.solution import Regressed

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from allanite.fit.result import Fit

#: Two frequencies or times agree if their difference is at most this many standard errors of the difference. For ten pairs
#: of equal frequencies, about 1 % are separated.
MAX_DIFFERENCE = 3.3


@dataclass(frozen=True, slots=True)
class CommonLine:
    """Line or resonance at one frequency on several columns.

    Attributes
    ----------
    frequency, std_error : float
        Weighted mean over the columns and its standard error, Hz.
    columns, kinds : tuple of str
        Columns that have it, and the kind of effect on each.
    p_value : float
        Probability of differences at least this large if the columns have one frequency.
    """

    frequency: float
    std_error: float
    columns: tuple[str, ...]
    kinds: tuple[str, ...]
    p_value: float

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON: frequency_hz, std_error_hz, columns, kinds and p_value."""
        return fields_dict(self, frequency="frequency_hz", std_error="std_error_hz")

    def __str__(self) -> str:
        what = " or ".join(dict.fromkeys(kind.replace("_", " ") for kind in self.kinds))
        return f"{self.frequency:.6g} Hz ({what}): {', '.join(self.columns)}"


@dataclass(frozen=True, slots=True)
class CommonEvent:
    """Change of the bias of several columns at one time.

    Attributes
    ----------
    time, std_error : float
        Weighted mean of the beginning over the columns and its standard error, s from the first sample.
    columns, kinds : tuple of str
        Columns that have it, and the kind of effect on each.
    """

    time: float
    std_error: float
    columns: tuple[str, ...]
    kinds: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON: time_s, std_error_s, columns (names) and kinds (of effect, one per column)."""
        return fields_dict(self, time="time_s", std_error="std_error_s")

    def __str__(self) -> str:
        what = " or ".join(dict.fromkeys(kind.replace("_", " ") for kind in self.kinds))
        return f"{self.time:.6g} s ({what}): {', '.join(self.columns)}"


@dataclass(frozen=True, slots=True)
class _Occurrence:
    """Frequency of a line in Hz, or time of an event in s, that one column shows, with its standard error."""

    value: float
    error: float
    column: str
    kind: str


def common_lines(fits: Mapping[str, Fit]) -> tuple[CommonLine, ...]:
    """`CommonLine`, lowest frequency first: frequencies that agree within their errors on several columns.

    They are frequencies of lines and of bands of noise, and the rates at which bands or noise levels repeat.
    """
    return tuple(CommonLine(*_merged(group)) for group in _agreeing_groups(fits, _frequencies))


def common_events(fits: Mapping[str, Fit]) -> tuple[CommonEvent, ...]:
    """Tuple of `CommonEvent`: times at which the bias of several columns changed, earliest first; often empty."""
    groups = _agreeing_groups(fits, _event_times)
    return tuple(
        CommonEvent(time, error, columns, kinds)
        for time, error, columns, kinds, _ in map(_merged, groups)
    )


def _agreeing_groups(
    fits: Mapping[str, Fit], occurrences_of: Callable[[str, Fit], list[_Occurrence]]
) -> list[list[_Occurrence]]:
    """Groups of frequencies (Hz) or times (s) on several columns that agree within their errors, lowest value first.

    Groups in which only one column occurs are omitted.
    """
    seen = sorted(
        (s for pair in fits.items() for s in occurrences_of(*pair)), key=lambda s: s.value
    )
    groups: list[list[_Occurrence]] = []
    for one in seen:
        if groups and _belongs_to(groups[-1], one):
            groups[-1].append(one)
        else:
            groups.append([one])
    return [group for group in groups if len({s.column for s in group}) > 1]


def _frequencies(column: str, fit: Fit) -> list[_Occurrence]:
    """Frequencies of the lines, notches and bands of a fit.

    A band that moves has its mean frequency, and a line that drifts its frequency at the first sample. Rates at which
    bands or noise levels repeat follow, unless a frequency in the list agrees with them. Frequencies without a standard
    error are omitted.
    """
    out: list[_Occurrence] = []
    repeating: list[_Occurrence] = []
    for effect, values in zip(fit.model, fit.estimates, strict=True):
        if isinstance(effect, Stochastic) and effect.segments:
            bands = np.array([p.occupies for p in effect.segments])
            # A moving band is located within half its width in each section.
            error = 0.5 * float(np.ptp(bands, axis=1).mean()) / np.sqrt(len(bands))
            out.append(_Occurrence(float(np.mean(effect.middles)), error, column, effect.kind))
        companions = effect.companions if isinstance(effect, Stochastic) else ()
        for name in ("frequency", *companions):
            found = values.get(name)
            if isinstance(found, Estimate) and found.std_error and found.unit == "Hz":
                seen = _Occurrence(float(found), float(found.std_error), column, effect.kind)
                (repeating if name in companions else out).append(seen)
        period = effect.values.get("period")
        if period is not None and isinstance(effect, Modifier):
            # The period is known to half a period over the record.
            repeating.append(
                _Occurrence(1.0 / period, 0.5 / fit.data.duration, column, effect.kind)
            )
    # Several harmonics have one repetition rate.
    for one in sorted(repeating, key=lambda s: s.error):
        if not any(_agree(other, one) for other in out):
            out.append(one)
    return out


def _event_times(column: str, fit: Fit) -> list[_Occurrence]:
    """Time (s) at which each step, excursion or other single event of a fit begins, if it has a standard error."""
    out = []
    for effect, values in zip(fit.model, fit.estimates, strict=True):
        if not isinstance(effect, Deterministic) or not effect.happens_once:
            continue
        if effect.returns:
            out += _excursion_times(column, fit, effect)
            continue
        first = next((p.name for p in effect.parameters if p.role == "shape"), "")
        found = values.get(first)
        if isinstance(found, Estimate) and found.std_error and found.unit == "s":
            out.append(_Occurrence(float(found), float(found.std_error), column, effect.kind))
    return out


def _excursion_times(column: str, fit: Fit, effect: Deterministic) -> list[_Occurrence]:
    """Start time in s of each excursion (temporary change of the bias) that the effect describes, if it has an error.

    Empty if the amplitudes of the effect are not part of the fit.
    """
    own = next(own for own in fit.solution.effects if own.effect == effect)
    out = []
    if isinstance(own, Regressed):
        for one, variance in zip(effect.singly, np.diag(own.covariance), strict=True):
            first = one.free_shapes[0]
            error = one.shape_error(first, float(variance), fit.data.duration)
            if error:
                out.append(_Occurrence(float(one.values[first]), error, column, one.kind))
    return out


def _weighted_mean(group: list[_Occurrence]) -> tuple[float, float]:
    """Tuple (mean of the frequencies (Hz) or times (s) of a group, weighted by 1/error²; standard error of this mean)."""
    weights = np.array([s.error**-2 for s in group])
    mean = float(weights @ [s.value for s in group] / weights.sum())
    return mean, float(weights.sum() ** -0.5)


def _belongs_to(group: list[_Occurrence], line: _Occurrence) -> bool:
    """True if `line` agrees, within the errors, with the weighted mean of the `group`.

    False if the group already has an entry of the column of `line`.
    """
    if line.column in {s.column for s in group}:
        return False
    mean, error = _weighted_mean(group)
    return _agree(_Occurrence(mean, error, line.column, line.kind), line)


def _agree(one: _Occurrence, other: _Occurrence) -> bool:
    """True if two frequencies or times differ by at most 3.3 standard errors of their difference."""
    return abs(one.value - other.value) <= MAX_DIFFERENCE * float(np.hypot(one.error, other.error))


def _merged(
    group: list[_Occurrence],
) -> tuple[float, float, tuple[str, ...], tuple[str, ...], float]:
    """(mean, standard error, columns, kinds, p-value) of a group of frequencies or times.

    The mean has weights 1/error². The p-value is that of a χ² test that all entries are equal.
    """
    from scipy.special import chdtrc

    mean, error = _weighted_mean(group)
    chi2 = float(sum(((s.value - mean) / s.error) ** 2 for s in group))
    columns, kinds = tuple(s.column for s in group), tuple(s.kind for s in group)
    return mean, error, columns, kinds, float(chdtrc(len(group) - 1, chi2))
