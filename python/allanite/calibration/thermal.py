"""Thermal calibration: the dependence of each axis's bias on temperature, from warm-up or chamber logs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite import _kernels
from allanite.calibration.band import curve_of
from allanite.calibration.forms import chosen, law_of, refitted, tried_forms
from allanite.calibration.law import AxisLaw
from allanite.calibration.remains import (
    deviations_before_and_after,
    error_growths,
    loop_of,
    noise_law,
    offsets_of,
    walk_of_steps,
)
from allanite.calibration.runs import join, thermometers
from allanite.common.errors import InputError
from allanite.common.numbers import number, with_readable_numbers
from allanite.common.printing import printed
from allanite.common.showing import brief
from allanite.effects import as_noise_model
from allanite.effects.model import Model
from allanite.fit import fit_model
from allanite.plots.axes import linear_axis, log_axis
from allanite.plots.curves import TAU
from allanite.plots.scaling import deviation_axis, in_figure_units, sample_axis
from allanite.plots.spec import Band, Figure, Line, Mark, Panel, Points
from allanite.recording import Recording

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from pathlib import Path

    from allanite.calibration.forms import Tried
    from allanite.calibration.runs import Runs
    from allanite.effects import Deterministic, Effect
    from allanite.statespace.growth import Growth

#: Maximum number of samples, after averaging, on which the forms are compared. The dependence on temperature is slow, so
#: that averages suffice, and the fit of one form takes about forty Fourier transforms.
MAX_SEARCH_SAMPLES = 8192


@dataclass(frozen=True, slots=True, eq=False)
class ThermalCalibration:
    """Result of `thermal`: the thermal law of every axis (how its bias depends on temperature).

    Attributes
    ----------
    axes : tuple of AxisLaw
    paths : tuple of str or None
        Paths of the logs.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> temp = 25 + 20 * (1 - np.exp(-np.arange(7200) / 1500))
    >>> x = 0.01 * temp + rng.normal(0, 0.05, 7200)
    >>> log = al.Recording(x, rate=1, unit="deg/s", columns=["gyro_x"], covariates={"temperature": temp})
    >>> found = al.thermal(log)
    >>> print(found["gyro_x"].form.name, found.export("csv").splitlines()[1].split(",")[0])
    linear gyro_x
    >>> figure, document = found.plot("law.svg"), found.to_dict()
    """

    axes: tuple[AxisLaw, ...]
    paths: tuple[str | None, ...]

    __repr__ = brief

    def __getitem__(self, name: str) -> AxisLaw:
        for axis in self.axes:
            if axis.name == name:
                return axis
        raise KeyError(f"no axis {name!r}; axes: {', '.join(a.name for a in self.axes)}")

    def __iter__(self) -> Iterator[AxisLaw]:
        return iter(self.axes)

    def __len__(self) -> int:
        return len(self.axes)

    def export(self, target: str) -> str:
        """Text of a parameter file for a target; nothing is written.

        Parameters
        ----------
        target : {"px4", "ardupilot", "c", "csv", "json"}

        Raises
        ------
        InputError
            The target is unknown, or has no parameters for these axes.
        """
        from allanite.calibration.targets import render

        return render(self, target)

    def plot(self, path: str | Path | None = None, theme: str = "light") -> Figure:
        """Figure with two panels per axis: the law b(T) with its band and the data, and the Allan deviation.

        Parameters
        ----------
        path : str or Path, optional
            SVG, PNG or PDF, written if given.
        theme : {"light", "dark"}

        Raises
        ------
        InputError
            The extension is not one of these, the folder does not exist, or matplotlib is not installed.
        """
        panels = tuple(
            p
            for row, axis in enumerate(self.axes)
            for p in (_law_panel(axis, row), _deviation_panel(axis, row))
        )
        logs = len(self.paths)
        figure = Figure(
            "Thermal calibration",
            f"{logs} log{'s' * (logs > 1)}, each band contains the whole law with 95 % confidence",
            panels,
            heights=(1.0,) * len(self.axes),
            widths=(1.0, 1.0),
            kind="thermal",
        )
        return in_figure_units(figure).saved(path, theme)

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON, schema ``allanite/thermal/1``."""
        return {
            "schema": "allanite/thermal/1",
            "version": _kernels.version(),
            "logs": list(self.paths),
            "axes": [axis.to_dict() for axis in self.axes],
        }

    def __str__(self) -> str:
        return "\n\n".join("\n".join(_axis_lines(axis)) for axis in self)


