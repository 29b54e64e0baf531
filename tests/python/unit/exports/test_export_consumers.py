"""Each file is read as its consumer reads it, and propagated through a copy of the consumer's update.

The updates follow the sources at the named commits. A filter's covariance or a simulator's samples after 1, 10 and 100
s must have the variance of the model: N²t + K²t³/3 for the angle if the bias is known at the beginning.
"""

import json
import math
import re
import sys
from types import SimpleNamespace

import numpy as np
import pytest

import allanite as al
from allanite.effects.files import model_to_dict
from allanite.exports import axes_of

RATE, N, K = 200.0, 2e-3, 3e-4
ACCEL_N, ACCEL_K = 0.02, 1e-3
TIMES = (1.0, 10.0, 100.0)
DEGREE = math.pi / 180


def axes(gyro=f"N(N={N})+K(K={K})", accel=f"N(N={ACCEL_N})+K(K={ACCEL_K})"):
    return [
        *axes_of([model_to_dict(al.parse_model(gyro))], "rad/s", "gyro"),
        *axes_of([model_to_dict(al.parse_model(accel))], "m/s^2", "accel"),
    ]


def number(text, key):
    return float(
        re.search(rf"^\s*(?:param set )?{re.escape(key)}[:,\s]+(\S+)", text, re.M).group(1)
    )


def expected(t, n=N, k=K):
    return n**2 * t + k**2 * t**3 / 3


def propagate(dt, step_white, step_bias, times=TIMES, phi=1.0, start=0.0):
    """Variance of an angle that integrates a bias: P ← F P Fᵀ + diag(white, bias) for each step dt."""
    F = np.array([[1.0, dt], [0.0, phi]])
    P = np.diag([0.0, start])
    out, done = [], 0
    for t in times:
        steps = round(t / dt)
        for _ in range(done, steps):
            P = F @ P @ F.T + np.diag([step_white, step_bias])
        done = steps
        out.append(P[0, 0])
    return np.array(out)


def agrees(found, n=N, k=K):
    # The filters' rectangles differ from integrals by half a step: 1/(2·rate·t) of the random walk's part at most.
    np.testing.assert_allclose(found, [expected(t, n, k) for t in TIMES], rtol=8e-3)


def test_kalibr_and_openvins():
    # Kalibr wiki "IMU Noise Model": σ_d = σ/√Δt of samples, σ_b√Δt of bias steps.
    text = al.export(axes(), "kalibr", RATE)
    n, k = number(text, "gyroscope_noise_density"), number(text, "gyroscope_random_walk")
    dt = 1 / RATE
    agrees(propagate(dt, (n / math.sqrt(dt) * dt) ** 2, (k * math.sqrt(dt)) ** 2))
    n, k = (number(text, f"accelerometer_{x}") for x in ("noise_density", "random_walk"))
    agrees(propagate(dt, n * n * dt, k * k * dt), ACCEL_N, ACCEL_K)


def test_vins():
    # VINS-Fusion integration_base.h at 939f01282fa4: V(3,3) = V(3,9) = 0.5 dt, V(12,15) = dt, independent noises.
    text = al.export(axes(), "vins", RATE)
    dt = 1 / RATE
    for keys, n, k in ((("gyr_n", "gyr_w"), N, K), (("acc_n", "acc_w"), ACCEL_N, ACCEL_K)):
        white, walk = (number(text, key) for key in keys)
        step = 2 * (0.5 * dt * white) ** 2
        agrees(propagate(dt, step, (dt * walk) ** 2), n, k)


def test_orbslam3():
    # Tracking.cc multiplies by √frequency and divides by it; ImuTypes.cc at c85e0eada71f: B = dt, C += NgaWalk.
    text = al.export(axes(), "orbslam3", RATE)
    frequency = number(text, "IMU.Frequency")
    dt = 1 / frequency
    sf = math.sqrt(frequency)
    n, k = number(text, "IMU.NoiseGyro") * sf, number(text, "IMU.GyroWalk") / sf
    agrees(propagate(dt, (n * dt) ** 2, k**2))
    n, k = number(text, "IMU.NoiseAcc") * sf, number(text, "IMU.AccWalk") / sf
    agrees(propagate(dt, (n * dt) ** 2, k**2), ACCEL_N, ACCEL_K)


def test_liosam():
    # imuPreintegration.cpp at 0be1fbe6275f: covariance = I·noise² in continuous time; between biases √Δt·BiasN.
    text = al.export(axes(), "liosam", RATE)
    dt = 1 / RATE
    n, k = number(text, "imuGyrNoise"), number(text, "imuGyrBiasN")
    agrees(propagate(dt, n**2 * dt, (math.sqrt(dt) * k) ** 2))
    n, k = number(text, "imuAccNoise"), number(text, "imuAccBiasN")
    agrees(propagate(dt, n**2 * dt, (math.sqrt(dt) * k) ** 2), ACCEL_N, ACCEL_K)


