"""The examples and the README run unchanged."""

from __future__ import annotations

import re
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import allanite as al

ROOT = Path(__file__).parents[3]


@pytest.mark.long
def test_mathworks_example_finds_what_its_last_paragraph_misses(capsys):
    module = runpy.run_path(str(ROOT / "examples" / "mathworks.py"))
    study = module["main"](hours=2.0)
    added = {step.added.kind for step in study.ladder if step.added is not None}
    assert "quantization" in added
    words = capsys.readouterr().out
    assert "nearest slopes" in words
    # The published N is read from the line of slope −½ at one point, with an error of 5 % here.
    seed = re.search(r"as published: N ([\d.]+)", words)
    assert seed is not None
    assert float(seed[1]) == pytest.approx(0.0126, rel=0.05)
    for name, truth in (("N", 0.0126), ("Q", 1.5e-4)):
        found = study.fit[name]
        assert abs(found.value - truth) < 4 * found.std_error, found
    # Quantization is 3Q²/τ² / (N²/τ) = 4.3 % of the variance at one sample, 2.1 % of the deviation; 720 000 samples scatter
    # by 0.1 % there. N+B+K has no room for it but in N, which the discrepancy keeps within 0.6 % (without a discrepancy N
    # is 1.5 % too high). The sensor lies 1.5 … 2.1 % above the simulation, printed in whole per cent.
    # With Q they agree. At 0.3 s and beyond, sensor and simulation have a standard error of 0.7 % together.
    said = re.findall(r"simulation[^:]*: ([+-][\d.]+) % at τ = ([\d.]+)", words)
    (first, at), (last, _) = ((float(v), float(tau)) for v, tau in said)
    assert at == 0.01
    assert first in (1.0, 2.0)
    assert abs(last) < 1.8
    scores = [step.fit.error.predictive.score for step in study.ladder]
    assert scores == sorted(scores, reverse=True)


@pytest.mark.long
@pytest.mark.data
def test_cesium_holdover(data, capsys, monkeypatch):
    monkeypatch.setenv("ALLANITE_DATA", str(data("clock_cs5071a_phase.npz").parent))
    found = runpy.run_path(str(ROOT / "examples" / "cesium_holdover.py"))["main"]()
    assert found["timing"].noise.name == "Q+N"
    # Six or more of eight 95 % bands hold in 99.4 % of runs.
    assert sum(found["held"]) >= 6
    assert "passes" in capsys.readouterr().out


@pytest.mark.data
def test_station_rate(data, capsys, monkeypatch):
    monkeypatch.setenv("ALLANITE_DATA", str(data("field/station_tenv.txt").parents[1]))
    found = runpy.run_path(str(ROOT / "examples" / "station_rate.py"))["main"]()
    assert list(found) == ["east", "north", "up"]
    words = capsys.readouterr().out
    for name, one in found.items():
        naive = float(re.search(rf"{name} .*± ([\d.]+) mm/year with white", words)[1])
        assert one.rate.std_error > 2.0 * naive


