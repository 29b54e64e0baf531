"""ArduPilot's EK3 parameters: deviations per step of the filter."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from allanite.export._lines import value_lines
from allanite.export._target import Target

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.export._axis import Axis

__all__ = ["TARGETS"]

#: EKF_TARGET_DT = 0.012 s: the filter's own rate, whatever the sensor's, Hz.
FILTER_RATE = 1.0 / 0.012
#: Range that the parameter's description allows (AP_NavEKF3.cpp).
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
    """N/√dt and K/√dt with dt of the filter: variances are (dt·σ)², of the biases times dt as (dt²·σ)².

    Notes have lines of their own: ground stations take a line of two words alone.
    """
    fs = rate or FILTER_RATE
    convention = (
        f"ArduPilot EK3: per step of the filter, here {fs:.4g} Hz, not of the sensor. The filter steps with the main loop,",
        "at most every 12 ms: if SCHED_LOOP_RATE is below 83 Hz (planes: 50 Hz), write the file again with that rate;",
        "deviations: N*sqrt(rate), K*sqrt(rate). Vibration in flight is not in a record at rest: keep larger defaults.",
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
