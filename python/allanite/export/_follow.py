"""N and K, or N and a Gauss-Markov process, that follow the whole model over a horizon.

A filter is overconfident if its N and K leave out what the sensor has: a bias instability, a lag, a slow line. The numbers
here are the closest ones with which a bias filter is nowhere overconfident. They are compared with the model in two ways:

* NEES: the filter is aided, then it coasts; the variance of its true error over the variance which it predicts
  (`allanite.statespace.bias_filter`) is at most 1.02 from one second to the horizon, and near 1 at the horizon.
* The Allan deviation of the numbers is at most 2 % below that of the model's broad and slow noise.

A simulator has to make samples like the sensor's: its numbers follow the Allan deviation alone, from one sample on.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from allanite.effects import white_noise
from allanite.effects.gauss_markov import GaussMarkov
from allanite.export._held import Choice, lag, walk
from allanite.statespace.bias_filter import coast, mission_of, true_variance

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from allanite.effects.model import Model
    from allanite.export._axis import Axis
    from allanite.statespace.bias_filter import Errors

    Array = NDArray[np.float64]

__all__ = ["LITTLE", "Quality", "follow_lag", "follow_walk", "quality", "shared_lag", "small_walk"]

#: Shortfall of a deviation, and excess of the NEES, that is allowed: 2 %.
SLACK = 0.02
#: The fitted N and K are written unchanged if the NEES lies between this and 1 + SLACK: half of the K's usual scatter.
AS_FITTED = 0.95
#: NEES at the horizon below which short times are given up, one after another: noise that averages out within seconds
#: (quantization, vibration) would make the filter too careful at the horizon. Acceptance is 0.7; fits scatter by 0.1.
CAREFUL = 0.8
#: Weight of the horizon beside the mean over all times: the horizon is what a user names.
AT_HORIZON = 4.0
#: Only times below the horizon over this are given up. Where that is not enough (a line as slow as the horizon), the NEES
#: may reach 1 + LAST_SLACK, half of the acceptance limit.
GIVEN_UP, LAST_SLACK = 10.0, 0.1
#: A K that is not needed is as small as adds this much of the variance at the longest τ: no filter accepts 0.
LITTLE = 0.01
#: Tried ratios K/N times the horizon, and how many a decade; refined once between neighbors.
LEAST_RATIO, MOST_RATIO, PER_DECADE = 1e-3, 1e5, 5
#: Tried time constants over the horizon, and how many.
SHORTEST_LAG, LONGEST_LAG, LAGS = 0.1, 30.0, 11
#: Averaging times a decade.
TAUS_PER_DECADE = 8


@dataclass(frozen=True, slots=True)
class Quality:
    """How the numbers of a file compare with a model.

    Attributes
    ----------
    ratio, tau : float
        Allan deviation of the numbers over the model's where it is farthest from 1, and τ in s.
    nees : float
        Largest NEES of a bias filter with these numbers, from a tenth of the horizon on.
    at : float
        Seconds of coasting of `nees`.
    early : float
        Largest NEES below a tenth of the horizon, 0 where no time is tried there.
    at_horizon : float
        NEES at the horizon.
    """

    ratio: float
    tau: float
    nees: float
    at: float
    early: float
    at_horizon: float

    @property
    def log_ratio(self) -> float:
        """Logarithm of `ratio`."""
        return float(np.log(self.ratio))


@dataclass(frozen=True)
class _Target:
    """What the numbers have to follow: an axis's model and its broad and slow part, in `scale` SI units."""

    model: Model
    slow: Model
    rate: float
    horizon: float
    scale: float
    simulator: bool

    @cached_property
    def tau(self) -> Array:
        low = 1.0 / self.rate if self.simulator else mission_of(self.horizon, self.rate).step
        high = max(self.horizon, 2.0 * low)
        count = max(2, int(TAUS_PER_DECADE * np.log10(high / low)) + 2)
        return (
            np.unique(np.round(np.geomspace(low * self.rate, high * self.rate, count))) / self.rate
        )

    @cached_property
    def allan(self) -> Array:
        """Allan variance of the broad and slow noise: vibration counts in the NEES by what the filter integrates of it."""
        return np.asarray(self.scale**2 * self.slow.allan_variance(self.tau, self.rate))

    @property
    def white(self) -> float:
        """N of the model, 0 where it has none."""
        return self.scale * _value(self.model, "N")

    @property
    def lags(self) -> list[tuple[float, float]]:
        """q_c (SI) and correlation time of each Gauss-Markov process of the model."""
        return [
            (self.scale * float(e.q_c or 0.0), float(e.correlation_time or 0.0))
            for e in self.model.stochastic
            if isinstance(e, GaussMarkov) and e.q_c
        ]

    @property
    def times(self) -> list[float]:
        """Correlation times that are tried, s: a range about the horizon, and those of the model."""
        grid = self.horizon * np.geomspace(SHORTEST_LAG, LONGEST_LAG, LAGS)
        return sorted({*map(float, grid), *(T for _, T in self.lags if T > 0.0)})

    def nees(self, ratio: Array, time: Array) -> Array:
        """NEES of filters with N = 1, shape (c, t)."""
        errors = _filters(self.horizon, self.rate, tuple(ratio.tolist()), tuple(time.tolist()))
        true = true_variance(self.model, self.rate, mission_of(self.horizon, self.rate), errors)
        return np.asarray(self.scale**2 * true / errors.predicted)

    def tried(self, ratio: Array, time: Array) -> Tried:
        """Numbers of each ratio K/N and correlation time (infinite: a random walk), shape (c,), and their costs."""
        tau, fs = self.tau, self.rate
        white = white_noise(1.0).allan_variance(tau, fs)
        slow = np.empty((ratio.size, tau.size))
        for T in np.unique(time):
            one = walk(1.0) if np.isinf(T) else lag(1.0, float(T))
            slow[time == T] = one.allan_variance(tau, fs)
        shares = self.allan / (white + ratio[:, None] ** 2 * slow)
        squares = np.maximum((1.0 - SLACK) ** 2 * shares.max(axis=1), self.white**2)
        if self.simulator:
            return Tried(ratio, time, squares, _cost(shares, squares, 0.0))
        nees = self.nees(ratio, time)
        late = _late(self)
        for first, slack in (*((k, SLACK) for k in range(late + 1)), (late, LAST_SLACK)):
            used = nees[:, first:]
            enough = np.maximum(squares, used.max(axis=1) / (1.0 + slack))
            found = Tried(ratio, time, enough, _cost(used, enough, AT_HORIZON))
            if nees[found.best, -1] >= CAREFUL * enough[found.best]:
                break
        return found

    def search(self, times: Sequence[float]) -> Tried:
        """All ratios of K to N with each of some correlation times, in that order."""
        one = self.ratios
        return self.tried(np.tile(one, len(times)), np.repeat(np.asarray(times, float), one.size))

    @property
    def ratios(self) -> Array:
        """Tried ratios of K to N, 1/s."""
        count = int(PER_DECADE * np.log10(MOST_RATIO / LEAST_RATIO)) + 1
        return np.geomspace(LEAST_RATIO, MOST_RATIO, count) / self.horizon

    def refined(self, found: Tried) -> tuple[float, float, float]:
        """N, slow coefficient and correlation time: the best of the tried ones, or of those between its neighbors."""
        ratio, time = found.ratio[found.best], found.time[found.best]
        near = ratio * np.geomspace(10 ** (-1 / PER_DECADE), 10 ** (1 / PER_DECADE), 13)
        again = self.tried(near, np.full(near.size, time))
        best = min(found, again, key=lambda one: float(one.cost[one.best]))
        N = float(np.sqrt(best.square[best.best]))
        return N, N * float(best.ratio[best.best]), float(time)


