"""MATLAB factorIMUParameters: covariances for the IMU factor of a factorGraph."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from allanite.exports._axis import Axis, rate_of
from allanite.exports._choice import choose
from allanite.exports._head import head_comments
from allanite.exports._target import Target
from allanite.exports._text import as_comments
from allanite.exports._triad import triads_of

#: Minimum SampleRate in the documentation of factorIMUParameters, Hz.
MIN_SAMPLE_RATE = 100.0
#: Units of √(N²·Hz) and √(K²·Hz) of each sensor.
UNITS = {"Gyroscope": ("rad/s", "rad/s^2"), "Accelerometer": ("m/s^2", "m/s^3")}


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """Text of a MATLAB script that calls factorIMUParameters with N² and K² of x, y and z in SI.

    MATLAB's factorIMU multiplies N² by the rate for a sample, and K² by the time between nodes. A rate below 100 Hz
    adds a remark. Raises `InputError` if `rate` is None and the axes have no common rate.
    """
    fs = rate_of(axes, rate, "factorimu")
    convention = [
        "factorIMUParameters: continuous-time, two-sided covariances N^2 and K^2, despite the units in its documentation.",
        "The factor multiplies N^2 by SampleRate for a sample, and K^2 by the time between two nodes.",
    ]
    if fs < MIN_SAMPLE_RATE:
        convention.append(
            f"SampleRate is below the documented minimum of {MIN_SAMPLE_RATE:g} Hz: use a higher sampling rate."
        )
    rows = []
    found = triads_of(axes, UNITS, partial(choose, overbound=overbound), ("N", "K"))
    for name, numbers in found.numbers.items():
        for key, coefficient, unit in zip(("Noise", "BiasNoise"), "NK", UNITS[name], strict=True):
            values = " ".join(f"{value:.6e}" for value in numbers[coefficient])
            rows.append(f"    '{name}{key}', diag([{values}].^2), ...  % ({unit})^2/Hz\n")
    lines = as_comments(head_comments(found.pairs, [*convention, *found.remarks]), "%")
    return (
        f"{lines}parameters = factorIMUParameters( ...\n{''.join(rows)}    'SampleRate', {fs:g});\n"
    )


TARGETS = (Target("factorimu", "MATLAB factorIMU", "factorimu.m", render, both_sensors=True),)