def thermal(
    recordings: Recording | Sequence[Recording],
    model: Model | Effect | str = "N+B+K",
    *,
    temperature: str | None = None,
    on_progress: Callable[[str, int, int], None] | None = None,
) -> ThermalCalibration:
    """`ThermalCalibration`: law b(T) of every axis, fitted to one or more logs in which the temperature changes.

    Parameters
    ----------
    recordings : Recording or sequence of Recording
        Logs of one sensor at rest with a logged temperature; each has its own bias at switch-on.
    model : Model, Effect or str
        Noise model that is fitted together with the law; random effects only.
    temperature : str, optional
        Column of the thermometer. By default each axis uses the thermometer with the highest evidence.
    on_progress : callable, optional
        Called with (axis, forms done, forms in all).

    Returns
    -------
    ThermalCalibration

    Raises
    ------
    InputError
        There is no log, the logs have no temperature or no axis in common, their rates differ by over 1 %, or the noise
        model has effects that are not random.
    TooShortError
        The temperature never changes, or there are too few samples.

    Examples
    --------
    >>> temp = 25 + 15 * np.sin(np.arange(6000) / 900)
    >>> x = 2e-4 * temp**2 + np.random.default_rng(1).normal(0, 0.02, 6000)
    >>> log = al.Recording(x, rate=1, unit="deg/s", covariates={"temperature": temp})
    >>> al.thermal(log).axes[0].form.name
    'quadratic'
    """
    given = [recordings] if isinstance(recordings, Recording) else list(recordings)
    if not given:
        raise InputError("no recordings: give at least one")
    given = [one.measured for one in given]
    noise = as_noise_model(model)
    names = [n for n in given[0].columns if all(n in one.columns for one in given)]
    if not names:
        raise InputError("the logs have no column in common")
    found = thermometers(given, temperature)
    axes = []

    def report(name: str, place: int, done: int, total: int) -> None:
        """Call `on_progress`, unless it is None, with the numbers of forms summed over all thermometers."""
        if on_progress is not None:
            on_progress(name, place * total + done, len(found) * total)

    for name in names:
        columns = [one.column(name) for one in given]
        joined = [join(columns, thermometer) for thermometer in found]
        fits = [
            tried_forms(one.averaged(MAX_SEARCH_SAMPLES), noise, partial(report, name, k))
            for k, one in enumerate(joined)
        ]
        best = max(range(len(found)), key=lambda k: chosen(fits[k]).log_evidence)
        axes.append(_axis_law(joined[best], fits[best], noise))
    return ThermalCalibration(tuple(axes), tuple(one.path for one in given))


def _axis_law(runs: Runs, tried: tuple[Tried, ...], noise: Model) -> AxisLaw:
    """`AxisLaw`: the best form of `tried`, fitted again to all samples, and the errors before and after correction."""
    best = chosen(tried)
    shapes = {type(e): {n: e.values[n] for n in e.free_shapes} for e in law_of(best.fit)}
    effects: list[Deterministic] = [
        e.with_values(**shapes.get(type(e), {})) for e in best.form.effects(runs)
    ]
    model = Model((*noise, *effects))
    fit = refitted(fit_model(runs.recording, model), model)
    before = refitted(fit, Model((*noise, *tried[0].form.effects(runs))))
    curve = curve_of(fit, runs.temperature, tried)
    return AxisLaw(
        runs,
        best.form,
        fit,
        tried,
        curve,
        offsets_of(fit, runs),
        noise_law(fit, runs),
        walk_of_steps(fit, runs),
        loop_of(fit, runs, best.form),
        deviations_before_and_after(fit, runs),
        error_growths(before, runs),
        error_growths(fit, runs),
    )


def _law_panel(axis: AxisLaw, row: int) -> Panel:
    """`Panel` with the law b(T), its band, and mean samples while warming and while cooling."""
    document = axis.to_dict()
    measured, curve = document["measured"], axis.curve
    t, bias, direction = (
        np.array(measured[k]) for k in ("temperature_celsius", "bias", "direction")
    )
    marks: list[Mark] = [Band(curve.temperature, curve.low, curve.high, "model", "95 % band")]
    for sign, color, label in ((1.0, "fail", "warming"), (-1.0, "c1", "cooling")):
        own = direction == sign
        if own.any():
            marks.append(Points(t[own], bias[own], color, label, size=3.0))
    marks.append(Line(curve.temperature, curve.bias, "model", "law"))
    shown = np.concatenate([bias, curve.low, curve.high])
    margin = 0.05 * float(np.ptp(shown)) or 1.0
    y = linear_axis("", float(shown.min()) - margin, float(shown.max()) + margin)
    return Panel(
        linear_axis("temperature (°C)", *axis.range),
        sample_axis(axis.unit, y, "bias"),
        tuple(marks),
        row=row,
        column=0,
        title=f"{axis.name}: {axis.form.name}",
    )


