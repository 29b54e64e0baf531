"""Exports of several axes: each in its place, none made up in silence; numbers that stand for a whole model."""

import json
import re

import numpy as np
import pytest

import allanite as al
from allanite.cli import main
from allanite.effects.files import model_to_dict
from allanite.exports import TARGETS, axes_of

INERTIAL = [t for t in TARGETS if t not in ("json", "c-header", "statespace")]
XYZ = ("gazebo", "gnss-ins-sim", "kfgins", "matlab", "ros")


def document(column, text, unit="rad/s", rate=100.0):
    found = model_to_dict(al.parse_model(text))
    found["recording"] = {"column": column, "unit": unit, "rate_hz": rate, "duration_s": 1000.0}
    return found


def white_of(text, target):
    """N of x, y and z of the gyroscope, in proportion."""
    if target == "ros":
        row = re.search(r"angular_velocity_covariance: \[(.*?)\]", text).group(1).split(", ")
        return np.sqrt([float(row[i]) for i in (0, 4, 8)])
    pattern = {
        "gazebo": r"<[xyz]><noise.*?<stddev>(.*?)</stddev>",
        "gnss-ins-sim": r"gyro_arw\": np.array\(\[(.*?)\]",
        "kfgins": r"arw: \[(.*?)\]",
        "matlab": r"gyroparams\(.*?NoiseDensity', \[(.*?)\]",
    }[target]
    found = re.findall(pattern, text, re.DOTALL)
    numbers = found[:3] if target == "gazebo" else re.split(r",? ", found[0])
    return np.array([float(n) for n in numbers])


@pytest.mark.parametrize("target", XYZ)
def test_axes_are_placed_by_their_names(target):
    ns = {"z": 3e-2, "y": 2e-2, "x": 1e-2}
    own = [document(f"gyro_{a}", f"N(N={n})+K(K=1e-5)") for a, n in ns.items()]
    own += [document(f"acc_{a}", "N(N=1e-3)+K(K=1e-5)", "m/s^2") for a in "xyz"]
    found = white_of(al.export(axes_of(own), target), target)
    np.testing.assert_allclose(found / found[0], [1.0, 2.0, 3.0], rtol=1e-5)
    # One that was not characterised has the largest number of the others, and the file says so.
    text = al.export(axes_of([own[0], own[2], *own[3:]]), target)
    found = white_of(text, target)
    np.testing.assert_allclose(found / found[0], [1.0, 3.0, 3.0], rtol=1e-5)
    assert "y: no own model was given" in text


def test_a_place_without_a_model_has_at_least_the_density_of_each_other():
    slow, fast = "N(N=0.03)+GM(q_c=1e-3,T=100)", "N(N=0.02)+GM(q_c=5e-3,T=3)"
    text = al.export(axes_of([document("gyro_x", slow), document("gyro_y", fast)]), "gazebo")
    tags = ("stddev", "dynamic_bias_stddev", "dynamic_bias_correlation_time")
    columns = [re.findall(f"<{tag}>(.*?)</{tag}>", text) for tag in tags]
    z = [float(column[2]) for column in columns]
    made = al.parse_model(f"N(N={z[0] / 10})+GM(q_c={z[1]},T={z[2]})")
    f = np.geomspace(1e-4, 49.0, 200)
    for other in (slow, fast):
        assert (made.psd(f, 100) >= 0.9999 * al.parse_model(other).psd(f, 100)).all()


def test_matlab_writes_the_flicker_of_the_axes_that_have_it():
    own = [
        document("gyro_x", "N(N=0.01)+B(B=0.002)+K(K=1e-4)"),
        document("gyro_y", "N(N=0.01)+K(K=1e-4)"),
    ]
    own += [document("gyro_z", "N(N=0.01)+B(B=0.001)+K(K=1e-4)")]
    text = al.export(axes_of(own), "matlab")
    assert "'BiasInstability', [2.000000e-03 0.000000e+00 1.000000e-03]" in text
    assert "model N+K; in this file: numbers that cover N, K\n" in text