def test_fastlio():
    # IMU_Processing.hpp and esekfom.hpp at 7cc4175de6f8: P ← F P Fᵀ + (dt G) Q (dt G)ᵀ, Q = diag of the covs.
    text = al.export(axes(), "fastlio", RATE)
    dt = 1 / RATE
    agrees(propagate(dt, dt**2 * number(text, "gyr_cov"), dt**2 * number(text, "b_gyr_cov")))
    found = propagate(dt, dt**2 * number(text, "acc_cov"), dt**2 * number(text, "b_acc_cov"))
    agrees(found, ACCEL_N, ACCEL_K)


@pytest.mark.parametrize("filter_rate", [None, 125.0])
def test_px4(filter_rate):
    # ekf2/EKF/covariance.cpp at 028733e1c7eb: d_ang_var = sq(delta_ang_dt·noise), gyro bias += sq(dt·p_noise).
    text = al.export(axes(), "px4", filter_rate)
    dt = 1 / (filter_rate or 100.0)
    white, walk = number(text, "EKF2_GYR_NOISE"), number(text, "EKF2_GYR_B_NOISE")
    agrees(propagate(dt, (dt * white) ** 2, (dt * walk) ** 2))
    white, walk = number(text, "EKF2_ACC_NOISE"), number(text, "EKF2_ACC_B_NOISE")
    agrees(propagate(dt, (dt * white) ** 2, (dt * walk) ** 2), ACCEL_N, ACCEL_K)


def test_ardupilot():
    # AP_NavEKF3_core.cpp at 363e7e9eec9b: dAngBiasVar = sq(sq(dt)·noise), states are bias·dt; sq(dt·noise) of the angle.
    text = al.export(axes(), "ardupilot")
    dt = 0.012
    times = tuple(round(t / dt) * dt for t in TIMES)
    for keys, n, k in (
        (("EK3_GYRO_P_NSE", "EK3_GBIAS_P_NSE"), N, K),
        (("EK3_ACC_P_NSE", "EK3_ABIAS_P_NSE"), ACCEL_N, ACCEL_K),
    ):
        white, walk = (number(text, key) for key in keys)
        # The bias in rad a step: its variance over dt² is that in rad/s.
        found = propagate(dt, (dt * white) ** 2, (dt**2 * walk) ** 2 / dt**2, times)
        np.testing.assert_allclose(found, [expected(t, n, k) for t in times], rtol=2e-2)


def walk_of(rng, runs, steps, sd):
    """Integrals of a bias that changes by sd per step, before each step."""
    steps_ = sd * rng.standard_normal((runs, steps))
    return np.cumsum(steps_, axis=1) - steps_


@pytest.mark.parametrize(("sensor", "n", "k"), [("gyro", N, K), ("accel", ACCEL_N, ACCEL_K)])
def test_airsim(sensor, n, k):
    # ImuSimple.hpp at 04c4bf969f6b, ImuSimpleParams.hpp: arw/√dt of a sample; bias_stability/√τ·√dt of a bias step.
    imu = json.loads(al.export(axes(), "airsim", RATE))["Sensors"]["Imu"]
    if sensor == "gyro":
        white = imu["AngularRandomWalk"] / math.sqrt(3600) * DEGREE
        bias = imu["GyroBiasStability"] / 3600 * DEGREE / math.sqrt(imu["GyroBiasStabilityTau"])
    else:
        white = imu["VelocityRandomWalk"] * 9.80665e-3
        bias = imu["AccelBiasStability"] * 1e-6 * 9.80665 / math.sqrt(imu["AccelBiasStabilityTau"])
    rng = np.random.default_rng(1)
    runs, steps, dt = 2000, 1000, 0.01
    x = white / math.sqrt(dt) * rng.standard_normal((runs, steps))
    x += walk_of(rng, runs, steps, bias * math.sqrt(dt))
    # 2000 runs: a variance is known to √(2/2000) = 3.2 %.
    assert (x.sum(axis=1) * dt).var() == pytest.approx(expected(10.0, n, k), rel=4 * 0.032)


def test_gazebo():
    # gz-sensors GaussianNoiseModel.cc at 9ba02f24108e: bias ← φ bias + N(0, σ_b √(−τ/2·expm1(−2dt/τ))).
    q, T = 4e-4, 30.0
    text = al.export(axes(gyro=f"N(N={N})+GM(q_c={q},T={T})"), "gazebo", RATE)
    values = {
        tag: float(re.search(rf"<{tag}>(\S+?)</{tag}>", text).group(1))
        for tag in ("stddev", "dynamic_bias_stddev", "dynamic_bias_correlation_time")
    }
    assert "in this file: numbers that cover N, GM" in text
    dt, tau = 1 / RATE, values["dynamic_bias_correlation_time"]
    step = values["dynamic_bias_stddev"] ** 2 * -tau / 2 * math.expm1(-2 * dt / tau)
    found = propagate(dt, (dt * values["stddev"]) ** 2, step, phi=math.exp(-dt / tau))
    np.testing.assert_allclose(found, lag_variance(q, T), rtol=8e-3)


