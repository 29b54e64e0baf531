"""Log, exported file, new data of the same truth, aiding, coasting: a small part of `benches/claims/filter_files.py`.

docs/validation.md has the results for 50 sensors of each of its twelve truths.
"""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[3] / "benches" / "claims"))

import filter_files as study
from results_file import Results

SEGMENTS, SENSORS = 300, 2


@pytest.mark.statistical
@pytest.mark.parametrize("name", ["N+B+K", "N+lag 10 s", "N+B+line"])
def test_a_filter_with_an_exported_file_is_consistent(name, monkeypatch):
    """A mean square over 300 segments has a standard error of 8 %; three of them are allowed."""
    monkeypatch.setattr(study, "TARGETS", ("kalibr", "vins", "fastlio"))
    new = study.new_data(name, SEGMENTS)
    rows = [
        study.sensor_of(name, sensor, new, states=False, overbound=False)["nees"]
        for sensor in range(SENSORS)
    ]
    found = {target: np.mean([row[target] for row in rows], axis=0) for target in rows[0]}
    allowed = 3 * np.sqrt(2 / SEGMENTS)
    for target, mean in found.items():
        assert mean.max() < 1.2 * (1 + allowed), (target, mean)
        assert mean[-1] > 0.7 * (1 - allowed), (target, mean)
    # The conversions of three consumers are one filter.
    np.testing.assert_allclose(found["vins"], found["kalibr"], rtol=0.02)
    np.testing.assert_allclose(found["fastlio"], found["kalibr"], rtol=0.02)


def test_the_weights_of_a_filter_give_its_errors():
    """The filter, run sample by sample on the data, has the mean squares that follow from its weights."""
    rng = np.random.default_rng(1)
    new = rng.standard_normal((3, study.AIDED + study.COASTING[-1]))
    F, Q = np.array([[1.0, -1.0], [0.0, 0.99]]), np.diag([1e-2, 1e-4])
    P, state, expected = np.diag([0.0, 1.0]), np.zeros((2, 3)), []
    for k in range(new.shape[1]):
        P, state = F @ P @ F.T + Q, F @ state
        state[0] += new[:, k]
        if k < study.AIDED:
            gain = P[:, 0] / P[0, 0]
            state, P = state - np.outer(gain, state[0]), P - np.outer(gain, P[0])
        elif k + 1 - study.AIDED in study.COASTING:
            expected.append(np.mean(state[0] ** 2) / P[0, 0])
    found = study.coasted(F, Q, np.diag([0.0, 1.0]), 1, new)
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_an_interrupted_study_continues(tmp_path, monkeypatch, capsys):
    """A half line at the end of the file is left out; a sensor of the file is not simulated again."""
    path = tmp_path / "results.jsonl"
    row = {"model": "N+B", "nees": {"kalibr": [1, 1, 1]}}
    Results(path, "7 segments").of("N+B 0", lambda: row)
    with path.open("a") as stream:
        stream.write('{"case": "N+B')
    again = Results(path, "7 segments")
    assert again.rows == {"N+B 0": row}
    again.of("N+B 1", lambda: row)
    assert set(Results(path, "7 segments").rows) == {"N+B 0", "N+B 1"}
    with pytest.raises(SystemExit, match="has the settings '7 segments'"):
        Results(path, "8 segments")
    given = ["filter_files.py", "--sensors", "2", "--truths", "1", "--segments", "7"]
    monkeypatch.setattr(sys, "argv", [*given, "--results", str(path)])
    study.main()
    assert "2 sensors, models N+B" in capsys.readouterr().out
