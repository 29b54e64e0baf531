"""Hysteresis: the samples follow another column with play, as backlash does."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from allanite.effects._base import Parameter
from allanite.effects._follower import COLUMN, Proportional

if TYPE_CHECKING:
    from allanite.effects.model import Model

__all__ = ["Hysteresis", "play"]


@dataclass(frozen=True)
class Hysteresis(Proportional):
    """x(t) = c·p(t), p what a column drags along with a play of ±`width`: it stands still where the column turns.

    Examples
    --------
    >>> up_and_down = {"temperature": [20.0, 24.0, 28.0, 24.0, 20.0]}
    >>> x = al.effects.Hysteresis(column="temperature", coefficient=1.0, width=1.0).simulate(
    ...     n=5, rate=1, seed=1, covariates=up_and_down
    ... )
    >>> print(x.samples - x.samples[0])
    [0. 3. 7. 5. 1.]
    """

    width: float | None = None

    #: Least and largest half play worth a look, where the column is known.
    reach: tuple[float, float] | None = field(default=None, compare=False, repr=False, kw_only=True)

    kind: ClassVar[str] = "hysteresis"
    short: ClassVar[str] = "HYS"
    title: ClassVar[str] = "hysteresis"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        COLUMN,
        Parameter(
            "coefficient",
            "U/unit",
            "change of the samples per unit of the column, between its turns",
            low=-np.inf,
            symbol="c",
        ),
        Parameter("width", "unit", "half the play", "shape", low=1e-12, symbol="w"),
    )
    one_of: ClassVar[tuple[str, ...]] = ("hysteresis",)
    legend: ClassVar[tuple[str, ...]] = ("coefficient", "width")
    physics: ClassVar[str] = (
        "stress that a package, a glue or a mounting relieves only by slipping: on the way back from a warm end the bias "
        "stays until the temperature has fallen by the play"
    )
    looks_like: ClassVar[str] = (
        "the low-passed samples over the column are a loop of parallel sides, as wide at slow cycles as at fast ones"
    )
    check_by: ClassVar[str] = (
        "cycle the column at two speeds: the loop of a play stays as wide, that of a lag widens with the speed"
    )
    rivals: ClassVar[tuple[str, ...]] = (
        "covariate",
        "two_lags",
        "rate_of_change",
        "bias_step",
        "warm_up",
        "rate_random_walk",
    )
    refined: ClassVar[bool] = True

    @classmethod
    def candidates(
        cls, model: Model, columns: Mapping[str, NDArray[np.float64]]
    ) -> tuple[Self, ...]:
        """One for each column, with the plays that its range can show."""
        out = []
        for effect in super().candidates(model, columns):
            low, high = np.quantile(columns[str(effect.column)], (0.01, 0.99))
            span = float(high - low)
            if span > 0.0:
                out.append(replace(effect, reach=(span / 16.0, span / 2.2)))
        return tuple(out)

    def grid(self, name: str, n: int, rate: float) -> NDArray[np.float64]:
        """From an eighth of the column's range, below which it is no play to be seen, to nearly all of it, 8 a decade.

        Six decades where the range is not known.
        """
        low, high = self.reach or (1e-3, 1e3)
        return np.geomspace(low, high, 1 + round(8.0 * np.log10(high / low)))

    def regressors(
        self, time: NDArray[np.float64], covariates: Mapping[str, NDArray[np.float64]]
    ) -> NDArray[np.float64]:
        """What the column drags along."""
        values, _ = self._followed(time, covariates)
        return self._by_run(values, lambda run: play(run, self.width or 0.0))[:, None]


def play(values: NDArray[np.float64], width: float) -> NDArray[np.float64]:
    """What `values`, shape (n,), drag along with a play of ±`width`, from the middle of the play.

    p_k = min(max(p_{k−1}, u_k − w), u_k + w): each step clips, and clips in a row are one clip, so that √n runs of √n
    steps go side by side. Prandtl's play operator (Visintin 1994, Differential Models of Hysteresis, III.2).
    """
    n = values.size
    rows = max(1, int(np.sqrt(n)))
    length = -(-n // rows)
    padded = np.concatenate([values, np.full(rows * length - n, values[-1])])
    low = np.ascontiguousarray((padded - width).reshape(rows, length).T)
    high = low + 2.0 * width
    for k in range(1, length):
        floor, ceiling = low[k].copy(), high[k]
        np.minimum(np.maximum(low[k - 1], floor), ceiling, out=low[k])
        np.minimum(np.maximum(high[k - 1], floor), ceiling, out=high[k])
    start, last = np.empty(rows), float(values[0])
    for row in range(rows):
        start[row] = last
        last = min(max(last, low[-1, row]), high[-1, row])
    return np.clip(start, low, high).T.reshape(-1)[:n]
