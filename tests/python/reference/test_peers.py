"""The tests of allantools with allanite's deviations in place of its own; skipped without a package index."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tarfile
from importlib.metadata import version
from pathlib import Path

import pytest

allantools = pytest.importorskip("allantools")

OURS = Path(__file__).with_name("allantools_with_ours.py")
#: Folders of its tests that judge deviations against Stable32 and published tables, and how many tests of them there are.
QUICK = {"nbs14 phasedat pink_frequency gradev": 49}
#: Longer records. Its own intervals of the caesium clock take it a minute and have no deviation of ours in them.
LONG = {"ocxo gps Keysight53230A_ti_noise_floor": 31, "Cs5071A": 8}


@pytest.fixture(scope="module")
def suite(tmp_path_factory):
    folder = tmp_path_factory.mktemp("allantools")
    wanted = f"allantools=={version('allantools')}"
    words = ["pip", "download", "--quiet", "--no-deps", "--no-binary=allantools", "--retries=0"]
    try:
        done = subprocess.run(
            [sys.executable, "-m", *words, "--timeout=20", "--dest", str(folder), wanted],
            capture_output=True, text=True, check=False, timeout=120,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        pytest.skip("the source of allantools could not be fetched in two minutes")
    found = list(folder.glob("*.tar.gz"))
    if done.returncode or not found:
        pytest.skip(f"the source of allantools could not be fetched: {done.stderr[-100:].strip()}")
    with tarfile.open(found[0]) as archive:
        archive.extractall(folder, filter="data")
    [tests] = folder.glob("*/tests")
    shutil.copy(OURS, tests / "conftest.py")
    return tests


def _passed(suite, folders):
    words = ["-q", "-p", "no:cacheprovider", "-p", "no:xdist", "--import-mode=prepend", "-rfE"]
    wanted = ["-k", "not (TestCS and ci)"]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", *words, *wanted, *folders.split()],
        cwd=suite, capture_output=True, text=True, check=False, timeout=600,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-1000:]
    return int(re.search(r"(\d+) passed", done.stdout)[1])


@pytest.mark.long
@pytest.mark.parametrize("folders", QUICK)
def test_allantools_own_tests(suite, folders):
    assert _passed(suite, folders) >= QUICK[folders]


@pytest.mark.statistical
@pytest.mark.parametrize("folders", LONG)
def test_allantools_own_tests_on_long_records(suite, folders):
    assert _passed(suite, folders) >= LONG[folders]
