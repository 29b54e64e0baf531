"""A minute of what `make fuzz` does for ten, and inputs that were once answered wrongly."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.common.errors import AllaniteError

HERE = Path(__file__).resolve().parent
NEEDS = {"mat": "scipy", "mat73": "h5py", "ulog": "pyulog", "page": "starlette"}
TARGETS = [
    "text", "text with a rate", "npy", "npz", "mat", "mat73", "ulog", "model string", "model file", "data sheet",
    "data sheet, JSON", "page",
]  # fmt: skip


@pytest.mark.skipif(sys.platform == "win32", reason="memory is read the POSIX way")
@pytest.mark.parametrize("target", TARGETS)
def test_damaged_input_is_answered(target, tmp_path):
    if target in NEEDS:
        pytest.importorskip(NEEDS[target])
    words = ["--target", target, "--seconds", "5", "--calls", "400"]
    done = subprocess.run(
        [sys.executable, HERE / "run.py", *words],
        cwd=tmp_path, capture_output=True, text=True, check=False, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr


def test_every_target_is_tried():
    source = (HERE / "targets.py").read_text(encoding="utf-8")
    assert [name for name in TARGETS if f'"{name}": ' not in source] == []


def test_numbers_near_the_edge_are_judged_without_warnings():
    for scale in (1e300, 1e39, 1e-300):
        recording = al.Recording(np.random.default_rng(1).standard_normal(500) * scale, rate=10)
        assert recording.describe()["n"] == 500


def test_a_model_string_is_no_name_of_a_file():
    for text in ("N" * 3000, "N+\0", "\ud800"):
        with pytest.raises(AllaniteError):
            al.parse_model(text)
