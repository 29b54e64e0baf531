"""MATLAB: gyroparams and accelparams of an imuSensor."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from allanite.effects import Stochastic
from allanite.export._axis import rate_of, split
from allanite.export._choice import LIMIT, choose, covering
from allanite.export._head import head
from allanite.export._target import Target
from allanite.export._text import comments
from allanite.export._triad import in_xyz

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.export._axis import Axis
    from allanite.export._held import Choice

__all__ = ["TARGETS"]

NOTE = (
    "imuSensor: continuous time, deviations. NoiseDensity is double-sided, and said to be; where NoiseType does",
    "not exist, the density is taken as single-sided: multiply it by sqrt(2) there.",
)


#: Kasdin's filter of n poles is 1/f down to one over n samples; the default of one pole is not (MATLAB from R2023b on).
MEMORY = "fractalcoef(n, 1) remembers n samples; the default, one pole, has no flicker noise."
#: Memory of the filter over the horizon: its Allan deviation is 1.5 % high at the horizon, 6 % with half of it.
MEMORY_HORIZONS = 2.0


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """N as NoiseDensity (declared double-sided), B as BiasInstability, K as RandomWalk, in SI.

    K covers other slow processes. B and K that no axis needs are not written, and keep MATLAB's default of 0; an axis
    that lacks what others have has 0. With an overbound, B is inside N and K.
    """
    fs = rate_of(axes, rate, "matlab")
    convention = [*NOTE]
    everything: list[tuple[Axis, Choice]] = []
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
        pairs = [(a, choose(a, overbound=True) if overbound else _chosen(a)) for a in own]
        everything += pairs
        arguments = ["'NoiseType', 'double-sided'"]
        said: list[str] = []
        for key, name, suffix in (
            ("NoiseDensity", "N", f"({unit})/sqrt(Hz)"),
            ("BiasInstability", "B", unit),
            ("RandomWalk", "K", f"({unit})*sqrt(Hz)"),
        ):
            found = [getattr(choice, name) for _, choice in pairs]
            if not any(found):
                continue
            numbers, said = in_xyz(own, [(v,) for v in found])
            lines.append(f"% {member} {key} in {suffix}{_remarks(pairs, name)}\n")
            arguments.append(f"'{key}', [{' '.join(f'{v:.6e}' for (v,) in numbers)}]")
            if name == "B":
                poles = max(1, round(MEMORY_HORIZONS * max(a.horizon for a in own) * fs))
                lines.append(f"% {MEMORY}\n")
                arguments.append(f"'BiasInstabilityCoefficients', fractalcoef({poles}, 1)")
        convention += [f"{member} {line}" for line in said]
        lines.append(f"imu.{member} = {maker}( ...\n    " + ", ...\n    ".join(arguments) + ");\n")
    return comments(head(everything, convention, simulator=True), "%") + "".join(lines)


def _chosen(axis: Axis) -> Choice:
    """N, B and K as they were fitted, or their upper limits; a K that covers what these do not hold, where it is larger."""
    first = choose(axis, simulator=True) if axis.as_fitted else _white(axis)
    values = {"B": 0.0, "K": 0.0}
    remarks = {"N": first.remark("N")}
    for name in values.keys() & axis.coefficients.keys():
        estimate = axis.coefficients[name]
        limit = not estimate.detected and estimate.interval is not None
        values[name] = float(estimate.interval[1] if limit and estimate.interval else estimate)
        remarks[name] = LIMIT if limit else ""
    choice = replace(first, B=values["B"], K=0.0)
    needed = covering(axis, choice.model) if _has_others(axis) and not axis.as_fitted else 0.0
    if needed > values["K"]:
        values["K"] = needed
        remarks["K"] = (
            "the smallest that keeps the Allan deviation of N, B and K above 98 % of that of white and slow noise"
            f" up to {axis.taus[-1]:.3g} s"
        )
    holds = tuple(name for name in "NBK" if name in axis.coefficients) if axis.as_fitted else None
    return replace(choice, K=values["K"], remarks=tuple(remarks.items()), holds=holds)


def _white(axis: Axis) -> Choice:
    """N as it was fitted, without a slow process; where the model has none, of the Allan deviation at one sample."""
    fitted = replace(axis, as_fitted=True)
    return replace(choose(fitted), K=0.0, holds=None)


def _has_others(axis: Axis) -> bool:
    """Whether the model has a slow process that has no place of its own."""
    return any(
        isinstance(e, Stochastic)
        and not e.white
        and (e.standard is None or e.standard.name not in "BK")
        for e in axis.slow
    )


def _remarks(pairs: Sequence[tuple[Axis, Choice]], name: str) -> str:
    """What is to be said of the numbers of this name, with the axes that it is true of unless it is all of them."""
    of: dict[str, list[str]] = {}
    for axis, choice in pairs:
        of.setdefault(choice.remark(name), []).append(axis.name)
    said = ((r, names) for r, names in of.items() if r)
    return "".join(f"; {r}" if len(of) == 1 else f"; {', '.join(n)}: {r}" for r, n in said)


TARGETS = (Target("matlab", "MATLAB", "matlab.m", render, whole_record=True),)
