"""Bets (sequential tests) against a model on segments of one length, valid for any distribution of the samples.

A segment is whitened: its cosine ordinates are divided by the model's standard deviations and transformed back. If the
model holds, the whitened samples are independent and have mean square 1. Their distribution may have heavy tails or
steps. A bet therefore has two factors that do not require normal samples:

* Power: uses the values without their order (`PowerBets`). Let v be the square of a whitened sample, clipped at a limit so
  that no single sample dominates. The factor 1 + λ (v/m − 1) is never negative. Its mean is at most 1 if the mean of v is
  at most m (λ > 0) or at least m (λ < 0), for any distribution of the samples.
* Shape: uses the order. Given the values, every order is equally likely. Normal scores of the ranks replace the samples.
  The vector of their cosine ordinates then has a uniform direction. The factor is the ratio of two angular central
  Gaussian densities (Tyler 1987) of this direction, whose mean is 1.

The shape factor has mean 1 given the values, so that the product of both has mean at most 1. For normal samples, the
product is nearly the likelihood ratio. The capital, divided among alternatives and starts, is a supermartingale that
starts at 1.

Clipping lowers the mean of v. Bets on more power (λ > 0) are then conservative. Bets on less power need an upper bound on
the clipped power, which depends on the tails of the samples. `ClippedPower` computes this bound from the exceedances in all
earlier segments. If a sensor is too quiet from the first sample on, exceedances are rare and the bound is small.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import Array
from allanite.common.errors import InputError
from allanite.fit.likelihood.expected import density

if TYPE_CHECKING:
    from allanite.effects import Model

#: Power of the alternatives divided by that of the model, at all frequencies and in octaves.
RATIOS = (0.25, 0.5, 0.7, 0.85, 0.95, 1.05, 1.2, 1.5, 2.0, 4.0)
#: Power ratios of alternatives with additional low-pass noise.
FILTERED_RATIOS = (1.5, 4.0, 16.0)
#: Power ratios of a line. Weaker lines need longer segments: slow noise is often known only to 20 %, which is no line.
LINE_RATIOS = (3.0, 12.0)
#: Number of ordinates of a line, and number of ordinates between two tested positions of a line.
LINE_WIDTH, LINE_STEP = 4, 2
#: First ordinate of the lowest line.
FIRST_LINE_ORDINATE = 8
#: Attributes of `Bets`, one value per bet, that a saved state contains.
STATE_FIELDS = ("stake", "best", "since", "power")
#: Ordinates, and the capital of a bet, are clipped at this value, so that their squares and sums do not overflow.
MAX_VALUE = 1e100
#: Natural logarithm of the largest factor by which one segment multiplies the capital of a bet.
MAX_LOG_GAIN = 400.0
#: Samples are clipped at this value, so that sums over a segment do not overflow.
MAX_SAMPLE = 1e290
#: Amplitude, in standard deviations, of the random numbers that put equal samples into random order. It is larger than
#: rounding errors of the transform (1e-14), and smaller than any relevant difference.
JITTER = 1e-6
#: Bets on less power clip squares of whitened samples at this value (3 standard deviations). For normal samples, this
#: removes 0.5 % of the power. A larger value would limit the size of these bets.
LOW_CLIP = 9.0
#: Bets on more power clip squares at this value (5 standard deviations). They need no bound on the clipped power.
HIGH_CLIP = 25.0
#: Whitened samples whose square exceeds this value (100 standard deviations) are invalid samples.
MAX_SQUARE = 1e4
#: Distance of an upper bound from its estimate, in standard errors. A normal estimate is this far off in 0.1 % of cases.
STANDARD_ERRORS = 3.0
#: Upper 99.9 % bound on the expected number of events if none occurred: −ln 0.001.
NONE_SEEN = 6.9
#: Number of different bets per factor of e in the change of the power. A bet for a change that is 10 % off loses 1 % of its
#: growth.
LEVELS_PER_E = 5
#: Minimum factor by which one sample multiplies a bet.
MIN_FACTOR = 0.1
#: Number of factors that are multiplied before a logarithm is taken. (1 + HIGH_CLIP) to this power must not overflow.
FACTORS_PER_PRODUCT = 32


class Bets:
    """Sequential test of a `model` with values, at `rate` Hz, on segments of one length: the capital of all its bets.

    The model holds within the relative deviation `tolerance` of the noise. With `lines`, only bets on lines.
    """

    def __init__(
        self, model: Model, rate: float, segment: int, tolerance: float, *, lines: bool
    ) -> None:
        self.segment = segment
        j = np.arange(1, segment, dtype=np.int64)
        expected = density(model.terms(rate, (0.0, segment / rate)), j, segment)
        used = np.ones(j.size)
        for line in model.deterministic:
            for multiple, _, _ in line.lines:
                at = 2.0 * segment * multiple * (line.base_frequency or 0.0) / rate
                used[np.abs(j - at) <= 6.0] = 0.0
        self._deviation = np.sqrt(expected)
        self._used = used
        count = np.cumulative_sum(used, include_initial=True)
        # Largest ratio of the power of two bands while the model holds, and of a few ordinates to the level of all
        # others.
        contrast, line_contrast = (
            ((1.0 + tolerance) / (1.0 - tolerance)) ** 2,
            (1.0 + tolerance) ** 2,
        )

        self._edges = _cell_edges(segment)
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
        """Logarithm of the factor by which each bet multiplies its capital after one segment, shape (…, bets).

        It is an e-value of the shape of the spectrum alone: its mean is 1 if the model holds. `total`, shape (…, segment),
        is 0 and then the cumulative sums of the squared cosine ordinates of the normal scores.
        """
        half = 0.5 * self._used.sum()
        cells = np.diff(total[..., self._edges - 1])
        wide = np.log(cells @ self._wide_weights / (cells @ self._wide_null_weights))
        power = _line_sums(total)[..., None, :]
        narrow = np.log1p(self._narrow_weights * power / total[..., -1:, None])
        narrow -= np.log1p(self._narrow_null_weight * power / total[..., -1:, None])
        narrow = (self._narrow_fixed - half * narrow).reshape(*total.shape[:-1], -1)
        return np.concatenate([self._wide_fixed - half * wide, narrow], axis=-1)

    def bet_on(self, samples: Array) -> None:
        """Bet on the next segment of `samples`, shape (segment,); one with a missing sample is counted but not bet on."""
        from scipy.fft import dct

        self.segments += 1
        if np.isnan(samples).any():
            return
        ordinates, white = self._whitened(samples)
        scores = dct(self._normal_scores(white), norm="ortho")[1:]
        gain = self.gains(np.cumulative_sum(self._used * scores**2, include_initial=True))
        wide = self._wide_fixed.size
        if wide:
            gain[:wide] += self._power_bets.gains(white, self.clipped.bound())
            self.clipped.update(white)
        # A part of the capital is bet at each start; all parts together are 1.
        part = capital_share(self.segments)
        self.kept -= part
        fresh = np.log(part) + self.weights
        growth = np.exp(np.minimum(gain, MAX_LOG_GAIN))
        self.stake = np.minimum((self.stake + part * np.exp(self.weights)) * growth, MAX_VALUE)
        begun = self.best < fresh
        self.since[begun], self.power[begun] = self.segments - 1, 0.0
        self.best = np.maximum(self.best, fresh) + gain
        self.capital = float(self.kept + self.stake.sum())
        total = np.cumulative_sum(ordinates**2, include_initial=True)
        self.power += total[self.spans[:, 1] - 1] - total[self.spans[:, 0] - 1]

    def _whitened(self, samples: Array) -> tuple[Array, Array]:
        """Tuple (cosine ordinates divided by their standard deviation under the model, whitened samples), all finite.

        Ordinates near the model's lines are 0. If whitened samples exceed 100 (√`MAX_SQUARE`), one constant is subtracted
        from all samples, so that those below 100 have mean 0.
        """
        # The compiled transform would start threads for each call, which takes longer than the transform of a segment.
        from scipy.fft import dct, idct

        limited = np.clip(samples, -MAX_SAMPLE, MAX_SAMPLE)
        with np.errstate(over="ignore"):
            ordinates = dct(limited - limited.mean(), norm="ortho")[1:] / self._deviation
        ordinates = np.clip(ordinates, -MAX_VALUE, MAX_VALUE) * self._used
        white = idct(np.concatenate([[0.0], ordinates]), norm="ortho")
        white *= math.sqrt(self.segment / self._used.sum())
        wrong = np.abs(white) > math.sqrt(MAX_SQUARE)
        if wrong.any() and not wrong.all():
            # The mean of the segment was subtracted. Wrong samples must not move the others by it.
            white -= white[~wrong].mean()
        return ordinates, white

    def _normal_scores(self, white: Array) -> Array:
        """Normal quantiles of the ranks of whitened samples, shape (n,); equal samples are ranked at random."""
        jitter = np.random.default_rng(self.segments).uniform(-JITTER, JITTER, white.size)
        scores = np.empty(white.size)
        scores[np.argsort(white + jitter)] = _rank_quantiles(white.size)
        return scores

    def best_bet(self) -> tuple[int, int, float, int]:
        """Tuple (first ordinate, last + 1, measured over expected power, start) of the bet that has gained most.

        The power is measured from the segment with index `start` on.
        """
        top = int(np.argmax(self.best))
        low, high = self.spans[top]
        freedom = self._freedom[top] * (self.segments - self.since[top])
        return int(low), int(high), float(self.power[top] / max(freedom, 1.0)), int(self.since[top])

    def state(self) -> dict[str, Any]:
        """Dict for JSON with the state of the bets, which `restore` accepts."""
        numbers = {name: getattr(self, name).tolist() for name in STATE_FIELDS}
        # JSON has no infinities: bets that have not begun have the logarithm None.
        numbers["best"] = [None if x == -math.inf else x for x in numbers["best"]]
        counts = {"segments": self.segments, "kept": self.kept, "clipped": self.clipped.state()}
        return {**counts, **numbers}

    def restore(self, state: dict[str, Any]) -> None:
        """Set the bets to a state that `state()` returned; `InputError` for one with another number of bets, or NaN."""
        for name in STATE_FIELDS:
            saved = [-math.inf if x is None else x for x in state[name]]
            numbers = np.array(saved, dtype=np.float64)
            if numbers.shape != self.weights.shape or np.isnan(numbers).any():
                raise InputError("damaged, or no state of a watch")
            setattr(self, name, numbers)
        self.segments, self.kept = int(state["segments"]), float(state["kept"])
        self.clipped.restore(state["clipped"])
        self.capital = float(self.kept + self.stake.sum())


@lru_cache(maxsize=4)
def _rank_quantiles(n: int) -> Array:
    """Array, shape (n,), ascending: standard normal quantiles at the probabilities (k + ½)/n, k = 0 … n − 1. Cached."""
    from scipy.special import ndtri

    return np.asarray(ndtri((np.arange(n) + 0.5) / n))


def _nearest_null(ratios: Array, count: Array, contrast: float) -> Array:
    """`ratios` clipped to an interval whose upper end is `contrast` times its lower end.

    The lower end, of 100 on a logarithmic grid, has the least Kullback-Leibler divergence from `ratios` after the best
    common scaling. `count` is the number of ordinates of each ratio.
    """
    lows = np.geomspace(ratios.min(), max(ratios.max() / contrast, ratios.min()), 100)
    nulls = np.clip(ratios, lows[:, None], lows[:, None] * contrast)
    quotient = ratios / nulls
    mean = quotient @ count / count.sum()
    distance = count.sum() * np.log(mean) - np.log(quotient) @ count
    return np.asarray(nulls[np.argmin(distance)])


def _line_sums(total: Array) -> Array:
    """Sum of the values in each band of `LINE_WIDTH` (4) neighboring ordinates, `LINE_STEP` (2) apart, shape (…, bands).

    `total` is 0 followed by the cumulative sums of the values, shape (…, segment).
    """
    first = FIRST_LINE_ORDINATE - 1
    return total[..., first + LINE_WIDTH :: LINE_STEP] - total[..., first:-LINE_WIDTH:LINE_STEP]


def capital_share(segment: int) -> float:
    """Fraction of the capital that is bet on a change at this segment (1, 2, …); the sum over all segments is 1."""
    # The series telescopes: 1/ln(e + k − 1) decreases by this fraction at segment k.
    return float(1.0 / np.log(math.e + segment - 1.0) - 1.0 / np.log(math.e + segment))


def _cell_edges(segment: int) -> NDArray[np.int64]:
    """Integer array, ascending: first ordinate of each half octave of the cosine spectrum, then `segment` (its length)."""
    halves = (at for k in range(segment.bit_length() - 1) for at in (1 << k, 3 << k >> 1))
    return np.array(sorted({1, *halves, segment}), dtype=np.int64)


#: Result of `_broad_alternatives` without any alternative.
_NOTHING = (np.ones((0, 1)), np.zeros((0, 2)), np.zeros(0))


def _broad_alternatives(edges: NDArray[np.int64]) -> tuple[Array, Array, Array]:
    """Tuple (power ratios, shape (k, cells); spans, shape (k, 2); shares of the capital, shape (k,)) of k alternatives.

    The power ratio in a cell (half octave between two `edges`) is the power of the alternative divided by that of the
    model. There are three kinds: another level, filtered noise, and a change in one octave. Each kind gets a quarter of the
    capital; the last quarter is for lines. The span (first ordinate, last + 1) is where the alternative differs by at least
    half of its largest ratio, in logarithms.
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


