"""Diagonals of a ROS sensor_msgs/Imu message's covariances, as robot_localization reads them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.export._axis import rate_of, split
from allanite.export._choice import report
from allanite.export._lines import GENERAL
from allanite.export._text import comments
from allanite.export._triad import in_xyz

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from allanite.effects.terms import Term
    from allanite.export._axis import Axis

__all__ = ["render"]


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """Variance of one sample: the integral of the fitted density over the band, row-major 3 × 3.

    The band begins at one over the longest τ of use; a fitted low-pass filter counts.
    """
    fs = rate_of(axes, rate, "ros")
    pairs = split(axes)
    band = f"{1.0 / max(a.until for a in axes):.3g} Hz to {fs / 2:g} Hz"
    lines = [
        GENERAL,
        f"sensor_msgs/Imu, robot_localization: per sample at {fs:g} Hz, variances: the density integrated, {band}.",
        "The filter takes samples as independent of each other: slow noise averages less than it thinks.",
        *(line for own in pairs for axis in own for line in report(axis, None, _noise(axis))),
    ]
    rows = []
    for key, own, unit in zip(
        ("angular_velocity_covariance", "linear_acceleration_covariance"),
        pairs,
        ("(rad/s)^2", "(m/s^2)^2"),
        strict=True,
    ):
        if not own:
            continue
        found = [(variance(axis, fs, upper=overbound),) for axis in own]
        ((x,), (y,), (z,)), said = in_xyz(own, found)
        lines += [f"{key} {line}" for line in said]
        note = f"{unit}; {'from the upper limits' if overbound else 'as fitted'}"
        rows.append(f"{key}: [{x:.6e}, 0, 0, 0, {y:.6e}, 0, 0, 0, {z:.6e}]  # {note}\n")
    return comments(lines) + "".join(rows)


def _noise(axis: Axis) -> list[str]:
    model = axis.model
    kept = (*model.stochastic, *model.modifiers)
    return [n for n, e in zip(model.labels, model.effects, strict=True) if e in kept]


def variance(axis: Axis, rate: float, *, upper: bool = False) -> float:
    """Variance of a sample in SI, without what is slower than the longest τ of use."""
    low = 2.0 * np.pi / (max(axis.until, 10.0 / rate) * rate)
    w = np.geomspace(low, np.pi, 4000)
    slower = np.geomspace(1e-9 * low, low, 2000)
    total = 0.0
    for term in axis.steady(upper=upper).terms(rate):
        if term.power is None:
            total += _within(term, w)
        else:
            # All of it is known exactly, a narrow band too; below the first frequency its density is that there.
            total += (
                term.power
                - _within(term, slower)
                - float(term.spectrum(slower[:1])[0]) * slower[0] / np.pi
            )
    return axis.scale**2 * total


def _within(term: Term, w: NDArray[np.float64]) -> float:
    """Power of a term between the first and the last of these frequencies, rad a sample."""
    return float(np.trapezoid(term.spectrum(w) * w, np.log(w))) / np.pi
