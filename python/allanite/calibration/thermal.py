"""Thermal calibration: the dependence of each axis's bias on temperature, from warm-up or chamber logs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

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
from allanite.calibration.table import axis_lines
from allanite.common.errors import InputError
from allanite.common.showing import brief
from allanite.effects import as_noise_model
from allanite.effects.model import Model
from allanite.fit import fit_model

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from pathlib import Path

    from allanite.calibration.forms import Tried
    from allanite.calibration.runs import Runs
    from allanite.effects import Deterministic, Effect
    from allanite.plots import Figure
    from allanite.recording import Recording

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
        """
        from allanite.calibration.figure import plot_thermal

        return plot_thermal(self, path, theme)

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON, schema ``allanite/thermal/1``."""
        return {
            "schema": "allanite/thermal/1",
            "version": _kernels.version(),
            "logs": list(self.paths),
            "axes": [axis.to_dict() for axis in self.axes],
        }

    def __str__(self) -> str:
        return "\n\n".join("\n".join(axis_lines(axis)) for axis in self)


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
    from allanite.recording import Recording

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
        """Call `on_progress`, unless it is None, after `done` of `total` forms with thermometer number `place`.

        `on_progress` gets the axis `name`, and both numbers summed over all thermometers.
        """
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
    """`AxisLaw` of one axis: the best form of `tried`, fitted again to all samples, and the errors left after correction.

    `noise` is the noise model. The first of `tried`, the constant form, gives the error growth before correction.
    """
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
