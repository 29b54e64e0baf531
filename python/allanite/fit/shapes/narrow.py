"""Bands narrower than a bin: frequency and width from single ordinates, strength from the bins."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.common.threads import go_on
from allanite.effects import Effect, Model, Stochastic
from allanite.fit.likelihood.expected import density, means
from allanite.fit.likelihood.peaks import (
    NARROW,
    bins_near,
    by_ordinates,
    is_narrow,
    near_seen_singly,
    within,
)

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data
    from allanite.fit.likelihood.random_part import RandomPart
    from allanite.fit.likelihood.whittle import Maximum

__all__ = ["Window", "flat_about", "narrowed", "within_bins"]

Array = NDArray[np.float64]
#: Half-widths of the bands that are tried, each this much of the next.
RATIO = 2.0
#: Least half-width, in ordinates: narrower is a line.
LEAST = 1.0
#: Most steps of a climb, and what one must gain of logL.
MOST, SAME = 40, 1e-3
#: Step of a difference in the coordinates of a band.
STEP = 1e-4
#: Least change of ln of the density over a bin that is no longer that of a flat one.
STEEP = 0.5
#: From this many times the width of a narrow band on the ordinates of a bin say nothing of a band.
BROAD = 4.0
#: A band this near to the widest half-width, in ln, comes from the bins.
ENTERED = 0.3


@dataclass(frozen=True, slots=True, eq=False)
class Window:
    """Ordinates about a narrow band.

    A band has four coordinates: ln of its power, its middle and ln of its half-width, both in ordinates, and ln of what
    the rest of the model is to be multiplied with there, so that what is amiss about the band does not bend it; and ln of
    every shape that says where its companions are and how strong.

    Attributes
    ----------
    j : ndarray of int64, shape (k,)
    power, rest : ndarray, shape (k,)
        Squared ordinates, and what the model without the band expects of them.
    """

    model: Model
    place: int
    data: Data
    j: NDArray[np.int64]
    power: Array
    rest: Array

    @classmethod
    def of(cls, model: Model, place: int, data: Data, ordinates: Array) -> Window:
        """About the effect at a place of a model with values."""
        effect = model.effects[place]
        near = bins_near(effect, data.bins, data.rate)
        others = Model((*model.effects[:place], *model.effects[place + 1 :]))
        j = within(near, data.bins)
        return cls(model, place, data, j, ordinates[j] ** 2, _rest(others, near, data))

    @property
    def own(self) -> Stochastic:
        """The band that the model has."""
        effect = self.model.effects[self.place]
        assert isinstance(effect, Stochastic)
        return effect

    @property
    def hertz(self) -> float:
        """From one ordinate to the next."""
        return self.data.rate / (2.0 * self.data.n)

    @property
    def more(self) -> tuple[str, ...]:
        """Shapes that its place and width do not decide."""
        return tuple(n for n in self.own.free_shapes if n in self.own.companions)

    def effect(self, x: Array) -> Stochastic:
        """The band at these coordinates."""
        half = float(np.exp(x[2]))
        made = self.own.banded(float(x[1] - half) * self.hertz, float(x[1] + half) * self.hertz)
        assert made is not None
        shapes = dict(zip(self.more, np.exp(x[4:]).tolist(), strict=True))
        return made.with_values(**{made.coefficient: float(np.exp(0.5 * x[0]))}, **shapes)

    def start(self) -> Array:
        """Coordinates of the band that the model has."""
        own = self.own
        assert own.occupies is not None
        low, high = np.array(own.occupies) / self.hertz
        power = np.log(max(own.values[own.coefficient] ** 2, 1e-300))
        shapes = [np.log(own.values[name]) for name in self.more]
        return np.array([power, 0.5 * (low + high), np.log(0.5 * (high - low)), 0.0, *shapes])

    def scales(self, x: Array) -> Array:
        """What moves the spectrum by its own size: a band is no farther from another than it is wide."""
        half = float(np.exp(x[2]))
        units = [self.own.parameter(name).unit for name in self.more]
        shapes = [
            half * self.hertz / float(np.exp(v)) if unit == "Hz" else 1.0
            for unit, v in zip(units, x[4:], strict=True)
        ]
        return np.array([1.0, half, 1.0, 0.5, *shapes])

    def spectrum(self, x: Array) -> Array:
        """Expected squared ordinates, shape (k,)."""
        effect = self.effect(x)
        effects = (*self.model.effects[: self.place], effect, *self.model.effects[self.place + 1 :])
        model = Model(effects)
        terms = [t.scaled(float(np.exp(x[0]))) for t in self.data.unit_terms(model, effect)]
        return np.exp(x[3]) * self.rest + density(tuple(terms), self.j, self.data.n)

    def log_likelihood(self, x: Array) -> float:
        """Whittle's, of the ordinates."""
        go_on()
        return self._judged(self.spectrum(x))

    def _judged(self, expected: Array) -> float:
        return -0.5 * float(np.sum(np.log(expected) + self.power / expected))

    @property
    def widest(self) -> float:
        """Ln of the widest half-width that is narrow."""
        return float(np.log(0.5 * NARROW * np.mean(self.j)))

    def inside(self, x: Array) -> bool:
        """Whether coordinates are those of a narrow band here."""
        return bool(
            np.log(LEAST) <= x[2] <= self.widest + 0.7
            and self.j[0] < x[1] < self.j[-1]
            and abs(x[3]) < 2.0
            and self._apart(x)
        )

    def _apart(self, x: Array) -> bool:
        """Whether no companion has a value that it may not have, or lies on another."""
        if not self.more:
            return True
        declared = [self.own.parameter(name) for name in self.more]
        if not all(p.low < np.exp(v) < p.high for p, v in zip(declared, x[4:], strict=True)):
            return False
        low, high = np.sort(np.array(self.effect(x).peaks).T)
        return bool(
            low[0] > 0.0 and (low[1:] > high[:-1]).all() and high[-1] < 0.5 * self.data.rate
        )

    def scanned(self) -> Array:
        """The best of bands of all widths, each where most stands out over so many ordinates."""
        if not np.all(self.rest > 0.0):  # beside nothing nothing stands out
            return self.start()
        excess = self.power / self.rest
        total = np.concatenate([[0.0], np.cumsum(excess - np.median(excess) / 0.4549)])
        best, half = self.start(), LEAST
        highest = self.log_likelihood(best) if self.inside(best) else -np.inf
        while np.log(half) <= self.widest:
            width = max(2, round(2.0 * half))
            if width < self.j.size // 2:
                sums = total[width:] - total[:-width]
                top = int(np.argmax(sums))
                middle = float(self.j[top]) + 0.5 * (width - 1.0)
                at = self.rest[top : top + width].mean()
                # Half of its power is within its half-widths; that of all ordinates is twice the variance's mean.
                power = max(2.0 * float(sums[top]) * float(at), 1e-300) / self.data.n
                x = np.array([np.log(power), middle, np.log(half), 0.0, *best[4:]])
                found = self.log_likelihood(x)
                if found > highest:
                    best, highest = x, found
            half *= RATIO
        return best

    def climbed(self, x: Array) -> Array:
        """The maximum uphill of coordinates by Fisher's scoring."""
        for _ in range(MOST):
            slopes, now = self._slopes(x)
            value = self._judged(now)
            gradient = 0.5 * slopes.T @ (self.power / now - 1.0)
            step = _inverse(slopes) @ gradient
            if float(gradient @ step) < 2.0 * SAME:
                break
            # No farther at a time than a band is wide.
            step /= max(1.0, float(np.max(np.abs(step) / self.scales(x))))
            share = 1.0
            while share > 1e-3:
                tried = x + share * step
                found = self.log_likelihood(tried) if self.inside(tried) else -np.inf
                if found > value:
                    break
                share *= 0.4
            else:
                break
            x, risen = tried, found - value
            if risen < SAME:
                break
        return x

    def _slopes(self, x: Array) -> tuple[Array, Array]:
        """Change of ln of the spectrum with the coordinates, shape (k, coordinates), and the spectrum."""
        now = self.spectrum(x)
        steps = STEP * self.scales(x)
        slopes = [(self.spectrum(x + s) - now) / (s.sum() * now) for s in np.diag(steps)]
        return np.column_stack(slopes), now

    def covariance(self, x: Array) -> Array:
        """Of the coordinates, the inverse of their Fisher information."""
        slopes, _ = self._slopes(x)
        return _inverse(slopes)

    def errors(self) -> dict[str, float]:
        """Standard errors of ln of the coefficient and of every shape of the band that the model has."""
        x = self.start()
        covariance, effect = self.covariance(x), self.effect(x)
        out = {effect.coefficient: 0.5 * float(np.sqrt(covariance[0, 0]))}
        for name in effect.free_shapes:
            slope = np.zeros(x.size)
            for i in (1, 2, *range(4, x.size)):
                step = STEP * self.scales(x)[i]
                moved = np.zeros(x.size)
                moved[i] = step
                up, down = (self.effect(x + s * moved).values[name] for s in (1.0, -1.0))
                slope[i] = float(np.log(up / down)) / (2.0 * step)
            out[name] = float(np.sqrt(slope @ covariance @ slope))
        return out


