"""allanite thermal: what it prints, writes and refuses."""

import json

import numpy as np
import pytest

from documents import valid


@pytest.fixture
def warm_up(tmp_path):
    """A log of a gyroscope that follows a thermometer with steps of whole degrees."""
    rng = np.random.default_rng(2)
    temp = 22.0 + 25.0 * (1.0 - np.exp(-np.arange(3000) / 600.0))
    x = 0.004 * temp + rng.normal(0.0, 0.01, temp.size)
    rows = "".join(f"{v:.9f},{t:.0f}\n" for v, t in zip(x, temp, strict=True))
    path = tmp_path / "warm.csv"
    path.write_text(f"gyro_x,temperature\n{rows}")
    return path


READ = ("--rate", 1, "--unit", "deg/s", "--quiet")


@pytest.mark.slow
def test_text_json_figure_and_parameters(run, warm_up, tmp_path):
    figure, parameters = tmp_path / "law.svg", tmp_path / "tc.params"
    code, out, err = run(
        "thermal", warm_up, *READ, "--plot", figure, "--export", "px4", "--output", parameters
    )
    assert code == 0, err
    assert out.startswith("gyro_x: linear")
    assert figure.read_text().lstrip().startswith("<?xml")
    assert "param set TC_G0_X1_0" in parameters.read_text()
    code, out, err = run("thermal", warm_up, *READ, "--json")
    assert code == 0, err
    axis = valid(json.loads(out))["axes"][0]
    assert axis["thermometer_step_celsius"] == 1.0
    low, high = axis["law"]["numbers"]["COV.coefficient"]["interval"]
    assert low < 0.004 < high


@pytest.mark.slow
def test_the_parameters_alone_on_standard_output(run, warm_up):
    code, out, err = run("thermal", warm_up, *READ, "--export", "ardupilot")
    assert code == 0, err
    assert all(line.startswith(("#", "INS_TCAL1_")) for line in out.splitlines())


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--export", "px4", "--json"), "add --output FILE"),
        (("--output", "law.h"), "--output needs --export"),
        (("--covariate", "humidity"), "humidity"),
        (("--model", "N+K+SIN"), "remove the others"),
    ],
)
def test_refusals_are_one_line(run, warm_up, options, said):
    code, out, err = run("thermal", warm_up, *READ, *options)
    assert code == 2
    assert not out
    assert said in err
    assert len(err.splitlines()) == 1