def lag_variance(q, T, n=N):
    """∫∫ of the covariance of a Gauss-Markov process that starts at 0, plus the white part."""
    t = np.array(TIMES)
    grown = t - 2 * T * (1 - np.exp(-t / T)) + T / 2 * (1 - np.exp(-2 * t / T))
    return n**2 * t + q**2 * T**2 * grown


def test_kfgins():
    # gi_engine.cpp at f39bc2e7be8a: F = −1/T, Qc = 2σ²/T and arw², Qd trapezoidal; kf_gins.cpp: units.
    q, T = 4e-4, 30.0
    text = al.export(
        axes(gyro=f"N(N={N})+GM(q_c={q},T={T})", accel=f"N(N={ACCEL_N})+GM(q_c=1e-3,T={T})"),
        "kfgins",
    )

    def first(key):
        return float(re.search(rf"{key}: \[?([^,\]\s]+)", text).group(1))

    arw, sigma = first("arw") * DEGREE / 60, first("gbstd") * DEGREE / 3600
    time = first("corrtime") * 3600
    assert time == pytest.approx(T)
    dt = 0.01
    F = np.array([[1.0, dt], [0.0, 1 - dt / time]])
    Qd = np.diag([arw**2, 2 * sigma**2 / time]) * dt
    Qd = (F @ Qd @ F.T + Qd) / 2
    P, out, done = np.zeros((2, 2)), [], 0
    for t in TIMES:
        for _ in range(done, round(t / dt)):
            P = F @ P @ F.T + Qd
        done = round(t / dt)
        out.append(P[0, 0])
    np.testing.assert_allclose(out, lag_variance(q, T), rtol=1.5e-2)
    assert first("vrw") / 60 == pytest.approx(ACCEL_N)
    assert first("abstd") * 1e-5 == pytest.approx(1e-3 * math.sqrt(T / 2))


def test_gnss_ins_sim():
    # pathgen.py at 966ff271bf21: arw/√dt of a sample; drift ← (1 − dt/T) drift + σ√(1 − e^{−2dt/T}) noise.
    q, T = 4e-4, 30.0
    text = al.export(axes(gyro=f"N(N={N})+GM(q_c={q},T={T})"), "gnss-ins-sim", RATE)
    scope = {}
    exec(text, scope)
    error = scope["imu_err"]
    arw, sigma = error["gyro_arw"][0] * DEGREE / 60, error["gyro_b_stability"][0] * DEGREE / 3600
    time, dt = error["gyro_b_corr"][0], 0.01
    b2 = sigma**2 * (1 - math.exp(-2 * dt / time))
    found = propagate(dt, (arw / math.sqrt(dt) * dt) ** 2, b2, phi=1 - dt / time)
    np.testing.assert_allclose(found, lag_variance(q, T), rtol=1.5e-2)
    assert error["accel_vrw"].shape == (3,)


def test_gtsam():
    gtsam = pytest.importorskip("gtsam")
    scope = {}
    exec(al.export(axes(), "gtsam"), scope)
    parameters = scope["parameters"]
    dt = 0.01
    bias = gtsam.imuBias.ConstantBias()
    pim = gtsam.PreintegratedCombinedMeasurements(parameters, bias)
    done = 0
    for t in (1.0, 10.0):
        for _ in range(done, round(t / dt)):
            # Free fall: no lever from attitude to velocity.
            pim.integrateMeasurement(np.zeros(3), np.zeros(3), dt)
        done = round(t / dt)
        P = pim.preintMeasCov()
        # Rotation, position, velocity, accelerometer bias, gyroscope bias.
        assert P[0, 0] == pytest.approx(expected(t), rel=2e-2)
        assert P[6, 6] == pytest.approx(expected(t, ACCEL_N, ACCEL_K), rel=2e-2)
        assert P[3, 3] == pytest.approx(ACCEL_N**2 * t**3 / 3 + ACCEL_K**2 * t**5 / 20, rel=3e-2)
        assert P[12, 12] == pytest.approx(K**2 * t, rel=1e-2)


