"""ArduPilot EK3 parameters: standard deviations per step of the filter."""

from __future__ import annotations

import math
from collections.abc import Sequence

from allanite.exports._axis import Axis
from allanite.exports._lines import value_lines
from allanite.exports._target import Target

#: Rate of the filter, whatever the rate of the sensor, Hz: EKF_TARGET_DT = 0.012 s.
FILTER_RATE = 1.0 / 0.012
#: Documented range of each parameter (AP_NavEKF3.cpp).
RANGES = {
    "EK3_GYRO_P_NSE": (1e-4, 0.1),
    "EK3_ACC_P_NSE": (0.01, 1.0),
    "EK3_GBIAS_P_NSE": (1e-5, 1e-3),
    "EK3_ABIAS_P_NSE": (1e-5, 0.02),
}
ROWS = (
    ("EK3_GYRO_P_NSE", "gyro", "N", "rad/s, deviation per step"),
    ("EK3_ACC_P_NSE", "accel", "N", "m/s^2, deviation per step"),
    ("EK3_GBIAS_P_NSE", "gyro", "K", "rad/s^2, deviation of a bias step over dt"),
    ("EK3_ABIAS_P_NSE", "accel", "K", "m/s^3, deviation of a bias step over dt"),
)


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """Text of lines ``key,value`` with N/√dt and K/√dt.

    The step dt of the filter is 1/`rate`, by default 0.012 s. EK3 uses the variances (dt·σ)², and (dt²·σ)² for delta
    biases. Comments are on their own lines, because ground stations only accept lines with two words. Each number is the
    largest of the axes of its sensor.
    """
    fs = rate or FILTER_RATE
    convention = (
        f"ArduPilot EK3: standard deviations per step of the filter, N*sqrt(rate) and K*sqrt(rate), here at {fs:.4g} Hz.",
        "The rate is that of the filter, not of the sensor: it steps with the main loop, at most every 12 ms. If",
        "SCHED_LOOP_RATE is below 83 Hz (planes: 50 Hz), write this file again with that rate. A record at rest does not",
        "contain the vibration of flight: keep a default that is larger.",
    )
    convert = {"N": lambda v: v * math.sqrt(fs), "K": lambda v: v * math.sqrt(fs)}
    return value_lines(
        axes,
        ROWS,
        convert,
        convention,
        overbound=overbound,
        form="{note}\n{key},{value:.6e}",
        ranges=RANGES,
    )


TARGETS = (Target("ardupilot", "ArduPilot", "ardupilot.param", render, own_rate=True),)
