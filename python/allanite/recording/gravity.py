"""Unit of accelerometers from their mean: at rest it is gravity."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.units import conversion

#: Standard gravity, m/s²; local gravity differs by at most 0.3 %.
GRAVITY = 9.80665
#: Maximum relative difference of a mean acceleration from gravity in the unit that is stated: poor accelerometers have
#: scale errors and biases of 6 % (measured on ten recordings). Twice that is allowed.
MAX_STATED_DIFFERENCE = 0.15
#: Maximum relative difference of a mean acceleration from gravity in a unit that is inferred: a scale error of 6 %.
MAX_INFERRED_DIFFERENCE = 0.06
#: Units of acceleration that loggers use.
UNITS = ("m/s^2", "g", "mg", "mm/s^2", "ug")
#: The median of a column is computed from at most about this number of samples.
MEDIAN_SAMPLES = 100_000


def mean_acceleration(axes: list[NDArray[Any]]) -> float:
    """Magnitude (float) of the vector of the medians of three columns, in their unit.

    NaN samples are ignored; long columns are thinned to about 100 000 samples.
    """
    middle = [
        float(np.nanmedian(x[:: max(1, x.size // MEDIAN_SAMPLES)].astype(np.float64))) for x in axes
    ]
    return float(np.linalg.norm(middle))


def is_gravity(mean: float, unit: str, within: float = MAX_STATED_DIFFERENCE) -> bool:
    """True if a mean acceleration, in `unit`, is 9.80665 m/s² up to the relative difference `within`."""
    return abs(mean * conversion(unit, "m/s^2") / GRAVITY - 1.0) < within


def unit_by_gravity(mean: float) -> str | None:
    """First of m/s^2, g, mg, mm/s^2, ug in which a mean acceleration equals gravity within 6 %; None without one."""
    return next((unit for unit in UNITS if is_gravity(mean, unit, MAX_INFERRED_DIFFERENCE)), None)
