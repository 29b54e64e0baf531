"""N and K, or N and a Gauss-Markov process, that follow the whole model over a horizon.

A filter is overconfident if its N and K ignore other effects of the sensor. The numbers here are the closest to the
model with which a bias filter is not overconfident. Two comparisons decide:

* NEES: the filter is aided, then it coasts without aiding. The true variance of its error divided by the predicted
  variance (`allanite.statespace.bias_filter`) is at most 1.02 from 1 s to the horizon, and close to 1 at the horizon.
* The Allan deviation of the numbers is at most 2 % below the Allan deviation of the model's broad and slow noise.

The numbers for a simulator only follow the Allan deviation, from one sample on, because a simulator generates samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from allanite.common.arrays import Array
from allanite.common.numbers import percent_text
from allanite.effects import Model, white_noise
from allanite.exports._axis import Axis
from allanite.exports._held import NoiseParameters, gauss_markov_effect, random_walk_effect
from allanite.statespace.bias_filter import Errors, bias_filter_errors, mission_of, true_variance

#: Allowed relative shortfall of the Allan deviation, and allowed excess of the NEES over 1.
SLACK = 0.02
#: Minimum NEES with which the fitted N and K are written unchanged; the maximum is 1 + SLACK. The difference to 1 is half
#: of the usual scatter of K.
MIN_UNCHANGED_NEES = 0.95
#: Minimum NEES at the horizon, relative to the allowed one. Below, the shortest coasting times are ignored one after
#: another: noise that averages out within seconds (quantization, vibration) would make the filter too conservative at the
#: horizon. The acceptance limit is 0.7, and fits scatter by 0.1.
MIN_NEES_AT_HORIZON = 0.8
#: Weight of the horizon in the cost, relative to the mean over all times, because the user names the horizon. Chosen by
#: judgment; not measured.
HORIZON_WEIGHT = 4.0
#: Only coasting times below the horizon divided by this number may be ignored. If that is not enough (a line with a period
#: as long as the horizon), the NEES may reach 1 + LAST_SLACK, half of the way to the acceptance limit 1.2.
IGNORABLE_FRACTION, LAST_SLACK = 10.0, 0.1
#: Fraction of the Allan variance at the horizon that a K adds if no K is needed, because many filters need K > 0.
SMALL_WALK_SHARE = 0.01
#: Range of the tried ratios K/N times the horizon, and number of ratios per decade. The best one is refined once.
MIN_RATIO, MAX_RATIO, RATIOS_PER_DECADE = 1e-3, 1e5, 5
#: Range of the tried correlation times divided by the horizon, and their number.
MIN_LAG, MAX_LAG, LAG_COUNT = 0.1, 30.0, 11
#: Number of averaging times per decade.
TAUS_PER_DECADE = 8
#: Explanation of the value of a coefficient that was not detected, for remarks.
EXPECTED_SIZE = "its expected size (0.64 of its 95 % limit)"


@dataclass(frozen=True, slots=True)
class Quality:
    """Comparison of the numbers of a file with a model.

    `ratio` is the Allan deviation of the numbers over that of the model at the `tau` (s) where it is farthest from 1.
    `nees` is the largest NEES of a bias filter with these numbers from a tenth of the horizon on, after coasting for
    `at` s; `early` is the largest one before (0 if no time is tried there).
    """

    ratio: float
    tau: float
    nees: float
    at: float
    early: float
    at_horizon: float


@dataclass(frozen=True)
class FollowedModel:
    """Model of an axis that the numbers of a file must follow, in units of `scale` SI units, and its white and slow part.

    `rate` is in Hz, `horizon` (longest time without aiding) in s. `undetected` names the standard coefficients that
    were not detected and have their expected size.
    """

    model: Model
    slow: Model
    rate: float
    horizon: float
    scale: float
    simulator: bool
    undetected: tuple[str, ...]

    @cached_property
    def tau(self) -> Array:
        """Averaging times at which the Allan deviations are compared, s, ascending, each a whole number of samples.

        They begin at one sample for a simulator, and at one interval between fixes for a filter.
        """
        low = 1.0 / self.rate if self.simulator else mission_of(self.horizon, self.rate).step
        high = max(self.horizon, 2.0 * low)
        count = max(2, int(TAUS_PER_DECADE * np.log10(high / low)) + 2)
        return (
            np.unique(np.round(np.geomspace(low * self.rate, high * self.rate, count))) / self.rate
        )

    @cached_property
    def allan(self) -> Array:
        """Allan variance (SI) of the white and slow noise without narrow bands at the averaging times `tau`."""
        return np.asarray(self.scale**2 * self.slow.allan_variance(self.tau, self.rate))

    @property
    def white(self) -> float:
        """White-noise coefficient N of the model (SI), or 0 if the model has no white noise."""
        return self.scale * _coefficient_of(self.model, "N")

    @property
    def gauss_markov_values(self) -> list[tuple[float, float]]:
        """List of pairs (q_c in SI, correlation time in s), one per Gauss-Markov process of the model."""
        return [
            (self.scale * e.gauss_markov[0], e.gauss_markov[1])
            for e in self.model.stochastic
            if e.gauss_markov is not None
        ]

    @property
    def times(self) -> list[float]:
        """Sorted list of correlation times to try, s: 11 from 0.1 to 30 times the horizon, and those of the model."""
        grid = self.horizon * np.geomspace(MIN_LAG, MAX_LAG, LAG_COUNT)
        return sorted({*map(float, grid), *(T for _, T in self.gauss_markov_values)})

    def nees(self, ratio: Array, time: Array) -> Array:
        """Normalized estimation error squared (NEES), true over predicted error variance, shape (filters, coasting times).

        The filters have N = 1 in SI units; each has a ratio K/N in 1/s and a correlation time in s, infinite for a
        random walk.
        """
        errors = _filter_errors(
            self.horizon, self.rate, tuple(ratio.tolist()), tuple(time.tolist())
        )
        true = true_variance(self.model, self.rate, mission_of(self.horizon, self.rate), errors)
        return np.asarray(self.scale**2 * true / errors.predicted)

    def candidates_of(self, ratio: Array, time: Array) -> Candidates:
        """`Candidates`: filters with these ratios K/N (1/s) and correlation times (s); each has the smallest sufficient N².

        N is at least that of the model, and the Allan variance at most 4 % below that of the model. For a filter, N²
        must also cover the variance of the error after coasting. If the best filter is then too pessimistic at the
        horizon, the shortest coasting times are left out, one by one.
        """
        tau, fs = self.tau, self.rate
        white = white_noise(1.0).allan_variance(tau, fs)
        slow = np.empty((ratio.size, tau.size))
        for T in np.unique(time):
            one = random_walk_effect(1.0) if np.isinf(T) else gauss_markov_effect(1.0, float(T))
            slow[time == T] = one.allan_variance(tau, fs)
        shares = self.allan / (white + ratio[:, None] ** 2 * slow)
        squares = np.maximum((1.0 - SLACK) ** 2 * shares.max(axis=1), self.white**2)
        if self.simulator:
            return Candidates(ratio, time, squares, _costs_of(shares, squares, 0.0))
        nees = self.nees(ratio, time)
        late = _count_short_times(self)
        for first, slack in (*((k, SLACK) for k in range(late + 1)), (late, LAST_SLACK)):
            used = nees[:, first:]
            enough = np.maximum(squares, used.max(axis=1) / (1.0 + slack))
            found = Candidates(ratio, time, enough, _costs_of(used, enough, HORIZON_WEIGHT))
            if nees[found.best, -1] >= MIN_NEES_AT_HORIZON * enough[found.best]:
                break
        return found

    def candidates_on_grid(self, times: Sequence[float]) -> Candidates:
        """`Candidates`: each ratio K/N of a logarithmic grid with each correlation time (s); sorted by time, then ratio."""
        count = int(RATIOS_PER_DECADE * np.log10(MAX_RATIO / MIN_RATIO)) + 1
        ratios = np.geomspace(MIN_RATIO, MAX_RATIO, count) / self.horizon
        every_time = np.repeat(np.asarray(times, float), ratios.size)
        return self.candidates_of(np.tile(ratios, len(times)), every_time)

    def refine_best(self, found: Candidates) -> tuple[float, float, float]:
        """Tuple (N, K or q_c, correlation time in s) in SI of the best of `found` and of 13 ratios K/N close to it."""
        ratio, time = found.ratio[found.best], found.time[found.best]
        step = 1 / RATIOS_PER_DECADE
        near = ratio * np.geomspace(10**-step, 10**step, 13)
        again = self.candidates_of(near, np.full(near.size, time))
        best = min(found, again, key=lambda one: float(one.cost[one.best]))
        N = float(np.sqrt(best.square[best.best]))
        return N, N * float(best.ratio[best.best]), float(time)


@dataclass(frozen=True, eq=False)
class Candidates:
    """Candidates for a file, arrays of shape (c,): K/N in 1/s, correlation time in s, smallest sufficient N², and cost."""

    ratio: Array
    time: Array
    square: Array
    cost: Array

    @property
    def best(self) -> int:
        """Index of the candidate (filter with a ratio K/N and a correlation time) with the smallest cost."""
        return int(np.argmin(self.cost))


def _costs_of(shares: Array, squares: Array, last_weight: float) -> Array:
    """Costs of candidates, shape (candidates,); small if the candidate predicts the noise of the model well.

    A share, shape (candidates, times), is a variance of the model over that of a candidate with N = 1; `squares` holds
    N². The cost is the mean of ln²(share/N²) over time, plus `last_weight` times ln²(share/N²) at the last time.
    """
    logs = np.log(np.maximum(shares / np.maximum(squares, 1e-300)[:, None], 1e-12))
    return np.asarray((logs**2).mean(axis=1) + last_weight * logs[:, -1] ** 2)


def shared_correlation_time(axes: Sequence[Axis]) -> float:
    """Correlation time in s for a file format that has only one time for all axes.

    It is that of the models, if all have the same. Otherwise it has the smallest sum over the axes of the cost of the
    best candidate.
    """
    targets = [followed_model(axis) for axis in axes]
    own = {T for target in targets for _, T in target.gauss_markov_values}
    if len(own) == 1 and all(target.gauss_markov_values for target in targets):
        return own.pop()
    times = sorted({T for target in targets for T in target.times})
    total = np.zeros(len(times))
    for target in targets:
        total += target.candidates_on_grid(times).cost.reshape(len(times), -1).min(axis=1)
    return times[int(np.argmin(total))]


def quality(axis: Axis, choice: NoiseParameters) -> Quality:
    """`Quality` of a filter with the parameters `choice`, compared with the whole model of an axis."""
    bare = NoiseParameters(choice.N, choice.K, choice.q_c, choice.correlation_time, B=choice.B)
    return _quality(followed_model(axis), bare)


def followed_model(axis: Axis, *, simulator: bool = False) -> FollowedModel:
    """`FollowedModel` of an axis for a filter, or for a `simulator`.

    A coefficient that was not detected is 0.64 times its upper limit in its models.
    """
    return FollowedModel(
        axis.expected_model,
        axis.slow_model,
        axis.sampling,
        axis.horizon,
        axis.scale,
        simulator,
        tuple(name for name, found in axis.coefficients.items() if not found.detected),
    )


def _coefficient_of(model: Model, name: str) -> float:
    """Coefficient of the noise with the standard letter `name` (Q, N, B, K or R), in the unit of the model; else 0."""
    for effect in model.stochastic:
        if effect.standard is not None and effect.standard.name == name:
            return float(getattr(effect, effect.coefficient))
    return 0.0


@lru_cache(maxsize=8)
def _filter_errors(
    horizon: float, rate: float, ratio: tuple[float, ...], time: tuple[float, ...]
) -> Errors:
    """`Errors` after coasting of bias filters with N = 1, ratios K/N (1/s) and correlation times (s); axes share them."""
    return bias_filter_errors(mission_of(horizon, rate), np.array(ratio), np.array(time))


@lru_cache(maxsize=64)
def follow_walk(target: FollowedModel) -> NoiseParameters:
    """`NoiseParameters` with an N and K with which a filter (or simulator) follows the model.

    They are the fitted N and K if `_is_consistent` accepts them, otherwise those of the best ratio K/N.
    """
    fitted = target.scale * _coefficient_of(target.model, "K")
    plain = _fitted_walk(target, fitted)
    if plain is not None:
        return plain
    N, K, _ = target.refine_best(target.candidates_on_grid([np.inf]))
    return NoiseParameters(N, K, remarks=_remarks_on_numbers(target, N, "K", K, fitted))


@lru_cache(maxsize=64)
def follow_gauss_markov(target: FollowedModel, time: float | None) -> NoiseParameters:
    """`NoiseParameters` with an N and a Gauss-Markov process with which a filter (or simulator) follows the model.

    They are the fitted ones if the model has exactly one such process and `_is_consistent` accepts them. Otherwise they
    are those of the best ratio and correlation time. A given `time` (s) fixes the correlation time.
    """
    own = target.gauss_markov_values
    if len(own) == 1 and time in (None, own[0][1]) and target.white > 0.0:
        choice = NoiseParameters(target.white, 0.0, *own[0])
        if _is_consistent(target, choice):
            return choice
    N, q_c, T = target.refine_best(
        target.candidates_on_grid(target.times if time is None else [time])
    )
    return NoiseParameters(N, 0.0, q_c, T, remarks=_remarks_on_numbers(target, N, "lag", q_c, 0.0))


def negligible_walk(N: float, horizon: float, rate: float) -> float:
    """Coefficient K of a random walk that adds 1 % to the Allan variance of white noise `N` at the horizon (s)."""
    last = np.array([max(horizon, 1.0 / rate)])
    white, unit = (
        e.allan_variance(last, rate)[0] for e in (white_noise(N), random_walk_effect(1.0))
    )
    return float(np.sqrt(SMALL_WALK_SHARE * white / unit))


def _fitted_walk(target: FollowedModel, K: float) -> NoiseParameters | None:
    """`NoiseParameters` with the fitted N and `K`; None if `_is_consistent` refuses them or the model has no white noise.

    K is at least `negligible_walk`, because filters need a positive K.
    """
    N = target.white
    if not N > 0.0:
        return None
    little = negligible_walk(N, target.horizon, target.rate)
    choice = NoiseParameters(N, max(K, little))
    if not _is_consistent(target, choice):
        return None
    if little <= K:
        words = f"K was not detected: {EXPECTED_SIZE}"
        return replace(choice, remarks=(("K", words),)) if "K" in target.undetected else choice
    last = target.horizon
    words = f"the model needs none: this K adds {percent_text(SMALL_WALK_SHARE)} to the Allan variance at {last:.3g} s"
    return NoiseParameters(N, little, remarks=(("K", words),))


def _is_consistent(target: FollowedModel, choice: NoiseParameters) -> bool:
    """True if a filter with these parameters predicts the variance of its error well at all times.

    The NEES must lie in [0.95, 1.02]. For a simulator, the model's Allan variance over that of the parameters must lie
    in [0.95, 1.04] at all τ instead.
    """
    if target.simulator:
        shares = target.allan / choice.model.allan_variance(target.tau, target.rate)
        return bool(shares.max() <= (1.0 - SLACK) ** -2 and shares.min() >= MIN_UNCHANGED_NEES)
    nees = _nees_of(target, choice)
    return bool(nees.max() <= 1.0 + SLACK and nees.min() >= MIN_UNCHANGED_NEES)


def _nees_of(target: FollowedModel, choice: NoiseParameters) -> Array:
    """NEES (true over predicted error variance) of a filter with these parameters, shape (coasting times,)."""
    ratio = np.array([(choice.q_c or choice.K) / choice.N])
    time = np.array([choice.correlation_time or np.inf])
    return target.nees(ratio, time)[0] / choice.N**2


def _remarks_on_numbers(
    target: FollowedModel, N: float, name: str, value: float, fitted: float
) -> tuple[tuple[str, str], ...]:
    """Pairs (name, remark) that compare the written N and slow coefficient `name` with the fitted ones."""
    last = f"{target.horizon:.4g} s"
    words = {}
    if not target.white > 0.0:
        words["N"] = (
            f"the model has no white noise: N and the bias together cover the model up to {last}"
        )
    elif N / target.white > 1.005:
        words["N"] = (
            f"{_ratio_text(target, 'N', N / target.white)}, to cover the model up to {last}"
        )
    if fitted > 0.0:
        words[name] = f"{_ratio_text(target, 'K', value / fitted)}, to cover the model up to {last}"
    else:
        words[name] = f"together with N, covers the slow noise of the model up to {last}"
    return tuple(words.items())


def _ratio_text(target: FollowedModel, name: str, ratio: float) -> str:
    """Text that compares a written number with the fitted coefficient `name`: ``2.1 times the fitted K``.

    If the coefficient was not detected, `ratio` refers to its expected size.
    """
    if name in target.undetected:
        return f"{name} was not detected: {ratio:.3g} times {EXPECTED_SIZE}"
    return f"the fitted {name}" if f"{ratio:.3g}" == "1" else f"{ratio:.3g} times the fitted {name}"


@lru_cache(maxsize=256)
def _quality(target: FollowedModel, choice: NoiseParameters) -> Quality:
    """`Quality` of the written parameters `choice` compared with the whole model, not only its white and slow part."""
    tau, fs = target.tau, target.rate
    written = choice.model.allan_variance(tau, fs)
    whole = target.scale**2 * target.model.allan_variance(tau, fs)
    logs = 0.5 * np.log(np.maximum(written, 1e-300) / np.maximum(whole, 1e-300))
    worst = int(np.argmax(np.abs(logs)))
    nees = _nees_of(target, choice)
    times = mission_of(target.horizon, fs).times
    late = _count_short_times(target)
    most = late + int(np.argmax(nees[late:]))
    return Quality(
        ratio=float(np.exp(logs[worst])),
        tau=float(tau[worst]),
        nees=float(nees[most]),
        at=float(times[most]),
        early=float(nees[:late].max(initial=0.0)),
        at_horizon=float(nees[-1]),
    )


def _count_short_times(target: FollowedModel) -> int:
    """Number of the compared coasting times that are shorter than a tenth of the horizon."""
    times = mission_of(target.horizon, target.rate).times
    return int(np.count_nonzero(times < target.horizon / IGNORABLE_FRACTION))
