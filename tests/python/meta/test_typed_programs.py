"""The programs on the pages, in the README and in examples/ pass mypy --strict, which also reports wrong options."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]

#: A program with one wrong option in each call; an error that mypy does not report makes its comment unused, which is an
#: error of its own.
WRONG = """
from pathlib import Path
from typing import assert_type

import numpy as np
import polars as pl
import xarray as xr

import allanite as al
from allanite.plots import Figure
from allanite.readers import read_sensors

recording = al.read("gyro.csv", rate=100.0)
fit = al.fit_model(recording, "N+K")
assert_type(fit["N"], al.Estimate)
assert_type(fit.estimates_of("GM"), dict[str, al.Estimate])
fit["GM"]["q_c"]  # type: ignore[index]
fit["BW.acts_on"].upper()  # type: ignore[attr-defined]
assert_type(al.oadev(recording), al.Deviation)
assert_type(al.deviations(recording)["gx"], al.Deviation)
assert_type(fit, al.Fit)
assert_type(al.fit_columns(recording, "N")["gx"], al.Fit)
assert_type(al.improve(recording), al.Study)
assert_type(al.improve_columns(recording)["gx"], al.Study)
assert_type(al.trend(recording), al.Trend)
assert_type(al.trend_columns(recording)["gx"], al.Trend)
assert_type(al.timing(recording), al.Timing)
assert_type(al.timing_columns(recording)["gx"], al.Timing)
assert_type(fit.simulate(duration=10.0, seed=1), al.Recording)
fit.simulate(sede=1)  # type: ignore[call-arg]
fit.simulate(seed="1")  # type: ignore[arg-type]
next(fit.simulate_chunks(size=100, n=1000))
fit.simulate_chunks(size="100")  # type: ignore[arg-type]
fit.state_space(states="4")  # type: ignore[arg-type]
fit.add(al.RateRandomWalk()).add(fit.check().suggestions[0])
fit.add(3)  # type: ignore[arg-type]
assert_type(al.oadev([1.0, 2.0, 4.0]), al.Deviation)
al.oadev(recording, taus=[1.0])
al.oadev(fit)  # type: ignore[arg-type]
al.totdev(fit)  # type: ignore[arg-type]
al.psd(np.ones(100), rate=10.0)
al.psd(recording)
al.psd(fit)  # type: ignore[arg-type]
al.compare_datasheet(fit, al.read_datasheet("sheet.toml"))
al.compare_datasheet(recording, al.read_datasheet("sheet.toml"))  # type: ignore[arg-type]
al.Watch(fit.model, rate=10.0).update([0.1, 0.2])
al.Watch(fit.model, rate=10.0).update(fit)  # type: ignore[arg-type]
al.read(Path("gyro.csv"))
al.read(xr.DataArray([1.0, 2.0]), rate=100.0)
al.read(pl.DataFrame({"gx": [1.0, 2.0]}), rate=100.0)
al.read(3)  # type: ignore[arg-type]
read_sensors(3)  # type: ignore[arg-type]
al.inspect(3)  # type: ignore[arg-type]
al.inspect("gyro.csv", rate=100.0, column=["gx", 1])
al.inspect("gyro.csv", rat=100.0)  # type: ignore[call-arg]
read_sensors("gyro.csv", unit=3)  # type: ignore[arg-type]
al.trend_columns(recording, unit="mm", steps=[10.0, "120d"])
al.trend_columns(recording, period=1.0)  # type: ignore[call-arg]
al.timing_columns(recording, after="60")  # type: ignore[arg-type]
al.innovations(recording, fit)
al.innovations(recording, 3)  # type: ignore[arg-type]
assert_type(al.compare([("gyro", recording, None)]).plot(), Figure)
assert_type(al.combine([recording, recording]).state_space(), al.StateSpace)
al.error_growth(fit, aided=100.0)
al.error_growth(3.0, aided=100.0)  # type: ignore[arg-type]
"""


@pytest.mark.slow
def test_programs_pass_mypy_strict(tmp_path):
    pytest.importorskip("mypy")
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    for page in pages:
        blocks = re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
        if blocks:
            name = f"page_{page.stem.replace('-', '_')}.py"
            (tmp_path / name).write_text("\n".join(blocks), encoding="utf-8")
    for path in (ROOT / "examples").glob("*.py"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    (tmp_path / "wrong_options.py").write_text(WRONG, encoding="utf-8")
    # Dask has no types of its own: its functions are untyped, whatever a user writes.
    (tmp_path / "mypy.ini").write_text("[mypy]\nstrict = true\nuntyped_calls_exclude = dask\n")
    found = subprocess.run(
        [sys.executable, "-m", "mypy", "--no-incremental", "."],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=500,
    )
    assert found.returncode == 0, found.stdout + found.stderr