def test_ros_takes_samples_as_independent():
    # robot_localization adds each sample's variance as if the next sample had an error of its own: the error of the sum
    # is right with N²·rate. The variance of a filtered sample itself, which is smaller, is a comment.
    text = al.export(axes(gyro=f"N(N={N})+BW(cutoff=20,order=2,design=digital)"), "ros", RATE)
    first = float(re.search(r"angular_velocity_covariance: \[(\S+),", text).group(1))
    inside = float(re.search(r"filter is (\S+) \(rad/s\)\^2", text).group(1))
    samples = al.parse_model(f"N(N={N})+BW(cutoff=20,order=2,design=digital)").simulate(
        n=200_000, rate=RATE, seed=1, unit="rad/s"
    )
    # 200 000 samples of which every fifth is new: √(2·5/200000) = 0.7 %.
    assert inside == pytest.approx(np.var(samples.samples), rel=0.03)
    assert first == pytest.approx(N**2 * RATE, rel=1e-3)
    sums = samples.samples.reshape(-1, 1000).sum(axis=1)
    # 200 sums: √(2/200) = 10 %.
    assert 1000 * first == pytest.approx(np.var(sums), rel=0.4)


def test_ros_counts_the_lines_that_every_sample_contains():
    text = al.export(axes(gyro=f"N(N={N})+SIN(frequency=31,amplitude=0.05)"), "ros", RATE)
    first = float(re.search(r"angular_velocity_covariance: \[(\S+),", text).group(1))
    assert first == pytest.approx(N**2 * RATE + 0.05**2 / 2, rel=1e-3)
    assert "variance of lines, bands and slow noise" in text


def test_c_header_and_state_space(tmp_path):
    text = al.export(axes(), "c-header")
    values = [float(v) for v in re.findall(r"^    (\S+),", text, re.M)]
    np.testing.assert_allclose(values, [N, ACCEL_N, K, ACCEL_K])
    (gyro, _) = json.loads(
        al.export(axes(gyro=f"N(N={N})+K(K={K})+B(B=1e-3)"), "statespace", RATE)
    )["axes"]
    assert len(gyro["states"]) <= 8
    # The variance of the sum of samples by the matrices is that of the model: √2 t σ(t) over two spans.
    F, Q, H, R = (np.array(gyro[k]) for k in "FQHR")
    assert R[0, 0] == pytest.approx(N**2 * RATE, rel=0.02)
    assert F.shape == Q.shape == (H.size, H.size)


def test_gtsam_4_2_adds_no_covariance_of_its_own():
    # CombinedImuFactor of GTSAM 4.2 adds biasAccOmegaInt to each preintegration (identity by default); 4.3 has no setter.
    class Parameters:
        def __init__(self):
            self.set = {"setBiasAccOmegaInit": np.eye(6)}

        def __getattr__(self, name):
            return lambda value: self.set.__setitem__(name, value)

    class Gtsam:
        class PreintegrationCombinedParams:
            made = Parameters()

            @classmethod
            def MakeSharedU(cls, _gravity):
                return cls.made

    text = al.export(axes(), "gtsam").replace("import gtsam\n", "")
    exec(text, {"gtsam": Gtsam, "np": np})
    found = Gtsam.PreintegrationCombinedParams.made.set
    extra = found["setBiasAccOmegaInit"]
    # The angle's variance after t: t² times that of the bias more.
    for t in TIMES:
        assert extra[3, 3] * t**2 < 0.005 * expected(t)
        assert extra[0, 0] * t**2 < 0.005 * expected(t, ACCEL_N, ACCEL_K)


def test_gtsam_says_what_has_no_model():
    text = al.export(axes()[:1], "gtsam")
    assert "# parameters.setAccelerometerCovariance: no model was given" in text


def test_openvins_finds_its_keys():
    # ov_core/utils/opencv_yaml_parse.h reads each key below the node imu0 of an OpenCV YAML 1.0 file.
    yaml = pytest.importorskip("yaml")
    text = al.export(axes(), "openvins", RATE)
    assert text.startswith("%YAML:1.0\n# Noise parameters of")
    assert "\n# Use: yes." in text
    node = yaml.safe_load(text.split("\n", 1)[1])["imu0"]
    assert node["gyroscope_noise_density"] == pytest.approx(N)
    assert node["accelerometer_random_walk"] == pytest.approx(ACCEL_K)
    assert node["model"] == "kalibr"
    assert np.array(node["T_i_b"]).shape == (4, 4)
    for name in ("Tw", "R_IMUtoGYRO", "Ta", "R_IMUtoACC", "Tg"):
        assert np.array(node[name]).shape == (3, 3)
    assert isinstance(node["update_rate"], float)


def test_orbslam3_loads_an_integer_frequency_and_real_noises():
    # Tracking::ParseIMUParamFile refuses a frequency that is not isInt() and noises that are not isReal().
    text = al.export(axes(), "orbslam3", 199.6)
    assert re.search(r"^IMU.Frequency: 200  # Hz; rounded from 199.6 Hz", text, re.M)
    for key in ("IMU.NoiseGyro", "IMU.NoiseAcc", "IMU.GyroWalk", "IMU.AccWalk"):
        assert re.search(rf"^{key}: \d\.\d+e[-+]\d+  #", text, re.M)


