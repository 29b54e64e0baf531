"""MATLAB script with gyroparams and accelparams of an imuSensor."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from allanite.effects import Stochastic
from allanite.exports._axis import gyro_and_accel_axes, rate_of
from allanite.exports._choice import LIMIT, choose, smallest_covering_walk
from allanite.exports._head import head_comments
from allanite.exports._target import Target
from allanite.exports._text import as_comments
from allanite.exports._triad import numbers_in_xyz

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.exports._axis import Axis
    from allanite.exports._held import Choice

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

    K covers other slow processes. If no axis needs B or K, the parameter is not written and keeps MATLAB's default 0.
    An axis without an effect that other axes have gets 0. With `overbound`, N and K also cover B. Each of x, y and z
    has its own numbers. Raises `InputError` if `rate` is None and the axes have no common rate.
    """
    fs = rate_of(axes, rate, "matlab")
    convention = [*NOTE]
    everything: list[tuple[Axis, Choice]] = []
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


def _fitted_numbers(axis: Axis) -> Choice:
    """`Choice` with the fitted N, B and K, or their upper limits if not detected; K also covers other slow processes.

    If the axis is exported as fitted (`as_fitted`), K is the fitted one alone.
    """
    first = choose(axis, simulator=True) if axis.as_fitted else _white_numbers(axis)
    values = {"B": 0.0, "K": 0.0}
    remarks = {"N": first.remark("N")}
    for name in values.keys() & axis.coefficients.keys():
        estimate = axis.coefficients[name]
        limit = not estimate.detected and estimate.interval is not None
        values[name] = float(estimate.interval[1] if limit and estimate.interval else estimate)
        remarks[name] = LIMIT if limit else ""
    choice = replace(first, B=values["B"], K=0.0)
    needed = (
        smallest_covering_walk(axis, choice.model)
        if _has_others(axis) and not axis.as_fitted
        else 0.0
    )
    if needed > values["K"]:
        values["K"] = needed
        remarks["K"] = (
            "the smallest K with which N, B and K reach 98 % of the Allan deviation of the white and slow noise"
            f" up to {axis.taus[-1]:.3g} s"
        )
    holds = tuple(name for name in "NBK" if name in axis.coefficients) if axis.as_fitted else None
    return replace(choice, K=values["K"], remarks=tuple(remarks.items()), holds=holds)


def _white_numbers(axis: Axis) -> Choice:
    """`Choice` with the fitted N and K = 0; without white noise, N from the Allan deviation at one sample."""
    fitted = replace(axis, as_fitted=True)
    return replace(choose(fitted), K=0.0, holds=None)


def _has_others(axis: Axis) -> bool:
    """True if the model has a slow process other than B and K."""
    return any(
        isinstance(e, Stochastic)
        and not e.white
        and (e.standard is None or e.standard.name not in "BK")
        for e in axis.slow_model
    )


def _remarks_text(pairs: Sequence[tuple[Axis, Choice]], name: str) -> str:
    """Remarks on the number `name`, as text to append to a comment (``; remark; x, y: remark``), or an empty text.

    A remark that does not hold for all axes names its axes.
    """
    of: dict[str, list[str]] = {}
    for axis, choice in pairs:
        of.setdefault(choice.remark(name), []).append(axis.name)
    found = ((remark, names) for remark, names in of.items() if remark)
    return "".join(f"; {r}" if len(of) == 1 else f"; {', '.join(n)}: {r}" for r, n in found)


TARGETS = (Target("matlab", "MATLAB", "matlab.m", render, whole_record=True),)
