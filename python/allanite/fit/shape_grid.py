"""Values of shape parameters worth trying on a record."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite.effects import Effect, Model

if TYPE_CHECKING:
    from allanite.fit.data import Data

__all__ = ["replaced", "shape_grid"]


def shape_grid(effect: Effect, name: str, data: Data) -> NDArray[np.float64]:
    """Values of a shape parameter worth trying on this record.

    Times run from two samples to half the record (a longer lag is a random walk), 8 a decade; frequencies from 4/T to
    Nyquist; an effect may say otherwise with a `grid` method.
    """
    own = getattr(effect, "grid", None)
    if own is not None:
        return np.asarray(own(name, data.n, data.rate), dtype=float)
    unit = effect.parameter(name).unit
    if unit == "s":
        low, high = 2.0 / data.rate, data.duration / 2.0
    else:
        low, high = 4.0 / data.duration, 0.5 * data.rate
    return np.geomspace(low, high, max(4, int(8 * np.log10(high / low))))


def replaced(model: Model, place: int, **values: Any) -> Model:
    """The model with other values of the effect at `place`."""
    effects = list(model.effects)
    effects[place] = effects[place].with_values(**values)
    return Model(tuple(effects))
