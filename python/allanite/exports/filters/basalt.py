"""Basalt calibration (JSON): continuous-time, two-sided N and K of each axis in SI."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import partial

from allanite.exports._axis import Axis, rate_of
from allanite.exports._choice import choose
from allanite.exports._head import head_comments
from allanite.exports._target import Target
from allanite.exports._triad import triads_of


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """JSON text of the calibration file: lists of N and of K for x, y and z in SI, not converted, and the update rate.

    Basalt multiplies N by √rate to get the standard deviation of a sample. ``dicrete_time_gyro_noise_std`` is
    std·√imu_update_rate, and a random walk over dt has the variance std²·dt (basalt/calibration/calibration.hpp,
    basalt/linearization/imu_block.hpp). Raises `InputError` if `rate` is None and the axes have no common rate.
    """
    update = rate_of(axes, rate, "basalt")
    found = triads_of(axes, ("gyro", "accel"), partial(choose, overbound=overbound), ("N", "K"))
    convention = (
        f"Basalt: continuous-time, two-sided densities of x, y, z. Basalt multiplies N by sqrt({update:g} Hz) itself.",
        "Copy these lines into value0 of your calibration file, which also holds the cameras.",
    )
    values: dict[str, object] = {"imu_update_rate": update}
    for name in ("accel", "gyro"):
        values[f"{name}_noise_std"] = found.numbers[name]["N"]
        values[f"{name}_bias_std"] = found.numbers[name]["K"]
    # Basalt reads the first member, whatever its name. Therefore the comment comes second.
    comment = [*head_comments(found.pairs, convention), *found.remarks]
    whole = {"value0": values, "_comment": comment}
    return json.dumps(whole, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


TARGETS = (Target("basalt", "Basalt", "basalt-calibration.json", render, both_sensors=True),)
