"""Fit one model to several recordings or axes, pool the coefficients, and test whether the recordings agree.

Input: fits of one model to recordings or columns. Output: common values, and p-values of agreement.

Coefficients of random processes are compared by likelihood, which allows non-normal errors and coefficients at zero. One
coefficient is made common to all recordings, and the others stay free. Twice the loss of logL against free fits follows χ²
with one degree of freedom fewer than recordings. All other parameters are compared by their standard errors.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.arrays import Array
from allanite.common.documents import fields_dict
from allanite.common.errors import InputError
from allanite.common.files import write_text
from allanite.common.former import Former
from allanite.common.numbers import number, probability_text
from allanite.common.parameters import NORMAL, Estimate
from allanite.common.printing import printed
from allanite.common.several import Several
from allanite.common.showing import aligned_lines
from allanite.effects import Deterministic, Model, Stochastic
from allanite.effects.sheet_units import in_sheet_unit
from allanite.fit.estimates import has_interval
from allanite.fit.likelihood.discrepancy import HALF_CHI2_95
from allanite.fit.likelihood.whittle import climb, profile_loss
from allanite.fit.models import parameter_label
from allanite.fit.result import Fit
from allanite.fit.table import estimate_cell

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from allanite.suggestion import Check

#: p-value below which recordings disagree, and a random-effects mean is reported: the usual 5 % level.
MIN_AGREEMENT_P = 0.05


@dataclass(frozen=True, slots=True)
class Pooled:
    """One parameter, such as ``N`` or ``GM.q_c``, pooled over all recordings.

    `value` is the common value with its 95 % `interval`. If the recordings disagree and `spread` is known, it is the
    random-effects mean: the exponential of the mean of logarithms, weighted by precision. `spread` is the relative standard
    deviation between recordings in addition to their errors; None if it cannot be estimated. `p_value` is the probability
    of recordings at least as different as these if the true values are equal. They `agree` if it is at least 5 %.
    """

    name: str
    unit: str
    value: float
    interval: tuple[float, float]
    spread: float | None
    p_value: float
    agree: bool

    def to_dict(self) -> dict[str, Any]:
        """Dict of the attributes, for JSON."""
        return fields_dict(self)


@dataclass(frozen=True, slots=True, eq=False)
class ManyFits:
    """Fits of one model to several recordings.

    Attributes
    ----------
    fits : tuple of Fit
    labels : tuple of str
        File and column of each recording.
    pooled : tuple of Pooled
        Pooled parameters.

    Examples
    --------
    >>> truth = al.AngleRandomWalk(N=0.1)
    >>> logs = [truth.simulate(duration=300, rate=10, seed=seed) for seed in (1, 2, 3)]
    >>> many = al.fit_many(logs, al.AngleRandomWalk())
    >>> many.agree, bool(many["N"].interval[0] < 0.1 < many["N"].interval[1])
    (True, True)
    >>> len(many.to_dict()["columns"]), many.pooled_dict()["agree"]
    (3, True)
    """

    fits: tuple[Fit, ...]
    labels: tuple[str, ...]
    pooled: tuple[Pooled, ...]

    def __getitem__(self, name: str) -> Pooled:
        for row in self.pooled:
            if row.name == name:
                return row
        raise KeyError(f"no {name!r} in the fits: {', '.join(r.name for r in self.pooled)}")

    @property
    def agree(self) -> bool:
        """True if no parameter differs between recordings at the level 5 % / number of parameters (Holm's first step).

        True without pooled parameters.
        """
        return (
            min((r.p_value for r in self.pooled), default=1.0) * len(self.pooled) >= MIN_AGREEMENT_P
        )

    of = Former("record_noun")

    @property
    def record_noun(self) -> str:
        """Noun for the fitted records in texts: ``columns`` for columns of one log, ``recordings`` for several logs."""
        columns = [fit.recording for fit in self.fits]
        one = len({c.path for c in columns}) == 1
        return "columns" if one and len({c.columns[0] for c in columns}) > 1 else "recordings"

    def to_dict(self) -> dict[str, Any]:
        """Dict (JSON form): ``columns`` lists a fit for each recording, ``pooled`` holds only `pooled_dict()`.

        ``schema`` is the name of the format.
        """
        return {
            "schema": "allanite/fit/1",
            "columns": [fit.to_dict() for fit in self.fits],
            "pooled": [self.pooled_dict()],
        }

    def pooled_dict(self) -> dict[str, Any]:
        """Dict (JSON form): ``recordings`` (names), ``agree`` (bool), ``parameters`` (list of the pooled parameters)."""
        return {
            "recordings": list(self.labels),
            "agree": self.agree,
            "parameters": [r.to_dict() for r in self.pooled],
        }

    def __str__(self) -> str:
        """Text table with a row for each column, then the pooled values and the test whether the columns agree."""
        fit = self.fits[0]
        pooled = self.pooled
        common = [_common_estimate(fit, row) for row in pooled]
        table = [["", *(row.name for row in pooled)]]
        for label, found in zip(self.labels, comparable_parameters(self.fits), strict=True):
            cells = (
                estimate_cell(_in_printed_unit(fit, row.name, found[row.name])) for row in pooled
            )
            table.append([label, *cells])
        table.append(["all", *map(estimate_cell, common)])
        spreads = (
            "–" if row.spread is None else f"{number(100 * row.spread, 2)} %" for row in pooled
        )
        table.append([f"spread between {self.record_noun}", *spreads])
        table.append(["p-value of agreement", *(probability_text(row.p_value) for row in pooled)])
        units = ", ".join(
            f"{e.name} in {printed(e.unit)}" for e in common if e.unit not in ("1", "")
        )
        noun, differing = self.record_noun, ", ".join(row.name for row in pooled if not row.agree)
        verdict = f"the {noun} agree: the values of row 'all' are common to all"
        if not self.agree:
            verdict = f"the {noun} differ: {differing} (for these, row 'all' is a mean over {noun}, weighted by precision)"
        return "\n".join(
            [f"model {fit.model.name}, {units}", "", *aligned_lines(table), "", verdict]
        )


class Fits(Several[Fit]):
    """Fits of one model to several columns, by column name.

    Examples
    --------
    >>> white = np.random.default_rng(1).standard_normal((5000, 2))
    >>> log = al.Recording(white, rate=100, unit="deg/s", columns=["gyro_x", "gyro_y"])
    >>> fits = al.fit_columns(log, "N")
    >>> round(fits["gyro_x"]["N"].value, 2), fits.pooled[0].agree, fits.check()["gyro_x"].adequate
    (0.1, True, True)
    >>> sorted(fits.to_dict())
    ['columns', 'pooled', 'schema']
    >>> fits.save("fits.json")
    """

    together = Former("pooled")

    @cached_property
    def pooled(self) -> tuple[ManyFits, ...]:
        """Tuple of `ManyFits`: pooled coefficients for each group of at least two columns with the same unit and model."""
        groups: dict[tuple[str, str], list[Fit]] = {}
        for fit in self.values():
            groups.setdefault((fit.recording.unit, fit.model.name), []).append(fit)
        return tuple(of_fits(group) for group in groups.values() if len(group) > 1)

    def check(self) -> Several[Check]:
        """`Several` (a mapping) from the name of each column to the `Check` of its fit."""
        return Several({name: fit.check() for name, fit in self.items()})

    def _missing(self, name: str) -> str:
        """Message of the KeyError for an unknown column `name`; for a parameter it explains how to access it."""
        first = next(iter(self))
        effects = self[first].model
        if name in effects.labels and name not in {p.name for e in effects for p in e.parameters}:
            return f"{len(self)} columns were fitted; use fit[{first!r}].estimates_of({name!r})"
        try:
            self[first][name]
        except KeyError:
            return super()._missing(name)
        return f"{len(self)} columns were fitted; use fit[{first!r}][{name!r}]"

    def to_dict(self) -> dict[str, Any]:
        """Dict (JSON form) with ``schema``, ``columns`` and ``pooled`` (an entry for each unit and model of several)."""
        return {**super().to_dict(), "pooled": [many.pooled_dict() for many in self.pooled]}

    def save(self, path: str | Path) -> None:
        """Write the fits, without pooled values, to `path` as JSON.

        ``--model``, `allanite simulate`, `compare` and `export` can read the file.
        """
        write_text(path, json.dumps(super().to_dict(), indent=1) + "\n")

    def __str__(self) -> str:
        return "\n\n".join([super().__str__(), *map(str, self.pooled)])


def of_fits(fits: Sequence[Fit]) -> ManyFits:
    """`ManyFits` of several fits of one model, with pooled parameters; no parameter is pooled for a single fit.

    `InputError` for recordings of different units.
    """
    columns = [fit.recording for fit in fits]
    units = sorted({c.unit for c in columns})
    if len(units) > 1:
        raise InputError(
            f"the recordings are in {' and '.join(units)}; convert them to one unit",
            remedy=" by {to}",
        )
    labels: list[str] = []
    for count, c in enumerate(columns, start=1):
        label = " · ".join(part for part in (c.path and str(c.path), c.columns[0]) if part)
        labels.append(f"{label} [{count}]" if label in labels or not c.path else label)
    return ManyFits(tuple(fits), tuple(labels), _pool(tuple(fits)) if len(fits) > 1 else ())


def _pool(fits: tuple[Fit, ...]) -> tuple[Pooled, ...]:
    """Tuple of a `Pooled` value for each parameter that all fits share.

    Coefficients are pooled by their likelihoods where `_coefficient_places` allows it, other parameters by their standard
    errors. Of these other parameters, those without a standard error in some fit are omitted.
    """
    tables = comparable_parameters(fits)
    by_likelihood = _coefficient_places(fits)
    out = []
    for name in tables[0]:
        if not all(name in table for table in tables):
            continue
        estimates = [table[name] for table in tables]
        place = by_likelihood.get(name)
        if place is not None:
            out.append(_pooled_by_likelihood(name, estimates, fits, place))
        elif all(e.std_error is not None for e in estimates):
            out.append(pooled_by_errors(name, estimates))
    return tuple(out)


def _coefficient_places(fits: tuple[Fit, ...]) -> dict[str, int]:
    """Dict from the name of a coefficient that can be pooled by likelihood to its index among the random effects.

    Effects with free shapes are left out. Empty if a fit is not a Whittle fit, or if any random effect has a held
    parameter.
    """
    held = any(e.held for fit in fits for e in fit.model.stochastic)
    if held or any(fit.method != "whittle" for fit in fits):
        return {}
    named = zip(fits[0].model, fits[0].model.labels, strict=True)
    processes = [(e, label) for e, label in named if isinstance(e, Stochastic)]
    return {
        parameter_label(label, effect.coefficient): place
        for place, (effect, label) in enumerate(processes)
        if not effect.free_shapes
    }


def _loss_function(fit: Fit, place: int) -> Callable[[float], float]:
    """Function of the squared coefficient of the random effect `place`: loss of logL, nats, with the others free."""
    s = fit.solution
    best = climb(s.power, s.count, s.columns, s.theta, s.scale)
    start = replace(best, theta=s.theta)
    loss = profile_loss(s.power, s.count, s.columns, start, place)
    return lambda square: max(0.0, loss(square))


def _pooled_by_likelihood(
    name: str, estimates: list[Estimate], fits: tuple[Fit, ...], place: int
) -> Pooled:
    """`Pooled` coefficient by likelihood: common value, 95 % profile interval, and likelihood-ratio test of agreement."""
    from scipy.optimize import brentq, minimize_scalar
    from scipy.special import chdtrc

    losses = [_loss_function(fit, place) for fit in fits]

    def total(root: float) -> float:
        """Sum of the losses of logL of all fits, nats, if all have the coefficient `root`."""
        return sum(loss(root * root) for loss in losses)

    values = np.array([float(e) for e in estimates])
    top = max(max(e.interval[1] for e in estimates if e.interval), float(values.max()))
    found = minimize_scalar(
        total,
        bounds=(float(values.min()), float(values.max()) + 1e-9 * top),
        method="bounded",
        options={"xatol": 1e-5 * top},
    )
    value, least = float(found.x), float(found.fun)
    if total(0.0) < least:
        value, least = 0.0, total(0.0)
    p_value = float(chdtrc(len(fits) - 1, max(2.0 * least, 0.0)))

    def loss_above_limit(root: float) -> float:
        """Loss of the total logL if all have the coefficient `root`, minus that at a 95 % limit, nats; negative inside."""
        return total(root) - least - HALF_CHI2_95

    outside = 2.0 * top
    while loss_above_limit(outside) < 0.0:
        outside *= 2.0
    high = float(brentq(loss_above_limit, value, outside, xtol=1e-6 * top))
    low = (
        float(brentq(loss_above_limit, 0.0, value, xtol=1e-6 * top))
        if loss_above_limit(0.0) > 0.0
        else 0.0
    )
    return _pooled(name, estimates, value, (low, high), p_value)


def _pooled(
    name: str,
    estimates: list[Estimate],
    value: float,
    interval: tuple[float, float],
    p_value: float,
) -> Pooled:
    """`Pooled` parameter `name`: common `value` and `interval`, or random-effects mean if `p_value` is below 5 %.

    The common value stays if an estimate is not detected, not positive or has no standard error.
    """
    spread, agree = _spread(estimates), p_value >= MIN_AGREEMENT_P
    if not agree and spread is not None:
        value, interval = _random_effects_mean(estimates, spread)
    return Pooled(name, estimates[0].unit, value, interval, spread, p_value, agree)


def _logarithms_and_errors(estimates: list[Estimate]) -> tuple[Array, Array] | None:
    """Pair of arrays: logarithms of estimates, and standard errors of the logarithms.

    None unless all estimates are detected, positive and have a standard error.
    """
    if not all(e.detected and e.std_error and float(e) > 0.0 for e in estimates):
        return None
    values = np.array([float(e) for e in estimates])
    return np.log(values), np.array([float(e.std_error or 0.0) for e in estimates]) / values


def _spread(estimates: list[Estimate]) -> float | None:
    """Relative standard deviation of the true values between recordings (Paule & Mandel 1982), from logarithms.

    0 if the errors explain the differences. None unless all estimates are detected, positive and have a standard error.
    """
    from scipy.optimize import brentq

    logs = _logarithms_and_errors(estimates)
    if logs is None:
        return None
    y, error = logs

    def excess(variance: float) -> float:
        """Weighted sum of squared deviations minus its expectation, if `variance` is the variance between recordings."""
        weights = 1.0 / (error**2 + variance)
        mean = float(weights @ y / weights.sum())
        return float(weights @ (y - mean) ** 2) - (y.size - 1)

    if excess(0.0) <= 0.0:
        return 0.0
    return float(np.sqrt(brentq(excess, 0.0, y.size * float(np.var(y)) + 1e-12)))


def _random_effects_mean(
    estimates: list[Estimate], spread: float
) -> tuple[float, tuple[float, float]]:
    """Pair: random-effects mean of a parameter over recordings, and its 95 % interval (low, high).

    The mean is geometric: logarithms are averaged with their standard errors and the `spread` of ln(value) between
    recordings. The interval is that of Hartung & Knapp (2001), with Student's t.
    """
    from scipy.special import stdtrit

    logs = _logarithms_and_errors(estimates)
    assert logs is not None
    y, error = logs
    weights = 1.0 / (error**2 + spread**2)
    mean = float(weights @ y / weights.sum())
    scatter = max(1.0, float(weights @ (y - mean) ** 2) / (y.size - 1))
    half = float(stdtrit(y.size - 1, 0.975)) * float(np.sqrt(scatter / weights.sum()))
    return float(np.exp(mean)), (float(np.exp(mean - half)), float(np.exp(mean + half)))


def pooled_by_errors(name: str, estimates: list[Estimate]) -> Pooled:
    """`Pooled` parameter: mean of the estimates, weighted by their inverse squared standard errors, with a χ² test.

    Logarithms are averaged if `_logarithms_and_errors` has them; otherwise the values.
    """
    from scipy.special import chdtrc

    logs = _logarithms_and_errors(estimates)
    if logs is None:
        y = np.array([float(e) for e in estimates])
        error = np.array([max(float(e.std_error or 0.0), 1e-300) for e in estimates])
    else:
        y, error = logs
    weights = 1.0 / error**2
    mean, half = float(weights @ y / weights.sum()), NORMAL / float(np.sqrt(weights.sum()))
    p_value = float(chdtrc(y.size - 1, float(weights @ (y - mean) ** 2)))
    ends = mean, mean - half, mean + half
    value, low, high = ends if logs is None else (float(np.exp(v)) for v in ends)
    return _pooled(name, estimates, value, (low, high), p_value)


def _in_printed_unit(fit: Fit, name: str, value: Estimate) -> Estimate:
    """Copy of an `Estimate` in the unit in which tables print it; `name` is its key in `comparable_parameters`."""
    label, _, parameter = name.rpartition(".")
    effect = fit.model.effects[fit.model.labels.index(label or name)]
    declared = effect.parameter(parameter)
    return in_sheet_unit(value, declared)


def _common_estimate(fit: Fit, row: Pooled) -> Estimate:
    """`Estimate` of a pooled value in the unit in which tables print it.

    It is not detected if the interval includes 0.
    """
    detected = not row.interval[0] <= 0.0 <= row.interval[1]
    own = Estimate(row.value, None, row.interval, row.unit, detected, row.name)
    return _in_printed_unit(fit, row.name, own)


def comparable_parameters(fits: Sequence[Fit]) -> list[dict[str, Estimate]]:
    """List of a dict for each fit: estimates with an interval, by their names in the first fit.

    Derived parameters, times, phases and effects that happen once are excluded. Several effects of a kind are matched by
    their order in frequency or time constant, because each fit puts its strongest first.
    """
    labels, order = fits[0].model.labels, _ranked(fits[0].model)
    out = []
    for fit in fits:
        place = dict(zip(order, _ranked(fit.model), strict=True))
        table = {}
        for i, label in enumerate(labels):
            effect = fit.model.effects[place[i]]
            if isinstance(effect, Deterministic) and effect.happens_once:
                continue
            for name, value in fit.estimates[place[i]].items():
                declared = effect.parameter(name)
                if (
                    has_interval(value)
                    and declared.role not in ("derived", "time")
                    and declared.unit != "rad"
                ):
                    table[parameter_label(label, name)] = value
        out.append(table)
    return out


def _ranked(model: Model) -> list[int]:
    """List of the indices of the effects sorted by kind and, within a kind, by their first free shape (0 without)."""

    def rank(place: int) -> tuple[str, float]:
        """Sort key (kind, first free shape) of the effect at index `place`."""
        effect = model.effects[place]
        first = next((effect.values[name] for name in effect.free_shapes), None)
        return effect.kind, float(first) if isinstance(first, (int, float)) else 0.0

    return sorted(range(len(model.effects)), key=rank)
