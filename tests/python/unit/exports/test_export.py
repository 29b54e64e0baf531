"""Export targets: the right powers of the rate, the right units, nothing made up."""

import json
import math
import re

import numpy as np
import pytest

import allanite as al
from allanite.effects.files import model_to_dict
from allanite.exports import TARGETS, axes_of, verdict_in
from allanite.sources import document_of_last_step, documents_of

N, B, K = 0.01, 1e-3, 1e-4  # deg/s·s^½, deg/s, deg/s/s^½
RAD = math.pi / 180


def axes(text="N(N=0.01)+K(K=1e-4)", unit="deg/s"):
    return axes_of([model_to_dict(al.parse_model(text))], unit, "model")


def fit_document(column, unit, rate=200.0, **coefficients):
    kinds = {"N": "angle_random_walk", "K": "rate_random_walk", "B": "bias_instability"}
    return {
        "schema": "allanite/fit/1",
        "recording": {"column": column, "unit": unit, "rate_hz": rate, "path": "log.csv"},
        "effects": [
            {"kind": kinds[n], "parameters": {n: e.to_dict()}} for n, e in coefficients.items()
        ],
    }


def document_of(column, unit):
    document = model_to_dict(al.parse_model("N(N=0.01)+B(B=1e-3)"))
    document["recording"] = {"unit": unit, "rate_hz": 100.0, "column": column}
    return document


def numbers(text):
    """Lines of a file without its comments, which name the source."""
    return [line for line in text.splitlines() if line[:1] not in ("#", " ")]


def test_every_source_of_one_model_gives_one_file(tmp_path):
    model = al.AngleRandomWalk(N=N) + al.RateRandomWalk(K=K)
    fit = model.fit(model.simulate(duration=60, rate=50, seed=1, unit="deg/s"))
    fit.save(tmp_path / "fit.json")
    text = numbers(al.export(fit, "kalibr", horizon=5.0))
    for source in (fit.to_dict(), tmp_path / "fit.json", str(tmp_path / "fit.json"), [fit]):
        assert numbers(al.export(source, "kalibr", horizon=5.0)) == text
    text = numbers(al.export(model, "kalibr", 50, unit="deg/s"))
    assert numbers(al.export(f"N(N={N})+K(K={K})", "kalibr", 50, unit="deg/s")) == text
    one = al.export(al.AngleRandomWalk(N=N), "kalibr", 50, unit="deg/s")
    assert value(one, "gyroscope_noise_density") == pytest.approx(RAD * N, rel=1e-5)


def test_columns_choose_the_axes_of_a_file():
    two = [document_of("gyro_x", "deg/s"), document_of("gyro_y", "deg/s")]
    assert len(json.loads(al.export(two, "json", column="gyro_y"))["axes"]) == 1
    with pytest.raises(al.InputError, match="did you mean gyro_y"):
        al.export(two, "json", column=["gyro_z", "gyro_x"])


def value(text, key):
    return float(re.search(rf"^{key}: (\S+)", text, re.MULTILINE).group(1))


def test_long_comments_wrap_and_are_not_cut(tmp_path):
    sheet = tmp_path / "sheet.toml"
    sheet.write_text(
        '[gyroscope]\nangle_random_walk = "1.27 deg/sqrt(h)"\nbias_instability = "18 deg/h"\n'
        '[accelerometer]\nvelocity_random_walk = "0.1 m/s/sqrt(h)"\nbias_instability = "0.1 mg"\n'
    )
    for target in TARGETS:
        text = al.export(axes_of(documents_of(sheet)), target, rate=100)
        assert "…" not in text, target
        if not text.startswith("{"):
            head = [s for s in text.splitlines() if s.startswith(("#", "%", "//", "  ass"))]
            # Commented keys have a value and a note in one line.
            head = [s for s in head if not re.match("# (set|EKF2)_", s)]
            assert max(map(len, head), default=0) <= 120, target
        elif "_comment" not in json.loads(text):
            continue
        words = " ".join(text.replace("\n#", " ").replace("\n%", " ").replace("\n//", " ").split())
        assert "covers the bias instability B too" in words, target
        assert "agrees with the sheet (sqrt(3) sigma_min^2 / (2 N))" in words, target


