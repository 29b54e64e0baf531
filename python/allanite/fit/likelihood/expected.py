"""What a model expects of a record: power in its bins, of each effect at coefficient 1, and squares of single ordinates."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from operator import is_
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.memory import released
from allanite.common.showing import brief
from allanite.common.threads import go_on
from allanite.effects import Model
from allanite.fit.likelihood.peaks import is_narrow, means_near
from allanite.fit.likelihood.stop_band import UNSEEN, empty
from allanite.spectrum import Bins, bins_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.effects import Modifier, Stochastic
    from allanite.effects.terms import Term
    from allanite.fit.likelihood.data import Data

__all__ = [
    "Noise",
    "at_each_time",
    "column",
    "column_of",
    "columns",
    "columns_like",
    "density",
    "means",
]


@dataclass(frozen=True, slots=True, eq=False)
class Noise:
    """What the random part of a model expects of single ordinates.

    Attributes
    ----------
    terms : tuple of Term
    bins : Bins
    level : ndarray, shape (bins,)
        By how much the power of each bin probably differs from the model: 1 where the model is true.
    """

    terms: tuple[Term, ...]
    bins: Bins
    level: NDArray[np.float64]

    __repr__ = brief

    def variance(self, j: NDArray[np.int64]) -> NDArray[np.float64]:
        """Expected squared ordinates j, U² per sample."""
        place = np.searchsorted(self.bins.edges, j, side="right") - 1
        # Of an empty bin nothing is told.
        unseen = np.where(empty(self.bins), UNSEEN, 1.0)
        return density(self.terms, j, self.bins.n) * (self.level * unseen)[place]


def columns(model: Model, effects: tuple[Stochastic, ...], data: Data) -> NDArray[np.float64]:
    """Expected bin power of each effect at coefficient 1, shape (bins, effects)."""
    out = np.empty((len(effects), data.bins.count.size))
    modifiers, filters = model.modifiers, model.filters
    for row, effect in zip(out, effects, strict=True):
        row[:] = _own(effect, modifiers if effect.white else filters, data)
    return out.T


def columns_like(
    model: Model, other: Model, known: NDArray[np.float64], data: Data
) -> NDArray[np.float64]:
    """`columns` of all random effects of a model, from those of another of as many: only what moved is computed anew."""
    effects, before = model.stochastic, other.stochastic
    modifiers, filters = model.modifiers, model.filters
    still = len(modifiers) == len(other.modifiers) and all(map(is_, modifiers, other.modifiers))
    passed = still or filters == other.filters
    out = np.array(known.T)
    for row, effect, old in zip(out, effects, before, strict=True):
        if effect is not old or not (still if effect.white else passed):
            row[:] = _own(effect, modifiers if effect.white else filters, data)
    return out.T


def column(terms: tuple[Term, ...], data: Data) -> NDArray[np.float64]:
    """Expected bin power of a sum of terms, shape (bins,)."""
    go_on()
    own = _column(terms, data.n)
    return own if data.mixing is None else data.mixing @ own


def column_of(model: Model, effect: Stochastic, data: Data) -> NDArray[np.float64]:
    """Expected bin power of one effect of a model at coefficient 1, shape (bins,)."""
    return _own(effect, model.modifiers if effect.white else model.filters, data)


def means(model: Model, data: Data, ends_out: bool = False) -> NDArray[np.float64]:
    """Expected power in each bin of a model with values, as if no sample were missing, shape (bins,).

    Or, with `ends_out`, none but the first and the last.
    """
    total = np.zeros(data.bins.count.size)
    for effect in model.stochastic:
        acting = model.modifiers if effect.white else model.filters
        own = _behind(_open(effect), acting, data.rate, data.span, data.n, ends_out)
        total += getattr(effect, effect.coefficient) ** 2 * own
    return total


def _own(effect: Stochastic, acting: tuple[Modifier, ...], data: Data) -> NDArray[np.float64]:
    """`column_of` an effect on which these modifiers act."""
    go_on()
    opened, mixing = _open(effect), data.mixing

    def own() -> NDArray[np.float64]:
        return _behind(opened, acting, data.rate, data.span, data.n, data.ends_out)

    return own() if mixing is None else data.mixed.get((opened, acting), lambda: mixing @ own())


@released
@lru_cache(maxsize=8192)
def _open(effect: Stochastic) -> Stochastic:
    """The effect without its coefficient, on which its column does not depend."""
    return effect.with_values(**{effect.coefficient: None}, hold=(), limits={}, at_limit=())


@released
@lru_cache(maxsize=8192)
def _behind(
    effect: Stochastic,
    acting: tuple[Modifier, ...],
    rate: float,
    span: tuple[float, float],
    n: int,
    ends_out: bool,
) -> NDArray[np.float64]:
    """`column_of` an effect behind these modifiers, in a record without holes."""
    terms = Model((*acting, effect)).unit_terms(effect, rate, span)
    if ends_out:
        inside = tuple(term.inside for term in terms)
        if inside == terms:
            return _behind(effect, acting, rate, span, n, False)
        terms = inside
    column = _column(terms, n)
    if is_narrow(effect):
        # The nodes of a bin miss it.
        column = column.copy()
        near, means = means_near(effect, bins_of(n), rate, lambda j: density(terms, j, n))
        column[near] = means
        column.flags.writeable = False
    return column


def _column(terms: tuple[Term, ...], n: int) -> NDArray[np.float64]:
    out = _nodes(n).means([term.at_ordinates(n) for term in terms], bins_of(n).owner)
    out.flags.writeable = False
    return out


@released
@lru_cache(maxsize=32)
def _nodes(n: int) -> _kernels.Ordinates:
    """The nodes of the bins of n samples, in the core."""
    return _kernels.Ordinates(bins_of(n).nodes, n)


def density(terms: tuple[Term, ...], ordinates: NDArray[np.int64], n: int) -> NDArray[np.float64]:
    """Expected squared ordinates at single j."""
    go_on()
    found = _kernels.Ordinates(ordinates, n).variance([term.at_ordinates(n) for term in terms])
    return np.maximum(found, 1e-300)


def at_each_time(
    parts: Sequence[Stochastic], ordinates: NDArray[np.int64], data: Data
) -> NDArray[np.float64]:
    """Power of each part in turn of a band that moves, over their mean, at single j, shape (parts, ordinates)."""
    terms = [part.unit_terms(data.rate) for part in parts]
    power = np.array([density(own, ordinates, data.n) for own in terms])
    return np.asarray(power / power.mean(axis=0))
