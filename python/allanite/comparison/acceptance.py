"""Acceptance test of a part: every figure of its data sheet is compared with the measured 95 % interval."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite import _kernels
from allanite.common.errors import InputError
from allanite.common.numbers import duration_text, number
from allanite.common.printing import printed
from allanite.common.showing import aligned_lines, brief
from allanite.common.units import parse_unit
from allanite.comparison.curves import Curves, Drawn, compare
from allanite.comparison.datasheet import measured_figure, measured_text, with_figures
from allanite.effects import as_model, find
from allanite.recording import Recording
from allanite.sources.datasheet import MINIMUM, known_figures

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from allanite.fit import Fit
    from allanite.plots.spec import Figure
    from allanite.sources.datasheet import DataSheet, Quoted
    from allanite.study import Study

#: Verdicts on a figure, an axis or a part.
MEETS, DOES_NOT_MEET, UNDECIDED = "meets", "does not meet", "undecided"
#: Maximum recommended length of a record, s: thirty days. Chosen by judgment; not measured.
MAX_RECORD_S = 30 * 86400.0


@dataclass(frozen=True, slots=True)
class FigureVerdict:
    """One figure of a data sheet and the corresponding measurement, in the unit of the sheet.

    Attributes
    ----------
    figure : Quoted
        As printed in the sheet.
    limit : float
        The printed value plus the margin.
    measured : float or None
        Measured value; None if the effect was not detected.
    low, high : float
        Ends of the 95 % interval; `low` is 0 if the effect was not detected.
    verdict : {"meets", "does not meet", "undecided"}
        *meets*: `high` is at most the limit. *does not meet*: `low` is above the limit.
    needs : float or None
        Length of a record in s that would probably give a decision. None if the verdict is decided, or if a record of 30
        days would not suffice.
    remark : str
        Explanation of a verdict that does not follow from the numbers alone.
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
        """Unit of `limit`, `measured`, `low` and `high`: the unit that the sheet prints."""
        return self.figure.unit

    def with_unit(self, text: str) -> str:
        """A number's text with the printed unit of the sheet: ``0.3 °/√h``."""
        return f"{text} {printed(self.unit)}"

    @property
    def texts(self) -> tuple[str, str, str]:
        """Limit, measured value (or why there is none), and 95 % interval such as ``0.1 … 0.3 °/√h``, as texts."""
        interval = "none"
        if self.low > 0.0:
            interval = self.with_unit(f"{number(self.low, 4)} … {number(self.high, 4)}")
        elif math.isfinite(self.high):
            interval = self.with_unit(f"at most {number(self.high, 4)}")
        limit = self.with_unit(number(self.limit, 4))
        return limit, measured_text(self.figure, self.measured), interval

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON; ``interval`` is the list [low, high], with None for an infinite high."""
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
    r"""Result of the acceptance test of one axis: a verdict on each figure of its data sheet.

    Attributes
    ----------
    sheet : DataSheet
    margin : float
        Allowed excess over the printed figures, as a fraction.
    figures : tuple of FigureVerdict
    study : Study
        The models that were fitted. The measured values come from the last one.
    remarks : tuple of str
        Contradictions in the sheet, and a warning if the model does not fit.

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
        """`Recording`: record that was tested."""
        return self.study.recording.recording()

    @property
    def verdict(self) -> str:
        """Verdict on the whole sheet: ``"meets"``, ``"does not meet"`` or ``"undecided"``.

        The sheet is met if the sensor meets every figure. It is not met if the sensor fails at least one figure.
        """
        found = {figure.verdict for figure in self.figures}
        return next(v for v in (DOES_NOT_MEET, UNDECIDED, MEETS) if v in found)

    @property
    def needs(self) -> float | None:
        """Length of a record, s, that would probably decide all undecided figures: the largest `needs` of the figures.

        None if no figure has one.
        """
        return max((f.needs for f in self.figures if f.needs is not None), default=None)

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON, schema ``allanite/accept/1``: recording, sheet, margin in %, model, verdict, figures, remarks."""
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
                *f.texts,
                f.verdict + (f" (needs {duration_text(f.needs)})" if f.needs is not None else ""),
            )
            for f in self.figures
        ]
        margin = f", margin {100 * self.margin:g} %" if self.margin else ""
        lines = [f"{self.recording.columns[0]}: {self.verdict} {self.sheet.name}{margin}"]
        lines += [f"  {line}" for line in aligned_lines(cells)]
        lines += [f"! {f.figure.name}: {f.remark}" for f in self.figures if f.remark]
        return "\n".join([*lines, *(f"! {remark}" for remark in self.remarks)])

    def plot(self, path: str | Path | None = None) -> Figure:
        """Figure with the measured Allan deviation, the last model and the limits of the sheet; written to `path` if given.

        A limit has no line if it belongs to no effect of allanite.
        """
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
    """Tuple (`tau`, limit): the Allan deviation that a figure of the data sheet allows at each `tau` (s), in `unit`.

    The coefficient of the effect is the figure times `margin`. For the minimum of the Allan deviation, the limit is the
    same at every τ. None if no effect has the coefficient that the figure states.
    """
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
    """Acceptance test of one axis: every figure of a data sheet is compared with the measured 95 % interval.

    The model N+B+K, extended by the coefficients that the sheet states, is fitted. If it does not describe the record,
    missing effects are added first (`improve`). A vibration or a temperature then does not count as noise of the part.
    The minimum of the Allan deviation is that of the samples themselves, including outliers and lines.

    Parameters
    ----------
    recording : Recording
        One column.
    sheet : DataSheet
        Figures of the recording's kind of sensor; others are ignored.
    margin : float
        Allowed excess over the printed figures, as a fraction: 0.1 allows 10 %.
    on_progress : callable, optional
        Called with the number of steps done and the number of all steps.

    Returns
    -------
    Acceptance

    Raises
    ------
    InputError
        The sheet has no figure for this kind of sensor, or the margin is negative.

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
            f"{sheet.name}: the sheet has no figure for {parse_unit(recording.unit).kind} (column {recording.columns[0]})"
        )
    study = improve(recording, with_figures(as_model("N+B+K"), own), on_progress=on_progress)
    return accept_study(study, own, margin)


