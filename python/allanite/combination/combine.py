"""Weights for averaging several units of one axis, and the gain in Allan deviation."""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite import _kernels
from allanite.combination.correlation import allan_covariance, correlations
from allanite.combination.deviating import MIN_UNITS, deviating_units
from allanite.common.documents import fields_dict
from allanite.common.errors import InputError
from allanite.common.numbers import number
from allanite.common.printing import printed
from allanite.common.showing import brief
from allanite.deviation import oadev
from allanite.effects import Model, as_noise_model
from allanite.fit import fit_model
from allanite.plots.axes import linear_axis, log_axis
from allanite.plots.curves import TAU
from allanite.plots.scaling import deviation_axis, in_figure_units
from allanite.plots.spec import Figure, Line, Mark, Panel, Points
from allanite.plots.themes import LOGS

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from allanite.combination.correlation import Correlation
    from allanite.combination.deviating import DeviatingUnit
    from allanite.common.arrays import Array
    from allanite.effects import Effect
    from allanite.fit import Fit
    from allanite.recording import Recording
    from allanite.statespace import StateSpace


#: Fewest averages of the shortest record at the longest averaging time: the deviation then has an error of 10 %.
MIN_AVERAGES = 50


@dataclass(frozen=True, slots=True, eq=False)
class Combination:
    """Several units of one axis, averaged to one sensor.

    Attributes
    ----------
    labels : tuple of str
        Names of the units.
    unit : str
        Unit of the samples.
    fits : tuple of Fit
        Fit of the noise of each unit.
    weights : ndarray, shape (units,)
        One set of weights for all averaging times; their sum is 1, and some can be negative.
    tau : ndarray, shape (k,)
        Averaging times, s, an octave apart.
    single : ndarray, shape (k, units)
        Allan deviation of each unit's model.
    equal, combined, best : ndarray, shape (k,)
        Allan deviation of the average with equal weights, with `weights`, and with the best weights for each τ.
    best_weights : ndarray, shape (k, units)
        Best weights for each τ.
    measured : ndarray, shape (k,), or None
        Allan deviation of the samples, averaged with `weights`; None if the units were not sampled together.
    shared : tuple of Correlation
        Pairs of units whose noise is correlated.
    deviating : tuple of DeviatingUnit
        Units whose noise differs from that of the others.
    model : Model
        Noise of the combined sensor.

    Examples
    --------
    >>> white = np.random.default_rng(1).normal(0, 0.1, (20000, 3))
    >>> log = al.Recording(white, rate=100, unit="deg/s", columns=["gyro1_x", "gyro2_x", "gyro3_x"])
    >>> found = al.combine(log, "N")
    >>> found.weights.round(1), found.gain.round(1)[0]
    (array([0.3, 0.3, 0.3]), np.float64(1.7))
    >>> found.state_space().R.shape, found.to_dict()["schema"]
    ((1, 1), 'allanite/combine/1')
    >>> figure = found.plot("combined.svg")
    >>> found.save("combined.json")
    """

    labels: tuple[str, ...]
    unit: str
    fits: tuple[Fit, ...]
    weights: Array
    tau: Array
    single: Array
    equal: Array
    combined: Array
    best: Array
    best_weights: Array
    measured: Array | None
    shared: tuple[Correlation, ...]
    deviating: tuple[DeviatingUnit, ...]
    model: Model

    __repr__ = brief

    @property
    def best_unit(self) -> int:
        """Index of the unit with the lowest Allan deviation: the lowest mean of its logarithm over all averaging times."""
        return int(np.argmin(np.log(self.single).mean(axis=0)))

    @property
    def gain(self) -> Array:
        """Array of the Allan deviation of the best unit divided by that of the combination at each τ, shape (k,)."""
        return np.asarray(self.single[:, self.best_unit] / self.combined)

    @property
    def rate(self) -> float:
        """Sampling rate of the combination, Hz: the lowest rate of the units."""
        return min(fit.recording.rate for fit in self.fits)

    def state_space(self) -> StateSpace:
        """New `StateSpace` (F, Q, H, R, P0) of `model` at the sampling rate `rate`; it is not cached."""
        return self.model.state_space(self.rate)

    @property
    def headline(self) -> str:
        """One sentence: the gain over the best unit at the first and last τ and at its maximum, and deviating units."""
        largest = int(np.argmax(self.gain))
        places = sorted({0, largest, self.tau.size - 1})
        shown = ", ".join(
            f"{number(self.gain[k], 3)} at {number(self.tau[k], 2)} s" for k in places
        )
        best = self.labels[self.best_unit]
        text = f"{len(self.labels)} units: averaging divides the Allan deviation of the best unit, {best}, by {shown}"
        if self.deviating:
            verb = "deviates" if len(self.deviating) == 1 else "deviate"
            text += f"; {', '.join(one.unit for one in self.deviating)} {verb} from the others"
        return text

    def plot(self, path: str | Path | None = None, theme: str = "light") -> Figure:
        """Figure of the Allan deviations of the units, their mean and the combination, and of the best weights over τ.

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
        marks: list[Mark] = []
        weights: list[Mark] = []
        for k, name in enumerate(self.labels):
            # The first color of logs is that of the combined samples.
            color = LOGS[1 + k % (len(LOGS) - 1)]
            marks.append(Line(self.tau, self.single[:, k], color, name, width=1.2))
            weights.append(Line(self.tau, self.best_weights[:, k], color, width=1.2))
        marks.append(Line(self.tau, self.equal, "before", "mean", dash="dash"))
        marks.append(Line(self.tau, self.combined, "model", "combined", width=2.2))
        if self.measured is not None:
            marks.append(Points(self.tau, self.measured, "measured", "combined samples"))
        y = deviation_axis(self.unit, log_axis("", self.single, self.combined))
        low, high = float(self.best_weights.min()), float(self.best_weights.max())
        room = 0.1 * max(high - low, 0.2)
        panels = (
            Panel(log_axis(TAU, self.tau), y, tuple(marks), show_x=False),
            Panel(
                log_axis(TAU, self.tau),
                linear_axis("best weight", min(low, 0.0) - room, high + room, 4),
                tuple(weights),
                row=1,
            ),
        )
        # Equal numbers in print are one number.
        gains = dict.fromkeys(number(gain) for gain in (self.gain.min(), self.gain.max()))
        figure = Figure(
            f"{len(self.labels)} units averaged to one sensor",
            f"Allan deviation {' to '.join(gains)} times lower than that of the best unit",
            panels,
            heights=(2.4, 1.0),
            kind="combination",
        )
        return in_figure_units(figure).saved(path, theme)

    def save(self, path: str | Path) -> None:
        """Write the noise model of the combination to `path` as JSON, with the unit and the rate of its samples.

        An existing file is replaced.
        """
        from allanite.effects.files import save_model

        save_model(self.model, path, {"unit": self.unit, "rate_hz": self.rate})

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON, schema ``allanite/combine/1``: all attributes except the fits, and the most important results.

        These are the headline, the best unit, the gain, and the matrices F, Q, H and R of the state space.
        """
        space = self.state_space()
        return {
            "schema": "allanite/combine/1",
            "version": _kernels.version(),
            "headline": self.headline,
            "rate_hz": self.rate,
            **fields_dict(self, labels="units", tau="tau_s", fits=""),
            "best_unit": self.labels[self.best_unit],
            "gain": self.gain.tolist(),
            "shared": [
                {
                    "units": [self.labels[k] for k in one.pair],
                    "edges_hz": one.edges.tolist(),
                    "correlation": one.values.tolist(),
                }
                for one in self.shared
            ],
            "model": str(self.model),
            "state_space": {name: getattr(space, name).tolist() for name in "FQHR"},
        }

    def __str__(self) -> str:
        unit = printed(self.unit)
        lines = [self.headline]
        weights_text = ", ".join(
            f"{name} {weight:.3f}" for name, weight in zip(self.labels, self.weights, strict=True)
        )
        lines += [
            f"  weights: {weights_text}",
            f"  noise of the combination: {self.model}, samples in {unit}",
        ]
        for one in self.shared:
            names = " and ".join(self.labels[k] for k in one.pair)
            low, high = one.values.min(), one.values.max()
            lines.append(
                f"  the noise of {names} is correlated: {number(low, 2)} to {number(high, 2)}, depending on frequency"
            )
        for unit_ in self.deviating:
            lines.append(
                f"  {unit_.unit} deviates from the others: {number(unit_.factor)} times their noise from"
                f" {number(unit_.low_hz, 2)} to {number(unit_.high_hz, 2)} Hz (p = {unit_.p_value:.1g})"
            )
        if len(self.labels) < MIN_UNITS:
            lines.append("  deviating units: not checked, because this needs three or more units")
        best = self.single[:, self.best_unit]
        head = ["tau / s", "best unit", "mean", "combined", "gain", "possible"]
        rows = [
            [self.tau[k], best[k], self.equal[k], self.combined[k], self.gain[k],
             best[k] / self.best[k]]
            for k in range(self.tau.size)
        ]  # fmt: skip
        lines.append("".join(f"{name:>12}" for name in head))
        lines += ["".join(f"{number(v):>12}" for v in row) for row in rows]
        return "\n".join(lines)