def test_px4_for_qgroundcontrol_and_its_documented_range():
    text = al.export(axes(gyro="N(N=1e-6)+K(K=1e-9)"), "px4-params")
    rows = [line.split("\t") for line in text.splitlines() if not line.startswith("#")]
    assert [len(row) for row in rows] == [5] * 4
    values = {row[2]: float(row[3]) for row in rows}
    assert values["EKF2_ACC_NOISE"] == pytest.approx(ACCEL_N * 10)
    assert {row[4] for row in rows} == {"9"}
    assert "below its documented minimum 0.0001" in text
    assert "below its documented minimum" in al.export(axes(gyro="N(N=1e-6)+K(K=1e-9)"), "px4")


def test_ardupilot_asks_for_the_rate_of_the_loop():
    text = al.export(axes(), "ardupilot")
    assert "SCHED_LOOP_RATE is below 83 Hz" in text
    dt = 1 / 50
    white = number(al.export(axes(), "ardupilot", 50.0), "EK3_GYRO_P_NSE")
    assert (dt * white) ** 2 == pytest.approx(N**2 * dt)


def test_a_gazebo_bias_is_stationary_from_the_first_sample():
    q, T = 4e-4, 30.0
    text = al.export(axes(gyro=f"N(N={N})+GM(q_c={q},T={T})"), "gazebo", RATE)
    assert float(re.search(r"<bias_stddev>(\S+?)</", text).group(1)) == pytest.approx(
        q * math.sqrt(T / 2), rel=1e-5
    )


def test_the_flicker_noise_of_matlab_through_its_published_filter():
    # fractalcoef(n, 1) of MATLAB: the first n + 1 coefficients of (1 − 1/z)^½ (Kasdin 1995) as denominator.
    B, rate = 1e-3, 10.0
    text = al.export(axes(gyro=f"N(N={N})+B(B={B})"), "matlab", rate, horizon=60.0)
    poles = int(re.search(r"fractalcoef\((\d+), 1\)", text).group(1))
    assert poles == 1200
    size = float(re.search(r"'BiasInstability', \[(\S+)", text).group(1))
    k = np.arange(1, poles + 1)
    denominator = np.concatenate([[1.0], np.cumprod((k - 1.5) / k)])
    response = np.fft.fft(denominator, 2**18)[1 : 2**17]
    w = 2 * np.pi * np.arange(1, 2**17) / 2**18
    spectrum = size**2 / np.abs(response) ** 2
    for tau in (1.0, 10.0, 60.0):
        m = round(tau * rate)
        # σ²(m) is the mean over w in (0, π) of S(w) · 2 sin⁴(mw/2)/(m sin(w/2))².
        kernel = 2.0 * np.sin(m * w / 2) ** 4 / (m * np.sin(w / 2)) ** 2
        allan = float(np.mean(spectrum * kernel))
        true = al.parse_model(f"B(B={B})").allan_variance([tau], rate)[0]
        assert 0.99 < math.sqrt(allan / true) < 1.04


def test_kimera():
    """ImuFrontend.cpp of 31ec188: squares of the densities for GTSAM, whose preintegration multiplies by dt."""
    text = al.export(axes(), "kimera", RATE)
    assert text.startswith("%YAML:1.0\n")
    n, k = (number(text, f"gyroscope_{key}") for key in ("noise_density", "random_walk"))
    agrees(propagate(1 / RATE, n**2 / RATE, k**2 / RATE))
    n, k = (number(text, f"accelerometer_{key}") for key in ("noise_density", "random_walk"))
    agrees(propagate(1 / RATE, n**2 / RATE, k**2 / RATE), ACCEL_N, ACCEL_K)
    # All keys that ImuFrontendParams.cpp reads; what is above 0 there is so here.
    assert number(text, "rate_hz") == RATE
    assert number(text, "imu_integration_sigma") > 0
    assert number(text, "imu_preintegration_type") == 1
    assert all(key in text for key in ("T_BS:", "imu_time_shift:", "n_gravity:"))
    with pytest.raises(al.InputError, match="kimera needs models of both a gyroscope and an"):
        al.export(axes()[:1], "kimera", RATE)


def test_okvis2():
    """okvis_ceres/src/ImuError.cpp of 0f18f34: K0 = dt, K2 = dt, times the squares of the sigmas."""
    text = al.export(axes(), "okvis2", RATE)
    assert "\nimu_parameters:\n" in text
    agrees(
        propagate(
            1 / RATE, number(text, "sigma_g_c") ** 2 / RATE, number(text, "sigma_gw_c") ** 2 / RATE
        )
    )
    found = propagate(
        1 / RATE, number(text, "sigma_a_c") ** 2 / RATE, number(text, "sigma_aw_c") ** 2 / RATE
    )
    agrees(found, ACCEL_N, ACCEL_K)


