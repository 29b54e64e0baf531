"""Consistency of a bias filter whose noise model differs from the true noise of its sensor.

The filter integrates a sensor (an angle from a rate, a velocity from an acceleration) and estimates the sensor's bias. Its
model of the sensor is white noise N and a bias, either a random walk K or a Gauss-Markov process. Fixes of the integral
aid the filter at fixed intervals; then it coasts. Every estimate is a weighted sum of samples, so that the variance of the
true error follows exactly from the variogram of the true noise. NEES, the normalized estimation error squared, is this
variance divided by the variance that the filter predicts: 1 is consistent, above 1 is overconfident.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.common.arrays import Array
from allanite.common.errors import InputError
from allanite.effects import Deterministic, Model
from allanite.effects.terms import Exponential, Term
from allanite.statespace.growth import MAX_SAMPLES, variogram_of

#: Minimum duration of aiding before coasting, s. Aiding also lasts at least three times the horizon.
MIN_AIDING = 300.0
#: Minimum and maximum number of steps of the longest coasting. A step, the time between two fixes, is 1 s within them.
MIN_STEPS, MAX_STEPS = 10, 200
#: Maximum number of steps of aiding; limits the computing time for a short horizon.
MAX_AIDED_STEPS = 1000
#: Coasting times per decade at which the error is compared.
PER_DECADE = 5
#: Variance of a random-walk bias before aiding, divided by N², 1/s: large, because nothing is known.
UNKNOWN_BIAS_VARIANCE = 1e6
#: Length of the segment before aiding whose mean is the bias that a forgetful filter falls back to, in horizons. The white
#: noise of that mean adds 1/30 to the variance; a longer segment would add the walk since its beginning.
LEVEL_HORIZONS = 30
#: Maximum number of samples of the variogram (32 MB); the segment before aiding is shortened to fit.
MAX_VARIOGRAM_SAMPLES = 2**22


@dataclass(frozen=True, eq=False)
class Mission:
    """Aiding with a fix every `step` seconds for `aided` steps, then coasting.

    The error is compared after the numbers of steps in `coasting`, shape (t,); the last one is the horizon.
    """

    step: float
    aided: int
    coasting: NDArray[np.int64]

    @property
    def times(self) -> Array:
        """Times of coasting after which the error is compared, s, shape (t,)."""
        return np.asarray(self.coasting * self.step)

    @property
    def steps(self) -> int:
        """Number of steps of the mission: those of aiding plus those of the longest coasting."""
        return self.aided + int(self.coasting[-1])


@dataclass(frozen=True, eq=False)
class Errors:
    """Error of the integral after coasting, for c filters and t coasting times; N of each filter is 1.

    `weights`, shape (c, t, steps), multiply the sensor's integral over each step. `predicted`, shape (c, t), is the
    variance that the filter predicts.
    """

    weights: Array
    predicted: Array


@lru_cache(maxsize=64)
def mission_of(horizon: float, rate: float) -> Mission:
    """`Mission` (aiding, then coasting) whose longest coasting is `horizon` seconds, at `rate` Hz.

    The step is a whole number of samples, so that at low rates the horizon has fewer steps than `MIN_STEPS`. Aiding
    lasts 300 s or three horizons, the longer of both, but at most 1000 steps.
    """
    step = float(np.clip(1.0, horizon / MAX_STEPS, horizon / MIN_STEPS))
    step = max(1, round(step * rate)) / rate
    last = max(1, round(horizon / step))
    count = max(2, int(PER_DECADE * np.log10(last)) + 2)
    coasting = np.unique(np.round(np.geomspace(1, last, count)).astype(np.int64))
    aided = min(MAX_AIDED_STEPS, round(max(MIN_AIDING, 3.0 * horizon) / step))
    return Mission(step, max(1, aided), coasting)


def bias_filter_errors(mission: Mission, walk: ArrayLike, correlation_time: ArrayLike) -> Errors:
    """`Errors` of c Kalman filters that estimate integral and bias from exact fixes of the integral, and then coast.

    `walk` is K/N of a random walk or q_c/N of a Gauss-Markov bias, 1/s. `correlation_time` is in s, infinite for a random
    walk. The white noise of each filter's model is N = 1.
    """
    q, T = np.broadcast_arrays(np.atleast_1d(np.asarray(walk, float)), correlation_time)
    F, Q, start = _bias_model(q, np.asarray(T, float), mission.step)
    gains, P = _aided_gains(F, Q, start, mission.aided)
    size, last = q.size, int(mission.coasting[-1])
    rows = np.zeros((size, mission.coasting.size, 2))
    predicted = np.zeros(rows.shape[:2])
    weights = np.zeros((*rows.shape[:2], mission.steps))
    whole = np.broadcast_to(np.eye(2), F.shape)
    for k in range(1, last + 1):
        whole = F @ whole
        P = F @ P @ F.swapaxes(1, 2) + Q
        for place in np.flatnonzero(mission.coasting == k):
            predicted[:, place] = P[:, 0, 0]
            rows[:, place] = whole[:, 0]
            weights[:, place, mission.aided : mission.aided + k] = 1.0
    # Back from the last fix: a row of the error's transition, through each update and each step.
    for k in range(mission.aided - 1, -1, -1):
        rows[:, :, 0] -= (rows * gains[k][:, None, :]).sum(axis=2)
        weights[:, :, k] = rows[:, :, 0]
        rows = rows @ F
    return Errors(weights, predicted)


def _bias_model(q: Array, T: Array, step: float) -> tuple[Array, Array, Array]:
    """Tuple (F, Q, P₀) of the states (integral, bias), each (c, 2, 2): transition, noise of a step, first covariance.

    `q` is K/N or q_c/N, 1/s, and `T` the correlation time, s, infinite for a random walk; both have shape (c,).
    """
    x = step / T
    # Integrals of exponentials; for nearly constant ones the first terms of their series.
    small = x < 1e-3
    safe = np.where(small, 1.0, x)
    phi = np.exp(-x)
    lever = step * np.where(small, 1 - x / 2 + x**2 / 6, -np.expm1(-safe) / safe)
    bias = step * np.where(small, 1 - x + 2 * x**2 / 3, -np.expm1(-2 * safe) / (2 * safe))
    both = 0.5 * lever**2
    integral = np.where(
        small,
        step**3 / 3 * (1 - 0.75 * x),
        (step - 2 * lever + bias) * (step / safe) ** 2,
    )
    zero, one = np.zeros_like(x), np.ones_like(x)
    F = np.array([[one, -lever], [zero, phi]]).transpose(2, 0, 1)
    Q = np.array([[q**2 * integral + step, -(q**2) * both], [-(q**2) * both, q**2 * bias]])
    start = np.zeros_like(F)
    lasting = np.isinf(T)
    start[:, 1, 1] = np.where(
        lasting, UNKNOWN_BIAS_VARIANCE * (1.0 + 1e3 * q**2), 0.5 * q**2 * np.where(lasting, 1.0, T)
    )
    return F, Q.transpose(2, 0, 1), start


def _aided_gains(F: Array, Q: Array, P: Array, count: int) -> tuple[Array, Array]:
    """Tuple (Kalman gains at each of `count` fixes, shape (count, c, 2), covariance after the last, shape (c, 2, 2)).

    The states are (integral, bias). A fix measures the integral without error, after each step. `P` is the first
    covariance.
    """
    gains = np.zeros((count, len(F), 2))
    for k in range(count):
        P = F @ P @ F.swapaxes(1, 2) + Q
        gains[k] = P[:, :, 0] / P[:, 0, :1]
        P = P - gains[k][:, :, None] * P[:, None, 0, :]
        # After an exact fix the variance of the integral is 0, which rounding would make negative.
        P[:, 0, 0] = 0.0
        P[:, 0, 1] = P[:, 1, 0]
    return gains, P


def true_variance(model: Model, rate: float, mission: Mission, errors: Errors) -> Array:
    """True variance of the integral's error after each coasting time of c filters, U² s², shape (c, coasting times).

    The fixes have no error. Lines have a random phase, a ramp counts with its square. Steps, warm-ups and effects of a
    logged column are left out, because the filter is expected to subtract them. The bias of a Gauss-Markov filter decays to
    the mean of the noise. Noise without a mean, such as a walk, counts relative to its mean over up to 30 horizons before
    aiding. `InputError` for a mission of more than 2²⁴ samples.
    """
    m = round(mission.step * rate)
    if mission.steps * m > MAX_SAMPLES:
        raise InputError(
            f"a horizon of {mission.times[-1]:g} s at {rate:g} Hz needs more than {MAX_SAMPLES} samples:"
            " give a shorter horizon"
        )
    terms = (*model.terms(rate), *_line_terms(model, rate))
    flat = errors.weights.reshape(-1, mission.steps)
    loose = flat.sum(axis=1)
    forgets = bool(np.abs(loose).max() > 1e-6 * np.abs(flat).max())
    has_mean = all(term.power is not None for term in terms)
    before = 0
    if forgets and not has_mean:
        most = max(MAX_VARIOGRAM_SAMPLES // m - mission.steps, int(mission.coasting[-1]))
        before = min(most, round(LEVEL_HORIZONS * mission.coasting[-1]))
    gamma, left_out = _step_variogram(terms, rate, m, mission.steps + before)
    places = np.arange(mission.steps)
    lags = np.abs(np.subtract.outer(places, places))
    found = -((flat @ gamma[lags]) * flat).sum(axis=1)
    if before:
        share = -loose / before
        summed = np.cumulative_sum(gamma, include_initial=True)
        across = summed[places + before + 1] - summed[places + 1]
        h = np.arange(1, before)
        within = before * gamma[0] + 2.0 * float((before - h) @ gamma[1:before])
        found -= 2.0 * share * (flat @ across) + share**2 * within
    elif forgets:
        power = sum(term.power or 0.0 for term in terms)
        found += loose**2 * (power - left_out) * mission.step**2
    for effect in model.deterministic:
        if not effect.periodic and effect.own_allan_variance(np.ones(1), rate)[0] > 0.0:
            found += _signal_error(effect, rate, mission, flat) ** 2
    return np.asarray(np.maximum(found, 0.0).reshape(errors.predicted.shape))


def _signal_error(effect: Deterministic, rate: float, mission: Mission, weights: Array) -> Array:
    """Array, shape (rows,): `weights`, shape (rows, steps), times the integral of a known function over each step, U s."""
    m = round(mission.step * rate)
    signal = effect.signal(np.arange(m * mission.steps) / rate, {})
    return np.asarray(weights @ (signal.reshape(-1, m).sum(axis=1) / rate))


@lru_cache(maxsize=64)
def _step_variogram(
    terms: tuple[Term, ...], rate: float, m: int, count: int
) -> tuple[Array, float]:
    """Tuple (v, c) for the variance of weighted sums of the noise: v in U² s², shape (count,), and c in U². Cached.

    u(k) is the integral of the noise over step k, which has m samples. If Σ w(k) = 0, the sum Σ w(k) u(k) has the variance
    −Σ w(k) w(l) v(|k − l|). c is the variogram of the samples, ½ E(x(k+h) − x(k))², at the longest lag. v(h) is the sum of
    variogram − c over all pairs of samples of two steps that are h apart, divided by rate².
    """
    g = variogram_of(terms, m * (count + 1))
    # Weights with the sum 0 ignore a constant; without the constant, little cancels.
    last = float(g[-1])
    g -= last
    # The second difference of `total` is g, an even function.
    total = np.cumulative_sum(np.cumsum(g), include_initial=True)
    total -= 0.5 * g[0] * np.arange(g.size + 1)
    h = m * np.arange(count)
    return (total[h + m] - 2.0 * total[h] + total[np.abs(h - m)]) / rate**2, last


def _line_terms(model: Model, rate: float) -> list[Term]:
    """List of `Term`, one `Exponential` with |φ| = 1 per spectral line of a model: a sinusoid of random phase."""
    return [
        Exponential(0.5 * amplitude**2, complex(np.exp(2j * np.pi * multiple * (e.base_frequency or 0.0) / rate)))
        for e in model.deterministic
        for multiple, amplitude, _ in e.lines
    ]  # fmt: skip