def test_the_verdict_of_a_file_is_read_as_one_line():
    found = axes_of([document_of("gyro_x", "deg/s"), document_of("acc_x", "mg")])
    for target in TARGETS:
        text = al.export(found, target, rate=100)
        said = verdict_in(text)
        assert "\n" not in said
        assert "#" not in said
        if not said:
            assert "Use: " not in text
            continue
        wanted = (
            r"Use: yes\. Allan deviation of this file up to \S+ s: .*\d times the model's, .*\.$"
        )
        assert re.match(wanted, said), target
        assert "Details" not in said
    whole = al.export(found, "kalibr", rate=100)
    assert re.search(r"# NEES of a bias filter [^#]*\n#     .* s on\.\n", whole)


def test_the_head_of_a_file_says_what_from_where_and_whether_to_use_it():
    found = axes_of([document_of("gyro_x", "deg/s"), document_of("acc_x", "mg")])
    what, source, use, details, *_ = al.export(found, "kalibr", rate=100).splitlines()
    assert what == "# Noise parameters of gyro_x, acc_x, written by allanite."
    assert source.startswith("# Source: ")
    assert use.startswith("# Use: yes. ")
    assert details == "# Details:"
    assert all(len(line) <= 120 for line in (what, source, use))


def test_kalibr_is_continuous_time_si():
    text = al.export(axes(), "kalibr", rate=100)
    assert value(text, "gyroscope_noise_density") == pytest.approx(N * RAD, rel=1e-6)
    assert value(text, "gyroscope_random_walk") == pytest.approx(K * RAD, rel=1e-6)
    assert value(text, "update_rate") == 100
    assert "two-sided" in text
    assert text.splitlines()[2].startswith("# Use: yes. ")
    assert "in this file: numbers that cover N, K" in text


def test_vins_is_per_sample():
    text = al.export(axes(), "vins", rate=400)
    # Two independent draws of half weight a step: √2 more than the deviation of a sample.
    assert value(text, "gyr_n") == pytest.approx(N * RAD * 20 * math.sqrt(2), rel=1e-6)
    assert value(text, "gyr_w") == pytest.approx(K * RAD * 20, rel=1e-6)


def test_ros_is_the_variance_of_a_sample():
    def first(text):
        found = al.export(axes(text), "ros", rate=100, horizon=1000.0)
        return float(re.search(r"angular_velocity_covariance: \[(\S+),", found).group(1))

    # Its density from 1 mHz to 50 Hz.
    white = (N * RAD) ** 2 * 100 * (1 - 1e-3 / 50)
    assert first("N(N=0.01)") == pytest.approx(white, rel=1e-6)
    # The slow noise above 1 mHz: B²/π·ln(50 000) of flicker (its density is B²τ0/(2 sin), ln 2/… more at Nyquist).
    assert white < first("N(N=0.01)+B(B=1e-3)") < white + (B * RAD) ** 2 / math.pi * 12


def test_gtsam_squares_the_densities():
    text = al.export(axes(), "gtsam")
    number = re.search(r"setGyroscopeCovariance\((\S+)\*\*2", text).group(1)
    assert float(number) == pytest.approx(N * RAD, rel=1e-6)
    compile(text, "gtsam", "exec")


def test_matlab_declares_its_side():
    text = al.export(axes(), "matlab", rate=100)
    assert "'NoiseType', 'double-sided'" in text
    densities = re.search(r"'NoiseDensity', \[(.*?)\]", text).group(1).split()
    assert [float(one) for one in densities] == pytest.approx([N * RAD] * 3, rel=1e-6)
    assert "x, y, z: no own model was given; the numbers are those of model" in text
    assert "'RandomWalk'" not in al.export(axes("N(N=1)"), "matlab", rate=100)


