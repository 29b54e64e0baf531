"""Fixtures and settings for all tests."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import settings

# Every run uses the same examples, without a time limit; `pytest --hypothesis-profile default` searches for new ones.
settings.register_profile("same", derandomize=True, deadline=None)
settings.load_profile("same")

# A shell lets background processes ignore SIGINT; restore the default so that tests of interrupts work there too.
signal.signal(signal.SIGINT, signal.default_int_handler)

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def field(tmp_path_factory):
    """Function that makes a larger field log by name; the test is skipped if the generator is not available."""
    folder = Path(os.environ.get("ALLANITE_DATA", ROOT.parent / "shared" / "data")) / "field"
    if not (folder / "make.py").is_file():
        pytest.skip(f"no field logs in {folder}")
    made = tmp_path_factory.mktemp("field")

    def make(name):
        if not (made / name).exists():
            subprocess.run([sys.executable, folder / "make.py", made, name], check=True)
        return str(made / name)

    return make


@pytest.fixture(scope="session")
def data():
    """Function that returns the path of a real recording; the test is skipped if the recording is not available."""
    folder = Path(os.environ.get("ALLANITE_DATA", ROOT.parent / "shared" / "data"))

    def find(name):
        if not (folder / name).exists():
            pytest.skip(f"no real recording {name}: set ALLANITE_DATA to their folder")
        return folder / name

    return find
