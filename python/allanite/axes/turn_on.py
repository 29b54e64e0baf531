"""Bias at switch-on: its spread between several logs of one sensor, and the part that temperature explains."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.documents import fields_dict
from allanite.common.numbers import number
from allanite.common.printing import printed

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from allanite.common.arrays import Array
    from allanite.recording import Recording

#: Minimum number of logs for a regression on temperature: a straight line leaves two degrees of freedom.
MIN_LOGS_FOR_TEMPERATURE = 4
#: A temperature column explains the bias if its p-value times the number of columns is below this level.
SIGNIFICANCE_LEVEL = 0.05


@dataclass(frozen=True, slots=True)
class TurnOn:
    """Bias of one axis at switch-on, in the unit of its samples.

    Attributes
    ----------
    logs : int
        Number of logs, each with its own switch-on.
    mean, sigma : float
        Mean of the logs' means, and their standard deviation.
    interval : (float, float)
        95 % interval of `sigma`.
    column : str
        Temperature column that explains a part; empty if none does.
    share, residual : float
        Share of the variance that the column explains, and standard deviation about the line.
    slope : float
        Bias for each unit of that column.
    unit : str
        Unit of the samples.
    """

    logs: int
    mean: float
    sigma: float
    interval: tuple[float, float]
    column: str
    share: float
    residual: float
    slope: float
    unit: str

    def __str__(self) -> str:
        unit = printed(self.unit)
        low, high = (number(v, 2) for v in self.interval)
        text = (
            f"mean {number(self.mean, 3)} {unit}, spread {number(self.sigma, 2)} ({low} … {high}) {unit}"
            f" over {self.logs} switch-ons"
        )
        if self.column:
            text += f"; {self.column} explains {100 * self.share:.0f} % of the variance"
            text += f", {number(self.residual, 2)} {unit} remain"
        return text

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON: logs, mean, sigma, interval, unit and temperature (dict, or None if none explains the bias)."""
        found = fields_dict(self)
        temperature = {name: found.pop(name) for name in ("column", "share", "residual", "slope")}
        return found | {"temperature": temperature if self.column else None}


def turn_on_biases(
    first: Sequence[Recording], others: Sequence[Sequence[Recording]]
) -> dict[str, TurnOn]:
    """`TurnOn` (bias at switch-on) of each column that `first` and another log have, by name, in the unit of `first`.

    Raises `InputError` if the units of a column differ in kind.
    """
    out = {}
    for one in first:
        for column in one.measured:
            name = column.columns[0]
            found = [column, *(c for log in others if (c := _column_named(log, name)) is not None)]
            if len(found) > 1:
                own = [c.to(column.unit) for c in found]
                out[name] = turn_on_bias(
                    [float(np.nanmean(c.rate_samples())) for c in own],
                    [column_means(c) for c in own],
                    column.unit,
                )
    return out


def column_means(recording: Recording) -> dict[str, float]:
    """Dict from the name of each logged column (covariate), such as a temperature, to its mean without NaN; often empty."""
    return {name: float(np.nanmean(values)) for name, values in recording.covariates.items()}


def _column_named(log: Sequence[Recording], name: str) -> Recording | None:
    """`Recording` of the column of a log with this name; None if there is none."""
    return next((c for one in log for c in one.measured if c.columns[0] == name), None)


def turn_on_bias(
    biases: Sequence[float], temperatures: Sequence[Mapping[str, float]], unit: str
) -> TurnOn:
    """`TurnOn`: mean and standard deviation of the bias over several logs of one sensor, and its dependence on temperature.

    `biases` are the means of the logs, at least two; `temperatures` the means of their logged columns, by name.
    """
    from scipy.stats import chi2

    means = np.asarray(biases, dtype=np.float64)
    free = means.size - 1
    sigma = float(means.std(ddof=1))
    ends = sigma * np.sqrt(free / chi2.ppf([0.975, 0.025], free))
    column, share, residual, slope = _best_temperature(means, temperatures)
    interval = float(ends[0]), float(ends[1])
    return TurnOn(
        means.size, float(means.mean()), sigma, interval, column, share, residual, slope, unit
    )


def _best_temperature(
    means: Array, temperatures: Sequence[Mapping[str, float]]
) -> tuple[str, float, float, float]:
    """(name, R², residual standard deviation, slope) of the logged column that explains the bias `means` best.

    R² of the straight line over the logs is corrected for its degrees of freedom. The result is ("", 0, 0, 0) for fewer
    than 4 logs, or if no line is significant (5 % over all columns).
    """
    from scipy.stats import linregress

    best = ("", 0.0, 0.0, 0.0)
    if means.size < MIN_LOGS_FOR_TEMPERATURE:
        return best
    names = [name for name in temperatures[0] if all(name in own for own in temperatures)]
    for name in names:
        t = np.array([own[name] for own in temperatures])
        if not np.ptp(t) > 0.0:
            continue
        line = linregress(t, means)
        # Bonferroni correction for the number of columns.
        if not line.pvalue < SIGNIFICANCE_LEVEL / len(names):
            continue
        left = means - line.intercept - line.slope * t
        residual = float(np.sqrt(left @ left / (means.size - 2)))
        share = max(0.0, 1.0 - residual**2 / float(means.var(ddof=1)))
        if share > best[1]:
            best = (name, share, residual, float(line.slope))
    return best
