"""Bets against a model on segments of one length, valid for any distribution of the samples.

A segment is whitened: its cosine ordinates are divided by the model's standard deviations and transformed back. If the
model holds, the whitened samples are independent and have mean square 1. Their distribution may have heavy tails, or
steps. So the bets split a segment into two parts that need no normal samples:

* The values without their order. They give the total power (`PowerBets`).
* The order. Given the values, every order is equally likely. The samples are replaced by normal scores of their ranks;
  the cosine ordinates of these then point in any direction with the same probability. A bet on the shape of the
  spectrum is the ratio of two angular central Gaussian densities (Tyler 1987) on that sphere, which has mean 1.

The shape bet has mean 1 given the values, so the product of both has mean at most 1. For normal samples the product is
nearly the likelihood ratio. The capital, shared among alternatives and starts, is a supermartingale that starts at 1.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.errors import InputError
from allanite.effects import Model, Periodic
from allanite.fit.likelihood.expected import density
from allanite.scale.power_bets import MAX_SQUARE, ClippedPower, PowerBets

Array = NDArray[np.float64]
#: Power ratios of the alternatives at all frequencies and in octaves.
RATIOS = (0.25, 0.5, 0.7, 0.85, 0.95, 1.05, 1.2, 1.5, 2.0, 4.0)
#: Power ratios in noise that a filter passes or removes.
FILTERED_RATIOS = (1.5, 4.0, 16.0)
#: Power ratios of a line. Weak lines need long segments: slow noise is often known only to 20 %, which is no line.
LINE_RATIOS = (3.0, 12.0)
#: Ordinates of a line, and ordinates from one place of a line to the next.
LINE_WIDTH, LINE_STEP = 4, 2
#: First ordinate of the lowest line.
FIRST_LINE_ORDINATE = 8
#: Fields of each bet that a restart needs.
STATE_FIELDS = ("stake", "best", "since", "power")
#: Limit of ordinates and of the capital of a bet, so that their squares and sums do not overflow.
MAX_VALUE = 1e100
#: Logarithm of the largest factor by which a segment multiplies a bet.
MAX_LOG_GAIN = 400.0
#: Limit of samples, so that sums over a segment do not overflow.
MAX_SAMPLE = 1e290
#: Random numbers of this size, in standard deviations, put equal samples into random order. Larger than rounding
#: errors of the transform (1e-14), smaller than any difference that matters.
JITTER = 1e-6


class Bets:
    """Capital of all bets on segments of one length.

    Parameters
    ----------
    model : Model
        Model with values.
    rate : float
        Sampling rate, Hz.
    segment : int
        Samples of one segment.
    tolerance : float
        Relative deviation of the noise within which the model holds.
    lines : bool
        If true, bet only on lines.
    """

    def __init__(
        self, model: Model, rate: float, segment: int, tolerance: float, *, lines: bool
    ) -> None:
        self.segment = segment
        j = np.arange(1, segment, dtype=np.int64)
        expected = density(model.terms(rate, (0.0, segment / rate)), j, segment)
        used = np.ones(j.size)
        for line in (e for e in model if isinstance(e, Periodic)):
            for multiple, _, _ in line.lines:
                at = 2.0 * segment * multiple * (line.frequency or 0.0) / rate
                used[np.abs(j - at) <= 6.0] = 0.0
        self._deviation = np.sqrt(expected)
        self._used = used
        count = np.concatenate([[0.0], np.cumsum(used)])
        # Largest ratio of the power of two bands while the model holds, and of a few ordinates to the level of all
        # others.
        contrast, line_contrast = (
            ((1.0 + tolerance) / (1.0 - tolerance)) ** 2,
            (1.0 + tolerance) ** 2,
        )

        self._edges = _edges(segment)
        wide, spans, weights = _broad_alternatives(self._edges) if not lines else _NOTHING
        cells = np.diff(count[self._edges - 1])
        wide = wide.reshape(-1, cells.size)
        null = np.array([_nearest_null(one, cells, contrast) for one in wide]).reshape(wide.shape)
        self._wide_fixed = 0.5 * np.log(null / wide) @ cells
        self._wide_weights, self._wide_null_weights = (1.0 / wide).T.copy(), (1.0 / null).T.copy()
        self._power_bets = PowerBets(wide @ cells / max(cells.sum(), 1.0), tolerance)
        self.clipped = ClippedPower()
        ratios = np.array(LINE_RATIOS)
        self._narrow_fixed = 0.5 * np.log(line_contrast / ratios)[:, None] * _line_sums(count)
        self._narrow_weights = (1.0 / ratios - 1.0)[:, None]
        self._narrow_null_weight = 1.0 / line_contrast - 1.0
        low = np.arange(FIRST_LINE_ORDINATE, segment - LINE_WIDTH + 1, LINE_STEP)
        places = np.column_stack([low, low + LINE_WIDTH])
        #: First ordinate of each bet and the one after the last, where its power differs most.
        self.spans = np.concatenate([spans, np.tile(places, (len(LINE_RATIOS), 1))]).astype(
            np.int64
        )
        narrow = self.spans.shape[0] - spans.shape[0]
        left = 1.0 - weights.sum()
        #: Logarithm of the part of the capital that each bet gets.
        self.weights = np.log(np.concatenate([weights, np.full(narrow, left / narrow)]))
        self._freedom = count[self.spans[:, 1] - 1] - count[self.spans[:, 0] - 1]
        self.segments = 0
        #: Capital that was not bet yet, capital of each bet, and their sum: 1, and rarely much more while the model
        #: holds.
        self.kept = self.capital = 1.0
        self.stake = np.zeros(self.weights.size)
        #: Best start of each bet: logarithm of its capital, its segment, and the power since then.
        self.best = np.full(self.weights.size, -np.inf)
        self.since = np.zeros(self.weights.size)
        self.power = np.zeros(self.weights.size)

    def gains(self, total: Array) -> Array:
        """Logarithms of the e-values of the shape of a spectrum, shape (…, bets).

        Parameters
        ----------
        total : ndarray, shape (…, segment)
            Sums of the squared ordinates of normal scores up to each ordinate, the first 0.
        """
        half = 0.5 * self._used.sum()
        cells = np.diff(total[..., self._edges - 1])
        wide = np.log(cells @ self._wide_weights / (cells @ self._wide_null_weights))
        power = _line_sums(total)[..., None, :]
        narrow = np.log1p(self._narrow_weights * power / total[..., -1:, None])
        narrow -= np.log1p(self._narrow_null_weight * power / total[..., -1:, None])
        narrow = (self._narrow_fixed - half * narrow).reshape(*total.shape[:-1], -1)
        return np.concatenate([self._wide_fixed - half * wide, narrow], axis=-1)

    def take(self, samples: Array) -> None:
        """Bet on the next segment and update the capital; a segment with missing samples only counts as a segment."""
        self.segments += 1
        if np.isnan(samples).any():
            return
        ordinates, white = self._whitened(samples)
        scores = _cosine_transform(self._normal_scores(white))[1:]
        gain = self.gains(_cumulative_sums(self._used * scores**2))
        wide = self._wide_fixed.size
        if wide:
            gain[:wide] += self._power_bets.gains(white, self.clipped.bound())
            self.clipped.update(white)
        # A part of the capital is bet at each start; all parts together are 1.
        part = share(self.segments)
        self.kept -= part
        fresh = np.log(part) + self.weights
        growth = np.exp(np.minimum(gain, MAX_LOG_GAIN))
        self.stake = np.minimum((self.stake + part * np.exp(self.weights)) * growth, MAX_VALUE)
        begun = self.best < fresh
        self.since[begun], self.power[begun] = self.segments - 1, 0.0
        self.best = np.maximum(self.best, fresh) + gain
        self.capital = float(self.kept + self.stake.sum())
        total = _cumulative_sums(ordinates**2)
        self.power += total[self.spans[:, 1] - 1] - total[self.spans[:, 0] - 1]

    def _whitened(self, samples: Array) -> tuple[Array, Array]:
        """Pair: cosine ordinates over their standard deviation under the model, and the samples with these ordinates."""
        limited = np.clip(samples, -MAX_SAMPLE, MAX_SAMPLE)
        with np.errstate(over="ignore"):
            ordinates = _cosine_transform(limited - limited.mean())[1:] / self._deviation
        ordinates = np.clip(ordinates, -MAX_VALUE, MAX_VALUE) * self._used
        white = _inverse_cosine_transform(np.concatenate([[0.0], ordinates]))
        white *= math.sqrt(self.segment / self._used.sum())
        wrong = np.abs(white) > math.sqrt(MAX_SQUARE)
        if wrong.any() and not wrong.all():
            # The mean of the segment was subtracted. Wrong samples must not move the others by it.
            white -= white[~wrong].mean()
        return ordinates, white

    def _normal_scores(self, white: Array) -> Array:
        """Normal scores of whitened samples, shape (n,): each sample is replaced by the normal quantile of its rank."""
        jitter = np.random.default_rng(self.segments).uniform(-JITTER, JITTER, white.size)
        scores = np.empty(white.size)
        scores[np.argsort(white + jitter)] = _rank_quantiles(white.size)
        return scores

    def clearest(self) -> tuple[int, int, float, int]:
        """Tuple (first ordinate, end (exclusive), measured over expected power, start) of the best bet.

        The start is the index of the segment from which on the power is measured.
        """
        top = int(np.argmax(self.best))
        low, high = self.spans[top]
        freedom = self._freedom[top] * (self.segments - self.since[top])
        return int(low), int(high), float(self.power[top] / max(freedom, 1.0)), int(self.since[top])

    def state(self) -> dict[str, Any]:
        """State of the bets as numbers and lists that JSON can hold."""
        numbers = {name: getattr(self, name).tolist() for name in STATE_FIELDS}
        # JSON has no infinities: bets that have not begun have the logarithm None.
        numbers["best"] = [None if x == -math.inf else x for x in numbers["best"]]
        counts = {"segments": self.segments, "kept": self.kept, "clipped": self.clipped.state()}
        return {**counts, **numbers}

    def restore(self, state: dict[str, Any]) -> None:
        """Continue from a state.

        Raises
        ------
        InputError
            A state of other bets.
        """
        for name in STATE_FIELDS:
            saved = [-math.inf if x is None else x for x in state[name]]
            numbers = np.array(saved, dtype=np.float64)
            if numbers.shape != self.weights.shape or np.isnan(numbers).any():
                raise InputError("damaged, or no state of a watch")
            setattr(self, name, numbers)
        self.segments, self.kept = int(state["segments"]), float(state["kept"])
        self.clipped.restore(state["clipped"])
        self.capital = float(self.kept + self.stake.sum())


def _cosine_transform(samples: Array) -> Array:
    """Array: orthonormal cosine transform of samples."""
    # The compiled transform would start threads for each call, which takes longer than the transform of a segment.
    from scipy.fft import dct

    return np.asarray(dct(samples, norm="ortho"))


def _inverse_cosine_transform(ordinates: Array) -> Array:
    """Samples from their cosine ordinates: the inverse of `_cosine_transform`."""
    from scipy.fft import idct

    return np.asarray(idct(ordinates, norm="ortho"))


def _cumulative_sums(power: Array) -> Array:
    """Array: cumulative sums, beginning with 0."""
    return np.concatenate([[0.0], np.cumsum(power)])


@lru_cache(maxsize=4)
def _rank_quantiles(n: int) -> Array:
    """Normal quantiles of the n ranks, in ascending order, shape (n,)."""
    from scipy.special import ndtri

    return np.asarray(ndtri((np.arange(n) + 0.5) / n))


def _nearest_null(ratios: Array, count: Array, contrast: float) -> Array:
    """Power ratios that the model still allows and that are nearest to an alternative; they differ at most by `contrast`.

    Total power does not matter: the distance is the Kullback-Leibler divergence after the best
    scaling. `ratios` is the alternative, and `count` is the number of ordinates of each ratio.
    """
    lows = np.geomspace(ratios.min(), max(ratios.max() / contrast, ratios.min()), 100)
    nulls = np.clip(ratios, lows[:, None], lows[:, None] * contrast)
    quotient = ratios / nulls
    mean = quotient @ count / count.sum()
    distance = count.sum() * np.log(mean) - np.log(quotient) @ count
    return np.asarray(nulls[np.argmin(distance)])


def _line_sums(total: Array) -> Array:
    """Sum of the values over each position at which a line is tried, from their cumulative sums, shape (…, positions)."""
    first = FIRST_LINE_ORDINATE - 1
    return total[..., first + LINE_WIDTH :: LINE_STEP] - total[..., first:-LINE_WIDTH:LINE_STEP]


def share(segment: int) -> float:
    """Fraction of the capital that is bet on a change at this segment (the first is 1); the sum over all segments is 1."""
    # The series telescopes: 1/ln(e + k − 1) decreases by this part at segment k.
    return float(1.0 / np.log(math.e + segment - 1.0) - 1.0 / np.log(math.e + segment))


def _edges(segment: int) -> NDArray[np.int64]:
    """Array: first ordinate of each half octave, followed by the number of samples of the segment, in ascending order."""
    halves = (at for k in range(segment.bit_length() - 1) for at in (1 << k, 3 << k >> 1))
    return np.array(sorted({1, *halves, segment}), dtype=np.int64)


#: No broad alternatives.
_NOTHING = (np.ones((0, 1)), np.zeros((0, 2)), np.zeros(0))


def _broad_alternatives(edges: NDArray[np.int64]) -> tuple[Array, Array, Array]:
    """Three arrays for k alternatives that change many ordinates.

    They are the power ratios, shape (k, cells); the first and last ordinate of the strongest change, shape (k, 2); and the
    shares of the capital that bets on them, shape (k,).
    Noise of another level, noise that a filter passes or removes, and octaves get a quarter of the capital each. The rest
    is for lines.
    """
    low, high, segment = edges[:-1], edges[1:], int(edges[-1])
    middle = np.sqrt(low * (high - 1.0))
    corners = 2.0 ** np.arange(segment.bit_length())[:, None]
    more = 1.0 / (1.0 + (middle / corners[:-1]) ** 2)
    slow = [1.0 + (ratio - 1.0) * more for ratio in FILTERED_RATIOS]
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