class ClippedPower:
    """Upper bound on the power that clipping removes, the mean of (w² − LOW_CLIP)₊, from the samples so far."""

    def __init__(self) -> None:
        self.samples = self.beyond = 0
        #: Sums of the excess over LOW_CLIP and of its square, then both for the excess limited to HIGH_CLIP − LOW_CLIP.
        self.sums = np.zeros(4)

    def bound(self) -> float:
        """Upper bound on the mean of max(w² − LOW_CLIP, 0) over whitened samples w; infinity before the first sample.

        It is the larger of two bounds. The first is the mean of the observed values plus three standard errors. The second
        is such a bound for w² limited to HIGH_CLIP, plus HIGH_CLIP times a bound on the share of samples with
        w² ≥ HIGH_CLIP. The second bound holds if the tail falls at least as w⁻⁴.
        """
        n = self.samples
        if n == 0:
            return math.inf
        seen = _upper_mean(self.sums[0], self.sums[1], n)
        near = _upper_mean(self.sums[2], self.sums[3], n)
        count = self.beyond + STANDARD_ERRORS * math.sqrt(self.beyond) + NONE_SEEN
        return max(seen, near + HIGH_CLIP * count / n)

    def update(self, white: Array) -> None:
        """Add whitened samples to the counts and sums; their squares are first limited to `MAX_SQUARE`."""
        square = np.minimum(np.abs(white), math.sqrt(MAX_SQUARE)) ** 2
        square = square[square > LOW_CLIP]
        seen, near = square - LOW_CLIP, np.minimum(square, HIGH_CLIP) - LOW_CLIP
        self.samples += white.size
        self.beyond += int(np.count_nonzero(square >= HIGH_CLIP))
        self.sums += (seen.sum(), seen @ seen, near.sum(), near @ near)

    def state(self) -> list[float]:
        """List of six numbers for JSON, which `restore` accepts: samples, samples beyond HIGH_CLIP, and `sums`."""
        return [self.samples, self.beyond, *self.sums.tolist()]

    def restore(self, state: list[float]) -> None:
        """Set the counts and sums to those that `state()` returned."""
        samples, beyond, *sums = state
        self.samples, self.beyond = int(samples), int(beyond)
        self.sums = np.array(sums, dtype=np.float64)


