"""Kalibr, and consumers with its convention: continuous-time, two-sided N and K in SI, the largest of a sensor's axes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from allanite.exports._axis import Axis, rate_of
from allanite.exports._initial import initial_lines
from allanite.exports._lines import value_lines
from allanite.exports._target import Target

#: (sensor, coefficient) → its unit in SI.
UNITS = {
    ("gyro", "N"): "rad/s/sqrt(Hz)",
    ("gyro", "K"): "rad/s^2/sqrt(Hz)",
    ("accel", "N"): "m/s^2/sqrt(Hz)",
    ("accel", "K"): "m/s^3/sqrt(Hz)",
}
#: Key of each format → (sensor, coefficient).
KALIBR = {
    "accelerometer_noise_density": ("accel", "N"),
    "accelerometer_random_walk": ("accel", "K"),
    "gyroscope_noise_density": ("gyro", "N"),
    "gyroscope_random_walk": ("gyro", "K"),
}
CUVSLAM = {
    "gyro_noise_density": ("gyro", "N"),
    "gyro_random_walk": ("gyro", "K"),
    "accel_noise_density": ("accel", "N"),
    "accel_random_walk": ("accel", "K"),
}
DMVIO = {
    "accelerometer_noise_density": ("accel", "N"),
    "gyroscope_noise_density": ("gyro", "N"),
    "accelerometer_random_walk": ("accel", "K"),
    "gyroscope_random_walk": ("gyro", "K"),
}
LIOSAM = {
    "imuAccNoise": ("accel", "N"),
    "imuGyrNoise": ("gyro", "N"),
    "imuAccBiasN": ("accel", "K"),
    "imuGyrBiasN": ("gyro", "K"),
}
OKVIS2 = {
    "sigma_g_c": ("gyro", "N"),
    "sigma_a_c": ("accel", "N"),
    "sigma_gw_c": ("gyro", "K"),
    "sigma_aw_c": ("accel", "K"),
}
ORBSLAM3 = {
    "IMU.NoiseGyro": ("gyro", "N"),
    "IMU.NoiseAcc": ("accel", "N"),
    "IMU.GyroWalk": ("gyro", "K"),
    "IMU.AccWalk": ("accel", "K"),
}
#: OKVIS2's keys of the standard deviation of the prior on the first bias, rad/s and m/s^2.
INITIAL = {"gyro": "sigma_bg", "accel": "sigma_ba"}
#: Rows of the matrices that OpenVINS requires: no rotation, no misalignment, no sensitivity to acceleration.
IDENTITY = tuple([float(i == j) for j in range(3)] for i in range(3))
MATRICES = {
    "T_i_b": tuple([float(i == j) for j in range(4)] for i in range(4)),
    "Tw": IDENTITY,
    "R_IMUtoGYRO": IDENTITY,
    "Ta": IDENTITY,
    "R_IMUtoACC": IDENTITY,
    "Tg": ([0.0] * 3,) * 3,
}


def _density_lines(
    axes: Sequence[Axis],
    keys: Mapping[str, tuple[str, str]],
    *convention: str,
    overbound: bool,
    node: str = "",
    indent: str = "",
) -> str:
    """Text of a head with the lines `convention`, then `node`, then one line per key with N or K in SI, not converted."""
    rows = [(k, *of, f"{UNITS[of]}, two-sided, continuous time") for k, of in keys.items()]
    form = f"{indent}{{key}}: {{value:.6e}}  {{note}}"
    return value_lines(axes, rows, {}, convention, overbound=overbound, form=form, node=node)


def kalibr(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """Text of imu.yaml: noise density is N and random walk is K in SI, as in "IMU Noise Model" of Kalibr's wiki.

    There, the standard deviation of a sample is N/√dt, and of a bias step K·√dt. Kalibr refuses values of 0. If `rate`
    is None, the update rate is the highest rate of the axes. Raises `InputError` without any rate.
    """
    logged = sorted({axis.rate for axis in axes if axis.rate is not None})
    # N and K hold at any rate. A driver that merges two topics publishes at the rate of the faster one.
    apart = rate is None and len(logged) > 1
    update = logged[-1] if apart else rate_of(axes, rate, "kalibr")
    slower = f"; the slower sensor was logged at {logged[0]:g} Hz" if apart else ""
    convention = "Kalibr and OpenVINS: continuous-time, two-sided densities. The programs apply sqrt(dt) themselves."
    text = _density_lines(axes, KALIBR, convention, overbound=overbound)
    return text + f"rostopic: /imu0\nupdate_rate: {update:g}  # Hz{slower}\n"


def openvins(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """Text of kalibr_imu_chain.yaml, which ``relative_config_imu`` names: YAML 1.0 with N and K below ``imu0``.

    The loader also reads the rotation ``T_i_b``, ``model`` and the calibration matrices
    (ov_core/utils/opencv_yaml_parse.h, ov_msckf/core/VioManagerOptions.h). Raises `InputError` if `rate` is None and
    the axes have no common rate.
    """
    update = rate_of(axes, rate, "openvins")
    matrices = "".join(
        f"  {name}:\n" + "".join(f"    - {row}\n" for row in rows)
        for name, rows in MATRICES.items()
    )
    numbers = _density_lines(
        axes,
        KALIBR,
        "OpenVINS: continuous-time, two-sided densities. The program applies sqrt(dt) itself.",
        "The matrices are the identity: replace them by your calibration.",
        overbound=overbound,
        node=f"imu0:\n{matrices}",
        indent="  ",
    )
    rest = f'  model: "kalibr"\n  rostopic: /imu0\n  time_offset: 0.0\n  update_rate: {update:.6f}  # Hz\n'
    return f"%YAML:1.0\n{numbers}{rest}"


def kimera(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """Text of ImuParams.yaml of Kimera-VIO: N and K, and the other keys that ImuFrontendParams.cpp reads.

    ImuFrontend.cpp squares the densities for GTSAM (MIT-SPARK 293b4ff). The file selects preintegration type 1. The
    combined factor (type 0) adds the identity to the covariance of the bias, and no parameter changes this. Raises
    `InputError` if `rate` is None and the axes have no common rate.
    """
    update = rate_of(axes, rate, "kimera")
    convention = "Kimera-VIO: continuous-time, two-sided densities. The program squares them for GTSAM's preintegration."
    numbers = _density_lines(axes, KALIBR, convention, overbound=overbound)
    rest = (
        "imu_preintegration_type: 1  # ImuFactor; CombinedImuFactor (0) adds the identity to the bias covariance\n"
        "T_BS:\n  cols: 4\n  rows: 4\n"
        "  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n"
        f"rate_hz: {update:g}\n"
        "imu_integration_sigma: 1.0e-8\nimu_time_shift: 0.0\nn_gravity: [0.0, 0.0, -9.81]\n"
    )
    return f"%YAML:1.0\n{numbers}{rest}"


def cuvslam(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """Text of a YAML file for the node of Isaac ROS: N and K in Kalibr's units (see cuvslam.h), and the sampling rate.

    Raises `InputError` if `rate` is None and the axes have no common rate.
    """
    fs = rate_of(axes, rate, "cuvslam")
    numbers = _density_lines(
        axes,
        CUVSLAM,
        "cuVSLAM (isaac_ros_visual_slam): Kalibr's noise model with continuous-time, two-sided densities.",
        overbound=overbound,
        node="visual_slam_node:\n  ros__parameters:\n    enable_imu_fusion: true\n",
        indent="    ",
    )
    return f"{numbers}    calibration_frequency: {fs:.6e}  # Hz\n"


def okvis2(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:  # noqa: ARG001
    """Text of the YAML node ``imu_parameters`` of OKVIS2 with N, K and the bias at switch-on; `rate` is not used.

    OKVIS2 adds dt·sigma² in each step of length dt (okvis_ceres/src/ImuError.cpp, 0f18f34).
    """
    numbers = _density_lines(
        axes,
        OKVIS2,
        "OKVIS2 (OKVIS): continuous-time, two-sided densities. Each step of length dt adds sigma^2*dt.",
        "Copy these lines into the node imu_parameters. Set a_max, g_max, g and T_BS yourself.",
        overbound=overbound,
        node="imu_parameters:\n",
        indent="    ",
    )
    form = "    {key}: {value:.6e}  {note}"
    return numbers + initial_lines(axes, INITIAL, form, "    #", overbound=overbound)


def dmvio(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:  # noqa: ARG001
    """Text of lines for the settings file of DM-VIO with N and K; `rate` is not used.

    GTSAM's preintegration squares N. The bias changes by K·√Δt between frames (IMUUtils.cpp, fcc306b).
    """
    numbers = _density_lines(
        axes,
        DMVIO,
        "DM-VIO: continuous-time, two-sided densities. Copy these lines into the settings file.",
        "The example files of DM-VIO have larger numbers: they also cover vibration, which a record at rest does not show.",
        overbound=overbound,
    )
    return numbers + (
        "# Error of the integration itself: negligible. DM-VIO's default would be 0.1.\n"
        "integration_sigma: 1.0e-08\n"
    )


def liosam(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:  # noqa: ARG001
    """Text of lines for params.yaml of LIO-SAM with N and K; `rate` is not used.

    GTSAM's preintegration squares N. LIO-SAM multiplies K by √Δt, with the time Δt between key frames.
    """
    convention = "LIO-SAM (copy below lio_sam:): continuous-time, two-sided densities. LIO-SAM squares them itself."
    return _density_lines(axes, LIOSAM, convention, overbound=overbound)


def orbslam3(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """Text of YAML lines for ORB-SLAM3 with N and K, and the sampling rate, rounded to an integer.

    ORB-SLAM3 itself multiplies N by √frequency and divides K by √frequency. Its loader refuses a frequency that is not
    an integer, and noises that are not written as real numbers. Raises `InputError` if `rate` is None and the axes have
    no common rate.
    """
    fs = rate_of(axes, rate, "orbslam3")
    convention = "ORB-SLAM3: continuous-time, two-sided densities. The program applies sqrt(IMU.Frequency) itself."
    text = _density_lines(axes, ORBSLAM3, convention, overbound=overbound)
    whole = max(1, round(fs))
    rounded = abs(whole - fs) > 1e-6 * fs
    note = f"; rounded from {fs:.6g} Hz, because the loader requires an integer" if rounded else ""
    return f"{text}IMU.Frequency: {whole}  # Hz{note}\n"


TARGETS = (
    Target("kalibr", "Kalibr", "kalibr.yaml", kalibr),
    Target("openvins", "OpenVINS", "kalibr_imu_chain.yaml", openvins, both_sensors=True),
    Target("kimera", "Kimera-VIO", "ImuParams.yaml", kimera, both_sensors=True),
    Target(
        "cuvslam", "cuVSLAM (Isaac ROS)", "isaac-ros-visual-slam.yaml", cuvslam, both_sensors=True
    ),
    Target("okvis2", "OKVIS2", "okvis2.yaml", okvis2, both_sensors=True),
    Target("dmvio", "DM-VIO", "dmvio.yaml", dmvio, both_sensors=True),
    Target("liosam", "LIO-SAM", "liosam.yaml", liosam),
    Target("orbslam3", "ORB-SLAM3", "orbslam3.yaml", orbslam3),
)