def test_basalt():
    """Its discrete deviation is std·√rate, which preintegration multiplies by dt; a walk has std²·dt."""
    two = axes_of([{**model_to_dict(al.parse_model("N(N=2e-3)+K(K=3e-4)")),
        "recording": {"column": "gyro_y", "unit": "rad/s"}}])  # fmt: skip
    one = axes_of([{**model_to_dict(al.parse_model("N(N=4e-3)+K(K=1e-4)")),
        "recording": {"column": "gyro_x", "unit": "rad/s"}}])  # fmt: skip
    whole = json.loads(al.export([*two, *one, axes()[1]], "basalt", RATE))
    found = whole["value0"]
    assert found["imu_update_rate"] == RATE
    # x and y have their own numbers, z has the largest, and the comment says so.
    assert found["gyro_noise_std"] == pytest.approx([4e-3, 2e-3, 4e-3], rel=0.02)
    assert any("gyro z" in line for line in whole["_comment"])
    sample = found["gyro_noise_std"][1] * math.sqrt(found["imu_update_rate"])
    dt = 1 / RATE
    agrees(propagate(dt, (sample * dt) ** 2, found["gyro_bias_std"][1] ** 2 * dt))


@pytest.mark.parametrize("scans", [None, 20.0])
def test_glim(scans):
    """imu_integration.cpp squares the densities; the between factor has one deviation from scan to scan (d1c23be)."""
    found = json.loads(al.export(axes(), "glim", scans))["sensors"]
    dt = 1 / RATE
    white = propagate(dt, found["imu_gyro_noise"] ** 2 * dt, 0.0)
    np.testing.assert_allclose(white, [expected(t, N, 0.0) for t in TIMES], rtol=8e-3)
    # The accelerometer has the larger K; a second of scans makes its variance.
    rate = scans or 10.0
    assert rate * found["imu_bias_noise"] ** 2 == pytest.approx(ACCEL_K**2, rel=1e-6)
    assert found["imu_acc_noise"] == pytest.approx(ACCEL_N, rel=1e-6)


def test_navego():
    """ins_gnss.m: Q of squares; kf_prediction.m: expm(F dt), Q dt; F_update.m: -1/corr (5f93200, 017fd29)."""
    q, T = 3e-4, 30.0
    text = al.export(axes(gyro=f"N(N={N})+GM(q_c={q},T={T})"), "navego")

    def first(key):
        return float(re.search(rf"^imu\.{key} = \[(\S+) ", text, re.MULTILINE)[1])

    assert first("gb_corr") == pytest.approx(T, rel=1e-6)
    assert first("gb_dyn") == pytest.approx(q * math.sqrt(T / 2), rel=1e-6)
    dt = 1 / RATE
    phi = math.exp(-dt / first("gb_corr"))
    found = propagate(dt, first("arw") ** 2 * dt, first("gb_psd") ** 2 * dt, phi=phi)
    np.testing.assert_allclose(found, lag_variance(q, T), rtol=8e-3)
    assert first("vrw") == pytest.approx(ACCEL_N, rel=0.02)


@pytest.mark.parametrize(
    ("target", "keys"),
    [
        ("cuvslam", ("gyro_noise_density", "gyro_random_walk", "accel_noise_density", "accel_random_walk")),
        ("dmvio", ("gyroscope_noise_density", "gyroscope_random_walk", "accelerometer_noise_density",
            "accelerometer_random_walk")),
    ],
)  # fmt: skip
def test_continuous_time(target, keys):
    """cuvslam.h: Kalibr's model. IMUUtils.cpp of DM-VIO (fcc306b): the bias moves by walk·√Δt; GTSAM squares N."""
    text = al.export(axes(), target, RATE)
    dt = 1 / RATE
    for (white, walk), n, k in ((keys[:2], N, K), (keys[2:], ACCEL_N, ACCEL_K)):
        step = (math.sqrt(dt) * number(text, walk)) ** 2
        agrees(propagate(dt, number(text, white) ** 2 * dt, step), n, k)
    with pytest.raises(al.InputError, match="needs models of both"):
        al.export(axes()[:1], target, RATE)


def test_cuvslam_has_the_rate_of_the_samples():
    assert number(al.export(axes(), "cuvslam", 250.0), "calibration_frequency") == 250.0


@pytest.mark.parametrize(
    ("target", "keys"),
    [
        ("fastlivo2", ("gyr_cov", "# set_gyr_bias_cov", "acc_cov", "# set_acc_bias_cov")),
        ("pointlio", ("gyr_cov_input", "b_gyr_cov", "acc_cov_input", "b_acc_cov")),
    ],
)
def test_variances_of_samples(target, keys):
    """IMU_Processing.cpp of FAST-LIVO2 (107acae), esekfom.hpp of Point-LIO (bbd402a): P ← F P Fᵀ + Q dt²."""
    text = al.export(axes(), target, RATE)
    dt = 1 / RATE
    for (white, walk), n, k in ((keys[:2], N, K), (keys[2:], ACCEL_N, ACCEL_K)):
        agrees(propagate(dt, dt**2 * number(text, white), dt**2 * number(text, walk)), n, k)


