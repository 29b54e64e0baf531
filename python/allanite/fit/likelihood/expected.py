"""Power that a model predicts for a record: bin power of each effect at coefficient 1, and density at single ordinates."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.arrays import Array
from allanite.common.memory import cleared_by_free_buffers
from allanite.common.showing import brief
from allanite.common.threads import stop_if_unwanted
from allanite.effects import Model, Modifier, Stochastic
from allanite.fit.likelihood.peaks import is_narrow, means_near, ordinates_of_bins
from allanite.fit.likelihood.stop_band import EMPTY_BIN_DENSITY_FACTOR, is_empty
from allanite.spectrum import Bins, bins_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.effects.terms import Term
    from allanite.fit.likelihood.data import Data


@dataclass(frozen=True, slots=True, eq=False)
class Noise:
    """Predicted variance of single ordinates from the random effects of a fitted model.

    `level`, shape (bins,), is the estimated ratio of true to modeled power in each bin; 1 without a discrepancy.
    """

    terms: tuple[Term, ...]
    bins: Bins
    level: Array

    __repr__ = brief

    def variance(self, j: NDArray[np.int64]) -> Array:
        """Expected squares of the ordinates j, U² per sample: the density of the model times `level`.

        In the bins of a filter's stop band, it is multiplied by 1e12, so that no ordinate stands out there.
        """
        place = np.searchsorted(self.bins.edges, j, side="right") - 1
        unseen = np.where(is_empty(self.bins), EMPTY_BIN_DENSITY_FACTOR, 1.0)
        return density(self.terms, j, self.bins.n) * (self.level * unseen)[place]


def columns(model: Model, data: Data) -> Array:
    """Expected power of each bin from each random effect at coefficient 1 (`column_of`), shape (bins, effects)."""
    return np.array([column_of(model, effect, data) for effect in model.stochastic]).T


def column(terms: tuple[Term, ...], data: Data) -> Array:
    """Array of the expected power of each bin from a sum of spectral terms, shape (bins,), including leakage by gaps."""
    stop_if_unwanted()
    own = _column_of_terms(terms, data.n)
    return own if data.mixing is None else data.mixing @ own


def column_of(model: Model, effect: Stochastic, data: Data) -> Array:
    """Expected power of each bin from one effect of a model at coefficient 1, shape (bins,).

    The filters of the model act on the effect; on white noise, its level changes and bandwidth act too. Leakage by missing
    samples is included. The array is cached, except for the factor of level changes.
    """
    stop_if_unwanted()
    unscaled, mixing = _without_coefficient(effect), data.mixing
    # Level changes multiply the column; cached columns do not depend on them.
    levels = model.levels if effect.white else ()
    acting: tuple[Modifier, ...] = model.filters
    if effect.white:
        acting = tuple(m for m in model.modifiers if m not in levels)
    arguments = (unscaled, acting, data.rate, data.span, data.n, data.ends_missing)
    if mixing is None:
        column = _complete_column(*arguments)
    else:
        column = data.of_bins.get((unscaled, acting), lambda: mixing @ _complete_column(*arguments))
    return model.mean_level(data.span) ** 2 * column if levels else column


def expected_power(model: Model, data: Data, ends_missing: bool = False) -> Array:
    """Expected power of each bin: sum over all random effects of a model with values, shape (bins,).

    The power is computed as if no sample were missing. With `ends_missing`, only the first and the last sample are missing,
    and the leakage from the ends of the record is left out.
    """
    total = np.zeros(data.bins.count.size)
    for effect in model.stochastic:
        acting = model.modifiers if effect.white else model.filters
        own = _complete_column(
            _without_coefficient(effect), acting, data.rate, data.span, data.n, ends_missing
        )
        total += getattr(effect, effect.coefficient) ** 2 * own
    return total


@cleared_by_free_buffers
@lru_cache(maxsize=8192)
def _without_coefficient(effect: Stochastic) -> Stochastic:
    """Copy of the effect without coefficient, held names and limits: a cache key, since columns do not depend on them."""
    return effect.with_values(**{effect.coefficient: None}, hold=(), limits={}, at_limit=())


@cleared_by_free_buffers
@lru_cache(maxsize=8192)
def _complete_column(
    effect: Stochastic,
    acting: tuple[Modifier, ...],
    rate: float,
    span: tuple[float, float],
    n: int,
    ends_missing: bool,
) -> Array:
    """Expected power of each bin from one effect at coefficient 1 with modifiers, as of `expected_power`, shape (bins,)."""
    terms = Model((*acting, effect)).unit_terms(effect, rate, span)
    if ends_missing:
        terms = tuple(term.inside for term in terms)
    column = _column_of_terms(terms, n)
    if is_narrow(effect):
        # The nodes of a bin would miss the narrow band.
        column = column.copy()
        near, means = means_near(effect, bins_of(n), rate, lambda j: density(terms, j, n))
        column[near] = means
        column.flags.writeable = False
    return column


def _column_of_terms(terms: tuple[Term, ...], n: int) -> Array:
    """Array of the expected power of each bin from spectral terms, for n samples without gaps, shape (bins,); read-only."""
    out = _evaluator(n).means([term.at_ordinates(n) for term in terms], bins_of(n).owner)
    out.flags.writeable = False
    return out


@cleared_by_free_buffers
@lru_cache(maxsize=32)
def _evaluator(n: int) -> _kernels.Ordinates:
    """`_kernels.Ordinates`: evaluator of densities at the nodes (selected ordinates) of the bins of n samples; cached."""
    return _kernels.Ordinates(bins_of(n).nodes, n)


def density(terms: tuple[Term, ...], ordinates: NDArray[np.int64], n: int) -> Array:
    """Expected squares of given cosine ordinates of n samples, U² per sample, at least 1e-300."""
    return density_by(_kernels.Ordinates(ordinates, n), terms, n)


def density_in_bins(terms: tuple[Term, ...], near: NDArray[np.intp], n: int) -> Array:
    """`density` at all ordinates of the bins with the indices `near`, bin after bin (`ordinates_of_bins`)."""
    return density_by(_evaluator_in_bins(n, tuple(near.tolist())), terms, n)


def density_by(evaluator: _kernels.Ordinates, terms: tuple[Term, ...], n: int) -> Array:
    """`density` at the ordinates of an `evaluator`, whose construction takes longer than the evaluation of a few terms."""
    stop_if_unwanted()
    return np.maximum(evaluator.variance([term.at_ordinates(n) for term in terms]), 1e-300)


@cleared_by_free_buffers
@lru_cache(maxsize=8)
def _evaluator_in_bins(n: int, near: tuple[int, ...]) -> _kernels.Ordinates:
    """`_kernels.Ordinates`: evaluator of densities at all ordinates of the bins with the indices `near`; cached."""
    return _kernels.Ordinates(ordinates_of_bins(np.array(near), bins_of(n)), n)


def relative_power_of_segments(
    parts: Sequence[Stochastic], ordinates: NDArray[np.int64], data: Data
) -> Array:
    """Power of a process in each time segment, divided by the mean over the segments, shape (segments, ordinates)."""
    evaluator = _kernels.Ordinates(ordinates, data.n)
    power = np.array([density_by(evaluator, p.unit_terms(data.rate), data.n) for p in parts])
    return np.asarray(power / power.mean(axis=0))