def combine(
    recordings: Recording | Sequence[Recording],
    model: Model | Effect | str = "N+B+K",
    *,
    tau: float | None = None,
    on_progress: Callable[[int, int], None] | None = None,
) -> Combination:
    """`Combination` of several units of one axis: weights for averaging, gain at each τ, and deviating units.

    Parameters
    ----------
    recordings : Recording or sequence of Recording
        Every column is a unit. Columns of one recording are on one board and were sampled together, so that the
        correlation of their noise is measured. Different recordings are different boards with independent noise; their
        rates may differ.
    model : Model, Effect or str
        Noise model of each unit; random effects only.
    tau : float, optional
        Averaging time for which the weights are optimal, s. By default the weights minimize the mean of the logarithm
        of the deviation over all τ.
    on_progress : callable, optional
        Called with (units done, all units).

    Returns
    -------
    Combination

    Raises
    ------
    InputError
        There are fewer than two units, the units measure different quantities, or the model has other effects than
        random ones.
    TooShortError
        There are too few samples.

    Examples
    --------
    The noisier unit gets a quarter of the weight:

    >>> rng = np.random.default_rng(1)
    >>> logs = [al.Recording(rng.normal(0, s, 20000), rate=100, unit="deg/s") for s in (0.1, 0.2)]
    >>> al.combine(logs, "N").weights.round(1)
    array([0.8, 0.2])
    """
    from allanite.recording import Recording

    given = [recordings] if isinstance(recordings, Recording) else list(recordings)
    boards = [list(one.measured) for one in given]
    columns = [column for board in boards for column in board]
    if len(columns) < 2:
        raise InputError(f"averaging needs two or more units, but the logs contain {len(columns)}")
    units = sorted({column.unit for column in columns})
    if len(units) > 1:
        raise InputError(
            f"the samples have different units, {' and '.join(units)}: choose columns of one axis",
            missing="column",
            remedy=" with {column}",
        )
    noise = as_noise_model(model)
    fits = []
    for place, column in enumerate(columns):
        fits.append(fit_model(column, noise))
        if on_progress is not None:
            on_progress(place + 1, len(columns))
    ends = np.cumsum([0, *map(len, boards)]).tolist()
    shared = correlations([{k: fits[k] for k in range(a, b)} for a, b in pairwise(ends)])
    times = _averaging_times(fits)
    covariance = allan_covariance(fits, shared, times)
    best = np.array([_minimum_variance_weights(c) for c in covariance])
    if tau is not None:
        weights = _minimum_variance_weights(allan_covariance(fits, shared, np.array([tau]))[0])
    else:
        weights = _weights_for_all_times(covariance)
    mean = np.full(len(fits), 1.0 / len(fits))

    def deviation(w: Array) -> Array:
        """Array of the Allan deviation of the average with the weights w at each averaging time, shape (k,)."""
        return np.sqrt(np.einsum("i,kij,j->k", w, covariance, w))

    labels = _unit_names(columns, len(given))
    return Combination(
        tuple(labels),
        columns[0].unit,
        tuple(fits),
        weights,
        times,
        np.sqrt(np.diagonal(covariance, axis1=1, axis2=2)),
        deviation(mean),
        deviation(weights),
        np.sqrt(np.einsum("ki,kij,kj->k", best, covariance, best)),
        best,
        _measured_deviation(columns, weights, times) if len(given) == 1 else None,
        shared,
        deviating_units(fits, labels),
        _combined_model(fits, shared, weights),
    )