def test_json_holds_everything():
    document = json.loads(al.export(axes("N(N=0.01)+GM(q_c=1,T=3)"), "json", rate=100))
    (axis,) = document["axes"]
    assert axis["coefficients"]["N"]["value"] == pytest.approx(N * RAD)
    assert axis["coefficients"]["N"]["unit"] == "rad/s·s^½"
    assert axis["density"] == "two-sided"
    assert axis["left_out"] == ["gauss_markov"]


def test_a_bias_instability_is_covered_by_both_numbers():
    text = al.export(axes("N(N=0.01)+B(B=1e-3)"), "kalibr", rate=100)
    assert "in this file: numbers that cover N, B\n" in text
    white, walk = (
        value(text, f"gyroscope_{key}") / RAD for key in ("noise_density", "random_walk")
    )
    tau = np.geomspace(1.0, 100.0, 60)
    written = al.parse_model(f"N(N={white})+K(K={walk})").allan_variance(tau, 100.0)
    model = al.parse_model("N(N=0.01)+B(B=1e-3)").allan_variance(tau, 100.0)
    ratio = np.sqrt(written / model)
    # Nowhere more than 2 % below the model (the search has eight tau a decade), and not far above it.
    assert ratio.min() > 0.975
    assert ratio.max() < 1.6


def test_white_noise_alone_gets_a_walk_that_changes_nothing():
    text = al.export(axes("N(N=0.01)"), "gtsam", horizon=300.0)
    walk = float(re.search(r"setBiasOmegaCovariance\((\S+)\*\*2", text).group(1)) / RAD
    # 1 % of the Allan variance at the horizon: K² t/3 = 0.01 N²/t.
    assert walk == pytest.approx(math.sqrt(0.03) * 0.01 / 300, rel=1e-3)
    assert "the model needs none" in text


@pytest.mark.parametrize("target", [t for t in TARGETS if t not in ("json", "statespace")])
def test_every_head_says_what_the_numbers_are(target):
    documents = [model_to_dict(al.parse_model("N(N=0.01)+B(B=1e-3)+GM(q_c=1e-4,T=30)+R(R=1e-9)"))]
    found = [*axes_of(documents, "deg/s", "g"), *axes_of(documents, "mg", "a")]
    text = al.export(found, target, rate=100)
    assert "two-sided" in text
    assert re.search("(?i)continuous.time|per sample|per step", text)
    assert re.search("deviation|variance|covariance|density", text)
    assert "in this file:" in text
    lines = text.splitlines()[1 if target in ("gazebo", "openvins", "kimera") else 0 :]
    if text.startswith("{"):
        lines = json.loads(text)["_comment"]
    use = next(line for line in lines if "Use: " in line)
    assert re.search(r"Use: (yes|no)\b.*Allan deviation of this file up to \S+ s: .*\d", use)
    assert text.count("Allan deviation of this file") == 1


def test_overbound_is_above_the_upper_limits_everywhere():
    def fitted(value, kind, name, unit, spread):
        low, high = value / spread, value * spread
        return {
            "kind": kind,
            "parameters": {name: al.Estimate(value, 0.1, (low, high), unit, name=name).to_dict()},
        }

    effects = [
        fitted(0.01, "angle_random_walk", "N", "deg/s·s^½", 1.02),
        fitted(1e-3, "bias_instability", "B", "deg/s", 1.2),
        fitted(1e-5, "rate_random_walk", "K", "deg/s/s^½", 1.5),
    ]
    recording = {"unit": "deg/s", "rate_hz": 100.0, "duration_s": 36_000.0, "column": "x"}
    document = {"schema": "allanite/fit/1", "recording": recording, "effects": effects}
    upper = al.parse_model("N(N=0.0102)+B(B=1.2e-3)+K(K=1.5e-5)")
    tau, f = np.geomspace(0.01, 3600, 500), np.geomspace(1 / 3600, 49, 500)
    for target, keys in (("kalibr", ("noise_density", "random_walk")), ("gnss-ins-sim", None)):
        text = al.export(axes_of([document]), target, overbound=True, horizon=3600.0)
        if keys:
            n, k = (value(text, f"gyroscope_{key}") / RAD for key in keys)
            bound = al.parse_model(f"N(N={n})+K(K={k})")
        else:
            scope = {}
            exec(text, scope)
            e = scope["imu_err"]
            n, s, T = e["gyro_arw"][0] / 60, e["gyro_b_stability"][0] / 3600, e["gyro_b_corr"][0]
            bound = al.parse_model(f"N(N={n})+GM(q_c={s * math.sqrt(2 / T)},T={T})")
        # Between the grid's points (eight a decade) half a per cent may be missing.
        assert (bound.allan_variance(tau, 100) > 0.99 * upper.allan_variance(tau, 100)).all()
        assert (bound.psd(f, 100) > 0.99 * upper.psd(f, 100)).all()
        # Not larger than it has to be: each touches the limits somewhere.
        ratio = np.concatenate(
            [
                bound.allan_variance(tau, 100) / upper.allan_variance(tau, 100),
                bound.psd(f, 100) / upper.psd(f, 100),
            ]
        )
        assert ratio.min() < 1.01
        assert "the upper limits of all its effects" in text