def test_point_lio_measures_samples():
    """R_IMU is the variance of one sample."""
    text = al.export(axes(), "pointlio", RATE)
    assert number(text, "imu_meas_omg_cov") == pytest.approx(N**2 * RATE, rel=0.01)
    assert number(text, "imu_meas_acc_cov") == pytest.approx(ACCEL_N**2 * RATE, rel=0.01)


def test_psins():
    """imuerrset.m: web in °/√h, wdb in µg/√Hz; sqrtR0 and Tau of a Gauss-Markov bias, driven by sqrtR0·√(2/Tau)."""
    q, T = 3e-4, 30.0
    text = al.export(axes(gyro=f"N(N={N})+GM(q_c={q},T={T})"), "psins")

    def first(key):
        return float(re.search(rf"^{key} = \[(\S+?);", text, re.MULTILINE)[1])

    dt, tau, sigma = 1 / RATE, first("TauG"), first("sqrtR0G") * DEGREE / 3600
    white = first("web") * DEGREE / 60
    found = propagate(dt, white**2 * dt, 2 * sigma**2 / tau * dt, phi=math.exp(-dt / tau))
    np.testing.assert_allclose(found, lag_variance(q, T), rtol=8e-3)
    assert first("wdb") * 9.7803267714e-6 == pytest.approx(ACCEL_N, rel=0.02)
    assert text.rstrip().endswith("imuerrset(eb, db, web, wdb, sqrtR0G, TauG, sqrtR0A, TauA);")


def test_carla():
    """InertialMeasurementUnit.cpp: each sample gets a normal number of this deviation."""
    scope, told = {}, {}
    exec(al.export(axes(), "carla", RATE), scope)
    scope["set_on"](SimpleNamespace(set_attribute=told.__setitem__))
    assert all(isinstance(value, str) for value in told.values())
    assert 1 / float(told["sensor_tick"]) == pytest.approx(RATE)
    for axis in "xyz":
        gyro, accel = (float(told[f"noise_{s}_stddev_{axis}"]) for s in ("gyro", "accel"))
        assert gyro**2 / RATE == pytest.approx(N**2, rel=0.02)
        assert accel**2 / RATE == pytest.approx(ACCEL_N**2, rel=0.02)


def test_isaac_lab():
    """noise_model.py (046b71b): std·randn for a sample, and a bias that "abs" draws at each reset."""
    q, T = 3e-4, 30.0
    text = al.export(axes(gyro=f"N(N={N})+GM(q_c={q},T={T})"), "isaaclab", RATE)
    noise = SimpleNamespace(
        GaussianNoiseCfg=SimpleNamespace, NoiseModelWithAdditiveBiasCfg=SimpleNamespace
    )
    scope = {}
    with_modules = {"isaaclab": noise, "isaaclab.utils": noise, "isaaclab.utils.noise": noise}
    with pytest.MonkeyPatch.context() as patch:
        for name, module in with_modules.items():
            patch.setitem(sys.modules, name, module)
        exec(text, scope)
    gyro = scope["imu_ang_vel_noise"]
    assert gyro.noise_cfg.std**2 / RATE == pytest.approx(N**2, rel=0.02)
    assert (gyro.noise_cfg.operation, gyro.bias_noise_cfg.operation) == ("add", "abs")
    assert gyro.bias_noise_cfg.std == pytest.approx(q * math.sqrt(T / 2), rel=0.02)


def without_bias(angle, rate, measured, times, dt=1 / RATE):
    """Variance of an angle by a filter of angle and rate: P ← F P Fᵀ + dt Q, and a measured rate each step."""
    F, Q = np.array([[1.0, dt], [0.0, 1.0]]), np.diag([angle, rate])
    P, out = np.diag([0.0, 1.0]), []
    for step in range(1, round(times[-1] / dt) + 1):
        P = F @ P @ F.T + dt * Q
        gain = P[:, 1] / (P[1, 1] + measured)
        P = P - np.outer(gain, P[1])
        if step in [round(t / dt) for t in times]:
            out.append(P[0, 0])
    return np.array(out)


def message_variance(key):
    return float(
        re.search(rf"{key}_covariance: \[([^,]+),", al.export(axes(), "ros", RATE)).group(1)
    )


def matrix(text, key):
    return np.fromstring(
        re.search(rf"{key}: \[([^\]]+)\]", text).group(1).replace("\n", " "), sep=","
    )


