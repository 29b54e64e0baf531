"""Bets against a model, on segments of one length: what a watch puts at stake.

The squared cosine ordinates of a segment, over what the model expects, are independent χ²₁ while it holds. An alternative
says by how much the power differs, ordinate by ordinate; its likelihood ratio against the nearest power that still counts
as the model's has an expectation of at most 1, whatever came before. So the capital, shared among alternatives and starts,
is a supermartingale from 1 of the segments of this length.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.errors import InputError
from allanite.effects import Model, Periodic
from allanite.fit.likelihood.expected import density

__all__ = ["Bets", "share"]

Array = NDArray[np.float64]
#: Power over the model's that is bet on: in octaves and at all frequencies, in noise that a filter lets through or holds
#: back, and in a line. Only strong lines are bet on: the numbers of slow noise are often not known to a fifth, which is no
#: line.
RATIOS = (0.25, 0.5, 0.7, 0.85, 0.95, 1.05, 1.2, 1.5, 2.0, 4.0)
FILTERED = (1.5, 4.0, 16.0)
NARROW = (3.0, 12.0)
#: Ordinates of a line, and by how many one place of it lies beside the next.
WIDTH, STEP = 4, 2
#: The first ordinate of the lowest line.
LOWEST = 8
#: What is kept over a restart.
STATE = ("stake", "best", "since", "power")


class Bets:
    """The capital of all bets on segments of one length.

    Parameters
    ----------
    model : Model
        With values.
    rate : float
        Hz.
    segment : int
        Samples of one.
    tolerance : float
        Relative deviation of the noise within which the model is taken to hold.
    lines : bool
        Bets on lines alone.
    """

    def __init__(
        self, model: Model, rate: float, segment: int, tolerance: float, *, lines: bool
    ) -> None:
        self.segment = segment
        j = np.arange(1, segment, dtype=np.int64)
        self._expected = density(model.terms(rate, (0.0, segment / rate)), j, segment)
        used = np.ones(j.size)
        for line in (e for e in model if isinstance(e, Periodic)):
            for multiple, _, _ in line.lines:
                at = 2.0 * segment * multiple * (line.frequency or 0.0) / rate
                used[np.abs(j - at) <= 6.0] = 0.0
        self._used = used
        count = np.concatenate([[0.0], np.cumsum(used)])

        def against(ratios: Array) -> tuple[Array, Array]:
            # The nearest power that still counts as the model's: itself, where the alternative is within the tolerance.
            null = np.clip(ratios, (1.0 - tolerance) ** 2, (1.0 + tolerance) ** 2)
            return 0.5 * np.log(null / ratios), 0.5 * (1.0 / null - 1.0 / ratios)

        self._edges = _edges(segment)
        wide, spans, weights = _wide(self._edges) if not lines else _NOTHING
        cells = np.diff(count[self._edges - 1])
        fixed, slope = against(wide.reshape(-1, cells.size))
        self._wide_fixed, self._wide_slope = fixed @ cells, slope.T.copy()
        fixed, self._narrow_slope = against(np.array(NARROW)[:, None])
        self._narrow_fixed = fixed * _of_lines(count)
        low = np.arange(LOWEST, segment - WIDTH + 1, STEP)
        places = np.column_stack([low, low + WIDTH])
        #: First ordinate of each bet and the one after the last, where its power differs most.
        self.spans = np.concatenate([spans, np.tile(places, (len(NARROW), 1))]).astype(np.int64)
        narrow = self.spans.shape[0] - spans.shape[0]
        left = 1.0 - weights.sum()
        #: Part of the capital that each bet gets, in logarithms.
        self.weights = np.log(np.concatenate([weights, np.full(narrow, left / narrow)]))
        self._freedom = count[self.spans[:, 1] - 1] - count[self.spans[:, 0] - 1]
        self.segments = 0
        #: What was never bet, and the capital of each bet that is at stake, in logarithms.
        self.kept = 1.0
        self.stake = np.full(self.weights.size, -np.inf)
        #: Of the best start of each bet: its logarithm, segment, and power since.
        self.best = np.full(self.weights.size, -np.inf)
        self.since = np.zeros(self.weights.size)
        self.power = np.zeros(self.weights.size)

    @property
    def capital(self) -> float:
        """1 at the start, rarely much more while the model holds."""
        return float(self.kept + np.exp(np.minimum(self.stake, 700.0)).sum())

    def gains(self, total: NDArray[Any]) -> NDArray[Any]:
        """What each bet gains by a segment, in logarithms, from the sums over ordinates (…, segment), 0 the first."""
        wide = np.diff(total[..., self._edges - 1]) @ self._wide_slope + self._wide_fixed
        power = _of_lines(total)
        narrow = power[..., None, :] * self._narrow_slope + self._narrow_fixed
        return np.concatenate([wide, narrow.reshape(*power.shape[:-1], -1)], axis=-1)

    def take(self, samples: Array) -> None:
        """Bet on the next segment; one with missing samples decides nothing."""
        self.segments += 1
        if np.isnan(samples).any():
            return
        z = _kernels.cosine_transform(samples)[1:] ** 2 / self._expected
        total = np.concatenate([[0.0], np.cumsum(self._used * z)])
        gain = self.gains(total)
        # A share of the capital is bet at each start; all shares together are 1.
        part = share(self.segments)
        self.kept -= part
        fresh = np.log(part) + self.weights
        self.stake = np.logaddexp(self.stake, fresh) + gain
        begun = self.best < fresh
        self.since[begun], self.power[begun] = self.segments - 1, 0.0
        self.best = np.maximum(self.best, fresh) + gain
        self.power += total[self.spans[:, 1] - 1] - total[self.spans[:, 0] - 1]

    def clearest(self) -> tuple[int, int, float, int]:
        """Of the best bet: the ordinates where the power differs most, by what ratio, and since which segment."""
        top = int(np.argmax(self.best))
        low, high = self.spans[top]
        freedom = self._freedom[top] * (self.segments - self.since[top])
        return int(low), int(high), float(self.power[top] / max(freedom, 1.0)), int(self.since[top])

    def state(self) -> dict[str, Any]:
        """For a restart."""
        numbers = {name: getattr(self, name).tolist() for name in STATE}
        return {"segments": self.segments, "kept": self.kept, **numbers}

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from there.

        Raises
        ------
        InputError
            A state of other bets.
        """
        for name in STATE:
            numbers = np.array(state[name], dtype=np.float64)
            if numbers.shape != self.weights.shape:
                raise InputError("damaged, or no state of a watch")
            setattr(self, name, numbers)
        self.segments, self.kept = int(state["segments"]), float(state["kept"])