HOSTILE = [
    'x"\n__import__("os").system("touch hacked")\n#',
    "x'); system('touch hacked'); %\n%{",
    "--><script>alert(1)</script><!--",
    "x\\\nint hacked;",
    "x*/ int hacked; /*\u2028int hacked2;",
    "x: &a [*a]\r\nhacked: 1\x00\x85hacked2: 1",
]


@pytest.mark.parametrize("name", HOSTILE)
@pytest.mark.parametrize("target", list(TARGETS))
def test_names_stay_inside_comments(name, target, tmp_path):
    documents = []
    for unit in ("deg/s", "mg"):
        document = model_to_dict(al.parse_model("N(N=0.01)+B(B=1e-3)"))
        document["recording"] = {"unit": unit, "rate_hz": 100.0, "column": name, "path": name + "2"}
        documents.append(document)
    text = al.export(axes_of(documents), target)
    if target == "px4-params":
        # The four lines of numbers are parted by tabs; nothing else has one.
        assert text.count("\t") == 16
        text = text.replace("\t", " ")
    assert not re.search(r"[\x00-\x09\x0b-\x1f\x7f-\x9f\u2028\u2029]", text)
    mark = {".m": "%", ".h": "//"}.get(TARGETS[target].file_name[-2:], "#")
    if text.startswith("{"):
        json.loads(text)
        return
    if target == "gazebo":
        from xml.dom import minidom

        root = minidom.parseString(text).documentElement
        assert root.tagName == "imu"
        return
    code = [line.split(mark)[0] for line in text.splitlines()]
    assert not any("hacked" in line for line in code)
    assert not any(line.rstrip().endswith("\\") for line in text.splitlines())
    assert "%{" not in text
    if target in ("gtsam", "gnss-ins-sim", "carla", "isaaclab"):
        compile(text, target, "exec")


def test_what_was_not_detected_counts_with_its_expected_square():
    documents = [
        fit_document(
            "gyro_x",
            "rad/s",
            N=al.Estimate(2e-4, 1e-6, (1.9e-4, 2.1e-4), "rad/s·s^½"),
            K=al.Estimate(0.0, 1e-6, (0.0, 3e-6), "rad/s/s^½", detected=False),
        )
    ]
    text = al.export(axes_of(documents), "kalibr")
    # The mean of a half-normal K² whose 95 % point is the square of the limit.
    assert value(text, "gyroscope_random_walk") == pytest.approx(
        3e-6 * (0.798 / 1.96) ** 0.5, rel=1e-3
    )
    text = al.export(axes_of(documents), "kalibr", as_fitted=True)
    assert value(text, "gyroscope_random_walk") == 3e-6
    assert "95 % upper limit" in text


