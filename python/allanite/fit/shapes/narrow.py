"""Fit bands narrower than a bin: frequency and width from single ordinates, strength from the bins."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import Array, scaled_inverse
from allanite.common.threads import stop_if_unwanted
from allanite.effects import Effect, Model, Stochastic
from allanite.fit.likelihood.expected import density, density_in_bins, expected_power
from allanite.fit.likelihood.peaks import (
    MAX_NARROW_WIDTH,
    bins_near,
    has_ordinates_near,
    is_fitted_to_ordinates,
    is_narrow,
    ordinates_of_bins,
)
from allanite.fit.models import with_effect, without_effect
from allanite.fit.shapes.simplex import MIN_SHAPE_DELTA_LOGL

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data
    from allanite.fit.likelihood.random_part import RandomPart
    from allanite.fit.likelihood.whittle import Maximum

#: Ratio of successive half-widths that are tried. Chosen by judgment; not measured.
HALF_WIDTH_RATIO = 2.0
#: Minimum half-width of a band, in ordinates: the resolution of the spectrum; a narrower band is a line.
MIN_HALF_WIDTH = 1.0
#: Maximum steps of the optimization. Chosen by judgment; not measured.
MAX_STEPS = 40
#: Fractions of a step that are tried until logL rises. Chosen by judgment; not measured.
STEP_SHARES = 0.4 ** np.arange(8)
#: Step of numerical derivatives, in units of `Window.scales`. Chosen by judgment; not measured.
DERIVATIVE_STEP = 1e-4
#: Maximum change of ln density of the other effects within a bin, for the bin to count as flat.
#: Chosen by judgment; not measured.
MAX_FLAT_CHANGE = 0.5
#: Maximum width of a band, relative to the maximum width of narrow bands, up to which single ordinates count.
#: Chosen by judgment; not measured.
MAX_WIDTH_WITH_WEIGHT = 4.0
#: Fraction of the widest half-width of a narrow band, above which all widths are tried: such a width comes from the bins,
#: which cannot resolve it. Chosen by judgment; not measured.
MAX_FRACTION_OF_WIDEST = 0.75


@dataclass(frozen=True, slots=True, eq=False)
class Window:
    """Ordinates near a narrow band of a model, and the likelihood of the band there.

    Its coordinates are ln of the band's variance, ln of a factor on the other effects of the model, and ln of each free
    shape of the band. The factor keeps errors of the other effects from distorting the band. `place` is the index of the
    band in the model. `j`, `power` and `other_power`, shape (k,), are the indices of the ordinates, their squares, and
    those that the model without the band expects.
    """

    model: Model
    place: int
    data: Data
    near: NDArray[np.int64]
    j: NDArray[np.int64]
    power: Array
    other_power: Array

    @classmethod
    def of(cls, model: Model, place: int, data: Data, ordinates: Array) -> Window:
        """`Window` of the ordinates near the band at index `place` of a model with values.

        `ordinates`, shape (n,), are those of the record minus known functions of time.
        """
        near = bins_near(model.effects[place], data.bins, data.rate)
        others = without_effect(model, place)
        j = ordinates_of_bins(near, data.bins)
        return cls(
            model,
            place,
            data,
            near,
            j,
            ordinates[j] ** 2,
            _mean_density_of_bins(others, near, data),
        )

    @property
    def own(self) -> Stochastic:
        """Effect of the band, `Stochastic`, with the model's present values."""
        effect = self.model.effects[self.place]
        assert isinstance(effect, Stochastic)
        return effect

    @property
    def hertz_per_ordinate(self) -> float:
        """Distance between two ordinates, Hz."""
        return self.data.rate / (2.0 * self.data.n)

    @property
    def max_half_width(self) -> float:
        """Maximum half-width, in ordinates, that counts as narrow at the mean frequency of the window."""
        return float(0.5 * MAX_NARROW_WIDTH * np.mean(self.j))

    def coordinates(self, band: Stochastic) -> Array:
        """Array of the coordinates of a band with values, of the kind of this band, and a factor of 1."""
        shapes = [band.values[name] for name in self.own.free_shapes]
        return np.log([max(band.values[band.coefficient] ** 2, 1e-300), 1.0, *shapes])

    def effect(self, x: Array) -> Stochastic:
        """Effect of the band with the parameters at the coordinates `x`; shapes are clipped to their ranges."""
        values = {self.own.coefficient: float(np.exp(0.5 * x[0]))}
        for name, value in zip(self.own.free_shapes, np.exp(x[2:]).tolist(), strict=True):
            declared = self.own.parameter(name)
            values[name] = min(max(value, declared.low), declared.high)
        return self.own.with_values(**values)

    def half_width(self, band: Stochastic) -> float:
        """Half-width of a band with values, in ordinates."""
        assert band.occupies is not None
        return float(np.ptp(band.occupies)) / (2.0 * self.hertz_per_ordinate)

    def scales(self, x: Array) -> Array:
        """Scale of each coordinate in `x`: a change by this scale alters the spectrum substantially.

        The scale of a frequency is the half-width of the band.
        """
        band = self.effect(x)
        half = self.half_width(band) * self.hertz_per_ordinate
        names = band.free_shapes
        shapes = [half / band.values[n] if band.parameter(n).unit == "Hz" else 1.0 for n in names]
        return np.array([1.0, 0.5, *shapes])

    def spectrum(self, x: Array) -> Array:
        """Expected squared ordinates in the window, for a band at the coordinates `x`, shape (k,)."""
        effect = self.effect(x)
        model = with_effect(self.model, self.place, effect)
        terms = [t.scaled(float(np.exp(x[0]))) for t in self.data.unit_terms(model, effect)]
        own = density_in_bins(tuple(terms), self.near, self.data.n)
        return np.exp(x[1]) * self.other_power + own

    def log_likelihood(self, x: Array) -> float:
        """Whittle logL of the ordinates in the window, nats and without constants, for a band at the coordinates `x`."""
        stop_if_unwanted()
        expected = self.spectrum(x)
        return -0.5 * float(np.sum(np.log(expected) + self.power / expected))

    def is_admissible(self, x: Array) -> bool:
        """True if the coordinates `x` describe a narrow band whose center is inside the window.

        To be narrow, the half-width must be at least one ordinate, and at most twice that of the widest narrow band. Also,
        the factor on the other effects must be between e^−2 and e². Shapes must lie inside their ranges. No two peaks may
        overlap, and all lie between 0 Hz and half the sampling rate.
        """
        declared = [self.own.parameter(name) for name in self.own.free_shapes]
        if not all(p.low < np.exp(v) < p.high for p, v in zip(declared, x[2:], strict=True)):
            return False
        band = self.effect(x)
        middle = 0.5 * sum(band.peaks[0]) / self.hertz_per_ordinate
        low, high = np.sort(np.array(band.peaks).T)
        return bool(
            MIN_HALF_WIDTH <= self.half_width(band) <= 2.0 * self.max_half_width
            and self.j[0] < middle < self.j[-1]
            and abs(x[1]) < 2.0
            and (low[1:] > high[:-1]).all()
            and low[0] > 0.0
            and high[-1] < 0.5 * self.data.rate
        )

    def best_of_widths(self) -> Array:
        """Coordinates of the most likely of several trial bands, or of the present band if likelier than all.

        Half-widths of 1, 2, 4, … ordinates are tried, up to that of the widest narrow band. Each trial band lies where the
        power, relative to that of the other effects, is largest.
        """
        best, half = self.coordinates(self.own), MIN_HALF_WIDTH
        if not np.all(self.other_power > 0.0):  # without other noise, no excess is defined
            return best
        excess = self.power / self.other_power
        total = np.concatenate([[0.0], np.cumsum(excess - np.median(excess) / 0.4549)])
        highest = self.log_likelihood(best) if self.is_admissible(best) else -np.inf
        while half <= self.max_half_width:
            width = max(2, round(2.0 * half))
            if width < self.j.size // 2:
                sums = total[width:] - total[:-width]
                top = int(np.argmax(sums))
                middle = float(self.j[top]) + 0.5 * (width - 1.0)
                at = self.other_power[top : top + width].mean()
                # Half of the band's power lies within its half-widths; all ordinates sum to twice the variance's mean.
                power = max(2.0 * float(sums[top]) * float(at), 1e-300) / self.data.n
                ends = (self.hertz_per_ordinate * (middle + side * half) for side in (-1.0, 1.0))
                band = self.own.banded(*ends)
                assert band is not None
                x = self.coordinates(band.with_values(**{band.coefficient: np.sqrt(power)}))
                found = self.log_likelihood(x)
                if found > highest:
                    best, highest = x, found
            half *= HALF_WIDTH_RATIO
        return best

    def optimized(self, x: Array) -> Array:
        """Coordinates of the local maximum of logL, by Fisher scoring from `x`; `x` itself if no step helps.

        It ends after 40 steps, or when a step promises or brings less than 1e-3 nats.
        """
        value = self.log_likelihood(x)
        for _ in range(MAX_STEPS):
            slopes, now = self._slopes(x)
            gradient = 0.5 * slopes.T @ (self.power / now - 1.0)
            step = scaled_inverse(0.5 * slopes.T @ slopes) @ gradient
            if float(gradient @ step) < 2.0 * MIN_SHAPE_DELTA_LOGL:
                break
            # Limit a step to the width of the band.
            step /= max(1.0, float(np.max(np.abs(step) / self.scales(x))))
            for share in STEP_SHARES:
                tried = x + share * step
                found = self.log_likelihood(tried) if self.is_admissible(tried) else -np.inf
                if found > value:
                    break
            else:
                break
            x, risen, value = tried, found - value, found
            if risen < MIN_SHAPE_DELTA_LOGL:
                break
        return x

    def _slopes(self, x: Array) -> tuple[Array, Array]:
        """Pair: derivatives of ln spectrum by the coordinates at `x`, (k, coordinates), and the spectrum, (k,)."""
        now = self.spectrum(x)
        steps = DERIVATIVE_STEP * self.scales(x)
        slopes = [(self.spectrum(x + s) - now) / (s.sum() * now) for s in np.diag(steps)]
        return np.column_stack(slopes), now

    def covariance(self, x: Array) -> Array:
        """Array: covariance matrix of the coordinates at `x`, the inverse of their Fisher information."""
        slopes, _ = self._slopes(x)
        return scaled_inverse(0.5 * slopes.T @ slopes)

    def errors(self) -> dict[str, float]:
        """Dict of the standard errors of ln(coefficient) and ln(shape) of the band, by parameter name."""
        variance, _, *shapes = np.sqrt(
            np.diag(self.covariance(self.coordinates(self.own)))
        ).tolist()
        own = self.own
        return {own.coefficient: 0.5 * variance, **dict(zip(own.free_shapes, shapes, strict=True))}


