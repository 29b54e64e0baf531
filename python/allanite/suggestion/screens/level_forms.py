"""Screens of the level of the white noise beyond one interval: several intervals, a period, or another column."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.showing import brief
from allanite.criticism.over_time import overdispersion
from allanite.effects import CATALOG, Model, Modifier
from allanite.fit.likelihood.whitened import cell_means
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE
from allanite.recording.audit import MAX_ROUNDING_SHARE
from allanite.recording.tails import coarse_step
from allanite.suggestion.constants import (
    FALSE_ALARM_PROBABILITY,
    LEVEL_CELLS,
    MIN_PERIODS,
)
from allanite.suggestion.p_values import Family, delta_logl_of_two_levels
from allanite.suggestion.screens._screen import Candidate
from allanite.suggestion.screens.level_borders import interval_powers, most_likely_borders

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data

Array = NDArray[np.float64]

#: Family of all changes of the noise level.
LEVELS = Family("level", scatter="none")
#: Maximum number of cells of the record in which a period or a column is compared with the power.
PERIOD_CELLS = 65_536
#: Maximum number of harmonics of a gate whose powers are summed.
HARMONICS = 6
#: Number of phases of a period at which a gate may begin and end.
PHASES = 64
#: Number of steps between neighboring phases, and neighboring periods, when a gate is refined by single samples.
#: The interval of N covers the truth in 5 of 12 records with 1 step, in 11 with 2, 8 and 16; the bias of N is 1.1 %, 0.6 %,
#: 0.5 % and 0.5 % (benches/decisions/chosen_values.py gates).
FINE_PHASES = 8
#: Number of periods tried around the best one.
REFINED_PERIODS = 33
#: Frequencies per block whose median is the usual power of a periodic level: a part of the frequency, within limits. Half
#: or twice these values give no false period of 8 and all 8 true ones, too (benches/decisions/chosen_values.py background).
BACKGROUND_PARTS, MIN_BACKGROUND_VALUES, MAX_BACKGROUND_VALUES = 8, 32, 128
#: Slope of −ln p over the statistic H (de Jager & Büsching 2010, A&A 517).
H_SLOPE = 0.398


@dataclass(frozen=True, slots=True, eq=False)
class Series:
    """Power of the white noise over time from `start` to `end`, s, with mean about 1, shape (k,).

    `power` measures levels, `judged` (with normal tails) decides on them. `freedom` are the independent degrees of freedom
    of each value, `share` the share of the power that is white noise.
    """

    power: Array
    judged: Array
    freedom: float
    share: float
    start: float
    end: float

    __repr__ = brief

    def time(self, place: float) -> float:
        """Time, s, at which the value with index `place` begins. A fractional `place` is interpolated."""
        return float(self.start + place * (self.end - self.start) / self.power.size)

    @property
    def times(self) -> Array:
        """Array of the times of the middles of all values, s, shape (k,)."""
        edges = np.linspace(self.start, self.end, self.power.size + 1)
        return np.asarray(0.5 * (edges[1:] + edges[:-1]))

    def place(self, time: float) -> float:
        """Index, with a fraction, of the value of this series at a `time`, s; inverse of `Series.time`."""
        return float((time - self.start) / (self.end - self.start) * self.power.size)

    def white_ratio(self, ratio: float) -> float:
        """Ratio of the white-noise power at two times, at least 1e-6, computed from the `ratio` of the total power.

        The rest of the total power is constant over time, so the white noise changes by a larger factor than the total.
        """
        return max(1e-6, 1.0 + (ratio - 1.0) / self.share)

    def delta_logl(self, white: Array) -> float:
        """ΔlogL, nats, of a white-noise power proportional to `white`, shape (k,), over a constant one; may be negative."""
        expected = 1.0 + self.share * (white / white.mean() - 1.0)
        logs = np.log(expected).mean() + np.log((self.judged / expected).mean())
        return float(-0.5 * self.freedom * self.judged.size * (logs - np.log(self.judged.mean())))


def is_deformed_by_rounding(data: Data) -> bool:
    """True if rounding makes up such a large part of the white variance that the noise level depends on the bias."""
    seen = data.present(data.samples)
    return coarse_step(seen) ** 2 / 12.0 > MAX_ROUNDING_SHARE * 0.5 * float(np.var(np.diff(seen)))


def series_of(
    power: Array, judged: Array, freedom: float, share: float, span: tuple[float, float]
) -> Series:
    """`Series` of the noise power over time, with its degrees of freedom divided by the overdispersion.

    The overdispersion is that of `judged`, divided by its own level in each interval.
    """
    places = _level_borders(judged, freedom, turns=False)
    steady = judged / np.repeat(
        _levels(judged, places, turns=False), np.diff([0, *places, judged.size])
    )
    return Series(power, judged, freedom / overdispersion(steady), share, *span)


def screen_several(series: Series, model: Model) -> list[Candidate]:
    """List with one `Candidate` (not refitted) in which the white-noise level changes at two or more times; or empty.

    Two forms are compared: each interval has its own level, or two levels alternate. The cost of a form is ½ ln n for each
    parameter, where n is the number of degrees of freedom. The p-value is exp(cost − ΔlogL), at most 1.
    """
    freedom = series.freedom
    price = 0.5 * np.log(max(freedom * series.judged.size, 2.0))
    found: list[tuple[float, float, Modifier | None]] = []
    for turns in (False, True):
        places = _level_borders(series.judged, freedom, turns=turns)
        if places.size < 2:
            continue
        levels = _levels(series.judged, places, turns)
        sizes = np.diff([0, *places, series.judged.size])
        mean = float(series.judged.mean())
        gain = -0.5 * freedom * float(sizes @ np.log(levels / mean))
        own = _levels(series.power, places, turns) / float(series.power.mean())
        white = np.array([series.white_ratio(float(r)) for r in own])
        factors = np.sqrt(white / white[0])
        times = tuple(series.time(p) for p in places)
        back = tuple(1.0 if turns and not k % 2 else float(f) for k, f in enumerate(factors))[1:]
        effect = level_effect(model, times=times, factors=back)
        if effect is None:
            return []
        one = turns and places.size == 2
        found.append((gain - price * effect.numbers, gain, None if one else effect))
    if not found:
        return []
    best, gain, chosen = max(found, key=lambda f: f[0])
    if chosen is None:
        return []  # one interval
    return [Candidate(chosen, gain, LEVELS, None, chosen.numbers, min(0.0, -best))]


def level_effect(model: Model, **values: Any) -> Modifier | None:
    """Change of the noise level with these values, of the first suitable kind that may be added to `model`; or None."""
    kinds = (type(blank) for blank in _level_effects(model, {}))
    return next((one for cls in kinds if (one := cls.from_values(**values)) is not None), None)


def _level_effects(model: Model, columns: Mapping[str, Array]) -> list[Modifier]:
    """List of catalog effects without values that change the noise level over time and may be added to `model`."""
    kinds = [cls for cls in CATALOG if issubclass(cls, Modifier) and cls.screened == "level"]
    return [blank for cls in kinds for blank in cls.candidates(model, columns)]


def _level_borders(power: Array, freedom: float, *, turns: bool) -> NDArray[np.int64]:
    """Most likely borders between intervals of constant noise level, as indices of `power`.

    With `turns`, two levels alternate. Without `turns`, each interval has its own level, and a border costs two parameters.
    """
    cells = min(LEVEL_CELLS, power.size // 8)
    edges = np.arange(cells + 1) * power.size // cells
    price = 0.5 * np.log(max(freedom * power.size, 2.0))
    coarse = np.add.reduceat(power, edges[:-1]) / np.diff(edges)
    count = freedom * np.diff(edges)
    borders = _partition(coarse, count, 2.0 * price)
    if turns:
        borders = _alternating_borders(coarse, count, borders, price)
    places = np.asarray(edges[np.array(borders, dtype=np.int64)], dtype=np.int64)
    for _ in range(2):
        places = most_likely_borders(
            power, places, _levels(power, places, turns), power.size // cells
        )
    return places


def _partition(power: Array, count: Array, price: float) -> list[int]:
    """Ascending list of the borders of the partition into constant levels with the largest penalized logL.

    Each border, the index of the first value after it, costs `price`; `count` is the degrees of freedom of each value.
    """
    total = np.concatenate([[0.0], np.cumsum(power * count)])
    size = np.concatenate([[0.0], np.cumsum(count)])
    best = np.zeros(power.size + 1)
    previous = np.zeros(power.size + 1, dtype=np.int64)
    for end in range(1, power.size + 1):
        n = size[end] - size[:end]
        mean = np.maximum((total[end] - total[:end]) / n, 1e-12)
        cost = best[:end] + 0.5 * n * np.log(mean) + price * (np.arange(end) > 0)
        previous[end] = int(np.argmin(cost))
        best[end] = cost[previous[end]]
    borders = []
    end = power.size
    while (end := int(previous[end])) > 0:
        borders.append(end)
    return borders[::-1]


def _alternating_borders(power: Array, count: Array, borders: list[int], price: float) -> list[int]:
    """Ascending list of the indices at which the noise power changes between a quiet and a loud level.

    `borders`, as indices of the cells of `power`, are the first guess, and `count` the degrees of freedom of each cell. All
    thresholds between two levels are tried, and the likeliest sequence is kept. A change of level costs `price` nats.
    """
    if len(borders) < 2:
        return []
    starts = [0, *borders]
    level = np.add.reduceat(power * count, starts) / np.add.reduceat(count, starts)
    means = np.sort(level)
    best: tuple[float, list[int]] = (-np.inf, [])
    for split in np.sqrt(means[1:] * means[:-1]):
        loud = np.repeat(level > split, np.diff([*starts, power.size]))
        for _ in range(4):
            if loud.all() or not loud.any():
                break
            levels = [float(np.average(power[part], weights=count[part])) for part in (~loud, loud)]
            value, loud = _best_path(power, count, levels, price)
            score = -value
            if score > best[0]:
                best = (score, [int(b) + 1 for b in np.flatnonzero(np.diff(loud))])
    return best[1]


def _best_path(
    power: Array, count: Array, levels: list[float], price: float
) -> tuple[float, NDArray[np.bool_]]:
    """Pair: lowest cost of a sequence of two alternating levels (Viterbi), and mask of the values at the second level.

    The cost is the negative logL plus `price` for each change of level; `levels` are the two mean powers.
    """
    cost = np.stack([0.5 * count * (np.log(v) + power / v) for v in levels])
    here = cost[:, 0]
    stayed = np.zeros((2, power.size), dtype=bool)
    for k in range(1, power.size):
        other = here[::-1] + price
        stayed[:, k] = here <= other
        here = np.minimum(here, other) + cost[:, k]
    at = int(np.argmin(here))
    value = float(here[at])
    path = np.zeros(power.size, dtype=bool)
    for k in range(power.size - 1, -1, -1):
        path[k] = bool(at)
        if k and not stayed[at, k]:
            at = 1 - at
    return value, path


def _levels(power: Array, places: NDArray[np.int64], turns: bool) -> Array:
    """Mean power of each interval between the borders `places`, at least 1e-12.

    With `turns`, all even intervals have one mean, and all odd ones another.
    """
    number = np.arange(1.0, places.size + 1.0)
    return interval_powers(power, places, 1.0 + (number % 2.0 if turns else number))


def screen_cycle(series: Series, model: Model) -> Candidate | None:
    """`Candidate` (not refitted) of a white-noise level that is higher or lower in the same part of each period; or None.

    The period comes from the H test: the sum of the powers of 1 to 6 harmonics minus 4 for each further harmonic, at its
    maximum over all frequencies. The powers are relative to those of neighboring frequencies (`_background`): a level that
    returns after about the same time, but not exactly, has no period. The p-value of the candidate is the larger of that of
    the H test, and that of the best part of the period.
    """
    from scipy.special import log_ndtr

    cells = min(PERIOD_CELLS, series.judged.size)
    power = cell_means(series.judged, cells)
    freedom = series.freedom * series.judged.size / cells
    centered = power - power.mean()
    spread = float(np.mean(centered**2))
    if spread <= 0.0:
        return None
    ratio = np.abs(np.fft.rfft(centered, 2 * cells)) ** 2 / (cells * spread)
    background = _background(ratio)
    ratio /= background
    highest = cells // HARMONICS
    places = np.arange(2 * MIN_PERIODS, highest)
    if places.size < 8:
        return None
    h = np.zeros(places.size)
    total = np.zeros(places.size)
    for m in range(1, HARMONICS + 1):
        total += 2.0 * ratio[m * places]
        h = np.maximum(h, total - 4.0 * m + 4.0)
    top = int(np.argmax(h))
    log_p = np.log(2.0 * places.size) - H_SLOPE * float(h[top])
    if log_p > np.log(FALSE_ALARM_PROBABILITY):
        return None
    gain, period, first, last = _best_gate(power, 0.5 * float(places[top]), freedom)
    if gain <= MAX_RIVAL_LOG_EVIDENCE:
        return None
    step = (series.end - series.start) / cells
    phase = (np.arange(cells) / period * PHASES - first) % PHASES
    level = cell_means(series.power, cells)
    inside = phase < last - first
    ratio_of = float(level[inside].mean() / level[~inside].mean())
    values = {
        "period": period * step,
        "start": series.start + first / PHASES * period * step,
        "share": (last - first) / PHASES,
        "factor": float(np.sqrt(series.white_ratio(ratio_of))),
    }
    effect = level_effect(model, **values)
    if effect is None:
        return None
    # The p-value of the best gate over all gates of all periods.
    gates = np.log(2.0 * places.size * PHASES * np.log2(PHASES)) + float(
        log_ndtr(-np.sqrt(2.0 * gain / background[places[top]]))
    )
    return Candidate(effect, gain, LEVELS, None, 4, min(0.0, max(log_p, gates)))


def _background(ratio: Array) -> Array:
    """Usual power at neighboring frequencies, at least 1, shape of `ratio`.

    It is the median of blocks of an eighth of the frequency, 32 to 128 values, divided by that of an exponential law.
    """
    edges = [0]
    while edges[-1] < ratio.size:
        size = edges[-1] // BACKGROUND_PARTS
        edges.append(edges[-1] + min(max(size, MIN_BACKGROUND_VALUES), MAX_BACKGROUND_VALUES))
    edges[-1] = ratio.size
    usual = [float(np.median(ratio[a:b])) for a, b in pairwise(edges)]
    return np.maximum(np.repeat(usual, np.diff(edges)) / np.log(2.0), 1.0)


def _best_gate(power: Array, cycles: float, freedom: float) -> tuple[float, float, int, int]:
    """Tuple (ΔlogL, period, first phase, end phase) of the most likely gate: part of each period with another level.

    The tried periods are `power.size` values divided by `cycles` ± 0.5; the returned one is in values of `power`. Phases
    are integers in 1/64 of a period; the end is exclusive and may exceed 64. ΔlogL is −inf if no tried period fills all
    phases.
    """
    cells = power.size
    best = (-np.inf, 0.0, 0, 0)
    for tried in cycles + np.linspace(-0.5, 0.5, REFINED_PERIODS):
        period = cells / tried
        which = ((np.arange(cells) / period) % 1.0 * PHASES).astype(np.int64)
        count = np.bincount(which, minlength=PHASES).astype(float)
        if not count.all():
            continue
        folded = np.asarray(np.bincount(which, weights=power, minlength=PHASES), dtype=np.float64)
        gain, first, last = _best_phases(folded, count, freedom)
        if gain > best[0]:
            best = (gain, period, first, last)
    return best


def refined_gate(square: Array, period: float, first: float, share: float) -> tuple[float, ...]:
    """Tuple (period, first sample, share of the period) of the most likely gate near a coarse one, from squares of samples.

    Period and first sample are in samples. Both ends of the gate are moved by up to 1/32 of a period.
    """
    n, reach = square.size, 2 * FINE_PHASES
    phases = PHASES * FINE_PHASES
    cycles, best = n / period, (-np.inf, period, first, share)
    below = np.concatenate([[0.0], np.cumsum(square)])
    # Edges from `reach` phases before to `reach` phases after the coarse ones.
    begin = np.arange(-reach, reach + 1)
    end = begin + round(share * phases)
    size = end - begin[:, None]
    usable = (size > 0) & (size < phases) & (end <= phases - reach)
    for width in (1.0 / FINE_PHASES, 1.0 / FINE_PHASES**2):
        for tried in cycles + np.linspace(-width, width, 2 * FINE_PHASES + 1):
            length = n / tried
            # Samples at both edges of all periods; the edges of the last one are after the record.
            periods = np.arange(np.floor(-first / length), np.ceil((n - first) / length) + 1.0)
            phase = periods[:, None] * phases + np.concatenate([begin, end])
            edges = np.clip(np.ceil(first + phase * (length / phases)), 0, n).astype(np.int64)
            sums, counts = (
                np.where(usable, total[begin.size :] - total[: begin.size, None], 0.0)
                for total in (below[edges].sum(axis=0), edges.sum(axis=0))
            )
            inside = np.maximum(counts, 1e-12)
            gain = delta_logl_of_two_levels(sums, inside, float(below[-1]), float(n), 1.0)
            gain[~usable | (counts < 1.0)] = -np.inf
            i, j = np.unravel_index(int(np.argmax(gain)), gain.shape)
            if gain[i, j] > best[0]:
                moved = first + (int(i) - reach) / phases * length
                best = float(gain[i, j]), length, moved, float(size[i, j]) / phases
        cycles = n / best[1]
    return best[1:]


def _best_phases(sums: Array, count: Array, freedom: float) -> tuple[float, int, int]:
    """Tuple (ΔlogL, first, end) of the part of a period, at most half of it, whose noise level differs most.

    `sums` and `count` are the sum and number of the values at each of 64 phases. `end` is exclusive and may be above 64.
    """
    twice, sizes = (np.concatenate([[0.0], np.cumsum(np.tile(x, 2))]) for x in (sums, count))
    first = np.arange(PHASES)[:, None]
    last = first + np.arange(1, PHASES // 2 + 1)[None, :]
    inside, size = twice[last] - twice[first], sizes[last] - sizes[first]
    gain = delta_logl_of_two_levels(inside, size, float(sums.sum()), float(count.sum()), freedom)
    a, b = np.unravel_index(int(np.argmax(gain)), gain.shape)
    return float(gain[a, b]), int(a), int(a + b + 1)


def screen_columns(series: Series, model: Model, columns: Mapping[str, Array]) -> list[Candidate]:
    """List of candidates, not refitted, in which the log of the noise level depends linearly on a logged column.

    Omitted are unsuitable and constant columns, and columns with a ΔlogL below 3.
    """
    from scipy.special import log_ndtr

    blanks = [blank for blank in _level_effects(model, columns) if blank.follows is not None]
    found = []
    cells = min(PERIOD_CELLS, series.judged.size)
    power = cell_means(series.judged, cells)
    freedom = series.freedom * series.judged.size / cells
    for blank in blanks:
        assert blank.follows is not None
        values = cell_means(np.asarray(columns[blank.follows], dtype=np.float64), cells)
        values = values - values.mean()
        spread = float(values.std())
        if spread <= 0.0:
            continue
        slope, gain = log_slope(power, values / spread, freedom)
        if gain < MAX_RIVAL_LOG_EVIDENCE:
            continue
        log_p = float(log_ndtr(-np.sqrt(2.0 * gain)) + np.log(2.0 * len(blanks)))
        # Other noise in the bands dilutes the slope.
        coefficient = 0.5 * slope / spread / series.share
        effect = blank.following(np.asarray(columns[blank.follows], dtype=np.float64), coefficient)
        if effect is not None:
            found.append(Candidate(effect, gain, LEVELS, None, 1, min(0.0, log_p)))
    return found


def log_slope(power: Array, values: Array, freedom: float) -> tuple[float, float]:
    """Pair (b, ΔlogL): most likely slope b of ln E(power) = a + b·values, and ΔlogL compared with b = 0.

    The `values` must have mean 0. `freedom` is the degrees of freedom of each `power`.
    """
    from scipy.optimize import minimize_scalar

    def loss(b: float) -> float:
        """Negative logL, up to a constant, if the slope is b."""
        return 0.5 * freedom * power.size * float(np.log(np.mean(power * np.exp(-b * values))))

    found = minimize_scalar(loss, bracket=(0.0, 0.1))
    return float(found.x), loss(0.0) - float(found.fun)
