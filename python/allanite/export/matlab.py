"""MATLAB: gyroparams and accelparams of an imuSensor."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.export._axis import header, needed, rate_of, split

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.export._axis import Axis

__all__ = ["render"]

NOTE = (
    "% NoiseDensity is double-sided, and said to be; where NoiseType does not exist, the\n"
    "% density is taken as single-sided: multiply it by sqrt(2) there.\n"
)


def render(axes: Sequence[Axis], rate: float | None) -> str:
    """N as NoiseDensity (declared double-sided), B as BiasInstability, K as RandomWalk, in SI.

    Coefficients that the model lacks are not written, and keep MATLAB's default of 0.
    """
    lines = [
        header(axes, "%", "NBK"),
        NOTE,
        f"imu = imuSensor('accel-gyro', 'SampleRate', {rate_of(axes, rate, 'matlab'):g});\n",
    ]
    for own, member, maker, unit in zip(
        split(axes),
        ("Gyroscope", "Accelerometer"),
        ("gyroparams", "accelparams"),
        ("rad/s", "m/s^2"),
        strict=True,
    ):
        if not own:
            continue
        arguments = ["'NoiseType', 'double-sided'"]
        for key, name, suffix in (
            ("NoiseDensity", "N", f"({unit})/sqrt(Hz)"),
            ("BiasInstability", "B", unit),
            ("RandomWalk", "K", f"({unit})*sqrt(Hz)"),
        ):
            if not all(name in axis.coefficients for axis in own):
                continue
            found = [needed(axis, name, "matlab") for axis in own]
            remark = next((f"; {r}" for _, r in found if r), "")
            three = len(found) == 3
            values = (
                "[" + " ".join(f"{v:.6e}" for v, _ in found) + "]"
                if three
                else f"{max(found)[0]:.6e}"
            )
            lines.append(f"% {member} {key} in {suffix}{remark}\n")
            arguments.append(f"'{key}', {values}")
        lines.append(f"imu.{member} = {maker}( ...\n    " + ", ...\n    ".join(arguments) + ");\n")
    return "".join(lines)
