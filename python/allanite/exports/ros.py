"""Covariances of a ROS sensor_msgs/Imu message, as robot_localization reads them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.effects.terms import Term
from allanite.exports._axis import Axis, gyro_and_accel_axes, rate_of
from allanite.exports._follow import negligible_walk
from allanite.exports._head import head_comments
from allanite.exports._held import NoiseParameters
from allanite.exports._target import Target
from allanite.exports._text import as_comments
from allanite.exports._triad import numbers_in_xyz


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """Text with the 3 × 3 covariance of one sample of each sensor, row by row, diagonal.

    Filters that read the message treat samples as independent. Therefore the variance is N²·rate plus the variance of
    spectral lines, noise bands and slow noise. White noise behind a low-pass filter counts without this filter, because
    it averages out as slowly. A comment states the variance within the band of the filter, if it is over 1 % smaller. A
    sensor without axes has no line. Raises `InputError` if `rate` is None and the axes have no common rate.
    """
    fs = rate_of(axes, rate, "ros")
    sensors = gyro_and_accel_axes(axes)
    low = 1.0 / max(a.horizon for a in axes)
    convention = [
        f"sensor_msgs/Imu, robot_localization: variance per sample at {fs:g} Hz. It is N^2*rate of the white noise plus",
        f"the variance of lines, bands and slow noise above {low:.3g} Hz, as the filter treats samples as independent.",
    ]
    rows, pairs = [], []
    for key, own, unit in zip(
        ("angular_velocity_covariance", "linear_acceleration_covariance"),
        sensors,
        ("(rad/s)^2", "(m/s^2)^2"),
        strict=True,
    ):
        if not own:
            continue
        found = [(sample_variance(axis, fs, upper=overbound),) for axis in own]
        ((x,), (y,), (z,)), axis_remarks = numbers_in_xyz(own, found)
        convention += [f"{key} {line}" for line in axis_remarks]
        for axis, (one,) in zip(own, found, strict=True):
            inside = sample_variance(axis, fs, upper=overbound, in_band=True)
            if inside < 0.99 * one:
                convention.append(
                    f"{axis.name}: the variance of a sample within the band of the sensor's filter is {inside:.3e} {unit}"
                )
            N = math.sqrt(one / fs)
            K = negligible_walk(N, axis.horizon, axis.sampling)
            pairs.append((axis, NoiseParameters(N, K, overbound=overbound)))
        note = f"{unit}; {'from the upper limits' if overbound else 'as fitted'}"
        rows.append(f"{key}: [{x:.6e}, 0, 0, 0, {y:.6e}, 0, 0, 0, {z:.6e}]  # {note}\n")
    return as_comments(head_comments(pairs, convention, samples=True)) + "".join(rows)


def sample_variance(
    axis: Axis, rate: float, *, upper: bool = False, in_band: bool = False
) -> float:
    """Variance of a sample in SI: all random processes and spectral lines, without noise slower than the horizon.

    With `upper`, every coefficient is at its upper limit. With `in_band`, white noise counts after the sensor's filter
    instead of with N²·rate.
    """
    low = 2.0 * np.pi / (max(axis.horizon, 10.0 / rate) * rate)
    w = np.geomspace(low, np.pi, 4000)
    slower = np.geomspace(1e-9 * low, low, 2000)
    steady = axis.steady_model(upper=upper)
    total = 0.0
    for effect in steady.stochastic:
        size = float(getattr(effect, effect.coefficient)) ** 2
        whole = effect.unit_terms(rate) if effect.white and not in_band else None
        for unit_term in whole or steady.unit_terms(effect, rate):
            term = unit_term.scaled(size)
            if term.power is None:
                total += _power_between(term, w)
            else:
                # The total power is known exactly, also for a narrow band. Below the lowest frequency of `slower` the
                # density is constant.
                total += (
                    term.power
                    - _power_between(term, slower)
                    - float(term.spectrum(slower[:1])[0]) * slower[0] / np.pi
                )
    for line in steady.deterministic:
        total += sum(0.5 * amplitude**2 for _, amplitude, _ in line.lines)
    return axis.scale**2 * total


def _power_between(term: Term, w: NDArray[np.float64]) -> float:
    """Integral of the spectrum of a term over the ascending frequencies `w` (rad per sample), divided by π: a variance."""
    return float(np.trapezoid(term.spectrum(w) * w, np.log(w))) / np.pi


TARGETS = (Target("ros", "ROS", "ros.yaml", render, whole_record=True),)