def units_of(recordings: Sequence[Recording], *, named: bool = False) -> dict[str, list[Recording]]:
    """Recordings of the units of each axis with two or more units, one per board, by the name of the axis.

    Columns belong to one axis if their units of measurement are equal and their names differ only in numbers. The name
    of the axis has ``#`` for each number: ``gyro#_x``. With `named`, the user chose the columns; if no names belong
    together, all columns then count as units of one axis. A board without an axis has no entry in its list. Raises
    `InputError` if no axis has two units.
    """
    groups: dict[tuple[str, str], list[list[str]]] = {}
    for place, one in enumerate(recordings):
        for name, unit in zip(one.columns, one.units, strict=True):
            key = re.sub(r"\d+", "#", name), unit
            groups.setdefault(key, [[] for _ in recordings])[place].append(name)
    found = {
        key[0]: [one[names] for one, names in zip(recordings, boards, strict=True) if names]
        for key, boards in groups.items()
        if sum(map(len, boards)) > 1
    }
    columns = [name for one in recordings for name in one.columns]
    if not found and named and len(columns) > 1:
        return {columns[0]: list(recordings)}
    if not found:
        raise InputError(
            f"no axis has two units: found {', '.join(dict.fromkeys(columns))}, and no two of these names differ only in"
            " a number",
            missing="column",
            remedy=": name the columns of the units with {column}, or give one log for each unit",
        )
    return found


