"""Bias step: the bias jumps once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.effects._declared import Array, Columns, texts_for_clocks
from allanite.effects._event import HEIGHT, TIME, Event, step_ordinates
from allanite.effects.excursion import Excursion
from allanite.effects.transient import Transient
from allanite.effects.transition import Transition

#: Minimum squared norm of the difference of two steps, relative to that of the largest step. Smaller differences are
#: rounding errors.
MIN_RELATIVE_NORM = 1e-9
#: Number of times from which begin and end of a transition are taken; both are optimized later. Chosen by judgment; not
#: measured.
TRANSITION_TIMES = 512


@dataclass(frozen=True)
class BiasStep(Event):
    """x(t) = h for t ≥ t0, 0 before.

    Examples
    --------
    >>> step = al.effects.BiasStep(time=50.0, height=0.2)
    >>> x = (al.AngleRandomWalk(N=0.01) + step).simulate(duration=100, rate=10, seed=1).samples
    >>> print((x[500:].mean() - x[:500].mean()).round(1))
    0.2
    """

    time: float | None = None
    height: float | None = None

    kind = "bias_step"
    short = "STEP"
    catalog_place = 24
    common = True
    title = "bias step"
    titles: ClassVar[dict[str, str]] = {"fractional frequency": "frequency step"}
    family = "step"
    lasting = True
    interval = ("time", "time")
    parameters = (TIME, HEIGHT)
    physics = "something was touched, switched or relaxed: a shock, a supply, a range change, a settling bond"
    looks_like = "two levels of the low-passed samples, one after the other; a hump at long τ"
    check_by = "look at the samples and at the laboratory's log at that time; repeat the record"
    texts = texts_for_clocks(
        physics="the frequency jumped: a resonator relaxed, a supply was switched, or the reference changed"
    )
    rivals = (
        "excursion",
        "transient",
        "transition",
        "rate_random_walk",
        "rate_ramp",
        "warm_up",
        "burst_noise",
        "gauss_markov",
    )

    def extended(self) -> tuple[Event, ...]:
        """One `Transient`, a jump at the time of the step that decays back to 0; empty without a time.

        The height and the time constant of the transient have no values.
        """
        return () if self.time is None else (Transient(time=self.time),)

    @classmethod
    def best_spans(
        cls, residual: Array, root: Array, basis: Array, n: int, rate: float
    ) -> tuple[tuple[Event, float], ...]:
        """(effect, angle) of the best excursion (two opposite steps) and of the best transition (a ramp to a new level)."""
        return (
            best_excursion(residual, root, basis, n, rate),
            best_transition(residual, root, basis, n, rate),
        )

    def shape_error(self, name: str, variance: float, duration: float) -> float:
        """Standard error 5.6 S/height² of the time of the step, s.

        The density S of the noise follows from the `variance` S·T/(t(T − t)) of the height. The time t counts as at
        least 1 % of the duration T away from the ends of the record.
        """
        t = min(max(self.time or 0.0, 0.01 * duration), 0.99 * duration)
        density = variance * t * (duration - t) / duration
        return self._edge_error(density)

    def regressors(self, time: Array, covariates: Columns) -> Array:
        """Array with 0 before the step and 1 from the step on, shape (n, 1)."""
        return (time >= (self.time or 0.0)).astype(float)[:, None]

    @classmethod
    def regressor_ordinates(
        cls, points: Sequence[Self], j: NDArray[np.int64], n: int, rate: float, start: float
    ) -> Array:
        """Array of cosine-transform coefficients j of the step of each of the `points`, shape (points, ordinates)."""
        return step_ordinates(np.array([p.time or 0.0 for p in points]), j, n, rate, start)


def best_excursion(
    residual: Array, root: Array, basis: Array, n: int, rate: float
) -> tuple[Event, float]:
    """Best `Excursion`, and the angle by which the whitened ordinates of a step turn as it moves over all times, rad.

    The parameters are those of `Deterministic.best_spans`. The best excursion has the largest ½z² − ln(length), with z
    its height over the standard error: every octave of lengths has the same prior probability. The length is at least
    T/1000; the edges of shorter excursions would be less certain than their length.
    """
    from scipy.fft import dct, dst

    places = residual.size + 1
    j = np.arange(1, places)
    # Steps at m/places of the record (see `regressor_ordinates`): sums over sines are sine transforms.
    scale = root * np.sqrt(0.5 / n) / np.sin(np.pi * j / (2 * n))
    score = 0.5 * dst(scale * (residual - basis @ (basis.T @ residual)), type=1)
    others = 0.5 * dst(scale[:, None] * basis, type=1, axis=0)
    # For sums Σ_j s_j² sin(πjm/M) sin(πjl/M), extended symmetrically to negative indices.
    waves = 0.5 * dct(np.concatenate([[0.0], scale**2, [0.0]]), type=1)
    waves = np.concatenate([waves, waves[-2::-1]])
    m = j
    own = 0.5 * (waves[0] - waves[2 * m]) - (others**2).sum(axis=1)
    least = max(1, places // 1000)
    floor = MIN_RELATIVE_NORM * float(own.max())
    first, last, _ = _kernels.best_pair(
        score, own, waves, np.ascontiguousarray(others), least, floor
    )
    known = np.sqrt(np.maximum(own, 0.0))
    neighbor_product = 0.5 * (waves[1] - waves[2 * m[:-1] + 1]) - (others[1:] * others[:-1]).sum(
        axis=1
    )
    seen = (known[1:] > 0.0) & (known[:-1] > 0.0)
    turn = np.clip(neighbor_product[seen] / (known[1:] * known[:-1])[seen], -1.0, 1.0)
    times = m * (n / rate / places)
    return (
        Excursion(start=float(times[first]), end=float(times[last])),
        float(np.arccos(turn).sum()),
    )


def best_transition(
    residual: Array, root: Array, basis: Array, n: int, rate: float
) -> tuple[Event, float]:
    """Best `Transition` (ramp to a new level), and the angle by which whitened ordinates turn as its kink moves, rad.

    The parameters are those of `Deterministic.best_spans`. The best transition reduces the sum of squares of the
    residual most. Begin and end are all pairs of at most 1023 equally spaced times.
    """
    from scipy.fft import dct

    places = residual.size + 1
    j = np.arange(1, places)
    # max(i − k, 0) has the transform cos(πj(k + ½)/n)/sin²(πj/2n), up to a part independent of k that cancels.
    scale = root / np.sin(np.pi * j / (2 * n)) ** 2
    scale /= scale.max()
    every = max(1, places // TRANSITION_TIMES)
    m = np.arange(every, places, every)

    def cosine_sums(values: Array) -> Array:
        """Sums Σ_j values_j cos(πjm/K) over j = 1 … K − 1 of each column, for m = 0, 1, …, K; shape (K + 1, columns)."""
        padded = np.zeros((places + 1, values.shape[1]))
        padded[1:places] = values
        return np.asarray(0.5 * dct(padded, type=1, axis=0))

    sums = cosine_sums(
        scale[:, None] * np.column_stack([residual - basis @ (basis.T @ residual), basis])
    )
    score, others = sums[m, 0], sums[m, 1:]
    waves = cosine_sums((scale**2)[:, None])[:, 0]
    waves = np.concatenate([waves, waves[-2::-1]])
    product = 0.5 * (waves[np.abs(m[:, None] - m)] + waves[m[:, None] + m]) - others @ others.T
    own = np.diagonal(product)
    size = own[:, None] + own - 2.0 * product
    first, last = np.triu_indices(m.size, 1)
    size, rise = size[first, last], score[last] - score[first]
    gain = np.where(size > MIN_RELATIVE_NORM * own.max(), rise**2 / np.maximum(size, 1e-300), 0.0)
    best = int(np.argmax(gain))
    turn = product[np.arange(m.size - 1), np.arange(1, m.size)]
    turn = np.clip(turn / np.sqrt(np.maximum(own[1:] * own[:-1], 1e-300)), -1.0, 1.0)
    step = n / rate / places
    return (
        Transition(begin=float(m[first[best]] * step), end=float(m[last[best]] * step)),
        float(np.arccos(turn).sum()),
    )