@dataclass(frozen=True, eq=False)
class Tried:
    """Numbers that were tried, shape (c,): K over N, correlation time, the smallest N² that is enough, and the cost."""

    ratio: Array
    time: Array
    square: Array
    cost: Array

    @property
    def best(self) -> int:
        """Place of the smallest cost."""
        return int(np.argmin(self.cost))


def _cost(shares: Array, squares: Array, last: float) -> Array:
    """Mean squared logarithm of the shares (model over N = 1) over N², the last one with an extra weight."""
    logs = np.log(np.maximum(shares / np.maximum(squares, 1e-300)[:, None], 1e-12))
    return np.asarray((logs**2).mean(axis=1) + last * logs[:, -1] ** 2)


def follow_walk(axis: Axis, *, simulator: bool = False) -> Choice:
    """N and K that follow the model of an axis up to its horizon."""
    return _walk(_target(axis, simulator))


def follow_lag(axis: Axis, time: float | None = None, *, simulator: bool = False) -> Choice:
    """N and a Gauss-Markov process (of this correlation time, if given) that follow the model up to its horizon."""
    return _lag(_target(axis, simulator), time)


def shared_lag(axes: Sequence[Axis]) -> float:
    """The correlation time with which all axes together follow their models best, s."""
    targets = [_target(axis, simulator=False) for axis in axes]
    own = {T for target in targets for _, T in target.lags}
    if len(own) == 1 and all(target.lags for target in targets):
        return own.pop()
    times = sorted({T for target in targets for T in target.times})
    total = np.zeros(len(times))
    for target in targets:
        total += target.search(times).cost.reshape(len(times), -1).min(axis=1)
    return times[int(np.argmin(total))]


def quality(axis: Axis, choice: Choice) -> Quality:
    """Worst ratio of the Allan deviations, and NEES, of written numbers against the whole model of an axis."""
    bare = Choice(choice.N, choice.K, choice.q_c, choice.correlation_time, B=choice.B)
    return _quality(_target(axis, simulator=False), bare)


def _target(axis: Axis, simulator: bool) -> _Target:
    return _Target(
        axis.expected_steady, axis.slow, axis.sampling, axis.horizon, axis.scale, simulator
    )