def _deviation_panel(axis: AxisLaw, row: int) -> Panel:
    """`Panel` of a figure (right column, given row): Allan deviation of one axis before and after correction."""
    r = axis.remainder
    marks = (
        Line(r.tau, r.before, "before", "before correction", dash="dash"),
        Line(r.tau, r.after, "measured", "after correction"),
    )
    y = deviation_axis(axis.unit, log_axis("", r.before, r.after))
    return Panel(log_axis(TAU, r.tau), y, marks, row=row, column=1, title="")


def _axis_lines(axis: AxisLaw) -> list[str]:
    """Headline of one axis, then indented lines: coefficients, hysteresis, noise, offsets, deviations."""
    unit = printed(axis.unit)
    lines = [axis.headline]
    if axis.alternatives:
        lines.append(
            f"  the data agree as well with: {', '.join(f.name for f in axis.alternatives)}"
        )
    if axis.numbers:
        numbers_text = (
            f"{name} {value}" if not value.detected else f"{name} = {value}"
            for name, value in axis.numbers.items()
        )
        shown = with_readable_numbers("; ".join(numbers_text))
        lines.append(f"  coefficients relative to {number(axis.curve.reference, 4)} °C: {shown}")
    if axis.loop is None:
        lines.append(
            "  bias while cooling minus while warming: not checked, because no temperature was passed in both directions"
        )
    else:
        value, (low, high) = axis.loop.value, axis.loop.interval
        text = f"{number(value, 2)} ({number(low, 2)} … {number(high, 2)}) {unit}"
        if not axis.loop.detected:
            text = f"not detected, at most {number(max(abs(low), abs(high)), 2)} {unit}"
        lines.append(f"  bias while cooling minus while warming, on average: {text}")
    if axis.noise is not None:
        low, high = axis.noise.interval
        shown = f"{number(axis.noise.percent, 2)} ({number(low, 2)} … {number(high, 2)}) % per °C"
        lines.append(
            f"  white noise: changes by {shown}"
            if axis.noise.detected
            else f"  white noise: no change with temperature detected, {shown}"
        )
    walk = axis.random.get("K")
    if axis.walk_of_steps > 0.0 and walk is not None and not walk.detected:
        lines.append(f"  K {walk}: the coarse steps of the thermometer can explain all of it")
    if len(axis.offsets) > 1:
        each = ", ".join(number(v) for v in axis.offsets)
        lines.append(f"  bias of each run at {number(axis.curve.reference, 4)} °C: {each} {unit}")
    lines.append(_deviation_line(axis, unit))
    lines += [
        _growth_line(a, b) for a, b in zip(axis.growth_before, axis.growth_after, strict=True)
    ]
    return [line for line in lines if line]


def _deviation_line(axis: AxisLaw, unit: str) -> str:
    """Text with the Allan deviation before and after correction at up to three averaging times; empty without any.

    A second line follows if a law was found but correcting raises the Allan deviation at the longest averaging times.
    """
    r = axis.remainder
    if not r.tau.size:
        return ""
    wanted = [t for t in 10.0 ** np.arange(-3.0, 8.0) if r.tau[0] <= t <= r.tau[-1]]
    places = dict.fromkeys(
        [*(int(np.argmin(np.abs(np.log(r.tau / t)))) for t in wanted), r.tau.size - 1]
    )
    shown = (
        f"{number(r.tau[k], 2)} s {number(r.before[k], 2)} → {number(r.after[k], 2)}"
        for k in list(places)[-3:]
    )
    line = f"  Allan deviation before → after correction: {', '.join(shown)} {unit}"
    helps = np.flatnonzero(r.after <= r.before)
    worse = r.tau[helps[-1] + 1 if helps.size else 0 :]
    if worse.size and axis.form.numbers:
        line += f"\n  ! correcting raises the Allan deviation from {number(worse[0], 2)} s on: other noise hides the law"
    return line


def _growth_line(before: Growth, after: Growth) -> str:
    """Line `` angle error after the last fix, before → after correction: 60 s 0.2 → 0.1 °``."""
    unit, factor = before.display_unit
    shown = (
        f"{number(t, 3)} s {number(factor * a, 2)} → {number(factor * b, 2)}"
        for t, a, b in zip(before.tau, before.total, after.total, strict=True)
    )
    return f"  {before.quantity} error after the last fix, before → after correction: {', '.join(shown)} {printed(unit)}"
