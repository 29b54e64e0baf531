"""MATLAB: gyroparams and accelparams of an imuSensor."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.export._axis import rate_of, split
from allanite.export._choice import choose, report
from allanite.export._lines import GENERAL
from allanite.export._text import comments
from allanite.export._triad import in_xyz

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

    B and K that no model has are not written, and keep MATLAB's default of 0; an axis that lacks what others have has 0.
    """
    fs = rate_of(axes, rate, "matlab")
    # With an overbound, B is inside N and K.
    names = ("N", "K") if overbound else ("N", "B", "K")
    notes = [GENERAL, *NOTE]
    lines = [f"imu = imuSensor('accel-gyro', 'SampleRate', {fs:g});\n"]
    for own, member, maker, unit in zip(
        split(axes),
        ("Gyroscope", "Accelerometer"),
        ("gyroparams", "accelparams"),
        ("rad/s", "m/s^2"),
        strict=True,
    ):
        if not own:
            continue
        for a in own:
            held = ["N", *(name for name in names[1:] if name in a.coefficients)]
            bound = choose(a, overbound=True) if overbound else None
            notes += report(a, bound, held)
        arguments = ["'NoiseType', 'double-sided'"]
        said: list[str] = []
        for key, name, suffix in (
            ("NoiseDensity", "N", f"({unit})/sqrt(Hz)"),
            ("BiasInstability", "B", unit),
            ("RandomWalk", "K", f"({unit})*sqrt(Hz)"),
        ):
            found = [_value(axis, name, overbound=overbound) for axis in own]
            if name not in names or all(v is None for v, _ in found):
                continue
            numbers, said = in_xyz(own, [(v or 0.0,) for v, _ in found])
            remark = next((f"; {r}" for _, r in found if r), "")
            lines.append(f"% {member} {key} in {suffix}{remark}\n")
            arguments.append(f"'{key}', [{' '.join(f'{v:.6e}' for (v,) in numbers)}]")
        notes += [f"{member} {line}" for line in said]
        lines.append(f"imu.{member} = {maker}( ...\n    " + ", ...\n    ".join(arguments) + ");\n")
    return comments(notes, "%") + "".join(lines)


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
