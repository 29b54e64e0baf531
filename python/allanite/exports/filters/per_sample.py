"""Consumers that expect SI numbers per sample, or per step of the filter, the largest of a sensor's axes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from allanite.exports._axis import Axis, rate_of
from allanite.exports._initial import initial_lines
from allanite.exports._lines import value_lines
from allanite.exports._target import Target

#: (sensor, coefficient) → unit of N·√rate, or of K·√rate.
UNITS = {
    ("gyro", "N"): "rad/s",
    ("gyro", "K"): "rad/s^2",
    ("accel", "N"): "m/s^2",
    ("accel", "K"): "m/s^3",
}
#: Key of each format → (sensor, coefficient).
FASTLIO = {
    "acc_cov": ("accel", "N"),
    "gyr_cov": ("gyro", "N"),
    "b_acc_cov": ("accel", "K"),
    "b_gyr_cov": ("gyro", "K"),
}
FASTLIVO2 = {
    "  acc_cov": ("accel", "N"),
    "  gyr_cov": ("gyro", "N"),
    "# set_acc_bias_cov": ("accel", "K"),
    "# set_gyr_bias_cov": ("gyro", "K"),
}
POINTLIO = {
    "gyr_cov_input": ("gyro", "N"),
    "acc_cov_input": ("accel", "N"),
    "imu_meas_omg_cov": ("gyro", "N"),
    "imu_meas_acc_cov": ("accel", "N"),
    "b_gyr_cov": ("gyro", "K"),
    "b_acc_cov": ("accel", "K"),
}
VINS = {
    "acc_n": ("accel", "N"),
    "gyr_n": ("gyro", "N"),
    "acc_w": ("accel", "K"),
    "gyr_w": ("gyro", "K"),
}
PX4 = {
    "EKF2_GYR_NOISE": ("gyro", "N"),
    "EKF2_ACC_NOISE": ("accel", "N"),
    "EKF2_GYR_B_NOISE": ("gyro", "K"),
    "EKF2_ACC_B_NOISE": ("accel", "K"),
}
ARDUPILOT = {
    "EK3_GYRO_P_NSE": ("gyro", "N"),
    "EK3_ACC_P_NSE": ("accel", "N"),
    "EK3_GBIAS_P_NSE": ("gyro", "K"),
    "EK3_ABIAS_P_NSE": ("accel", "K"),
}
#: Documented range of each parameter (ekf2_params.c, AP_NavEKF3.cpp).
RANGES = {
    "EKF2_GYR_NOISE": (1e-4, 0.1),
    "EKF2_ACC_NOISE": (0.01, 1.0),
    "EKF2_GYR_B_NOISE": (0.0, 0.01),
    "EKF2_ACC_B_NOISE": (0.0, 0.01),
    "EK3_GYRO_P_NSE": (1e-4, 0.1),
    "EK3_ACC_P_NSE": (0.01, 1.0),
    "EK3_GBIAS_P_NSE": (1e-5, 1e-3),
    "EK3_ABIAS_P_NSE": (1e-5, 0.02),
}
#: PX4's parameters for the standard deviation of the bias at switch-on, rad/s and m/s^2 (ekf2_params.c).
PX4_INITIAL = {"gyro": "EKF2_GBIAS_INIT", "accel": "EKF2_ABIAS_INIT"}
#: Rates of the filters, whatever the rate of the sensor, Hz: EKF2_PREDICT_US = 10 000, and EKF_TARGET_DT = 0.012 s.
PX4_RATE, ARDUPILOT_RATE = 100.0, 1.0 / 0.012
#: MAVLink's number of a 32-bit floating-point parameter.
REAL32 = 9


def _variance_target(
    name: str, title: str, keys: Mapping[str, tuple[str, str]], *convention: str, node: str = ""
) -> Target:
    """`Target` of a YAML file with N²·rate and K²·rate, for a filter that adds dt²·Q per sample.

    The lines `convention` of its head are formats with the sampling rate ``fs``. `node` is the text above the numbers.
    Rendering raises `InputError` if its `rate` is None and the axes have no common rate.
    """
    what = {"N": "variance per sample", "K": "variance of a bias step over dt^2"}
    rows = [(key, *of, f"({UNITS[of]})^2, {what[of[1]]}") for key, of in keys.items()]

    def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
        """Text of the file."""
        fs = rate_of(axes, rate, name)
        convert = {"N": lambda v: v * v * fs, "K": lambda v: v * v * fs}
        head = [line.format(fs=fs) for line in convention]
        return value_lines(axes, rows, convert, head, overbound=overbound, node=node)

    return Target(name, title, f"{name}.yaml", render)


def _deviation_lines(
    axes: Sequence[Axis],
    keys: Mapping[str, tuple[str, str]],
    fs: float,
    *convention: str,
    overbound: bool,
    form: str,
) -> str:
    """Text with an entry in the format `form` per key: N·√`fs` or K·√`fs`, with a note on its documented range."""
    what = {"N": "deviation per step", "K": "deviation of a bias step over dt"}
    rows = [(key, *of, f"{UNITS[of]}, {what[of[1]]}") for key, of in keys.items()]
    convert = {"N": lambda v: v * math.sqrt(fs), "K": lambda v: v * math.sqrt(fs)}
    return value_lines(
        axes, rows, convert, convention, overbound=overbound, form=form, ranges=RANGES
    )


def vins(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """Text of lines ``key: value`` for VINS-Mono and VINS-Fusion: N·√(2·rate) and K·√rate.

    The midpoint rule of integration_base.h averages two independent noises per step. The variance of a step is then
    n²dt²/2, which gives n = N√(2/dt). A bias step is w·dt, which gives w = K/√dt. Raises `InputError` if `rate` is None
    and the axes have no common rate.
    """
    fs = rate_of(axes, rate, "vins")
    what = {"N": "deviation per sample times sqrt(2)", "K": "deviation of a bias step over dt"}
    rows = [(key, *of, f"{UNITS[of]}, {what[of[1]]}") for key, of in VINS.items()]
    convention = (
        f"VINS: standard deviations per sample at {fs:g} Hz, n = N*sqrt(2*rate) and w = K*sqrt(rate).",
        "The factor 2 is needed because the midpoint rule of VINS averages two independent noises per step.",
    )
    convert = {"N": lambda v: v * math.sqrt(2.0 * fs), "K": lambda v: v * math.sqrt(fs)}
    return value_lines(axes, rows, convert, convention, overbound=overbound)


def px4(
    axes: Sequence[Axis],
    rate: float | None,
    *,
    overbound: bool = False,
    form: str = "param set {key} {value:.6e}  {note}",
) -> str:
    """Text with commands of PX4's shell that set N/√dt, K/√dt and the bias at switch-on; `form` is the format of one entry.

    The step dt of the filter is 1/`rate`, by default 0.01 s. The filter uses the variances (dt·σ)².
    """
    fs = rate or PX4_RATE
    text = _deviation_lines(
        axes,
        PX4,
        fs,
        f"PX4 EKF2: standard deviations per step of the filter, N*sqrt(rate) and K*sqrt(rate), here at {fs:g} Hz. The rate",
        "is that of the filter (EKF2_PREDICT_US), not of the sensor. A record at rest does not contain the vibration of",
        "flight: keep a default that is larger.",
        overbound=overbound,
        form=form,
    )
    return text + initial_lines(axes, PX4_INITIAL, form, overbound=overbound)


def px4_tabs(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """Text of `px4` for QGroundControl: system, component, name, value and type of each parameter, separated by tabs."""
    form = f"{{note}}\n1\t1\t{{key}}\t{{value:.9g}}\t{REAL32}"
    return px4(axes, rate, overbound=overbound, form=form)


def ardupilot(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """Text of lines ``key,value`` with N/√dt and K/√dt.

    The step dt of the filter is 1/`rate`, by default 0.012 s. EK3 uses the variances (dt·σ)², and (dt²·σ)² for delta
    biases. Comments are on their own lines, because ground stations only accept lines with two words.
    """
    fs = rate or ARDUPILOT_RATE
    return _deviation_lines(
        axes,
        ARDUPILOT,
        fs,
        f"ArduPilot EK3: standard deviations per step of the filter, N*sqrt(rate) and K*sqrt(rate), here at {fs:.4g} Hz.",
        "The rate is that of the filter, not of the sensor: it steps with the main loop, at most every 12 ms. If",
        "SCHED_LOOP_RATE is below 83 Hz (planes: 50 Hz), write this file again with that rate. A record at rest does not",
        "contain the vibration of flight: keep a default that is larger.",
        overbound=overbound,
        form="{note}\n{key},{value:.6e}",
    )


TARGETS = (
    _variance_target(
        "fastlio",
        "FAST-LIO",
        FASTLIO,
        "FAST-LIO2 (copy below mapping:): variances per sample at {fs:g} Hz, N^2*rate and K^2*rate.",
        "The filter makes one prediction per IMU sample. It scales the acceleration to m/s^2 itself.",
    ),
    # IMU_Processing.cpp (107acae) multiplies both by dt² at each sample.
    _variance_target(
        "fastlivo2",
        "FAST-LIVO2",
        FASTLIVO2,
        "FAST-LIVO2: variances per sample at {fs:g} Hz, N^2*rate and K^2*rate.",
        "The variances of the biases are constants in LIVMapper.cpp (0.0001). Put the values of the commented lines there.",
        node="imu:\n",
    ),
    # esekfom.hpp (bbd402a) adds Q·dt² per prediction, and R_IMU is the variance of a sample.
    _variance_target(
        "pointlio",
        "Point-LIO",
        POINTLIO,
        "Point-LIO (copy below mapping:): variances per sample at {fs:g} Hz, N^2*rate and K^2*rate.",
        "They hold with prop_at_freq_of_imu: 1. The _input lines are used with use_imu_as_input: 1, the imu_meas lines",
        "with use_imu_as_input: 0. vel_cov, gyr_cov_output and acc_cov_output describe the vehicle: keep yours.",
    ),
    Target("vins", "VINS", "vins.yaml", vins),
    Target("px4", "PX4 (shell)", "px4.sh", px4, own_rate=True),
    Target("px4-params", "PX4 (QGroundControl)", "px4.params", px4_tabs, own_rate=True),
    Target("ardupilot", "ArduPilot", "ardupilot.param", ardupilot, own_rate=True),
)
