"""Bands whose frequency is not the same at all times: looked for in sections of the record where a model fails.

No test of its own: what it finds explains a failure that another view has found.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.numbers import tidy
from allanite.effects import Model, Stochastic
from allanite.fit.likelihood.expected import density
from allanite.fit.likelihood.peaks import seen_singly

if TYPE_CHECKING:
    from allanite.fit.result import Fit
    from allanite.fit.solution import Process

__all__ = ["MovingBand", "moving_bands"]

Array = NDArray[np.float64]
#: Sections of the record; ordinates of a section that a half-width must have.
SECTIONS, RESOLVED = 16, 8.0
#: How far from its place a band is looked for, in steps of a part of its half-width, and how much beside it is looked at.
SHIFTS, ASIDE = np.arange(-24, 25) / 4.0, 3.0
#: Rise of logL by places of its own for each section, beyond ln of the shifts tried each time, that is no chance.
SURE = 20.0
#: A band moves if it does so by this many half-widths.
FAR = 1.0


@dataclass(frozen=True, slots=True)
class MovingBand:
    """Where a band is lowest and where it is highest.

    Attributes
    ----------
    name : str
        Of the effect.
    frequency : float
        That of the model, Hz.
    places : tuple of (start, end, frequency)
        The two sections, in s, in their order, and the middle of the band in each, Hz.
    """

    name: str
    frequency: float
    places: tuple[tuple[float, float, float], tuple[float, float, float]]

    @property
    def range(self) -> tuple[float, float]:
        """From the lowest to the highest middle, Hz."""
        (*_, one), (*_, other) = self.places
        return min(one, other), max(one, other)

    def __str__(self) -> str:
        told = " and at ".join(f"{f:.3g} Hz in {a:.5g}–{b:.5g} s" for a, b, f in self.places)
        return tidy(
            f"over time: the {self.name} at {self.frequency:.3g} Hz is at {told}: it drifts, as the speed of a machine or a"
            " mode that warms up, which no effect of the catalogue tells"
        )


def moving_bands(fit: Fit) -> tuple[MovingBand, ...]:
    """The bands of a model that are elsewhere at other times; none of a summary, or where much is missing.

    One that is taken for another where that is elsewhere moves no further than that: the stronger is told.
    """
    data = fit.data
    bands = [own for own in fit.solution.processes if _may_move(own, fit)]
    if not bands or not seen_singly(data):
        return ()
    samples = np.array_split(data.residual(fit.model), SECTIONS)
    pieces = [_kernels.cosine_transform(np.ascontiguousarray(piece)) for piece in samples]
    found: list[MovingBand] = []
    for own in sorted(bands, key=lambda own: -own.theta):
        middles = _middles(own, fit, pieces)
        if middles is None:
            continue
        low, high = float(middles.min()), float(middles.max())
        if all(high < one.range[0] or low > one.range[1] for one in found):
            found.append(_moving(own, fit, middles))
    return tuple(found)


def _may_move(own: Process, fit: Fit) -> bool:
    """Whether a band is wide enough to be placed in a section."""
    place = own.effect.occupies
    if place is None or own.effect.banded(1.0, 1.1) is None or own.effect.companions:
        return False
    half = 0.5 * (place[1] - place[0])
    return own.theta > 0.0 and 2.0 * half * fit.data.duration / SECTIONS > RESOLVED


def _middles(own: Process, fit: Fit, pieces: list[Array]) -> Array | None:
    """The middle of a band in each section, Hz, where these explain clearly more than one for all; else None."""
    data, effect = fit.data, own.effect
    assert effect.occupies is not None
    low, high = effect.occupies
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    shifts = half * SHIFTS
    reach = shifts[-1] + ASIDE * half
    first, last = max(middle - reach, half), min(middle + reach, 0.5 * data.rate)
    shifts = shifts[(middle + shifts - half > first) & (middle + shifts + half < last)]
    if shifts.size < 2 or not (shifts == 0.0).any():
        return None
    gains = np.zeros((len(pieces), shifts.size))
    for gain, ordinates in zip(gains, pieces, strict=True):
        n = ordinates.size
        cells = np.arange(first, last, 0.25 * half) * 2.0 * n / data.rate
        edges: NDArray[np.int64] = np.unique(np.round(cells).astype(np.int64).clip(1, n))
        count = np.diff(edges)
        power = np.add.reduceat(ordinates[: edges[-1]] ** 2, edges[:-1]) / count
        at = np.asarray((edges[:-1] + edges[1:] - 1) // 2, dtype=np.int64)
        rest = _rest(own, fit, at, n)
        for i, shift in enumerate(shifts):
            scale = 1.0 + float(shift) / middle
            moved = effect.banded(low * scale, high * scale)
            assert isinstance(moved, Stochastic)
            expected = rest + own.theta * _density(fit.model, effect, moved, at, n, data.rate)
            gain[i] = -0.5 * float(count @ (np.log(expected) + power / expected))
    best = gains.argmax(axis=1)
    risen = float((gains.max(axis=1) - gains[:, shifts == 0.0].ravel()).sum())
    places = middle + shifts[best]
    far = float(np.ptp(places)) > FAR * half
    return places if far and risen > SURE + len(pieces) * np.log(shifts.size) else None


def _rest(own: Process, fit: Fit, at: NDArray[np.int64], n: int) -> Array:
    """What the model without a band expects of squared ordinates of a section of n samples."""
    others = Model(tuple(e for e in fit.model if e is not own.effect))
    terms = fit.data.terms(others) if others.stochastic else ()
    return density(terms, at, n) if terms else np.zeros(at.size)


def _density(
    model: Model, effect: Stochastic, moved: Stochastic, at: NDArray[np.int64], n: int, rate: float
) -> Array:
    """The same of a band at another place, of coefficient 1."""
    there = Model(tuple(moved if e is effect else e for e in model))
    return density(there.unit_terms(moved, rate), at, n)


def _moving(own: Process, fit: Fit, middles: Array) -> MovingBand:
    data = fit.data
    edges = data.start + data.duration * np.arange(SECTIONS + 1) / SECTIONS
    places = sorted((int(np.argmin(middles)), int(np.argmax(middles))))
    one, other = ((float(edges[s]), float(edges[s + 1]), float(middles[s])) for s in places)
    frequency = 0.5 * sum(own.effect.occupies or (0.0, 0.0))
    return MovingBand(fit.display_name(own.effect), frequency, (one, other))