def _upper_mean(total: float, squares: float, n: int) -> float:
    """Mean of n values plus three standard errors, from the sums of the values and of their squares."""
    mean = total / n
    return float(mean + STANDARD_ERRORS * math.sqrt(max(squares / n - mean**2, 0.0) / n))


class PowerBets:
    """Bets on other `levels` of the total power, each relative to that of the model, which holds within `tolerance`."""

    def __init__(self, levels: Array, tolerance: float) -> None:
        self._low, self._high = (1.0 - tolerance) ** 2, (1.0 + tolerance) ** 2
        # Levels with nearly the same change share a bet, which gains nearly as much.
        change = np.abs(levels - 1.0)
        size = np.exp(np.round(np.log(np.maximum(change, 1e-9)) * LEVELS_PER_E) / LEVELS_PER_E)
        self._levels, place = np.unique(1.0 + np.sign(levels - 1.0) * size, return_inverse=True)
        self._place = place.reshape(-1)
        self._fractions = np.array(
            [_kelly_fraction(float(level), self._low, self._high) for level in self._levels]
        )

    def gains(self, white: Array, clipped: float) -> Array:
        """Natural logarithms of the e-values of the n `levels` from one segment of whitened samples, shape (n,).

        The mean of an e-value is at most 1 if the model holds. The logarithm is 0 for levels within the tolerance, and for
        low levels that clipping alone could explain. `clipped` is an upper bound of the power that clipping at LOW_CLIP
        removes.
        """
        square = np.minimum(np.abs(white), math.sqrt(HIGH_CLIP)) ** 2
        low = self._low - clipped
        out = np.zeros(self._levels.size)
        up, down = self._levels > self._high, self._levels < low
        out[up] = _log_products(self._fractions[up], square / self._high - 1.0)
        if down.any():
            most = (1.0 - MIN_FACTOR) / (LOW_CLIP / low - 1.0)
            v = np.minimum(square, LOW_CLIP)
            out[down] = _log_products(np.maximum(self._fractions[down], -most), v / low - 1.0)
        return out[self._place]