@pytest.mark.parametrize("name", ["cesium_holdover", "station_rate"])
def test_an_example_says_where_its_data_are(name, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("ALLANITE_DATA", str(tmp_path))
    assert runpy.run_path(str(ROOT / "examples" / f"{name}.py"))["main"]() is None
    assert "no " in capsys.readouterr().out


@pytest.mark.slow
def test_gyro_simulator(capsys, tmp_path):
    module = runpy.run_path(str(ROOT / "examples" / "gyro_simulator.py"))
    found = module["main"](hours=12.0, folder=str(tmp_path))
    for name, term in found["terms"].items():
        assert abs(term.fitted.value - term.truth) < 4 * term.fitted.std_error, name
        # Readings at a point: B at τ = 100 s of 12 h has 3 % of scatter, the others less; 4 σ.
        assert term.read == pytest.approx(term.truth, rel=0.12 if name == "B" else 0.03), name
        together = found["fit"][name].to(term.unit)
        assert together.detected
        assert abs(together.value - term.truth) < 4 * together.std_error, name
    sheets = found["sheets"]
    # √2 for one-sided, 60 for √h: 1.273 where three recordings gave 1.30 on average.
    assert sheets["MEMS N (deg/√h)"] == pytest.approx(0.03 / 2**0.5 * 60, rel=1e-12)
    assert sheets["MEMS N (deg/√h)"] == pytest.approx((1.4 + 1.17 + 1.33) / 3, rel=0.03)
    slip = sheets["MEMS white meets flicker at τ (s)"] / sheets["MEMS with the slip, at τ (s)"]
    assert slip == pytest.approx(1800.0, rel=1e-9)  # (60/√2)² times
    assert sheets["RLG quantization meets white at τ (years)"] > 1e4
    by_log, by_linear = found["grids"]
    assert by_log == pytest.approx(1.0, abs=0.1)
    assert by_linear > 5.0
    assert (tmp_path / "gyro_simulator.svg").stat().st_size > 10_000
    assert "RLG" in capsys.readouterr().out


def test_one_function_for_accelerometers_and_gyroscopes(capsys):
    module = runpy.run_path(str(ROOT / "examples" / "accel_and_gyro.py"))
    found = module["main"](hours=4.0)
    for name, (slope, value) in found["exact"].items():
        _, _, expected, height = module["SLOPES"][name]
        assert slope == pytest.approx(expected, abs=2e-3), name
        assert value == pytest.approx(height, rel=1e-4), name
    place, height = found["peak"]
    assert place == pytest.approx(1.892618, abs=3e-4)  # steps of 2.5e-4
    assert height == pytest.approx(0.436542, rel=1e-5)
    # The same unit comes out as went in: the two analyses of a sensor differ by the factor of their units. Rounding of the
    # samples moves the fit's stopping point by a little; intervals are some per cent wide.
    for a, b, factor in (
        ("accelerometer g", "accelerometer m/s^2", 9.80665),
        ("gyroscope deg/s", "gyroscope deg/h", 3600.0),
    ):
        for name, value in found[a].items():
            other = found[b][name]
            assert (value is None) == (other is None), name
            if value is not None and name != "correlation_time fitted":
                assert other / value == pytest.approx(factor, rel=0.03), name
    g, gyro = found["accelerometer g"], found["gyroscope deg/s"]
    assert g["N by its line"] == pytest.approx(1.2e-4, rel=0.05)
    assert g["N fitted"] == pytest.approx(1.2e-4, rel=0.01)
    assert gyro["correlation_time fitted"] == pytest.approx(60.0, rel=0.3)
    assert gyro["K by its line"] is None
    assert "peak at 1.893 T" in capsys.readouterr().out


@pytest.mark.long
@pytest.mark.data
def test_thermal_calibration(data, capsys):
    """Accelerometer axes of one log: the correction reduces the deviation beyond 1000 s to at most a third."""
    path = data("cats_thermal_b.npz")
    module = runpy.run_path(str(ROOT / "examples" / "thermal_calibration.py"))
    found = module["main"](path.parent)
    assert [axis.runs.recording.n for axis in found] == [91_933 + 45_182] * 3
    assert "acc_y,m/s^2" in capsys.readouterr().out
    for axis in al.thermal(al.read(path)[["acc_y", "acc_z"]]):
        slow = axis.remainder.tau > 1000.0
        assert (axis.remainder.after[slow] < axis.remainder.before[slow] / 3.0).all()


@pytest.mark.long
@pytest.mark.data
def test_several_sensors(data, capsys):
    """Three equal sensors: the gain is √3 at short times, and no sensor deviates."""
    module = runpy.run_path(str(ROOT / "examples" / "several_sensors.py"))
    for combination in module["main"](data("adis16405_imu1.npz").parent).values():
        assert combination.gain[0] == pytest.approx(3**0.5, rel=0.02)
        assert not combination.deviating
    assert "3 units" in capsys.readouterr().out


@pytest.mark.long
def test_examples_say_where_data_come_from(tmp_path):
    for name, source in (
        ("thermal_calibration", "scikit-diveMove"),
        ("several_sensors", "any three logs"),
    ):
        module = runpy.run_path(str(ROOT / "examples" / f"{name}.py"))
        with pytest.raises(SystemExit, match=source):
            module["main"](tmp_path)


def test_the_small_log_is_simulated_as_stated_and_its_line_is_found():
    text = (ROOT / "docs" / "examples.md").read_text(encoding="utf-8")
    command = re.search(r"^allanite simulate '(\S+)' (.*) --output examples/gyro.csv$", text, re.M)
    assert command is not None
    rate, duration, seed = (
        float(re.search(rf"--{name} (\d+)", command[2])[1]) for name in ("rate", "duration", "seed")
    )
    recording = al.read(ROOT / "examples" / "gyro.csv")
    simulated = al.parse_model(command[1]).simulate(duration=duration, rate=rate, seed=int(seed))
    assert recording.unit == "deg/s"
    np.testing.assert_allclose(recording.samples, simulated.samples, rtol=1e-12)
    found = al.fit_model(recording, "N").check().significant[0].effect
    assert found.kind == "sinusoid"
    # The standard error of the frequency is √6 N/(π a T^1.5) = 9·10⁻⁵ Hz.
    assert found.frequency == pytest.approx(2.5, abs=3.6e-4)


@pytest.mark.long
def test_readme_example_runs():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    code = re.search(r"```python\n(.*?)```", text, re.DOTALL)
    assert code is not None
    names: dict[str, object] = {}
    exec(code[1], names)
    kinds = [step.added.kind for step in names["study"].ladder[1:]]
    assert kinds == ["gauss_markov"]
    assert names["fit"]["N"].to("deg/sqrt(h)").unit == "deg/sqrt(h)"


def test_every_example_is_told_and_every_figure_there():
    docs = ROOT / "docs"
    text = (docs / "examples.md").read_text(encoding="utf-8")
    for path in (ROOT / "examples").glob("*.py"):
        assert f"(../examples/{path.name})" in text
    pages = [p for p in docs.rglob("*.md") if p.is_file()] + [ROOT / "README.md"]
    for page in pages:
        for link in re.findall(r"!\[[^]]*\]\(([^)]+)\)", page.read_text(encoding="utf-8")):
            assert (page.parent / link).is_file(), (page.name, link)


#: Programs with which the benches compare; the tests do not need them.
PEERS = {"numba", "colorednoise", "polars"}


#: One process per folder, because importing NumPy, SciPy and the package takes most of the time.
IMPORTS = """
import importlib, os, sys, traceback
peers, tests, *names = sys.argv[1:]
path = sys.path[:]
for name in names:
    # Each script finds the modules of this repository that are not in the package.
    sys.path[:] = path
    for known, module in list(sys.modules.items()):
        if (getattr(module, "__file__", None) or "").startswith((tests, os.getcwd())):
            del sys.modules[known]
    try:
        importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name not in peers.split():
            print(name, traceback.format_exc())
    except BaseException:
        print(name, traceback.format_exc())
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    "folder", ["docs", "benches/claims", "benches/decisions", "benches/python"]
)
def test_scripts_find_what_they_import(folder):
    """The tests do not run long scripts, so this test finds renamed or missing imports early."""
    names = sorted(path.stem for path in (ROOT / folder).glob("*.py"))
    assert names
    run = subprocess.run(
        [sys.executable, "-c", IMPORTS, " ".join(PEERS), str(ROOT / "tests"), *names],
        cwd=ROOT / folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (run.returncode, run.stdout) == (0, ""), run.stdout + run.stderr


def test_every_folder_of_scripts_is_tried():
    folders = {
        path.parent.relative_to(ROOT).as_posix() for path in (ROOT / "benches").rglob("*.py")
    }
    assert folders == {"benches/claims", "benches/decisions", "benches/python"}
