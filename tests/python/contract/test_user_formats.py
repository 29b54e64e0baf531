"""A log format of another package: one module, named by an entry point."""

import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.readers import FORMATS
from allanite.readers._lines import HEAD

MODULE = """
import numpy as np
from allanite.readers import LogFormat, Table

def read(path, pick):
    counts = np.frombuffer(path.read_bytes()[4:], dtype="<i2")
    return Table(names=("gx",), columns=(counts * 0.01,), units=("deg/s",), rate=50.0)

FORMAT = LogFormat("my logger", read, suffixes=(".mine",))
TAKEN = LogFormat("another logger", read, suffixes=(".npz",))
"""


@pytest.fixture
def folder(tmp_path):
    """A folder in which a package is installed that offers a good and a bad format."""
    (tmp_path / "logger.py").write_text(MODULE)
    about = tmp_path / "logger-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: logger\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(
        "[allanite.readers]\nmine = logger:FORMAT\ntaken = logger:TAKEN\nabsent = logger:ABSENT\n"
    )
    counts = np.random.default_rng(1).integers(-500, 500, 3000).astype("<i2")
    (tmp_path / "rest.mine").write_bytes(b"MINE" + counts.tobytes())
    return tmp_path


def test_the_format_of_an_installed_package_is_read(folder):
    program = textwrap.dedent(
        """
        import allanite as al
        recording = al.read("rest.mine")
        print(recording.columns, recording.rate, recording.units, recording.n)
        """
    )
    answer = subprocess.run(
        [sys.executable, "-W", "always", "-c", program],
        cwd=folder, env={"PYTHONPATH": str(folder)}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert answer.returncode == 0, answer.stderr
    assert "gx" in answer.stdout
    assert "50.0" in answer.stdout
    assert "deg/s" in answer.stdout
    assert "taken = logger:TAKEN of logger was not loaded: the suffix .npz" in answer.stderr
    assert "absent = logger:ABSENT of logger was not loaded" in answer.stderr


def test_a_suffix_belongs_to_one_format():
    suffixes = FORMATS.suffixes
    assert len(set(suffixes)) == len(suffixes)


def test_topics_of_a_log_without_topics_are_refused(tmp_path):
    np.save(tmp_path / "x.npy", np.random.default_rng(1).standard_normal(100))
    with pytest.raises(al.InputError, match="this log has no topics"):
        al.read(tmp_path / "x.npy", rate=1, topic="imu")


@pytest.mark.parametrize("kind", ["texts", "sentences", "stable32"])
def test_a_text_log_is_recognized_by_one_format(kind, monkeypatch):
    """Formats are tried in the order of their modules, so two formats must not recognize the same log."""
    monkeypatch.syspath_prepend(Path(__file__).parents[1] / "fuzz")
    import logs

    for head in getattr(logs, kind)():
        found = [f.title for f in FORMATS if f.recognizes and f.recognizes(head[:HEAD])]
        assert len(found) <= 1, (found, head[:80])