def _value(model: Model, name: str) -> float:
    """Coefficient of the standard effect of this name, 0 where the model has none."""
    for effect in model.stochastic:
        if effect.standard is not None and effect.standard.name == name:
            return float(getattr(effect, effect.coefficient))
    return 0.0


@lru_cache(maxsize=8)
def _filters(
    horizon: float, rate: float, ratio: tuple[float, ...], time: tuple[float, ...]
) -> Errors:
    """Bias filters of N = 1; the same ratios are tried for every axis."""
    return coast(mission_of(horizon, rate), np.array(ratio), np.array(time))


@lru_cache(maxsize=64)
def _walk(target: _Target) -> Choice:
    fitted = target.scale * _value(target.model, "K")
    plain = _unchanged(target, fitted)
    if plain is not None:
        return plain
    N, K, _ = target.refined(target.search([np.inf]))
    return Choice(N, K, remarks=_remarks(target, N, "K", K, fitted))


@lru_cache(maxsize=64)
def _lag(target: _Target, time: float | None) -> Choice:
    own = target.lags
    if len(own) == 1 and time in (None, own[0][1]) and target.white > 0.0:
        choice = Choice(target.white, 0.0, *own[0])
        if _is_consistent(target, choice):
            return choice
    N, q_c, T = target.refined(target.search(target.times if time is None else [time]))
    return Choice(N, 0.0, q_c, T, remarks=_remarks(target, N, "lag", q_c, 0.0))


def small_walk(N: float, axis: Axis) -> float:
    """K that adds `LITTLE` to the Allan variance of N at the horizon."""
    return _small(N, axis.horizon, axis.sampling)


def _small(N: float, horizon: float, rate: float) -> float:
    last = np.array([max(horizon, 1.0 / rate)])
    white, unit = (e.allan_variance(last, rate)[0] for e in (white_noise(N), walk(1.0)))
    return float(np.sqrt(LITTLE * white / unit))


def _unchanged(target: _Target, K: float) -> Choice | None:
    """The fitted N and K if a filter with them is consistent: nothing else in the model matters to it."""
    N = target.white
    if not N > 0.0:
        return None
    little = _small(N, target.horizon, target.rate)
    choice = Choice(N, max(K, little))
    if not _is_consistent(target, choice):
        return None
    if little <= K:
        return choice
    last = target.horizon
    words = f"the model needs none: this adds {LITTLE:.0%} to the Allan variance at {last:.3g} s"
    return Choice(N, little, remarks=(("K", words),))


def _is_consistent(target: _Target, choice: Choice) -> bool:
    """Whether a filter with these numbers is, or whether they simulate the Allan variance of the model."""
    if target.simulator:
        shares = target.allan / choice.model.allan_variance(target.tau, target.rate)
        return bool(shares.max() <= (1.0 - SLACK) ** -2 and shares.min() >= AS_FITTED)
    nees = _nees_of(target, choice)
    return bool(nees.max() <= 1.0 + SLACK and nees.min() >= AS_FITTED)


def _nees_of(target: _Target, choice: Choice) -> Array:
    """NEES at each coasting time of a filter with these numbers."""
    ratio = np.array([(choice.q_c or choice.K) / choice.N])
    time = np.array([choice.correlation_time or np.inf])
    return target.nees(ratio, time)[0] / choice.N**2


def _remarks(
    target: _Target, N: float, name: str, value: float, fitted: float
) -> tuple[tuple[str, str], ...]:
    """What is said of N and of the slow coefficient: how far they are from the fitted ones."""
    last = f"{target.horizon:.4g} s"
    words = {}
    if not target.white > 0.0:
        words["N"] = f"the model has no white noise: with the bias, covers the model up to {last}"
    elif N / target.white > 1.005:
        words["N"] = f"{N / target.white:.3g} times the fitted N, to cover the model up to {last}"
    if fitted > 0.0:
        words[name] = f"{value / fitted:.3g} times the fitted K, to cover the model up to {last}"
    else:
        words[name] = f"with N, covers the slow noise of the model up to {last}"
    return tuple(words.items())


@lru_cache(maxsize=256)
def _quality(target: _Target, choice: Choice) -> Quality:
    tau, fs = target.tau, target.rate
    written = choice.model.allan_variance(tau, fs)
    whole = target.scale**2 * target.model.allan_variance(tau, fs)
    logs = 0.5 * np.log(np.maximum(written, 1e-300) / np.maximum(whole, 1e-300))
    worst = int(np.argmax(np.abs(logs)))
    nees = _nees_of(target, choice)
    times = mission_of(target.horizon, fs).times
    late = _late(target)
    most = late + int(np.argmax(nees[late:]))
    return Quality(
        ratio=float(np.exp(logs[worst])),
        tau=float(tau[worst]),
        nees=float(nees[most]),
        at=float(times[most]),
        early=float(nees[:late].max(initial=0.0)),
        at_horizon=float(nees[-1]),
    )


def _late(target: _Target) -> int:
    """Number of coasting times below a tenth of the horizon."""
    times = mission_of(target.horizon, target.rate).times
    return int(np.count_nonzero(times < target.horizon / GIVEN_UP))
