"""Fixtures for every test: the real recordings, where they are at hand."""

import os
import signal
from pathlib import Path

import pytest
from hypothesis import settings

# The same examples in every run, and no time limit for one on a busy machine; `pytest --hypothesis-profile default` looks
# for others.
settings.register_profile("same", derandomize=True, deadline=None)
settings.load_profile("same")

# A shell ignores SIGINT in what it starts in the background: tests and what they start would not hear an interrupt.
signal.signal(signal.SIGINT, signal.default_int_handler)

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def data():
    """Path of a real recording by name; the test is skipped where the folder is absent."""
    folder = Path(os.environ.get("ALLANITE_DATA", ROOT.parent / "shared" / "data"))

    def find(name):
        if not (folder / name).exists():
            pytest.skip(f"no real recording {name}: set ALLANITE_DATA to their folder")
        return folder / name

    return find