def within_bins(model: Model, data: Data, ordinates: Array, count: Array) -> float:
    """What logL of the power of bins leaves out where a model has narrow bands: that of the ordinates given their sums.

    The rest of the model is as flat within a bin as it is for other models: next to the empty end of a filtered spectrum a
    band would else be worth thousands for what the filter does.

    Parameters
    ----------
    model : Model
        With values.
    ordinates : ndarray, shape (n,)
        Without known functions of time.
    count : ndarray, shape (bins,)
        Degrees of freedom of the bins: fewer than their ordinates where neighbours share what they show.
    """
    narrow = [e for e in model.stochastic if _share(e, data)]
    if not narrow:
        return 0.0
    share = np.zeros(data.bins.count.size)
    for effect in narrow:
        own = bins_near(effect, data.bins, data.rate)
        share[own] = np.maximum(share[own], _share(effect, data))
    near = np.flatnonzero(share)
    j = within(near, data.bins)
    power = ordinates[j] ** 2
    expected = _rest(Model(tuple(e for e in model if e not in narrow)), near, data)
    for effect in narrow:
        strength = effect.values[effect.coefficient] ** 2
        terms = tuple(t.scaled(strength) for t in data.unit_terms(model, effect))
        expected += density(terms, j, data.n) if strength else 0.0
    sizes = _sizes(near, data)
    mean = np.repeat(_means(expected, sizes), sizes)
    uneven = np.log(expected / mean) + power * (1.0 / expected - 1.0 / mean)
    return float(-0.5 * (share[near] * count[near]) @ _means(uneven, sizes))