def numbers_of(text):
    keys = ("gyroscope_noise_density", "gyroscope_random_walk")
    return [float(re.search(rf"^{key}: (\S+)", text, re.MULTILINE).group(1)) for key in keys]


@pytest.mark.parametrize(
    "text",
    [
        "N(N=0.001)+K(K=1e-5)+RES(frequency=23,damping=0.005,rms=0.02)",
        "N(N=0.001)+GM(q_c=0.01,T=5)",
        "N(N=0.001)+B(B=0.005)+K(K=1e-4)",
        "N(N=0.001)+K(K=1e-5)+SIN(frequency=0.2,amplitude=0.01)",
        "N(N=0.001)+GM(q_c=0.01,T=0.002)",
        "N(N=0.001)+CYCLE(period=10,start=1,share=0.3,factor=2)",
        "N(N=0.001)",
    ],
)
def test_an_overbound_is_above_both_curves_in_every_band(text):
    made = al.export(axes_of([document("gyro_x", text)]), "kalibr", overbound=True)
    white, walk = numbers_of(made)
    assert walk > 0.0
    bound, model = (
        al.parse_model(f"N(N={white})+K(K={walk})"),
        al.parse_model(text).steady((0.0, 1000.0)),
    )
    f = np.linspace(1e-2, 49.9, 20_000)
    tau = np.unique(np.round(np.geomspace(1, 10_000, 2000))) / 100.0
    # Six digits are written; between two points of the grid, 48 a decade, curves of second order in 1/96 of a decade.
    assert (bound.psd(f, 100) > 0.999 * model.psd(f, 100)).all()
    assert (bound.allan_variance(tau, 100) > 0.999 * model.allan_variance(tau, 100)).all()


def test_an_overbound_counts_the_intervals_of_shapes():
    def fitted(kind, **values):
        unit = {"N": "rad/s·s^½", "rms": "rad/s", "frequency": "Hz", "damping": "1"}
        parameters = {
            name: al.Estimate(v, 0.1 * v, (low, high), unit[name], name=name).to_dict()
            for name, (v, low, high) in values.items()
        }
        return {"kind": kind, "parameters": parameters}

    effects = [
        fitted("angle_random_walk", N=(0.001, 0.00099, 0.00101)),
        fitted("resonance", rms=(0.02, 0.019, 0.021), frequency=(20.0, 19.0, 21.0), damping=(0.05, 0.04, 0.06)),
    ]  # fmt: skip
    whole = {**document("gyro_x", "N(N=1)"), "schema": "allanite/fit/1", "effects": effects}
    white, _ = numbers_of(al.export(axes_of([whole]), "kalibr", overbound=True))
    f = np.linspace(15.0, 25.0, 2001)
    for frequency in (19.0, 20.0, 21.0):
        true = al.parse_model(f"N(N=0.001)+RES(frequency={frequency},damping=0.04,rms=0.021)")
        assert white**2 > 0.999 * true.psd(f, 100).max()


@pytest.mark.parametrize("target", TARGETS)
def test_every_model_with_noise_has_an_overbound(target):
    for text in (
        "N(N=1e-3)",
        "N(N=1e-3)+RES(frequency=20,damping=0.02,rms=0.02)",
        "N(N=1e-3)+NOTCH(frequency=20,quality=3)",
    ):
        own = [document("gyro_x", text), document("acc_x", text, "m/s^2")]
        assert al.export(axes_of(own), target, overbound=True)


@pytest.mark.parametrize("target", INERTIAL)
@pytest.mark.parametrize("text", ["N(N=0)+K(K=0)", "R(R=1e-4)", "SIN(f=3,amplitude=1)"])
def test_a_model_without_noise_is_refused(target, text):
    own = [document("gyro_x", text), document("acc_x", text, "m/s^2")]
    with pytest.raises(al.InputError, match=r"gyro_x: the model .* has no noise"):
        al.export(axes_of(own), target)


