"""Acceptance test of a part: every figure of its data sheet against the measured 95 % interval."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite import _kernels
from allanite.common.errors import InputError
from allanite.common.showing import brief
from allanite.common.units import parse_unit
from allanite.comparison.curves import Curves, Drawn, compare
from allanite.comparison.datasheet import minimum_of, with_figures
from allanite.effects import as_model, find
from allanite.planning.duration import duration_text
from allanite.sources.datasheet import MINIMUM, known_figures

if TYPE_CHECKING:
    from collections.abc import Callable

    from allanite.recording import Recording
    from allanite.sources.datasheet import DataSheet, Quoted
    from allanite.study import Study

__all__ = ["Acceptance", "FigureVerdict", "accept", "accept_study", "limit_line"]

MEETS, DOES_NOT_MEET, UNDECIDED = "meets", "does not meet", "undecided"
#: Degrees of freedom of a point of the Allan curve that decides about a minimum: its 95 % interval then reaches to
#: 1.23 times the deviation (chi-squared with 40 degrees of freedom).
EDF_OF_MINIMUM = 40.0
#: Longest record that is recommended, s: thirty days.
LONGEST = 30 * 86400.0


@dataclass(frozen=True, slots=True)
class FigureVerdict:
    """One figure of a data sheet and what the record says of it, in the unit of the sheet.

    Attributes
    ----------
    figure : Quoted
        As printed in the sheet.
    limit : float
        The printed value, with the margin.
    measured : float or None
        Estimate; None where nothing was detected.
    low, high : float
        Ends of the 95 % interval; `low` is 0 where the effect was not detected.
    verdict : {"meets", "does not meet", "undecided"}
        *meets*: `high` is at most the limit. *does not meet*: `low` is above the limit.
    needs : float or None
        Length of a record in s that would probably decide; None where it is decided, or no record of 30 days decides.
    remark : str
        Why the verdict is what it is, where the numbers alone do not show it.
    """

    figure: Quoted
    limit: float
    measured: float | None
    low: float
    high: float
    verdict: str
    needs: float | None
    remark: str = ""

    @property
    def unit(self) -> str:
        """Unit of limit and measurement, as printed in the sheet."""
        return self.figure.unit

    def to_dict(self) -> dict[str, Any]:
        """JSON form."""
        return {
            "name": self.figure.name,
            "printed": self.figure.value,
            "unit": self.unit,
            "limit": self.limit,
            "measured": self.measured,
            "interval": [self.low, self.high if math.isfinite(self.high) else None],
            "verdict": self.verdict,
            "needs_s": self.needs,
            "remark": self.remark or None,
        }


@dataclass(frozen=True, slots=True, eq=False)
class Acceptance:
    r"""The acceptance test of one axis.

    Attributes
    ----------
    sheet : DataSheet
    margin : float
        Allowance above the printed figures, as a fraction.
    figures : tuple of FigureVerdict
    study : Study
        The models that were fitted; the last one gives the numbers.
    remarks : tuple of str

    Examples
    --------
    >>> with open("part.toml", "w", encoding="utf-8") as file:
    ...     _ = file.write("[figures]\nangle_random_walk = '0.3 deg/sqrt(h)'\n")
    >>> log = al.AngleRandomWalk(N=0.004).simulate(duration=600, rate=50, seed=1, unit="deg/s")
    >>> found = al.accept(log, al.read_datasheet("part.toml"))
    >>> found.verdict, found.figures[0].verdict, found.needs, found.to_dict()["schema"]
    ('meets', 'meets', None, 'allanite/accept/1')
    >>> figure = found.plot("part.svg")
    >>> found.recording.n
    30000
    """

    sheet: DataSheet
    margin: float
    figures: tuple[FigureVerdict, ...]
    study: Study
    remarks: tuple[str, ...]

    __repr__ = brief

    @property
    def recording(self) -> Recording:
        """The record that was tested."""
        return self.study.recording

    @property
    def verdict(self) -> str:
        """*does not meet* if any figure does not; *meets* if all do; *undecided* otherwise."""
        found = {figure.verdict for figure in self.figures}
        return next(v for v in (DOES_NOT_MEET, UNDECIDED, MEETS) if v in found)

    @property
    def needs(self) -> float | None:
        """Length of a record in s that would probably decide every undecided figure; None where there is none."""
        return max((f.needs for f in self.figures if f.needs is not None), default=None)

    def to_dict(self) -> dict[str, Any]:
        """``allanite/accept/1``."""
        return {
            "schema": "allanite/accept/1",
            "version": _kernels.version(),
            "recording": self.recording.describe(),
            "sheet": self.sheet.name,
            "margin_percent": 100.0 * self.margin,
            "model": self.study.fit.model.name,
            "verdict": self.verdict,
            "figures": [figure.to_dict() for figure in self.figures],
            "remarks": list(self.remarks),
        }

    def __str__(self) -> str:
        cells = [("figure", "limit", "measured", "95 % interval", "verdict")]
        cells += [
            (
                f.figure.name,
                f"{f.limit:.4g} {f.unit}",
                "not detected" if f.measured is None else f"{f.measured:.4g}",
                f"{f.low:.4g} … {f.high:.4g}" if f.low > 0.0 else f"below {f.high:.4g}",
                f.verdict + (f" (record {duration_text(f.needs)})" if f.needs is not None else ""),
            )
            for f in self.figures
        ]
        widths = [max(len(row[i]) for row in cells) for i in range(5)]
        margin = f", margin {100 * self.margin:g} %" if self.margin else ""
        lines = [f"{self.recording.columns[0]}: {self.verdict} {self.sheet.name}{margin}"]
        lines += ["  " + "  ".join(map(str.ljust, row, widths)).rstrip() for row in cells]
        lines += [f"! {f.figure.name}: {f.remark}" for f in self.figures if f.remark]
        return "\n".join([*lines, *(f"! {remark}" for remark in self.remarks)])

    def plot(self, path: Any = None) -> Any:
        """Measured Allan deviation, the last model, and the limits of the sheet; written to `path` if given."""
        from allanite.plots import plot_compare

        recording = self.recording
        name = recording.columns[0]
        curves = compare([(name, recording, None), ("model", self.study.fit.model, recording.unit)])
        tau = curves.curves[0].tau
        limits = [
            Drawn(f"limit: {f.figure.name}", "model", recording.unit, *line)
            for f in self.figures
            if (line := limit_line(f.figure, recording.unit, tau, f.limit / f.figure.value))
        ]
        return plot_compare(Curves((*curves.curves, *limits)), path, title=f"{self.sheet.name}")


def limit_line(figure: Quoted, unit: str, tau: Any, margin: float = 1.0) -> tuple[Any, Any] | None:
    """Averaging times and Allan deviation of an effect as large as a figure of a data sheet, times a margin."""
    limit = figure.in_unit(unit) * margin
    if figure.coefficient == MINIMUM:
        return tau, np.full(tau.shape, limit)
    effect = find(figure.coefficient)
    if effect is None:
        return None
    values: dict[str, Any] = {figure.coefficient: limit}
    one = effect(**values)
    return tau, np.sqrt(as_model(one).allan_variance(tau, rate=1.0 / float(tau[0])))


def accept(
    recording: Recording,
    sheet: DataSheet,
    margin: float = 0.0,
    on_progress: Callable[[int, int], None] | None = None,
) -> Acceptance:
    """Compare every figure of a data sheet with the measured 95 % interval.

    The model N+B+K, with the coefficients that the sheet names, is fitted. If it is not adequate, missing effects are
    added first (`improve`), so that a vibration or a temperature does not count as noise of the part.

    Parameters
    ----------
    recording : Recording
        One column.
    sheet : DataSheet
        Figures of the recording's kind of sensor; others are ignored.
    margin : float
        Allowance above the printed figures, as a fraction: 0.1 allows 10 %.
    on_progress : callable, optional
        Called with steps done and steps in all.

    Returns
    -------
    Acceptance

    Raises
    ------
    InputError
        A sheet without figures for this kind of sensor, or a margin below 0.

    Examples
    --------
    >>> sheet = al.DataSheet("part", (al.Quoted("noise_density", 0.01, "deg/s/sqrt(Hz) one-sided"),))
    >>> log = al.AngleRandomWalk(N=0.014).simulate(duration=600, rate=50, seed=1, unit="deg/s")
    >>> al.accept(log, sheet).verdict
    'does not meet'
    """
    from allanite.study import improve

    if not 0.0 <= margin < math.inf:
        raise InputError(f"the margin must be 0 or more, found {margin:g}")
    own = sheet.of_kind(parse_unit(recording.unit).kind)
    if not own.figures:
        raise InputError(
            f"{sheet.name}: no figure for {parse_unit(recording.unit).kind} (column {recording.columns[0]})"
        )
    study = improve(recording, with_figures(as_model("N+B+K"), own), on_progress=on_progress)
    return accept_study(study, own, margin)


def accept_study(study: Study, own: DataSheet, margin: float = 0.0) -> Acceptance:
    """The acceptance test of the last model of a study by a sheet of its kind of sensor."""
    fit = study.fit
    tested = []
    for figure in own.figures:
        if figure.coefficient == MINIMUM:
            tested.append(_minimum(figure, fit, margin))
        else:
            tested.append(_coefficient(figure, fit, margin))
    remarks = list(own.remarks())
    if not fit.adequate:
        remarks.append(
            f"{fit.model.name} does not describe this record completely; its intervals include that misfit"
        )
    return Acceptance(own, margin, tuple(tested), study, tuple(remarks))


def _coefficient(figure: Quoted, fit: Any, margin: float) -> FigureVerdict:
    unit = fit.recording.unit
    try:
        measured = fit[figure.coefficient]
    except KeyError:
        # The search dropped it: it is not needed to describe the record.
        measured = None
    scale = figure.value / figure.in_unit(unit)
    limit = figure.value * (1.0 + margin)
    if measured is None or measured.interval is None:
        remark = f"the last model {fit.model.name} has no {figure.coefficient}: no interval"
        return FigureVerdict(figure, limit, None, 0.0, math.inf, UNDECIDED, None, remark)
    low, high = (scale * end for end in measured.interval)
    value = scale * float(measured) if measured.detected else None
    low = low if measured.detected else 0.0
    verdict = _verdict(low, high, limit)
    power = known_figures()[figure.name][1]
    assert not isinstance(power, str)
    needs = None
    if verdict == UNDECIDED:
        needs = _needed(fit.recording.duration, value, low, high, limit, power)
    return FigureVerdict(figure, limit, value, low, high, verdict, needs, _close(verdict, needs))


def _verdict(low: float, high: float, limit: float) -> str:
    if high <= limit:
        return MEETS
    return DOES_NOT_MEET if low > limit else UNDECIDED


def _needed(
    duration: float, value: float | None, low: float, high: float, limit: float, power: float
) -> float | None:
    """Length of a record in s whose interval would probably exclude the limit.

    The width of an interval falls with the square root of the length. The upper limit of an effect that is not
    detected beside white noise N falls with N T^(power - 1/2), where the effect's unit is U s^power: 1/2 for B, 1 for K,
    3/2 for R.
    """
    if value is None:
        factor = (high / limit) ** (1.0 / max(0.5 - power, 0.5))
    else:
        width = high - value if value < limit else value - low
        distance = abs(limit - value)
        factor = (width / distance) ** 2 if distance > 0.0 else math.inf
    # Intervals scatter themselves: a tenth more.
    needed = 1.1 * duration * max(factor, 1.0)
    return needed if needed <= LONGEST else None


def _close(verdict: str, needs: float | None) -> str:
    if verdict != UNDECIDED or needs is not None:
        return ""
    return "too close to the limit: no record of 30 days would decide"


def _minimum(figure: Quoted, fit: Any, margin: float) -> FigureVerdict:
    """The lowest Allan deviation: an upper bound from the curve, a lower bound from the slow noise that was detected."""
    recording = fit.recording
    scale = figure.value / figure.in_unit(recording.unit)
    limit = figure.value * (1.0 + margin)
    found = minimum_of(fit, EDF_OF_MINIMUM)
    assert found.interval is not None
    low, high = (scale * end for end in found.interval)
    verdict = _verdict(low, high, limit)
    value = scale * float(found)
    needs, remark = None, ""
    if not found.detected:
        remark = (
            "the Allan deviation still falls at the end of this record: its minimum is below"
            f" {high:.3g} {figure.unit}"
        )
    if verdict == UNDECIDED:
        if found.detected:
            needs = _needed(recording.duration, value, low, high, limit, 0.0)
        else:
            # White noise falls with the square root of the length.
            needed = recording.duration * (high / limit) ** 2
            needs = needed if needed <= LONGEST else None
        remark = remark or _close(verdict, needs)
    shown = value if found.detected else None
    return FigureVerdict(figure, limit, shown, low, high, verdict, needs, remark)
