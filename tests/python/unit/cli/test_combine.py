"""allanite combine: what it prints, writes and refuses."""

import json

import numpy as np
import pytest

from documents import valid

RATE = 20.0


@pytest.fixture
def log(tmp_path):
    rng = np.random.default_rng(8)
    path = tmp_path / "board.csv"
    x = np.column_stack([rng.normal(0.0, 0.05, 4000) for _ in range(2)])
    np.savetxt(path, x, delimiter=",", header="gyro0_x,gyro1_x", comments="", fmt="%.9f")
    return path


def test_command(run, log, tmp_path):
    model, figure = tmp_path / "model.json", tmp_path / "units.svg"
    read = ("--rate", RATE, "--unit", "deg/s", "--quiet")
    code, out, err = run("combine", log, *read, "--model", "N", "--save", model, "--plot", figure)
    assert code == 0, err
    assert out.startswith("2 units: averaging divides the Allan deviation")
    assert figure.exists()
    code, out, err = run("combine", log, *read, "--model", "N", "--json")
    assert code == 0, err
    document = valid(json.loads(out))
    assert sum(document["weights"]) == pytest.approx(1.0)
    code, out, err = run("export", model, "--format", "kalibr")
    assert code == 0, err
    (line,) = [one for one in out.splitlines() if one.startswith("gyroscope_noise_density:")]
    saved = json.loads(model.read_text())["effects"][0]["parameters"]["N"]["value"]
    assert float(line.split()[1]) == pytest.approx(np.deg2rad(saved), rel=1e-3)
    code, out, err = run("combine", log, "--rate", RATE, "--unit", "deg/s", "--column", "gyro0_x")
    assert code == 2
    assert "no axis has two units" in err
