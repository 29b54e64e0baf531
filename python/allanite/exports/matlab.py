"""MATLAB script with gyroparams and accelparams of an imuSensor."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from allanite.effects import Stochastic
from allanite.exports._axis import Axis, gyro_and_accel_axes, rate_of, value_or_limit
from allanite.exports._choice import choose
from allanite.exports._follow import SLACK
from allanite.exports._head import head_comments
from allanite.exports._held import NoiseParameters, random_walk_effect
from allanite.exports._target import Target
from allanite.exports._text import as_comments
from allanite.exports._triad import numbers_in_xyz

NOTE = (
    "imuSensor: continuous-time densities. NoiseDensity is double-sided, as NoiseType states. Versions of MATLAB without",
    "NoiseType expect a single-sided density: multiply NoiseDensity by sqrt(2) there.",
)


#: Kasdin's filter with n poles is 1/f down to the frequency of n samples. MATLAB's default of one pole (from R2023b on) is
#: not 1/f.
MEMORY = "fractalcoef(n, 1) gives flicker noise over n samples. The default, one pole, gives no flicker noise."
#: Length of the filter divided by the horizon. Its Allan deviation is then 1.5 % too high at the horizon; with half of the
#: length, 6 %.
MEMORY_HORIZONS = 2.0


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """Text of a MATLAB script: N as NoiseDensity (double-sided), B as BiasInstability, K as RandomWalk, in SI units.

    K also covers other slow processes. With `overbound`, N and K cover B as well. Each of x, y and z has its own
    numbers, and 0 for an effect that only other axes have. If no axis of a sensor needs B or K, MATLAB's default 0
    holds. Raises `InputError` if `rate` is None and the axes have no common rate.
    """
    fs = rate_of(axes, rate, "matlab")
    convention = [*NOTE]
    everything: list[tuple[Axis, NoiseParameters]] = []
    lines = [f"imu = imuSensor('accel-gyro', 'SampleRate', {fs:g});\n"]
    for own, member, maker, unit in zip(
        gyro_and_accel_axes(axes),
        ("Gyroscope", "Accelerometer"),
        ("gyroparams", "accelparams"),
        ("rad/s", "m/s^2"),
        strict=True,
    ):
        if not own:
            continue
        pairs = [(a, choose(a, overbound=True) if overbound else _fitted_numbers(a)) for a in own]
        everything += pairs
        arguments = ["'NoiseType', 'double-sided'"]
        axis_remarks: list[str] = []
        for key, name, suffix in (
            ("NoiseDensity", "N", f"({unit})/sqrt(Hz)"),
            ("BiasInstability", "B", unit),
            ("RandomWalk", "K", f"({unit})*sqrt(Hz)"),
        ):
            found = [getattr(choice, name) for _, choice in pairs]
            if not any(found):
                continue
            numbers, axis_remarks = numbers_in_xyz(own, [(v,) for v in found])
            lines.append(f"% {member} {key} in {suffix}{_remarks_text(pairs, name)}\n")
            arguments.append(f"'{key}', [{' '.join(f'{v:.6e}' for (v,) in numbers)}]")
            if name == "B":
                poles = max(1, round(MEMORY_HORIZONS * max(a.horizon for a in own) * fs))
                lines.append(f"% {MEMORY}\n")
                arguments.append(f"'BiasInstabilityCoefficients', fractalcoef({poles}, 1)")
        convention += [f"{member} {line}" for line in axis_remarks]
        lines.append(f"imu.{member} = {maker}( ...\n    " + ", ...\n    ".join(arguments) + ");\n")
    return as_comments(head_comments(everything, convention, simulator=True), "%") + "".join(lines)


def _fitted_numbers(axis: Axis) -> NoiseParameters:
    """`NoiseParameters` with the fitted N, B and K; for a coefficient that was not detected, its 95 % upper limit.

    If the model has other slow noise, K is enlarged until N, B and K cover it, unless `Axis.as_fitted` is true.
    """
    first = choose(replace(axis, as_fitted=True))
    values = {"B": 0.0, "K": 0.0}
    remarks = {"N": first.remark("N")}
    for name in values.keys() & axis.coefficients.keys():
        values[name], remarks[name] = value_or_limit(axis.coefficients[name])
    written = replace(first, B=values["B"], K=0.0)
    needed = 0.0
    if _has_other_slow_noise(axis) and not axis.as_fitted:
        needed = _smallest_covering_walk(axis, written)
    if needed > values["K"]:
        values["K"] = needed
        remarks["K"] = (
            "the smallest K with which N, B and K reach 98 % of the Allan deviation of the white and slow noise"
            f" up to {axis.taus[-1]:.3g} s"
        )
    holds = tuple(name for name in "NBK" if name in axis.coefficients) if axis.as_fitted else None
    return replace(written, K=values["K"], remarks=tuple(remarks.items()), holds=holds)


def _smallest_covering_walk(axis: Axis, written: NoiseParameters) -> float:
    """Smallest K (SI) of a random walk that, together with the `written` noise, covers the noise of an axis; may be 0.

    Both must reach 98 % of the Allan deviation of the axis' white and slow noise, at every τ up to the horizon.
    """
    tau, rate = axis.taus, axis.sampling
    slow = axis.scale**2 * axis.slow_model.allan_variance(tau, rate)
    missing = (1.0 - SLACK) ** 2 * slow - written.model.allan_variance(tau, rate)
    needed = float((missing / random_walk_effect(1.0).allan_variance(tau, rate)).max())
    return math.sqrt(max(0.0, needed))


def _has_other_slow_noise(axis: Axis) -> bool:
    """True if the model of an axis has a slow random process other than bias instability B and random walk K."""
    return any(
        isinstance(e, Stochastic)
        and not e.white
        and (e.standard is None or e.standard.name not in "BK")
        for e in axis.slow_model
    )


def _remarks_text(pairs: Sequence[tuple[Axis, NoiseParameters]], name: str) -> str:
    """Remarks on N, B or K (`name`), to append to a comment; a remark that does not hold for all axes names its axes.

    The text begins with ``; ``, and is empty without remarks.
    """
    of: dict[str, list[str]] = {}
    for axis, choice in pairs:
        of.setdefault(choice.remark(name), []).append(axis.name)
    found = ((remark, names) for remark, names in of.items() if remark)
    return "".join(f"; {r}" if len(of) == 1 else f"; {', '.join(n)}: {r}" for r, n in found)


TARGETS = (Target("matlab", "MATLAB", "matlab.m", render, whole_record=True),)
