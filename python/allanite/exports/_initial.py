"""Initial bias of a filter: its standard deviation from several switch-ons, or a comment if there is only one log."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from allanite.exports._axis import Axis, gyro_and_accel_axes

#: Alignment time at rest for which files state the remaining bias, s. Chosen by judgment; not measured.
ALIGNMENT = 60.0


def initial_bias(axis: Axis, *, overbound: bool = False) -> float | None:
    """Standard deviation (SI) of the bias at switch-on, for a filter that starts with bias 0; None without several logs.

    σ is the spread of the bias between n logs. For a gyroscope, the result is √(σ²(1 + 1/n) + mean²). For an
    accelerometer, the mean is left out, because gravity hides it. With `overbound`, σ is the upper end of its interval.
    """
    found = axis.turn_on
    if found is None:
        return None
    sigma = float(found["interval"][1] if overbound else found["sigma"])
    square = sigma**2 * (1.0 + 1.0 / int(found["logs"]))
    if axis.unit == "rad/s":
        square += float(found["mean"]) ** 2
    return axis.scale * math.sqrt(square)


def largest_initial_bias(axes: Iterable[Axis], *, overbound: bool) -> tuple[float, Axis] | None:
    """Pair (`initial_bias`, axis) of the axis with the largest one; None if no axis has several logs."""
    known = [
        (value, axis)
        for axis in axes
        if (value := initial_bias(axis, overbound=overbound)) is not None
    ]
    return max(known, key=lambda pair: pair[0], default=None)


def unknown_bias_text(axis: Axis) -> str:
    """Sentence that one log does not show the bias at switch-on, and which bias remains after an alignment at rest."""
    tau = np.array([min(ALIGNMENT, axis.until)])
    # The means of two neighboring segments differ by √2 Allan deviations.
    left = axis.scale * math.sqrt(
        2.0 * float(axis.expected_model.allan_variance(tau, axis.sampling)[0])
    )
    return (
        f"{axis.name}: the bias at switch-on is not known from one log (give several logs); after {tau[0]:.3g} s of"
        f" alignment at rest {left:.3g} {axis.unit} remain"
    )


def initial_lines(
    axes: Sequence[Axis], keys: Mapping[str, str], form: str, mark: str = "#", *, overbound: bool
) -> str:
    """Text with a line for the bias at switch-on of each sensor: its standard deviation, the largest of the sensor's axes.

    A sensor with only one log gets a comment, which begins with `mark`. `keys` has the key for ``gyro`` and ``accel``;
    `form` is the format of a line with ``key``, ``value`` and ``note``.
    """
    lines = []
    for sensor, own in zip(("gyro", "accel"), gyro_and_accel_axes(axes), strict=True):
        largest = largest_initial_bias(own, overbound=overbound)
        if largest is not None:
            value, axis = largest
            assert axis.turn_on is not None
            note = (
                f"{mark} {axis.unit}, standard deviation at switch-on from {axis.turn_on['logs']} logs; largest axis:"
                f" {axis.name}"
            )
            if sensor == "accel":
                note += "; relative to the mean, as gravity hides the mean; includes tilt between the logs"
            lines.append(form.format(key=keys[sensor], value=value, note=note) + "\n")
        elif own:
            lines.append(f"{mark} {keys[sensor]}: {unknown_bias_text(own[0])}\n")
    return "".join(lines)