@lru_cache(maxsize=1024)
def _kelly_fraction(level: float, low: float, high: float) -> float:
    """Fraction λ of the capital to bet on the power `level` (Kelly criterion), for normal whitened samples w.

    λ maximizes the mean of ln(1 + λ (v/m − 1)), v being w² clipped. Under the model, the mean of w² lies between `low` and
    `high`. Above `high`, m = `high` and λ ≥ 0; below `low`, m = `low` and λ ≤ 0; between them λ is 0.
    """
    from scipy.optimize import minimize_scalar
    from scipy.special import chdtri

    if low <= level <= high:
        return 0.0
    null = low if level < 1.0 else high
    sign, clip = (-1.0, LOW_CLIP) if level < 1.0 else (1.0, HIGH_CLIP)
    # The squares of 500 normal samples at evenly spaced probabilities.
    squares = chdtri(1.0, (np.arange(500) + 0.5) / 500)
    gain = np.minimum(level * squares, clip) / null - 1.0
    most = (1.0 - MIN_FACTOR) / (LOW_CLIP / null - 1.0 if level < 1.0 else 1.0)
    found = minimize_scalar(
        lambda part: -np.log1p(sign * part * gain).mean(), bounds=(0.0, most), method="bounded"
    )
    return float(sign * found.x)


def _log_products(fractions: Array, gain: Array) -> Array:
    """Array, shape (fractions,): Σ ln(1 + λ g) over the samples g of `gain`, for each λ in `fractions`."""
    factors = 1.0 + fractions[:, None] * gain
    whole = factors.shape[1] // FACTORS_PER_PRODUCT * FACTORS_PER_PRODUCT
    products = factors[:, :whole].reshape(len(fractions), -1, FACTORS_PER_PRODUCT).prod(axis=2)
    return np.asarray(np.log(products).sum(axis=1) + np.log(factors[:, whole:]).sum(axis=1))
