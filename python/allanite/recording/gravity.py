"""What the mean acceleration of three accelerometers says of their unit: at rest it is gravity."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.units import conversion

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["is_gravity", "mean_acceleration", "unit_by_gravity"]

#: m/s². Local gravity differs by 0.3 % at most.
GRAVITY = 9.80665
#: Largest relative difference of a mean acceleration from gravity in the unit that is stated: poor accelerometers have
#: scale errors and biases of 6 % (measured on ten recordings); twice that is allowed.
STATED = 0.15
#: The same for a unit that is inferred: a scale error of 6 %.
INFERRED = 0.06
#: Units that loggers write.
UNITS = ("m/s^2", "g", "mg", "mm/s^2", "ug")
#: Samples of which the median is taken.
SAMPLES = 100_000


def mean_acceleration(axes: list[NDArray[Any]]) -> float:
    """Return the length of the vector of the medians of three columns, in their unit."""
    middle = [float(np.nanmedian(x[:: max(1, x.size // SAMPLES)].astype(np.float64))) for x in axes]
    return float(np.linalg.norm(middle))


def is_gravity(mean: float, unit: str, within: float = STATED) -> bool:
    """Return whether a mean acceleration in a unit is gravity."""
    return abs(mean * conversion(unit, "m/s^2") / GRAVITY - 1.0) < within


def unit_by_gravity(mean: float) -> str | None:
    """Return the unit in which a mean acceleration is gravity, or None."""
    return next((unit for unit in UNITS if is_gravity(mean, unit, INFERRED)), None)
