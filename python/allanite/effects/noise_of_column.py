"""Noise that follows a column: the level of the white noise depends on a logged column."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from allanite.effects._declared import COLUMN, Array, Columns, Parameter, texts_for_clocks
from allanite.effects._follower import followed_column
from allanite.effects._level import Level
from allanite.effects.terms import Term, White


@dataclass(frozen=True)
class NoiseOfColumn(Level):
    """White noise whose standard deviation is multiplied by e^{coefficient·(u − reference)} with u the column.

    `reference` is the column value at which the level is N; a fit chooses it so that N is the rms level of the record.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> temp = np.linspace(10.0, 30.0, 20_000)
    >>> x = rng.normal(0, 0.1, 20_000) * np.exp(0.02 * (temp - 20.0))
    >>> recording = al.Recording(x, rate=10, unit="deg/s", covariates={"temp": temp})
    >>> found = al.AngleRandomWalk().fit(recording).check().significant[0]
    >>> found.kind, round(found.effect.coefficient, 2)
    ('noise_of_column', 0.02)
    """

    column: str | None = None
    coefficient: float | None = None
    reference: float | None = None

    kind = "noise_of_column"
    short = "NCOL"
    catalog_place = 35
    title = "noise that follows"
    one_of = ("noise_of_column",)
    unplanned = "its evidence is the power over time against the column: plan a noise level change between its extremes"
    legend = ("coefficient",)
    parameters = (
        COLUMN,
        Parameter(
            "coefficient",
            "1/unit",
            "relative change of the standard deviation per unit of the column",
            "time",
            low=-np.inf,
            symbol="c",
        ),
        Parameter(
            "reference", "unit", "value of the column at which the level is N", "time", low=-np.inf
        ),
    )
    physics = (
        "the noise depends on another quantity: on the temperature (gain, thermal noise, a lamp or laser), on a supply "
        "voltage, or on the motion of something nearby"
    )
    looks_like = "nothing on the Allan curve; the power of the samples over time traces the column"
    check_by = "hold the column at two values and compare N; repeat with changes at other times"
    texts = texts_for_clocks(
        physics="the noise depends on another quantity, such as the temperature, a supply voltage or the network load"
    )
    rivals = ("noise_level_change", "noise_levels")

    @property
    def numbers(self) -> int:
        """Number of parameters: always 1, since the reference only defines N."""
        return 1

    def following(self, values: Array, coefficient: float) -> Self:
        """Copy with this `coefficient` and the `reference` ln(mean(e^{2·coefficient·values}))/(2·coefficient).

        With this reference, the mean of the squared `gain` over the column `values` is 1, so that N is the rms level.
        """
        power = 2.0 * coefficient * values
        top = float(np.max(power))
        mean = top + float(np.log(np.mean(np.exp(power - top))))
        return self.with_values(coefficient=coefficient, reference=mean / (2.0 * coefficient))

    def modify(
        self, white: float, rate: float, span: tuple[float, float] | None = None
    ) -> tuple[Term, ...]:
        """Tuple with one term: white noise with unchanged variance, since N is the rms level of the record."""
        return (White(white),)

    def gain(self, time: Array, columns: Columns | None = None) -> Array:
        """e^{coefficient·(u − reference)} at each time, shape (n,), with u the column in `columns`.

        The exponent is clipped to ±50. Raises `InputError` without such a column. A coefficient or reference without a
        value counts as 0.
        """
        values = followed_column(self, columns) - (self.reference or 0.0)
        return np.asarray(np.exp(np.clip((self.coefficient or 0.0) * values, -50.0, 50.0)))

    def mean_power(self, start: ArrayLike, end: ArrayLike, columns: Columns | None = None) -> Array:
        """Squared `gain` at the mean column value of each time segment in `columns`; `start` and `end` are not used."""
        return self.gain(np.asarray(start, dtype=float), columns) ** 2
