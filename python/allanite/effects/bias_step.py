"""Bias step: the bias jumps once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.effects._base import Parameter
from allanite.effects._event import Event, sines

#: What is left of a difference of two steps, in parts of a step, is rounding below this.
SAME = 1e-9
#: Times between which a transition is looked for; its begin and end are refined from there.
KINKS = 512


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

    kind: ClassVar[str] = "bias_step"
    short: ClassVar[str] = "STEP"
    common: ClassVar[bool] = True
    title: ClassVar[str] = "bias step"
    family: ClassVar[str] = "step"
    lasting: ClassVar[bool] = True
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("time", "s", "when, from the first sample", "shape", aliases=("t",), symbol="t"),
        Parameter("height", 0.0, "by how much", low=-np.inf, aliases=("h",), symbol="h"),
    )
    physics: ClassVar[str] = (
        "something was touched, switched or relaxed: a shock, a supply, a range change, a settling bond"
    )
    looks_like: ClassVar[str] = (
        "two levels of the low-passed samples, one after the other; a hump at long τ"
    )
    check_by: ClassVar[str] = (
        "look at the samples and at the laboratory's log about that time; repeat the record"
    )
    rivals: ClassVar[tuple[str, ...]] = (
        "excursion",
        "transient",
        "transition",
        "rate_random_walk",
        "rate_ramp",
        "warm_up",
        "burst_noise",
        "gauss_markov",
    )

    @property
    def when(self) -> tuple[float, float] | None:
        """The time of the jump."""
        return None if self.time is None else (self.time, self.time)

    def extended(self) -> tuple[Event, ...]:
        """The form in which the bias returns by decay."""
        from allanite.effects.transient import Transient

        return () if self.time is None else (Transient(time=self.time),)

    @classmethod
    def best_spans(
        cls,
        residual: NDArray[np.float64],
        root: NDArray[np.float64],
        basis: NDArray[np.float64],
        n: int,
        rate: float,
    ) -> tuple[tuple[Event, float], ...]:
        """The best excursion, to which two opposite steps add up, and the best transition: many equal small steps."""
        return (
            best_excursion(residual, root, basis, n, rate),
            best_transition(residual, root, basis, n, rate),
        )

    def grid(self, name: str, n: int, rate: float) -> NDArray[np.float64]:
        """A thousand times over the record."""
        return np.linspace(0.0, n / rate, 1026)[1:-1]

    def shape_error(self, name: str, variance: float, duration: float) -> float:
        """Standard error of the time, s, in noise of the density S of which the height has the variance S·T/(t(T−t))."""
        t = min(max(self.time or 0.0, 0.01 * duration), 0.99 * duration)
        density = variance * t * (duration - t) / duration
        return self._edge_error(density)

    def regressors(
        self,
        time: NDArray[np.float64],
        covariates: Mapping[str, NDArray[np.float64]],
    ) -> NDArray[np.float64]:
        """One column of 0 and 1."""
        return (time >= (self.time or 0.0)).astype(float)[:, None]

    @classmethod
    def regressor_ordinates(
        cls, points: Sequence[Self], j: NDArray[np.int64], n: int, rate: float, start: float
    ) -> NDArray[np.float64]:
        """−√(2/n) sin(πjk/n)/(2 sin(πj/2n)) for a step at sample k, which may lie outside."""
        times = np.array([p.time or 0.0 for p in points])
        k = np.clip(np.ceil((times - start) * rate - 1e-9), 0, n)
        found = sines(k, j, n)
        found *= -np.sqrt(0.5 / n) / np.sin(np.pi * j / (2 * n))
        return found


def best_excursion(
    residual: NDArray[np.float64],
    root: NDArray[np.float64],
    basis: NDArray[np.float64],
    n: int,
    rate: float,
) -> tuple[Event, float]:
    """The excursion between two of as many times as there are ordinates, ½z² less ln of its length the largest.

    Every octave of lengths is as likely: of two times of return that explain as much the nearer one is it. None is
    shorter than a thousandth of the record: its edges would be less certain than it is long. With the arc of one edge.
    """
    from scipy.fft import dct, dst

    from allanite.effects.excursion import Excursion

    places = residual.size + 1
    j = np.arange(1, places)
    # Steps at m/places of the record, as `regressor_ordinates`: sums over sines are sine transforms.
    scale = root * np.sqrt(0.5 / n) / np.sin(np.pi * j / (2 * n))
    score = 0.5 * dst(scale * (residual - basis @ (basis.T @ residual)), type=1)
    others = 0.5 * dst(scale[:, None] * basis, type=1, axis=0)
    # Σ_j s_j² sin(πjm/M) sin(πjl/M), and M in place of l for −l.
    waves = 0.5 * dct(np.concatenate([[0.0], scale**2, [0.0]]), type=1)
    waves = np.concatenate([waves, waves[-2::-1]])
    m = j
    own = 0.5 * (waves[0] - waves[2 * m]) - (others**2).sum(axis=1)
    least = max(1, places // 1000)
    floor = SAME * float(own.max())
    first, last, _ = _kernels.best_pair(
        score, own, waves, np.ascontiguousarray(others), least, floor
    )
    known = np.sqrt(np.maximum(own, 0.0))
    beside = 0.5 * (waves[1] - waves[2 * m[:-1] + 1]) - (others[1:] * others[:-1]).sum(axis=1)
    seen = (known[1:] > 0.0) & (known[:-1] > 0.0)
    turn = np.clip(beside[seen] / (known[1:] * known[:-1])[seen], -1.0, 1.0)
    times = m * (n / rate / places)
    return (
        Excursion(start=float(times[first]), end=float(times[last])),
        float(np.arccos(turn).sum()),
    )


def best_transition(
    residual: NDArray[np.float64],
    root: NDArray[np.float64],
    basis: NDArray[np.float64],
    n: int,
    rate: float,
) -> tuple[Event, float]:
    """The transition between two of 512 times of the record with the largest ½z², and the arc of one kink."""
    from scipy.fft import dct

    from allanite.effects.transition import Transition

    places = residual.size + 1
    j = np.arange(1, places)
    # max(i − k, 0) has the transform cos(πj(k + ½)/n)/sin²(πj/2n), up to what all k share, which a difference loses.
    scale = root / np.sin(np.pi * j / (2 * n)) ** 2
    scale /= scale.max()
    every = max(1, places // KINKS)
    m = np.arange(every, places, every)

    def cosine_sums(values: NDArray[np.float64]) -> NDArray[np.float64]:
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
    gain = np.where(size > SAME * own.max(), rise**2 / np.maximum(size, 1e-300), 0.0)
    best = int(np.argmax(gain))
    turn = product[np.arange(m.size - 1), np.arange(1, m.size)]
    turn = np.clip(turn / np.sqrt(np.maximum(own[1:] * own[:-1], 1e-300)), -1.0, 1.0)
    step = n / rate / places
    return (
        Transition(begin=float(m[first[best]] * step), end=float(m[last[best]] * step)),
        float(np.arccos(turn).sum()),
    )