def test_state_spaces_of_what_cannot_be_reduced_or_has_no_noise(capsys):
    steep = json.loads(
        al.export(
            axes_of([document("gyro_x", "N(N=0.02)+PL(exponent=-2.5,level=1e-4)")]), "statespace"
        )
    )
    assert len(steep["axes"][0]["states"]) > 8
    with pytest.raises(SystemExit) as stop:
        main(
            [
                "export",
                "N(N=0)+K(K=0)",
                "--unit",
                "rad/s",
                "--rate",
                "100",
                "--format",
                "statespace",
            ]
        )
    assert stop.value.code == 2
    assert "no random part" in capsys.readouterr().err


def test_the_covariance_of_ros_has_what_is_in_its_band():
    # A lag of 10⁵ s, seen from 1/100 s on: its density there is q_c²/(2πf)².
    text = al.export(axes_of([document("gyro_x", "N(N=1e-4)+GM(q_c=1e-3,T=1e5)")]), "ros")
    first = float(re.search(r"angular_velocity_covariance: \[(\S+),", text).group(1))
    low, high = 0.01, 50.0
    # Of the sampled process the sum of its aliases: 1/(2 sin)² in the place of 1/(2πf)².
    lag = 2.0 * 1e-6 / 100**2 * (1 / np.tan(np.pi * low / 100) / 2 / np.pi * 0.5) * 100
    assert first == pytest.approx(1e-8 * 100 * (1 - low / high) + lag, rel=1e-3)


@pytest.mark.parametrize("target", ["ros", "kalibr", "gazebo"])
def test_a_noise_level_that_changes_counts_with_its_mean(target):
    text = al.export(
        axes_of([document("gyro_x", "N(N=0.02)+CYCLE(period=10,start=0,share=0.3,factor=2)")]),
        target,
    )
    if target == "ros":
        first = float(re.search(r"angular_velocity_covariance: \[(\S+),", text).group(1))
        assert first == pytest.approx(0.02**2 * 100 * 1.9, rel=1e-3)
    else:
        assert "in this file: numbers that cover N, CYCLE" in text
        assert ": 1.00 times the model's" in text


def test_a_vibration_is_no_bias():
    own = [document(f"acc_{a}", "N(N=1e-3)+K(K=1e-5)", "m/s^2") for a in "xy"]
    own += [
        document("acc_z", "N(N=1e-3)+K(K=1e-5)+RES(frequency=22,damping=0.01,rms=5e-3)", "m/s^2")
    ]
    own += [document(f"gyro_{a}", "N(N=1e-3)+K(K=1e-5)") for a in "xyz"]
    text = al.export(axes_of(own), "kfgins")
    x, _, z = (float(v) for v in re.search(r"abstd: \[(.*?)\]", text).group(1).split(", "))
    assert z == pytest.approx(x, rel=0.01)
    assert "model N+K+RES; in this file: numbers that cover N, K, RES" in text
    no_walk = document("gyro_x", "N(N=1e-3)+RES(frequency=22,damping=0.01,rms=5e-3)")
    _, walk = numbers_of(al.export(axes_of([no_walk]), "kalibr"))
    # One per cent of the Allan variance at the horizon, 100 s.
    assert walk == pytest.approx(np.sqrt(0.03) * 1e-3 / 100, rel=1e-3)


def test_ardupilot_lines_are_a_name_and_a_number():
    own = [
        document("gyro_x", "N(N=1e-3)+K(K=1e-5)"),
        document("acc_x", "N(N=1e-3)+B(B=1e-4)", "m/s^2"),
    ]
    lines = [
        line
        for line in al.export(axes_of(own), "ardupilot").splitlines()
        if not line.startswith("#")
    ]
    assert len(lines) == 4
    for line in lines:
        name, number = re.split(r"[ ,\t]+", line)
        assert name.startswith("EK3_")
        assert float(number) > 0.0