def ordinates_delta_logl(model: Model, data: Data, ordinates: Array, count: Array) -> float:
    """Additional logL from the single ordinates near narrow bands, given the power of their bins; 0 without such bands.

    `ordinates`, shape (n,), are those minus known functions of time. `count`, shape (bins,), are the degrees of freedom of
    the bins: fewer than their ordinates if neighboring ordinates are correlated. The power of the other effects is averaged
    over each bin. Otherwise a band next to the empty end of a filtered spectrum would get credit for the slope of the
    filter.
    """
    narrow = [e for e in model.stochastic if _ordinates_weight(e, data)]
    if not narrow:
        return 0.0
    share = np.zeros(data.bins.count.size)
    for effect in narrow:
        own = bins_near(effect, data.bins, data.rate)
        share[own] = np.maximum(share[own], _ordinates_weight(effect, data))
    near = np.flatnonzero(share)
    j = ordinates_of_bins(near, data.bins)
    power = ordinates[j] ** 2
    expected = _mean_density_of_bins(Model(tuple(e for e in model if e not in narrow)), near, data)
    for effect in narrow:
        strength = effect.values[effect.coefficient] ** 2
        terms = tuple(t.scaled(strength) for t in data.unit_terms(model, effect))
        expected += density_in_bins(terms, near, data.n) if strength else 0.0
    sizes = _sizes(near, data)
    mean = np.repeat(_means(expected, sizes), sizes)
    uneven = np.log(expected / mean) + power * (1.0 / expected - 1.0 / mean)
    return float(-0.5 * (share[near] * count[near]) @ _means(uneven, sizes))


