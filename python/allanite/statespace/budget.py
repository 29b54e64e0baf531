"""Budget of a strapdown system at rest: what gyroscopes and accelerometers add to velocity and position together.

In a horizontal channel gravity turns a tilt into acceleration, and the travelled velocity turns the local level:

    dθ/dt = ω + v/R,    dv/dt = a − g θ,    dp/dt = v.

An error then swings with the Schuler period 2π √(R/g), 84 minutes, instead of growing without limit (Titterton & Weston,
Strapdown Inertial Navigation Technology, 2004, chapter 12). As in `growth`, each bias was averaged before the last fix, at
which attitude, velocity and position are right.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.common.errors import InputError
from allanite.common.units import ACCELERATION, ANGULAR_RATE, parse_unit
from allanite.common.validation import positive, positive_rate
from allanite.recording.axis_names import letter_of
from allanite.statespace.coasting import Coasting, Sums
from allanite.statespace.growth import GRAVITY, LONGEST, Growth, count_of, parts_of, variogram_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from allanite.effects import Model

__all__ = ["Axis", "six_axis_budget"]

Array = NDArray[np.float64]
#: Mean radius of the Earth, m (IUGG).
RADIUS = 6.371e6
SCHULER = float(np.sqrt(GRAVITY / RADIUS))


@dataclass(frozen=True, slots=True)
class Axis:
    """Model of one axis: its name, the unit of its samples and their rate in Hz."""

    name: str
    model: Model
    unit: str
    rate: float


def _sine(u: Array) -> Array:
    return np.asarray(np.sin(SCHULER * u) / SCHULER)


def _half(u: Array) -> Array:
    """(1 − cos)/ω²: u²/2 at the beginning."""
    return np.asarray(2.0 * (np.sin(0.5 * SCHULER * u) / SCHULER) ** 2)


def _third(u: Array) -> Array:
    """(u − sin/ω)/ω²: u³/6 at the beginning, from its series where little is left of the difference."""
    x = SCHULER * u
    series = u**3 / 6.0 * (1.0 - x**2 / 20.0 * (1.0 - x**2 / 42.0))
    return np.asarray(np.where(x < 0.1, series, (u - _sine(u)) / SCHULER**2))


#: Kind of sensor and quantity → integral over u of what an impulse makes after u seconds.
RESPONSES: dict[str, dict[str, Callable[[Array], Array]]] = {
    "horizontal velocity": {
        ANGULAR_RATE: lambda u: -GRAVITY * _half(u),
        ACCELERATION: _sine,
    },
    "horizontal position": {
        ANGULAR_RATE: lambda u: -GRAVITY * _third(u),
        ACCELERATION: _half,
    },
}
SENSORS = {ANGULAR_RATE: "gyroscopes", ACCELERATION: "accelerometers"}


class _Swinging(Coasting):
    """A coasting whose samples count with the response of a horizontal channel."""

    def __init__(self, back: int, m: int, rate: float, integral: Callable[[Array], Array]) -> None:
        super().__init__(back, m, rate, 1)
        edges = integral((m - np.arange(m + 1)) / rate)
        weights = edges[:-1] - edges[1:]
        size = 1 << (2 * m - 1).bit_length()
        spectrum = np.fft.rfft(weights, size)
        # Cached properties of the class, found here first.
        self.__dict__["weights"] = weights
        self.__dict__["_correlation"] = np.fft.irfft(np.abs(spectrum) ** 2, size)[:m]


def six_axis_budget(axes: Sequence[Axis], *, aided: float, tau: ArrayLike) -> tuple[Growth, ...]:
    """Horizontal velocity and position of all axes together, by sensor.

    Parameters
    ----------
    axes : sequence of Axis
        At least a gyroscope and an accelerometer. Of three that are named by letters x and y count: y tilts x.
    aided : float
        Seconds of aiding before the fix.
    tau : array_like
        Times since the fix, s.

    Returns
    -------
    tuple of Growth
        Root of the sum of both horizontal variances. Vertical errors and heading are not in it.

    Raises
    ------
    InputError
        A kind of sensor is missing.
    """
    kinds = {kind: [a for a in axes if parse_unit(a.unit).kind == kind] for kind in SENSORS}
    for kind, own in kinds.items():
        if not own:
            raise InputError(f"a budget needs a model of the {SENSORS[kind]} too: give both")
    times = np.atleast_1d(np.asarray(tau, dtype=float))
    out = []
    for quantity, responses in RESPONSES.items():
        budget = {
            SENSORS[kind]: np.sqrt(_squares(_horizontal(own), responses[kind], aided, times))
            for kind, own in kinds.items()
        }
        total = np.sqrt(sum((v**2 for v in budget.values()), np.zeros(times.size)))
        unit = "m/s" if quantity.endswith("velocity") else "m"
        out.append(Growth(quantity, unit, times, total, budget, (), aided))
    return tuple(out)


def _horizontal(own: Sequence[Axis]) -> list[Axis]:
    """The axes of both horizontal channels: x and y where the names say so, else the mean of all, twice."""
    level = [axis for axis in own if letter_of(axis.name) in ("x", "y")]
    return level if len(level) == 2 else list(own)


def _squares(
    own: Sequence[Axis], integral: Callable[[Array], Array], aided: float, times: Array
) -> Array:
    """Variance of both channels together: twice the mean over the axes."""
    total = np.zeros(times.size)
    for axis in own:
        rate = positive_rate(axis.rate)
        back = count_of(positive(aided, "aided", "s", "give the seconds of aiding"), rate, "aided")
        ahead = [count_of(float(t), rate, "tau") for t in times]
        if back + max(ahead) > LONGEST:
            raise InputError(
                f"{max(times):g} s at {rate:g} Hz are too many samples: predict a shorter time"
            )
        parts, _ = parts_of(axis.model, rate)
        terms = [term for own_terms in parts.values() for term in own_terms]
        sums = Sums(variogram_of(terms, back + max(ahead)))
        scale = parse_unit(axis.unit).scale
        found = [_Swinging(back, m, rate, integral).deviation(sums) for m in ahead]
        total += (scale * np.array(found)) ** 2
    return np.asarray(2.0 * total / len(own))