def test_robot_localization():
    """ekf.cpp of 1cb9533: P ← J P Jᵀ + dt Q; the rate is measured with the message's variance; no state of bias."""
    text = al.export(axes(), "robot_localization", horizon=TIMES[-1])
    noise = matrix(text, "process_noise_covariance").reshape(15, 15)
    np.testing.assert_array_equal(noise, np.diag(np.diag(noise)))
    noise = np.diag(noise)
    for angle, rate, key, n, k in (
        (5, 11, "angular_velocity", N, K),
        (6, 12, "linear_acceleration", ACCEL_N, ACCEL_K),
    ):
        found = without_bias(noise[angle], noise[rate], message_variance(key), TIMES)
        truth = np.array([expected(t, n, k) for t in TIMES])
        assert found[-1] == pytest.approx(truth[-1], rel=0.01)
        assert (found > truth).all()
    # Motion of the vehicle: the program's defaults stay.
    np.testing.assert_array_equal(noise[:3], [0.05, 0.05, 0.06])
    np.testing.assert_array_equal(noise[9:], [0.01, 0.01, 0.02, 0.01, 0.01, 0.015])


def test_fuse():
    """unicycle_2d.cpp (dae8521), omnidirectional_3d.cpp (24ee705): the covariance is the diagonal times dt."""
    text = al.export(axes(), "fuse", horizon=TIMES[-1])
    plane, space = (
        matrix(part, "process_noise_diagonal") for part in text.split("omnidirectional_3d")
    )
    assert (plane.size, space.size) == (8, 15)
    # The factor inverts the covariance.
    assert (plane > 0).all()
    assert (space > 0).all()
    for angle, rate, key, n, k in (
        (plane[2], plane[5], "angular_velocity", N, K),
        (space[3], space[9], "angular_velocity", N, K),
        (plane[3], plane[6], "linear_acceleration", ACCEL_N, ACCEL_K),
        (space[8], space[14], "linear_acceleration", ACCEL_N, ACCEL_K),
    ):
        found = without_bias(angle, rate, message_variance(key), TIMES)
        truth = np.array([expected(t, n, k) for t in TIMES])
        assert found[-1] == pytest.approx(truth[-1], rel=0.01)
        assert (found > truth).all()


@pytest.mark.parametrize(
    ("name", "n", "k"), [("gyroscope", N, K), ("accelerometer", ACCEL_N, ACCEL_K)]
)
def test_insekf(name, n, k):
    """insEKF/predict: P ← P + dt (F P + P Fᵀ + Q), Euler; fuse: the reading is rate + bias, of the given variance."""
    text = al.export(axes(), "insekf", RATE)
    walk = float(re.search(rf"Q\(states.{name.title()}_Bias, .*diag\(\[(\S+) ", text).group(1))
    sample = float(re.search(rf"{name}Noise = diag\(\[(\S+) ", text).group(1))
    dt = 1 / RATE
    F = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    # Process noise of the motion is the user's: here the rate follows its readings within 0.2 s. A shorter time is beyond
    # the Euler step, which leaves out dt²·P of the rate.
    Q = np.diag([0.0, (5 * n) ** 2, walk**2])
    P, found = np.diag([1.0, 5 * n**2, 0.0]), []
    for step in range(1, round(10.0 * RATE) + 1):
        P = P + dt * (F @ P + P @ F.T + Q)
        column = P[:, 1] + P[:, 2]
        P = P - np.outer(column, column) / (column[1] + column[2] + sample**2)
        if step in (RATE, 10 * RATE):
            found.append(P[0, 0])
    # dt·P of the rate is 1.25 % of twice the covariance of angle and rate.
    growth = expected(10.0, n, k) - expected(1.0, n, k)
    assert found[1] - found[0] == pytest.approx(growth, rel=0.03)


def test_insekf_of_a_gyroscope_alone():
    text = al.export(axes()[:1], "insekf", RATE)
    assert "filter = insEKF(gyroscope, insMotionPose);" in text
    assert "Accelerometer" not in text


def test_factorimu():
    """FactorIMU of the toolbox: each sample adds dt²·noise/dt; the bias moves by (time between nodes)·bias noise."""
    text = al.export(axes(), "factorimu", RATE)
    assert "'SampleRate', 200);" in text
    rate, nodes = RATE, 0.1
    for name, n, k in (("Gyroscope", N, K), ("Accelerometer", ACCEL_N, ACCEL_K)):
        noise, bias = (
            float(re.search(rf"'{name}{key}', diag\(\[(\S+) ", text).group(1)) ** 2
            for key in ("Noise", "BiasNoise")
        )
        preintegrated = nodes * rate * (1 / rate) ** 2 * (noise / (1 / rate))
        agrees(propagate(nodes, preintegrated, nodes * bias), n, k)
    with pytest.raises(al.InputError, match="needs models of both"):
        al.export(axes()[:1], "factorimu", RATE)
    assert "below the documented minimum of 100 Hz" in al.export(axes(), "factorimu", 50.0)