def _ordinates_weight(effect: Stochastic, data: Data) -> float:
    """Weight, 0 … 1, of the single ordinates in the fit of a band: 1 for a narrow band, less for a wider one.

    The weight falls to 0 at four times the maximum width of narrow bands; without this gradual fall, logL would jump.
    """
    if is_fitted_to_ordinates(effect, data):
        return 1.0
    if effect.occupies is None or effect.banded(1.0, 1.001) is None:
        return 0.0
    if not has_ordinates_near(effect, data):
        return 0.0
    low, high = effect.occupies
    width = 2.0 * (high - low) / (high + low) if high > low else np.inf
    return float(
        np.clip(
            np.log(MAX_WIDTH_WITH_WEIGHT * MAX_NARROW_WIDTH / width)
            / np.log(MAX_WIDTH_WITH_WEIGHT),
            0.0,
            1.0,
        )
    )


def is_flat_near(model: Model, place: int, data: Data) -> bool:
    """True if the model without its narrow bands is nearly constant within each bin near the band at index `place`.

    This means that ln of its density changes by less than 0.5 from the first to the last ordinate of each bin. Where the
    model is not constant, e.g. at the edge of a filter, single ordinates would describe the filter instead of the band.
    """
    near = bins_near(model.effects[place], data.bins, data.rate)
    terms = data.terms(Model(tuple(e for e in model if not is_narrow(e))))
    if not terms:
        return True
    ends = (data.bins.edges[near], data.bins.edges[near + 1] - 1)
    first, last = (np.log(density(terms, j, data.n)) for j in ends)
    return bool(np.abs(last - first).max() < MAX_FLAT_CHANGE)