def test_three_axes_and_two_sensors():
    def of(column, unit, n):
        return fit_document(
            column,
            unit,
            N=al.Estimate(n, unit=f"{unit}·s^½"),
            K=al.Estimate(n / 10, unit=f"{unit}/s^½"),
        )

    documents = [of(f"gyro_{a}", "deg/s", v) for a, v in zip("xyz", (1, 3, 2), strict=True)]
    documents += [of(f"acc_{a}", "mg", v) for a, v in zip("xyz", (5, 4, 6), strict=True)]
    found = axes_of(documents)
    text = al.export(found, "kalibr")
    assert value(text, "gyroscope_noise_density") == pytest.approx(3 * RAD, rel=1e-6)
    assert value(text, "accelerometer_noise_density") == pytest.approx(6e-3 * 9.80665, rel=1e-6)
    assert "largest of 3 axes: gyro_y" in text
    assert "gyr_n" in al.export(found, "vins")
    assert (
        len(re.search(r"'NoiseDensity', \[(.*?)\]", al.export(found, "matlab")).group(1).split())
        == 3
    )


def test_errors():
    with pytest.raises(al.InputError, match="one of airsim, ardupilot"):
        al.export(axes(), "simulink")
    with pytest.raises(al.InputError, match="add unit="):
        axes_of([model_to_dict(al.parse_model("N(N=1)"))], None, "model")
    with pytest.raises(al.InputError, match="has no value"):
        axes_of([model_to_dict(al.parse_model("N"))], "deg/s", "model")
    with pytest.raises(al.InputError, match="add rate="):
        al.export(axes(), "kalibr")
    with pytest.raises(al.InputError, match="gyroscopes and accelerometers"):
        al.export(axes(unit="1"), "kalibr", rate=1)


def test_documents_of_files(tmp_path):
    path = tmp_path / "fit.json"
    document = fit_document("x", "deg/s", N=al.Estimate(1.0, unit="deg/s·s^½"))
    path.write_text(json.dumps({"schema": "allanite/fit/1", "columns": [document, document]}))
    assert len(documents_of(path)) == 2
    rungs = [{"effects": []}, {"effects": document["effects"]}]
    path.write_text(
        json.dumps(
            {"schema": "allanite/improve/2", "recording": document["recording"], "ladder": rungs}
        )
    )
    assert axes_of(documents_of(path))[0].coefficients["N"] == pytest.approx(RAD)
    for text in ("[1]", '{"schema": "other"}', "{"):
        path.write_text(text)
        with pytest.raises(al.InputError, match=r"not a (model|JSON) file"):
            documents_of(path)
    with pytest.raises(al.InputError, match="no such file"):
        documents_of(tmp_path / "absent.json")


def test_the_registry_and_the_command_agree():
    from allanite.cli.commands.export import command

    choices = [option.type.choices for option in command.params if hasattr(option.type, "choices")]
    assert list(choices[0]) == list(TARGETS)


@pytest.mark.parametrize("target", TARGETS)
def test_a_fit_that_is_not_adequate_is_a_warning_in_every_file(target):
    kinds = {"N": al.Estimate(0.01, 1e-3, (0.008, 0.012), "deg/s·s^½", True, "N")}
    good = {**fit_document("gx", "deg/s", **kinds), "adequate": True}
    error = {"adev_worst": {"factor": 1 / 36.0, "tau_s": 0.1}}
    kinds = {"N": al.Estimate(0.01, 1e-3, (0.008, 0.012), "m/s^2·s^½", True, "N")}
    accel = fit_document("ax", "m/s^2", **kinds)
    assert "not adequate" not in al.export(axes_of([good, accel]), target)
    text = al.export(axes_of([{**good, "adequate": False, "error": error}, accel]), target)
    assert "model and measured Allan deviation differ by a factor of 36 at 0.1 s" in text
    # An Allan error within its scatter is not the reason.
    within = {**error, "adev_rms_percent": 5.6, "chance_rms_percent": 8.4}
    text = al.export(axes_of([{**good, "adequate": False, "error": within}, accel]), target)
    assert "the fit is not adequate" in text
    assert "deviation differ" not in text
    # The same of the last step of a ladder.
    rung = {"effects": good["effects"], "adequate": False, "error": error}
    path_less = {"ladder": [rung], "recording": good["recording"]}
    assert document_of_last_step(path_less)["error"] == error
