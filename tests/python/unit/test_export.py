"""Export targets: the right powers of the rate, the right units, nothing made up."""

import json
import math
import re

import pytest

from allanite.common.errors import InputError
from allanite.common.parameters import Estimate
from allanite.effects.files import model_to_dict, parse_model
from allanite.export import TARGETS, export
from allanite.export._axis import axes_of, documents_of

N, B, K = 0.01, 1e-3, 1e-4  # deg/s·s^½, deg/s, deg/s/s^½
RAD = math.pi / 180


def axes(text="N(N=0.01)+B(B=1e-3)+K(K=1e-4)", unit="deg/s"):
    return axes_of([model_to_dict(parse_model(text))], unit, "model")


def fit_document(column, unit, rate=200.0, **coefficients):
    kinds = {"N": "angle_random_walk", "K": "rate_random_walk", "B": "bias_instability"}
    return {
        "schema": "allanite/fit/1",
        "recording": {"column": column, "unit": unit, "rate_hz": rate, "path": "log.csv"},
        "effects": [
            {"kind": kinds[n], "parameters": {n: e.to_dict()}} for n, e in coefficients.items()
        ],
    }


def value(text, key):
    return float(re.search(rf"^{key}: (\S+)", text, re.MULTILINE).group(1))


def test_kalibr_is_continuous_time_si():
    text = export(axes(), "kalibr", rate=100)
    assert value(text, "gyroscope_noise_density") == pytest.approx(N * RAD, rel=1e-6)
    assert value(text, "gyroscope_random_walk") == pytest.approx(K * RAD, rel=1e-6)
    assert value(text, "update_rate") == 100
    assert "two-sided" in text
    assert "left out, this format cannot hold it: B" in text


def test_vins_is_per_sample():
    text = export(axes(), "vins", rate=400)
    assert value(text, "gyr_n") == pytest.approx(N * RAD * 20, rel=1e-6)
    assert value(text, "gyr_w") == pytest.approx(K * RAD * 20, rel=1e-6)


def test_ros_is_the_variance_of_a_sample():
    text = export(axes(), "ros", rate=100)
    first = re.search(r"angular_velocity_covariance: \[(\S+),", text).group(1)
    assert float(first) == pytest.approx((N * RAD) ** 2 * 100, rel=1e-6)


def test_gtsam_squares_the_densities():
    text = export(axes(), "gtsam")
    number = re.search(r"setGyroscopeCovariance\((\S+)\*\*2", text).group(1)
    assert float(number) == pytest.approx(N * RAD, rel=1e-6)
    compile(text, "gtsam", "exec")


def test_matlab_declares_its_side():
    text = export(axes(), "matlab", rate=100)
    assert "'NoiseType', 'double-sided'" in text
    density = re.search(r"'NoiseDensity', (\S+?)[,)]", text).group(1)
    assert float(density) == pytest.approx(N * RAD, rel=1e-6)
    assert "'RandomWalk'" not in export(axes("N(N=1)"), "matlab", rate=100)


def test_json_holds_everything():
    document = json.loads(export(axes("N(N=0.01)+GM(q_c=1,T=3)"), "json", rate=100))
    (axis,) = document["axes"]
    assert axis["coefficients"]["N"]["value"] == pytest.approx(N * RAD)
    assert axis["coefficients"]["N"]["unit"] == "rad/s·s^½"
    assert axis["density"] == "two-sided"
    assert axis["left_out"] == ["gauss_markov"]


@pytest.mark.parametrize("target", ["kalibr", "vins", "gtsam"])
def test_no_random_walk_is_made_up_from_a_bias_instability(target):
    with pytest.raises(InputError, match=r"needs K.*not a random walk"):
        export(axes("N(N=0.01)+B(B=1e-3)"), target, rate=100)


def test_what_was_not_detected_is_its_upper_limit_and_says_so():
    documents = [
        fit_document(
            "gyro_x",
            "rad/s",
            N=Estimate(2e-4, 1e-6, (1.9e-4, 2.1e-4), "rad/s·s^½"),
            K=Estimate(0.0, 1e-6, (0.0, 3e-6), "rad/s/s^½", detected=False),
        )
    ]
    text = export(axes_of(documents), "kalibr")
    assert value(text, "gyroscope_random_walk") == 3e-6
    assert "95 % upper limit" in text


def test_three_axes_and_two_sensors():
    def of(column, unit, n):
        return fit_document(
            column, unit, N=Estimate(n, unit=f"{unit}·s^½"), K=Estimate(n / 10, unit=f"{unit}/s^½")
        )

    documents = [of(f"gyro_{a}", "deg/s", v) for a, v in zip("xyz", (1, 3, 2), strict=True)]
    documents += [of(f"acc_{a}", "mg", v) for a, v in zip("xyz", (5, 4, 6), strict=True)]
    found = axes_of(documents)
    text = export(found, "kalibr")
    assert value(text, "gyroscope_noise_density") == pytest.approx(3 * RAD, rel=1e-6)
    assert value(text, "accelerometer_noise_density") == pytest.approx(6e-3 * 9.80665, rel=1e-6)
    assert "largest of 3 axes, gyro_y" in text
    assert "gyr_n" in export(found, "vins")
    assert (
        len(re.search(r"'NoiseDensity', \[(.*?)\]", export(found, "matlab")).group(1).split()) == 3
    )


def test_errors():
    with pytest.raises(InputError, match="one of json, kalibr"):
        export(axes(), "simulink")
    with pytest.raises(InputError, match="with unit="):
        axes_of([model_to_dict(parse_model("N(N=1)"))], None, "model")
    with pytest.raises(InputError, match="has no value"):
        axes_of([model_to_dict(parse_model("N"))], "deg/s", "model")
    with pytest.raises(InputError, match="give rate="):
        export(axes(), "kalibr")
    with pytest.raises(InputError, match="gyroscopes and accelerometers"):
        export(axes(unit="1"), "kalibr", rate=1)


def test_documents_of_files(tmp_path):
    path = tmp_path / "fit.json"
    document = fit_document("x", "deg/s", N=Estimate(1.0, unit="deg/s·s^½"))
    path.write_text(json.dumps({"schema": "allanite/fit/1", "columns": [document, document]}))
    assert len(documents_of(path)) == 2
    rungs = [{"effects": []}, {"effects": document["effects"]}]
    path.write_text(
        json.dumps(
            {"schema": "allanite/improve/1", "recording": document["recording"], "ladder": rungs}
        )
    )
    assert axes_of(documents_of(path))[0].coefficients["N"] == pytest.approx(RAD)
    for text in ("[1]", '{"schema": "other"}', "{"):
        path.write_text(text)
        with pytest.raises(InputError, match="not a model file"):
            documents_of(path)
    with pytest.raises(InputError, match="no such file"):
        documents_of(tmp_path / "absent.json")


def test_the_registry_and_the_command_agree():
    from allanite.cli.commands.export import command

    choices = [option.type.choices for option in command.params if hasattr(option.type, "choices")]
    assert list(choices[0]) == list(TARGETS)
