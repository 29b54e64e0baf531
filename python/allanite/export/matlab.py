"""MATLAB: gyroparams and accelparams of an imuSensor."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.export._axis import rate_of, split
from allanite.export._choice import choose, report
from allanite.export._lines import GENERAL
from allanite.export._text import comments

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.export._axis import Axis

__all__ = ["render"]

NOTE = (
    "imuSensor: continuous time, deviations. NoiseDensity is double-sided, and said to be; where NoiseType does",
    "not exist, the density is taken as single-sided: multiply it by sqrt(2) there.",
)


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """N as NoiseDensity (declared double-sided), B as BiasInstability, K as RandomWalk, in SI.

    B and K that the model lacks are not written, and keep MATLAB's default of 0.
    """
    fs = rate_of(axes, rate, "matlab")
    pairs = split(axes)
    # With an overbound, B is inside N and K.
    names = ("N", "K") if overbound else ("N", "B", "K")
    lines = [
        comments(
            [
                GENERAL,
                *NOTE,
                *(
                    line
                    for own in pairs
                    for a in own
                    for line in (
                        report(a, choose(a, overbound=True))
                        if overbound
                        else report(a, None, names)
                    )
                ),
            ],
            "%",
        ),
        f"imu = imuSensor('accel-gyro', 'SampleRate', {fs:g});\n",
    ]
    for own, member, maker, unit in zip(
        pairs,
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
            found = [_value(axis, name, overbound=overbound) for axis in own]
            numbers = [v for v, _ in found if v is not None]
            if len(numbers) < len(own) or name not in names:
                continue
            remark = next((f"; {r}" for _, r in found if r), "")
            values = (
                "[" + " ".join(f"{v:.6e}" for v in numbers) + "]"
                if len(numbers) == 3
                else f"{max(numbers):.6e}"
            )
            lines.append(f"% {member} {key} in {suffix}{remark}\n")
            arguments.append(f"'{key}', {values}")
        lines.append(f"imu.{member} = {maker}( ...\n    " + ", ...\n    ".join(arguments) + ");\n")
    return "".join(lines)


def _value(axis: Axis, name: str, *, overbound: bool) -> tuple[float | None, str]:
    if overbound or name == "N":
        choice = choose(axis, overbound=overbound)
        return getattr(choice, name, None), choice.remark(name)
    estimate = axis.coefficients.get(name)
    if estimate is None:
        return None, ""
    if estimate.detected or estimate.interval is None:
        return estimate.value, ""
    return estimate.interval[1], "not detected: this is the 95 % upper limit"