def _share(effect: Stochastic, data: Data) -> float:
    """How much counts what single ordinates say of a band: all where it is narrow, then less and less.

    A band that is a little too wide to be fitted to them has shown them as much as one that is not.
    """
    if by_ordinates(effect, data):
        return 1.0
    if effect.occupies is None or effect.banded(1.0, 1.001) is None:
        return 0.0
    if not near_seen_singly(effect, data):
        return 0.0
    low, high = effect.occupies
    width = 2.0 * (high - low) / (high + low) if high > low else np.inf
    return float(np.clip(np.log(BROAD * NARROW / width) / np.log(BROAD), 0.0, 1.0))


def flat_about(model: Model, place: int, data: Data) -> bool:
    """Whether a model without its narrow bands hardly changes within the bins near one of them.

    Where a filter leaves next to nothing of a part of a bin, single ordinates would speak of the filter.
    """
    near = bins_near(model.effects[place], data.bins, data.rate)
    terms = data.terms(Model(tuple(e for e in model if not is_narrow(e))))
    if not terms:
        return True
    ends = (data.bins.edges[near], data.bins.edges[near + 1] - 1)
    first, last = (np.log(density(terms, j, data.n)) for j in ends)
    return bool(np.abs(last - first).max() < STEEP)


def _rest(model: Model, near: NDArray[np.int64], data: Data) -> Array:
    """The mean density of each of some bins, at each of their ordinates."""
    return np.repeat(means(model, data, data.ends_out)[near], _sizes(near, data))


def _sizes(near: NDArray[np.int64], data: Data) -> NDArray[np.int64]:
    return np.diff(data.bins.edges)[near]


def _means(values: Array, sizes: NDArray[np.int64]) -> Array:
    return np.asarray(np.add.reduceat(values, np.cumsum(sizes) - sizes) / sizes)


def _inverse(slopes: Array) -> Array:
    """Of the Fisher information of coordinates whose units differ."""
    fisher = 0.5 * slopes.T @ slopes
    scale = np.sqrt(np.maximum(np.diag(fisher), 1e-300))
    inverse = np.linalg.pinv(fisher / np.outer(scale, scale), rcond=1e-10, hermitian=True)
    return np.asarray(inverse / np.outer(scale, scale))


def _touch(one: Effect, other: Effect, data: Data) -> bool:
    """Whether two effects have bands or lines that overlap, or ordinates that a fit of either looks at."""
    if any(a[0] <= b[1] and b[0] <= a[1] for a in one.peaks for b in other.peaks):
        return True
    near, beside = (bins_near(e, data.bins, data.rate) for e in (one, other))
    return bool(np.isin(near, beside).any())


def narrowed(
    model: Model, best: Maximum, part: RandomPart, ordinates: Array, settled: int = 0
) -> tuple[Model, Maximum]:
    """The model with every narrow band where single ordinates have it, and the maximum of the coefficients there.

    Parameters
    ----------
    model : Model
        With values of its coefficients.
    ordinates : ndarray, shape (n,)
        Without known functions of time.
    settled : int
        Bands among so many effects, from the first, stay where they are if none behind these touches them.
    """
    data, moved = part.data, False
    for place, effect in enumerate(model.effects):
        if not by_ordinates(effect, data):
            continue
        if place < settled and not any(_touch(effect, e, data) for e in model.effects[settled:]):
            continue
        assert isinstance(effect, Stochastic)
        if not effect.values[effect.coefficient]:
            continue
        window = Window.of(model, place, data, ordinates)
        start = window.start()
        # Where bins put it, it may be anywhere near and of any width.
        at = window.scanned() if start[2] > window.widest - ENTERED else start
        x = window.climbed(at)
        if x is start:
            continue
        # The strength is that of the bins, or held.
        found = window.effect(x)
        model = model.replaced(place, **{n: found.values[n] for n in effect.free_shapes})
        moved = True
    return (model, part.maximise(model, best)) if moved else (model, best)
