"""Rate ramp R: a constant drift of the rate (IEEE 952-1997 C.1.5)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from allanite.effects._declared import Array, Columns, Parameter, StraightLine, texts_for_clocks
from allanite.effects._known import Deterministic


@dataclass(frozen=True)
class RateRamp(Deterministic):
    """x(t) = R t; σ²(τ) = R²τ²/2. Slope +1.

    References
    ----------
    IEEE 952-1997, C.1.5.

    Examples
    --------
    >>> print(np.sqrt(al.RateRamp(R=1e-3).allan_variance(10.0, rate=100)).round(5))  # R τ/√2
    0.00707
    """

    R: float | None = None

    kind = "rate_ramp"
    short = "R"
    catalog_place = 5
    common = True
    title = "rate ramp"
    titles: ClassVar[dict[str, str]] = {
        "acceleration": "acceleration ramp",
        "fractional frequency": "linear frequency drift",
    }
    parameters = (
        Parameter(
            "R",
            -1.0,
            "drift of the rate per second",
            low=-np.inf,
            sheet={"angular rate": "deg/h^2", "acceleration": "ug/h"},
            figures={"rate_ramp": ()},
        ),
    )
    single = True
    # A ramp has no scatter of its own; the scatter of random-walk noise is the most conservative choice.
    standard = StraightLine("R", 1.0, float(np.sqrt(2.0)), 1.0, "random_walk")
    physics = "a monotonic change of the bias: warming up, aging of a light source, outgassing"
    looks_like = "a slope of +1 at the longest τ; the samples drift in one direction"
    check_by = "repeat after the sensor has settled; plot the bias against its temperature"
    texts = texts_for_clocks(
        physics="a monotonic change of the frequency: aging of a crystal or a lamp, or warming up",
        looks_like="a slope of +1 at the longest τ; the frequency drifts in one direction",
        check_by="repeat after the clock has settled; plot the frequency against its temperature",
    )
    rivals = ("rate_random_walk", "warm_up", "covariate", "gauss_markov")

    def regressors(self, time: Array, covariates: Columns) -> Array:
        """Array of t − mean(t), s, shape (n, 1); the offset belongs to the bias, which models do not contain."""
        return (time - time.mean())[:, None]

    def sampler(self, n: int, rate: float, covariates: Columns) -> Callable[[int, int], Array]:
        """Function (first, last) that returns samples first … last − 1 of a ramp that is 0 at mid-record, U."""
        slope, middle = self.R or 0.0, 0.5 * (n - 1) / rate
        return lambda first, last: slope * (np.arange(first, last) / rate - middle)

    @classmethod
    def regressor_ordinates(
        cls, points: Sequence[Self], j: NDArray[np.int64], n: int, rate: float, start: float
    ) -> Array:
        """Cosine-transform coefficients j of a ramp of slope 1 per second, equal rows for all `points`.

        The coefficients are −√(2/n) cos(a)/(2 rate sin²(a)) with a = πj/2n for odd j, and 0 for even j.
        """
        a = np.pi * j / (2 * n)
        odd = np.where(
            j % 2 == 1, -np.sqrt(2.0 / n) * np.cos(a) / (2.0 * rate * np.sin(a) ** 2), 0.0
        )
        return np.tile(odd, (len(points), 1))

    def own_allan_variance(self, m: Array, rate: float) -> Array:
        """Array of the Allan variance R²τ²/2 at averaging factors m of samples at `rate` Hz, U²."""
        return np.asarray((self.R or 0.0) ** 2 * (m / rate) ** 2 / 2.0)
