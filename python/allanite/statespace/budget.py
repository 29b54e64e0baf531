"""Error budget of a strapdown system at rest: velocity and position errors from gyroscopes and accelerometers together.

In a horizontal channel gravity turns a tilt into acceleration, and the traveled velocity turns the local level:

    dθ/dt = ω + v/R,    dv/dt = a − g θ,    dp/dt = v.

An error then oscillates with the Schuler period 2π √(R/g), 84 minutes, instead of growing without limit (Titterton &
Weston, Strapdown Inertial Navigation Technology, 2004, chapter 12). As in `growth`, each bias was averaged before the last
fix, at which attitude, velocity and position are right.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from allanite.common.arrays import Array
from allanite.common.errors import InputError
from allanite.common.units import ACCELERATION, ANGULAR_RATE, parse_unit
from allanite.common.validation import positive, positive_rate
from allanite.effects import Model
from allanite.recording.axis_names import axis_letter
from allanite.statespace.coasting import Coasting, Sums
from allanite.statespace.growth import (
    GRAVITY,
    Growth,
    sample_counts,
    terms_by_label,
    variogram_of,
)

#: Mean radius of the Earth, m (IUGG).
RADIUS = 6.371e6
#: Schuler frequency, rad/s.
SCHULER = float(np.sqrt(GRAVITY / RADIUS))


@dataclass(frozen=True, slots=True)
class Axis:
    """Model of one axis: its name, the unit of its samples and their rate in Hz."""

    name: str
    model: Model
    unit: str
    rate: float


def _schuler_response(u: Array) -> Array:
    """Impulse response sin(ωu)/ω, s, at the times u (s), with the Schuler frequency ω. For small u it is about u."""
    return np.asarray(np.sin(SCHULER * u) / SCHULER)


def _integrated_sine(u: Array) -> Array:
    """Integral of sin(ωu)/ω from 0 to u, (1 − cos ωu)/ω², s², at the times u (s), with the Schuler frequency ω."""
    return np.asarray(2.0 * (np.sin(0.5 * SCHULER * u) / SCHULER) ** 2)


def _twice_integrated_sine(u: Array) -> Array:
    """Second integral of sin(ωu)/ω from 0 to u (s), (u − sin(ωu)/ω)/ω², s³, with the Schuler frequency ω."""
    x = SCHULER * u
    series = u**3 / 6.0 * (1.0 - x**2 / 20.0 * (1.0 - x**2 / 42.0))
    return np.asarray(np.where(x < 0.1, series, (u - _schuler_response(u)) / SCHULER**2))


#: Quantity → kind of sensor → function of u: the quantity u seconds (array) after a unit step of the sensor's error.
RESPONSES: dict[str, dict[str, Callable[[Array], Array]]] = {
    "horizontal velocity": {
        ANGULAR_RATE: lambda u: -GRAVITY * _integrated_sine(u),
        ACCELERATION: _schuler_response,
    },
    "horizontal position": {
        ANGULAR_RATE: lambda u: -GRAVITY * _twice_integrated_sine(u),
        ACCELERATION: _integrated_sine,
    },
}
#: Name of each kind of sensor in a budget.
SENSORS = {ANGULAR_RATE: "gyroscopes", ACCELERATION: "accelerometers"}


@dataclass(frozen=True, eq=False)
class _SchulerCoasting(Coasting):
    """Coasting of a horizontal channel. `step_response` is a function of the time, s, since a unit step of the error."""

    step_response: Callable[[Array], Array]

    @cached_property
    def weights(self) -> Array:
        """Weights of the samples since the fix, oldest first, shape (m,): the error at the end is Σ weight · sample."""
        edges = self.step_response((self.m - np.arange(self.m + 1)) / self.rate)
        return np.asarray(edges[:-1] - edges[1:])

    @cached_property
    def _correlation(self) -> Array:
        """Autocorrelation Σ_l r(l) r(l+h) of `weights` r at the lags h = 0 … m − 1, by FFT, shape (m,)."""
        size = 1 << (2 * self.m - 1).bit_length()
        spectrum = np.fft.rfft(self.weights, size)
        return np.fft.irfft(np.abs(spectrum) ** 2, size)[: self.m]


def six_axis_budget(axes: Sequence[Axis], *, aided: float, tau: ArrayLike) -> tuple[Growth, ...]:
    """Tuple of two `Growth`: horizontal velocity error, then position error, of a strapdown system at rest.

    It needs a gyroscope and an accelerometer. If axes of one kind are named x and y, only these two count. `aided` seconds
    before the fix estimate the bias; `tau` are times since the fix, s. The error is the root of the sum of both horizontal
    variances, without vertical and heading errors. `InputError` for a missing kind of sensor, times that are not positive,
    or more than 2²⁴ samples.
    """
    kinds = {kind: [a for a in axes if parse_unit(a.unit).kind == kind] for kind in SENSORS}
    for kind, own in kinds.items():
        if not own:
            raise InputError(f"a budget needs a model of the {SENSORS[kind]} too: give both")
    aided = positive(aided, "aided", "s", "give the seconds of aiding before the fix")
    times = np.atleast_1d(np.asarray(tau, dtype=float))
    out = []
    for quantity, responses in RESPONSES.items():
        budget = {
            SENSORS[kind]: np.sqrt(
                _horizontal_variance(_horizontal_axes(own), responses[kind], aided, times)
            )
            for kind, own in kinds.items()
        }
        total = np.sqrt(sum((v**2 for v in budget.values()), np.zeros(times.size)))
        unit = "m/s" if quantity.endswith("velocity") else "m"
        out.append(Growth(quantity, unit, times, total, budget, (), aided))
    return tuple(out)


def _horizontal_axes(own: Sequence[Axis]) -> list[Axis]:
    """List of `Axis`: the two axes named x and y if there are exactly two, else all axes."""
    level = [axis for axis in own if axis_letter(axis.name) in ("x", "y")]
    return level if len(level) == 2 else list(own)


def _horizontal_variance(
    axes: Sequence[Axis], step_response: Callable[[Array], Array], aided: float, times: Array
) -> Array:
    """Array: variance of the horizontal velocity or position error at the `times` (s) after aiding ends, SI units squared.

    `axes` are all gyroscopes or all accelerometers. The result is twice their mean, because there are two horizontal
    channels. `step_response` is the error of a channel due to a sensor error of 1 from time 0 on. The mean over the
    `aided` seconds before time 0 is subtracted as the bias. Raises `InputError` for more than 2²⁴ samples.
    """
    total = np.zeros(times.size)
    for axis in axes:
        rate = positive_rate(axis.rate)
        back, ahead = sample_counts(aided, times, rate)
        parts, _ = terms_by_label(axis.model, rate)
        terms = [term for own_terms in parts.values() for term in own_terms]
        sums = Sums(variogram_of(terms, back + max(ahead)))
        scale = parse_unit(axis.unit).scale
        found = [_SchulerCoasting(back, m, rate, 1, step_response).deviation(sums) for m in ahead]
        total += (scale * np.array(found)) ** 2
    return np.asarray(2.0 * total / len(axes))
