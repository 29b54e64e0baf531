"""The bias at the beginning: its deviation from several switch-ons, or what one log tells of it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from allanite.export._axis import split

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from allanite.export._axis import Axis

__all__ = ["initial_bias", "initial_lines", "unknown"]

#: Seconds of alignment at rest that a file speaks of.
ALIGNMENT = 60.0


def initial_bias(axis: Axis, *, overbound: bool = False) -> float | None:
    """Deviation of the bias at switch-on for a filter that begins with a bias of 0, SI; None from one log.

    Of a gyroscope the mean belongs to it; that of an accelerometer is gravity, and only the spread is known. A further
    switch-on deviates from a mean of n by σ√(1 + 1/n).
    """
    found = axis.turn_on
    if found is None:
        return None
    sigma = float(found["interval"][1] if overbound else found["sigma"])
    square = sigma**2 * (1.0 + 1.0 / int(found["logs"]))
    if axis.unit == "rad/s":
        square += float(found["mean"]) ** 2
    return axis.scale * math.sqrt(square)


def unknown(axis: Axis) -> str:
    """What one log tells: the residual bias after an alignment, and that the rest is unknown."""
    tau = np.array([min(ALIGNMENT, axis.until)])
    # The means of two neighboring stretches differ by the square root of two Allan deviations.
    left = axis.scale * math.sqrt(
        2.0 * float(axis.expected_steady.allan_variance(tau, axis.sampling)[0])
    )
    return (
        f"{axis.name}: the bias at switch-on is not known from one log (give several); after {tau[0]:.3g} s of alignment at"
        f" rest {left:.3g} {axis.unit} remain"
    )


def initial_lines(
    axes: Sequence[Axis], keys: Mapping[str, str], form: str, mark: str = "#", *, overbound: bool
) -> str:
    """A line for the initial bias of each sensor, the largest of its axes; without several logs a comment.

    Parameters
    ----------
    axes : sequence of Axis
    keys : mapping of str to str
        Key of ``gyro`` and ``accel``.
    form : str
        Form of a line with ``key``, ``value`` and ``note``.
    mark : str
        What begins a comment.
    overbound : bool
        Whether the upper ends of the intervals are written.
    """
    lines = []
    for sensor, own in zip(("gyro", "accel"), split(axes), strict=True):
        known = [
            (value, axis)
            for axis in own
            if (value := initial_bias(axis, overbound=overbound)) is not None
        ]
        if known:
            value, axis = max(known, key=lambda one: one[0])
            assert axis.turn_on is not None
            note = (
                f"{mark} {axis.unit}, deviation at switch-on from {axis.turn_on['logs']} logs, largest of the axes,"
                f" {axis.name}"
            )
            if sensor == "accel":
                note += "; about the mean, which gravity hides; tilt between the logs is in it"
            lines.append(form.format(key=keys[sensor], value=value, note=note) + "\n")
        elif own:
            lines.append(f"{mark} {keys[sensor]}: {unknown(own[0])}\n")
    return "".join(lines)