def _unit_names(columns: Sequence[Recording], boards: int) -> list[str]:
    """Different names of the units: ``gyro_x``, ``b.csv · gyro_x`` for several boards and files, or ``gyro_x [2]``."""
    names = []
    for column in columns:
        file = re.sub(r".*[/\\]", "", column.path or "")
        parts = [file] if boards > 1 and file else []
        names.append(" · ".join([*parts, column.columns[0]]))
    repeated = {name for name in names if names.count(name) > 1}
    return [f"{n} [{k}]" if n in repeated else n for k, n in enumerate(names, start=1)]


def _averaging_times(fits: Sequence[Fit]) -> Array:
    """Averaging times, s, each twice the one before, shape (k,), k ≥ 1.

    The first is the longest sampling interval of all fits. At the last, the shortest record has at least 50 averages,
    unless only the first remains.
    """
    rate = min(fit.recording.rate for fit in fits)
    longest = min(fit.recording.duration for fit in fits) / MIN_AVERAGES
    most = max(longest * rate, 1.0)
    return np.asarray(2.0 ** np.arange(int(np.log2(most)) + 1) / rate, dtype=np.float64)


def _minimum_variance_weights(covariance: Array) -> Array:
    """Array of weights with sum 1 and minimum variance of the average, C⁻¹1/(1ᵀC⁻¹1), shape (units,); can be negative."""
    size = np.sqrt(np.diag(covariance))
    # The pseudoinverse also handles units with identical noise, whose covariance is singular.
    scaled = np.linalg.pinv(covariance / np.outer(size, size), rcond=1e-9, hermitian=True)
    row = (scaled / np.outer(size, size)).sum(axis=1)
    return np.asarray(row / row.sum())


def _weights_for_all_times(covariance: Array) -> Array:
    """Weights of the units, sum 1, shape (units,), with the lowest mean of ln σ(τ) over all τ; σ is that of the average.

    `covariance`, shape (τ, units, units), has the Allan covariances C_k. At the minimum, w is the minimum-variance
    solution for the covariance Σ C_k/(wᵀC_k w).
    """
    count = covariance.shape[1]
    w = np.full(count, 1.0 / count)
    for _ in range(200):
        variance = np.einsum("i,kij,j->k", w, covariance, w)
        new = _minimum_variance_weights((covariance / variance[:, None, None]).mean(axis=0))
        if float(np.abs(new - w).max()) < 1e-9:
            return new
        w = 0.5 * (w + new)
    return w


def _measured_deviation(columns: Sequence[Recording], weights: Array, tau: Array) -> Array:
    """Overlapping Allan deviation of the weighted sum of `columns` of one board, at the averaging times `tau` (s)."""
    rate = columns[0].rate
    samples = np.column_stack([column.rate_samples() for column in columns])
    factors = np.round(tau * rate).astype(int)
    return np.asarray(oadev(samples @ weights, rate=rate, factors=factors).deviation)


def _combined_model(fits: Sequence[Fit], shared: Sequence[Correlation], weights: Array) -> Model:
    """`Model` of the noise of the weighted average of the units: effects of the first unit, with combined coefficients.

    A coefficient is √(Σ wᵢ wⱼ ρᵢⱼ cᵢ cⱼ), where c are the coefficients of the units, w the weights and ρ correlations.
    ρ is 0 for pairs that `shared` lacks. Otherwise it is averaged over frequency, weighted by the share of the effect
    in the spectrum of the first unit of the pair.
    """
    effects = []
    for place, effect in enumerate(fits[0].model.stochastic):
        sizes = np.array(
            [getattr(f.model.stochastic[place], effect.coefficient) or 0.0 for f in fits]
        )
        total = float(np.sum((weights * sizes) ** 2))
        for one in shared:
            a, b = one.pair
            own, data = fits[a].solution, fits[a].data
            share = own.processes[place].power / own.spectrum
            at = one.at(data.bins.frequency(data.rate))
            rho = float(share @ at / share.sum()) if share.sum() > 0.0 else 0.0
            total += 2.0 * rho * weights[a] * weights[b] * sizes[a] * sizes[b]
        effects.append(effect.with_values(**{effect.coefficient: float(np.sqrt(max(total, 0.0)))}))
    return Model(tuple(effects))
