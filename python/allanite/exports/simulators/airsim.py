"""AirSim settings.json: N in data-sheet units, K as BiasStability/√Tau."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence

from allanite.exports._axis import Axis, gyro_and_accel_axes
from allanite.exports._head import head_comments
from allanite.exports._lines import choose_all, largest_number, with_shared_numbers
from allanite.exports._target import Target

#: Standard gravity, m/s² (CGPM 1901): AirSim counts acceleration in mg.
GRAVITY = 9.80665
#: Any time gives the same noise, because only BiasStability/√Tau counts, s.
TAU = 500.0


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:  # noqa: ARG001
    """JSON text of the IMU settings: N, and BiasStability and Tau such that K = BiasStability/√Tau.

    The simulator adds N/√dt to a sample and BiasStability/√Tau·√dt to the bias. Its ``VelocityRandomWalk`` is in mg
    (per √Hz), ``AngularRandomWalk`` in °/√h. `rate` is not used.
    """
    gyro, accel = (
        choose_all(own, overbound=overbound, simulator=True) for own in gyro_and_accel_axes(axes)
    )
    convention = (
        "AirSim: continuous-time, two-sided densities; AirSim divides by sqrt(dt) itself. K = BiasStability/sqrt(Tau).",
    )
    sensor: dict[str, object] = {"SensorType": 2, "Enabled": True}
    notes = head_comments(with_shared_numbers(gyro, accel), convention, simulator=True)
    degree = math.pi / 180.0
    for own, keys, n_unit, k_unit in (
        (gyro, ("AngularRandomWalk", "GyroBiasStabilityTau", "GyroBiasStability"), degree / 60.0, degree / 3600.0),
        (accel, ("VelocityRandomWalk", "AccelBiasStabilityTau", "AccelBiasStability"), GRAVITY * 1e-3, GRAVITY * 1e-6),
    ):  # fmt: skip
        if not own:
            continue
        (n, n_remark), (k, k_remark) = largest_number(own, "N"), largest_number(own, "K")
        sensor[keys[0]] = float(f"{n / n_unit:.6e}")
        sensor[keys[1]] = TAU
        sensor[keys[2]] = float(f"{k * math.sqrt(TAU) / k_unit:.6e}")
        notes += [f"{key}: {r}" for key, r in ((keys[0], n_remark), (keys[2], k_remark)) if r]
    document = {"_comment": notes, "Sensors": {"Imu": sensor}}
    return json.dumps(document, indent=1, ensure_ascii=False) + "\n"


TARGETS = (Target("airsim", "AirSim", "airsim.json", render, whole_record=True),)
