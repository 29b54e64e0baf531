"""Hysteresis: the samples follow a logged column with play (backlash)."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Self

import numpy as np

from allanite._kernels import play
from allanite.effects._declared import COLUMN, Array, Columns, Parameter, texts_for_clocks
from allanite.effects._follower import Follower, by_run, coefficient_parameter, followed_column

if TYPE_CHECKING:
    from allanite.effects.model import Model


@dataclass(frozen=True)
class Hysteresis(Follower):
    """x(t) = c·p(t) with p a value that the column drags along with a play of ±`width`; p rests while the column turns.

    Examples
    --------
    >>> up_and_down = {"temperature": [20.0, 24.0, 28.0, 24.0, 20.0]}
    >>> x = al.effects.Hysteresis(column="temperature", coefficient=1.0, width=1.0).simulate(
    ...     n=5, rate=1, seed=1, covariates=up_and_down
    ... )
    >>> print(x.samples - x.samples[0])
    [0. 3. 7. 5. 1.]
    """

    coefficient: float | None = None
    width: float | None = None

    #: Minimum and maximum half-width of the hysteresis that a search tries; None if the column is unknown.
    reach: tuple[float, float] | None = field(default=None, compare=False, repr=False, kw_only=True)

    kind = "hysteresis"
    short = "HYS"
    catalog_place = 22
    title = "hysteresis"
    parameters = (
        COLUMN,
        coefficient_parameter(
            "U/unit", "change of the samples per unit of the column, between its turning points"
        ),
        Parameter("width", "unit", "half the play", "shape", low=1e-12, symbol="w"),
    )
    one_of = ("hysteresis",)
    legend = ("coefficient", "width")
    physics = (
        "stress that a package, a glue or a mounting relieves only by slipping: when the temperature falls again, the bias "
        "stays until the temperature has fallen by the play"
    )
    looks_like = "low-passed samples over the column form a loop with parallel sides, equally wide in slow and fast cycles"
    check_by = "cycle the column at two speeds: the loop of a play keeps its width, the loop of a lag widens with the speed"
    texts = texts_for_clocks(
        physics=(
            "stress that a resonator relieves only by slipping: when the temperature falls again, the "
            "frequency stays until the temperature has fallen by the play"
        )
    )
    rivals = ("covariate", "two_lags", "rate_of_change", "bias_step", "warm_up", "rate_random_walk")
    refined = True

    @classmethod
    def candidates(cls, model: Model, columns: Columns) -> tuple[Self, ...]:
        """One effect for each candidate column, whose attribute `reach` is the range of widths to try.

        Columns whose 1 % and 99 % quantiles are equal are omitted.
        """
        out = []
        for effect in super().candidates(model, columns):
            low, high = np.quantile(columns[str(effect.column)], (0.01, 0.99))
            span = float(high - low)
            if span > 0.0:
                out.append(replace(effect, reach=(span / 16.0, span / 2.2)))
        return tuple(out)

    def grid(self, name: str, n: int, rate: float) -> Array:
        """Hysteresis half-widths to try, in the unit of the column, 8 per decade over the range `reach`.

        `reach` is W/16 to W/2.2 for a column with 98 % of its values in a range W, since a smaller width is not
        visible. Without `reach`, the widths are 0.001 to 1000.
        """
        low, high = self.reach or (1e-3, 1e3)
        return np.geomspace(low, high, 1 + round(8.0 * np.log10(high / low)))

    @property
    def column_powers(self) -> tuple[int, ...]:
        """Tuple (1,): the mean of the branches while the column rises and falls is linear in the column."""
        return (1,)

    @property
    def column_loop(self) -> float:
        """Value while the column falls minus the value while it rises, 2·coefficient·width; 0 without values."""
        return 2.0 * (self.coefficient or 0.0) * (self.width or 0.0)

    def regressors(self, time: Array, covariates: Columns) -> Array:
        """The followed column minus its mean after the hysteresis (play) operator of half-width `width`, shape (n, 1).

        Each joined log is processed on its own. A `width` of None counts as 0.
        """
        column = followed_column(self, covariates)
        column = column - column.mean()
        return by_run(column, self.starts, lambda run: play(run, self.width or 0.0))[:, None]
