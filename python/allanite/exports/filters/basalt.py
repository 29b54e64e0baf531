"""Basalt calibration (JSON): continuous-time, two-sided N and K of each axis in SI."""

from __future__ import annotations

import json
from collections.abc import Sequence

from allanite.exports._axis import Axis, gyro_and_accel_axes, rate_of
from allanite.exports._head import head_comments
from allanite.exports._lines import check_both_sensors, choose_all
from allanite.exports._target import Target
from allanite.exports._triad import numbers_in_xyz


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """JSON text of the calibration file: lists of N and of K for x, y and z in SI, not converted, and the update rate.

    Basalt multiplies N by √rate to get the standard deviation of a sample. ``dicrete_time_gyro_noise_std`` is
    std·√imu_update_rate, and a random walk over dt has the variance std²·dt (basalt/calibration/calibration.hpp,
    basalt/linearization/imu_block.hpp). Raises `InputError` unless both sensors and one sampling rate are known.
    """
    update = rate_of(axes, rate, "basalt")
    check_both_sensors(axes, "basalt")
    gyro, accel = (choose_all(own, overbound=overbound) for own in gyro_and_accel_axes(axes))
    convention = (
        f"Basalt: continuous-time, two-sided densities of x, y, z. Basalt multiplies N by sqrt({update:g} Hz) itself.",
        "Copy these lines into value0 of your calibration file, which also holds the cameras.",
    )
    lines = head_comments([*gyro, *accel], convention)
    values: dict[str, object] = {"imu_update_rate": update}
    for name, pairs in (("accel", accel), ("gyro", gyro)):
        places, axis_remarks = numbers_in_xyz(
            [axis for axis, _ in pairs], [(c.N, c.K) for _, c in pairs]
        )
        values[f"{name}_noise_std"] = [N for N, _ in places]
        values[f"{name}_bias_std"] = [K for _, K in places]
        lines += [f"{name} {remark}" for remark in axis_remarks]
    # Basalt reads the first member, whatever its name. Therefore the comment comes second.
    whole = {"value0": values, "_comment": lines}
    return json.dumps(whole, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


TARGETS = (Target("basalt", "Basalt", "basalt-calibration.json", render),)