def accept_study(study: Study, own: DataSheet, margin: float = 0.0) -> Acceptance:
    """`Acceptance`: verdicts on the figures of a data sheet from the last fit of a finished study; nothing is fitted again.

    `own` is the data sheet with only the figures of this kind of sensor. `margin` is the allowed excess, as a fraction.
    """
    fit = study.fit
    tested = tuple(_verdict_on(figure, fit, margin) for figure in own.figures)
    remarks = list(own.remarks())
    if not fit.adequate:
        remarks.append(
            f"{fit.model.name} does not describe this record completely; the intervals are widened accordingly"
        )
    return Acceptance(own, margin, tested, study, tuple(remarks))


def _verdict_on(figure: Quoted, fit: Fit, margin: float) -> FigureVerdict:
    """`FigureVerdict`: does one figure of a data sheet hold, given the 95 % interval of this quantity in the fit?

    The limit is the figure times (1 + `margin`). If the quantity was not detected, the measured value is None, and the
    interval begins at 0. Without an interval, the verdict is undecided.
    """
    recording = fit.recording
    limit = figure.value * (1.0 + margin)
    found = measured_figure(figure, fit)
    if found is None or found.interval is None:
        # `improve` removed the effect, because the record can be described without it.
        remark = f"no interval, because the last model {fit.model.name} has no {figure.coefficient}"
        return FigureVerdict(figure, limit, None, 0.0, math.inf, UNDECIDED, None, remark)
    scale = figure.value / figure.in_unit(recording.unit)
    low, high = (scale * end for end in found.interval)
    value = scale * float(found) if found.detected else None
    low = low if found.detected else 0.0
    verdict = _verdict_on_interval(low, high, limit)
    needs, remark = None, ""
    if figure.coefficient == MINIMUM and not found.detected:
        remark = (
            "the measured Allan deviation still falls at the longest τ, so the record does not reach its minimum; the"
            f" minimum is at most {high:.3g} {printed(figure.unit)} (95 % limit)"
        )
    if verdict == UNDECIDED:
        power = known_figures()[figure.name][1]
        assert not isinstance(power, str)
        needs = _needed_length(recording.duration, value, low, high, limit, power)
        if needs is None and not remark:
            remark = "too close to the limit: even a record of 30 days would not be enough for a decision"
    return FigureVerdict(figure, limit, value, low, high, verdict, needs, remark)


def _verdict_on_interval(low: float, high: float, limit: float) -> str:
    """``"meets"`` if `high` is at most `limit`, ``"does not meet"`` if `low` exceeds `limit`, otherwise ``"undecided"``."""
    if high <= limit:
        return MEETS
    return DOES_NOT_MEET if low > limit else UNDECIDED


def _needed_length(
    duration: float, value: float | None, low: float, high: float, limit: float, power: float
) -> float | None:
    """Length of a record, s, whose 95 % interval would probably exclude the `limit`; None above 30 days.

    `value`, `low` and `high` are the result of a record of `duration` s and its 95 % interval; `value` is None if the
    effect was not detected.

    The width of an interval decreases with the square root of the length T. If an effect is not detected in white noise
    N, its upper limit is proportional to N T^(power - 1/2), where the unit of the effect is U s^power. The exponent of
    1/T is therefore 1/2 for B and for a minimum of the Allan deviation, 1 for K and 3/2 for R.
    """
    if value is None:
        factor = (high / limit) ** (1.0 / max(0.5 - power, 0.5))
    else:
        width = high - value if value < limit else value - low
        distance = abs(limit - value)
        factor = (width / distance) ** 2 if distance > 0.0 else math.inf
    # Ten percent more, because the width of the next interval is random. Chosen by judgment; not measured.
    needed = 1.1 * duration * max(factor, 1.0)
    return needed if needed <= MAX_RECORD_S else None