def test_units_of_several_models_are_a_list(capsys):
    models = ["N(N=1e-3)+K(K=1e-5)", "N(N=1e-2)+K(K=1e-4)"]

    def run(unit):
        with pytest.raises(SystemExit) as stop:
            main(["export", *models, "--unit", unit, "--rate", "100", "--format", "kalibr"])
        return stop.value.code, capsys.readouterr()

    code, out = run("rad/s,m/s^2")
    assert not code
    assert "gyroscope_noise_density: 1.0" in out.out
    assert "accelerometer_noise_density: 1.0" in out.out
    code, out = run("rad/s,m/s^2,deg/s")
    assert code == 2
    assert "3 units for 2 models" in out.err


def test_two_imus_are_not_merged():
    own = [document(f"imu{i}_gyro_{a}", "N(N=1e-3)+K(K=1e-5)") for i in (1, 2) for a in "xyz"]
    with pytest.raises(al.InputError, match="kalibr holds one IMU, found 6 axes"):
        al.export(axes_of(own), "kalibr")


def test_a_state_space_has_the_parameters_of_known_functions():
    own = document("gyro_x", "N(N=1e-3)+K(K=1e-5)+STEP(time=30,height=0.01)")
    (axis,) = json.loads(al.export(axes_of([own]), "statespace"))["axes"]
    assert axis["known"] == ["bias_step"]
    (step,) = axis["functions"]
    assert step["parameters"]["height"]["value"] == 0.01


def test_two_imus_are_two_files(tmp_path, capsys):
    """Columns of each IMU share a stem; the first gyroscope belongs to the first accelerometer."""
    columns = []
    for imu, N in (("a", 1e-3), ("b", 2e-3)):
        for axis in "xyz":
            columns.append(document(f"{imu}_gyro_{axis}", f"N(N={N})"))
            columns.append(document(f"{imu}_acc_{axis}", f"N(N={10 * N})", "m/s^2"))
    path = tmp_path / "models.json"
    path.write_text(json.dumps({"schema": "allanite/fit/1", "columns": columns}))
    with pytest.raises(SystemExit) as stop:
        main(["export", str(path), "--format", "kalibr", "-o", str(tmp_path / "imu.yaml")])
    assert not stop.value.code
    found = {p.name: p.read_text() for p in tmp_path.glob("*.yaml")}
    assert set(found) == {"imu-1.yaml", "imu-2.yaml"}
    for k, (text, N) in enumerate(
        zip((found["imu-1.yaml"], found["imu-2.yaml"]), (1e-3, 2e-3), strict=True)
    ):
        assert float(re.search(r"gyroscope_noise_density: (\S+)", text)[1]) == pytest.approx(
            N, rel=0.02
        )
        assert ("b_gyro" in text) == bool(k)
        assert text.count("_acc_") >= 3
    # A target of all sensors has one file; on stdout there is one file alone.
    with pytest.raises(SystemExit):
        main(["export", str(path), "--format", "json", "-o", str(tmp_path / "all.json")])
    assert (tmp_path / "all.json").exists()
    with pytest.raises(SystemExit) as stop:
        main(["export", str(path), "--format", "kalibr"])
    assert stop.value.code == 2
    assert "holds one IMU" in capsys.readouterr().err


def test_the_bias_at_a_temperature_can_be_built_from_the_state_space():
    """offset + coefficient (T - reference) is the bias of the simulated sensor, in SI."""
    rng = np.random.default_rng(2)
    warm = 25.0 + 5.0 * np.sin(np.arange(4000) / 300)
    x = 0.5 + 0.01 * (warm - 20.0) + 0.002 * rng.standard_normal(4000)
    log = al.Recording(x, 10.0, unit="deg/s", columns=["gx"], covariates={"temperature": warm})
    found = al.characterize(log, "N+COV(column=temperature,lag=0!)")
    (axis,) = json.loads(found.export("statespace"))["axes"]
    function = next(f for f in axis["functions"] if f["kind"] == "covariate")
    slope = function["parameters"]["coefficient"]["value"] * axis["functions_unit_si"]
    for T in (20.0, 30.0):
        bias = axis["offset"] + slope * (T - axis["references"]["temperature"])
        # 4000 samples tell the line to 0.002/63/5 a degree.
        assert np.degrees(bias) == pytest.approx(0.5 + 0.01 * (T - 20.0), abs=3e-4)
