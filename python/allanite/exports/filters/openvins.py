"""OpenVINS kalibr_imu_chain.yaml: continuous-time, two-sided N and K in SI below the node imu0."""

from __future__ import annotations

from collections.abc import Sequence

from allanite.exports._axis import Axis, rate_of
from allanite.exports._lines import check_both_sensors, value_lines
from allanite.exports._target import Target
from allanite.exports.filters.kalibr import ROWS

#: Rows of the matrices that the loader requires: no rotation, no misalignment, no sensitivity to acceleration.
IDENTITY = tuple([float(i == j) for j in range(3)] for i in range(3))
MATRICES = {
    "T_i_b": tuple([float(i == j) for j in range(4)] for i in range(4)),
    "Tw": IDENTITY,
    "R_IMUtoGYRO": IDENTITY,
    "Ta": IDENTITY,
    "R_IMUtoACC": IDENTITY,
    "Tg": ([0.0] * 3,) * 3,
}


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """Text of the file that ``relative_config_imu`` names: YAML 1.0 with N and K in SI, not converted, below ``imu0``.

    The loader also reads the rotation ``T_i_b``, ``model`` and the calibration matrices
    (ov_core/utils/opencv_yaml_parse.h, ov_msckf/core/VioManagerOptions.h). The file sets the matrices to the identity
    and ``model`` to kalibr. Each number is the largest of the axes of its sensor. Raises `InputError` unless both sensors
    and one sampling rate are known.
    """
    update = rate_of(axes, rate, "openvins")
    check_both_sensors(axes, "openvins")
    convention = (
        "OpenVINS: continuous-time, two-sided densities. The program applies sqrt(dt) itself.",
        "The matrices are the identity: replace them by your calibration.",
    )
    matrices = "".join(
        f"  {name}:\n" + "".join(f"    - {row}\n" for row in rows)
        for name, rows in MATRICES.items()
    )
    form = "  {key}: {value:.6e}  {note}"
    node = f"imu0:\n{matrices}"
    numbers = value_lines(axes, ROWS, {}, convention, overbound=overbound, form=form, node=node)
    rest = f'  model: "kalibr"\n  rostopic: /imu0\n  time_offset: 0.0\n  update_rate: {update:.6f}  # Hz\n'
    return f"%YAML:1.0\n{numbers}{rest}"


TARGETS = (Target("openvins", "OpenVINS", "kalibr_imu_chain.yaml", render),)