def _of_lines(total: NDArray[Any]) -> NDArray[Any]:
    """Sums over the ordinates of each place of a line, from those over all before."""
    return total[..., LOWEST - 1 + WIDTH :: STEP] - total[..., LOWEST - 1 : -WIDTH : STEP]


def share(segment: int) -> float:
    """Part of the capital that is bet on a change at a segment, from 1; the sum over all is 1."""
    # Telescoping: of 1/ln(e + k − 1) what is lost at each step.
    return float(1.0 / np.log(math.e + segment - 1.0) - 1.0 / np.log(math.e + segment))


def _edges(segment: int) -> NDArray[np.int64]:
    """First ordinates of half octaves, and the one after the last."""
    halves = (at for k in range(segment.bit_length() - 1) for at in (1 << k, 3 << k >> 1))
    return np.array(sorted({1, *halves, segment}), dtype=np.int64)


_NOTHING = (np.ones((0, 1)), np.zeros((0, 2)), np.zeros(0))


def _wide(edges: NDArray[np.int64]) -> tuple[Array, Array, Array]:
    """Power ratios of the alternatives of many ordinates in each cell, where they differ most, and shares.

    A quarter of the capital each is for noise of another level, for noise that a filter lets through or holds back, and for
    octaves; what is left is for lines.
    """
    low, high, segment = edges[:-1], edges[1:], int(edges[-1])
    middle = np.sqrt(low * (high - 1.0))
    corners = 2.0 ** np.arange(segment.bit_length())[:, None]
    more = 1.0 / (1.0 + (middle / corners[:-1]) ** 2)
    slow = [1.0 + (ratio - 1.0) * more for ratio in FILTERED]
    lag = 1.0 / (1.0 + (middle / corners[-5:]) ** 2)
    octaves = [(low >= at) & (high <= 2 * at) for at in 1 << np.arange(segment.bit_length() - 1)]
    octaves += [low >= segment // 8, high <= 4]
    groups = [
        np.array(RATIOS)[:, None] * np.ones(low.size),
        np.concatenate([*slow, lag]),
        np.array([np.where(band, ratio, 1.0) for band in octaves for ratio in RATIOS]),
    ]
    wide = np.concatenate(groups)
    size = np.abs(np.log(wide))
    most = size >= 0.5 * size.max(axis=1, keepdims=True)
    spans = np.array([(low[of].min(), high[of].max()) for of in most])
    weights = [np.full(len(group), 0.25 / len(group)) for group in groups]
    return wide, spans, np.concatenate(weights)