def _mean_density_of_bins(model: Model, near: NDArray[np.int64], data: Data) -> Array:
    """The model's mean density in the bins with the indices `near`, repeated for each of their ordinates."""
    return np.repeat(expected_power(model, data, data.ends_missing)[near], _sizes(near, data))


def _sizes(near: NDArray[np.int64], data: Data) -> NDArray[np.int64]:
    """Array of the number of ordinates in each of the bins with the indices `near`."""
    return np.diff(data.bins.edges)[near]


def _means(values: Array, sizes: NDArray[np.int64]) -> Array:
    """Array of the means of consecutive groups of values with the given sizes."""
    return np.asarray(np.add.reduceat(values, np.cumsum(sizes) - sizes) / sizes)


def _overlap(one: Effect, other: Effect, data: Data) -> bool:
    """True if a peak of one effect overlaps a peak of the other in frequency, or if both effects lie near a common bin."""
    if any(a[0] <= b[1] and b[0] <= a[1] for a in one.peaks for b in other.peaks):
        return True
    near, near_other = (bins_near(e, data.bins, data.rate) for e in (one, other))
    return bool(np.isin(near, near_other).any())


def fit_narrow_bands(
    model: Model, best: Maximum, part: RandomPart, ordinates: Array, settled: int = 0
) -> tuple[Model, Maximum]:
    """Pair: model whose narrow bands have shapes fitted to single ordinates, and its `Maximum` over the coefficients.

    The arguments `model` and `best` are returned if no band changes. Not fitted are bands without power, with a held shape,
    or without ordinates near them. `ordinates`, shape (n,), are those minus known functions of time. Bands among the first
    `settled` effects are kept unless a later effect overlaps them.
    """
    data, moved = part.data, False
    for place, effect in enumerate(model.effects):
        if not is_fitted_to_ordinates(effect, data):
            continue
        if place < settled and not any(_overlap(effect, e, data) for e in model.effects[settled:]):
            continue
        assert isinstance(effect, Stochastic)
        if not effect.values[effect.coefficient]:
            continue
        window = Window.of(model, place, data, ordinates)
        start = window.coordinates(effect)
        if window.half_width(effect) > MAX_FRACTION_OF_WIDEST * window.max_half_width:
            start = window.best_of_widths()
        x = window.optimized(start)
        if np.array_equal(x, window.coordinates(effect)):
            continue
        # The strength comes from the bins, or is held.
        found = window.effect(x)
        model = model.replaced(place, **{n: found.values[n] for n in effect.free_shapes})
        moved = True
    return (model, part.maximize(model, best)) if moved else (model, best)
