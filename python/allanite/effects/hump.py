"""Hump: the bias leaves its level slowly and returns slowly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from allanite.effects._declared import Array, Columns, Parameter, texts_for_clocks
from allanite.effects._event import HEIGHT, TIME, Event, cosines

#: Widths to each side of the middle at which a hump has ended: there it has 3·10⁻⁴ of its height.
WIDTHS_TO_END = 4.0

#: Fewest cells of a record in which a hump that one of its ends cuts is transformed. Chosen by judgment; not measured.
MIN_CELLS = 4096


@dataclass(frozen=True)
class Hump(Event):
    """x(t) = h exp(−(t − t0)²/(2w²)), with the middle t0 and the width w.

    Examples
    --------
    >>> sun = al.effects.Hump(time=50.0, width=10.0, height=0.2)
    >>> print(sun.simulate(duration=100, rate=10, seed=1).samples[[0, 400, 500, 600]].round(3))
    [0.    0.121 0.2   0.121]
    """

    width: float | None = None
    time: float | None = None
    height: float | None = None

    kind = "hump"
    short = "HUMP"
    catalog_place = 27
    title = "slow hump"
    family = "hump"
    interval = ("time", "time")
    parameters = (
        Parameter("width", "s", "time from the middle to 61 % of the height", "shape", low=1e-12),
        TIME,
        HEIGHT,
    )
    legend = ("height", "time", "width")
    physics = "the temperature or another cause rose and fell slowly: a heater, the sun, a ventilation, a visitor"
    looks_like = "low-passed samples leave their level slowly and return slowly; a hump at long τ"
    check_by = "look at the samples and at the laboratory's log at that time; log the temperature; repeat the record"
    texts = texts_for_clocks(
        physics="something rose and fell slowly: the temperature, the supply, or another reference"
    )
    rivals = ("excursion", "transient", "transition", "gauss_markov", "rate_random_walk")

    @property
    def when(self) -> tuple[float, float] | None:
        """Pair (begin, end), s: two widths before and after the middle; None without values."""
        if self.time is None or self.width is None:
            return None
        return self.time - 2.0 * self.width, self.time + 2.0 * self.width

    def grid(self, name: str, n: int, rate: float) -> Array:
        """Values to try, s: five widths from 1/128 to 1/11 of the record, or times one width apart.

        The times are at least two widths from both ends: a hump begins and ends in the record.
        """
        duration = n / rate
        if name != "time":
            return duration / np.geomspace(128.0, 11.0, 5)
        width = self.width or duration / 1024.0
        count = max(4, round(duration / width - 3.0))
        return np.linspace(2.0 * width, max(duration - 2.0 * width, 2.5 * width), count)

    def regressors(self, time: Array, covariates: Columns) -> Array:
        """Array of the hump of height 1, shape (n, 1). Without values the middle is 0 and the width 1 s."""
        return np.exp(-0.5 * ((time - (self.time or 0.0)) / (self.width or 1.0)) ** 2)[:, None]

    @classmethod
    def regressor_ordinates(
        cls, points: Sequence[Self], j: NDArray[np.int64], n: int, rate: float, start: float
    ) -> Array:
        """Cosine-transform coefficients j of the hump of each of the `points`, shape (points, ordinates).

        With w and t0 in samples they are √(2/n) w√(2π) exp(−(πjw/n)²/2) cos(πj(t0 + ½)/n) for a hump that begins and
        ends in the record. The sum over the samples equals the integral unless w is below a sample. Others are
        transformed.
        """
        from scipy.fft import dct

        middle = (np.array([p.time or 0.0 for p in points]) - start) * rate
        width = np.array([p.width or 1.0 for p in points]) * rate
        found = cosines(middle + 0.5, j, n)
        # A grid has few widths.
        each, which = np.unique(width, return_inverse=True)
        found *= np.exp(-0.5 * (np.pi / n * np.outer(each, j)) ** 2)[which]
        found *= (np.sqrt(4.0 * np.pi / n) * width)[:, None]
        reach = WIDTHS_TO_END * width
        cut = (middle < reach) | (middle > n - 1 - reach) | (width < 1.0)
        # Cells instead of samples, at least four times as many as ordinates.
        cells = min(n, max(4 * (int(j[-1]) + 1), MIN_CELLS))
        time = start + ((np.arange(cells) + 0.5) * n / cells - 0.5) / rate
        for place in np.flatnonzero(cut).tolist():
            whole = np.asarray(dct(points[place].regressors(time, {})[:, 0], norm="ortho"))
            found[place] = np.sqrt(n / cells) * whole[j]
        return np.asarray(found)
