"""Ctrl-C while the page reads a log: it ends at once, and so does the process that reads."""

import json
import os
import signal
import urllib.request
from pathlib import Path

import numpy as np
import pytest

from command_line import spent, started, until

pytest.importorskip("starlette")
pytest.importorskip("uvicorn")
pytestmark = pytest.mark.skipif(
    not Path("/proc/self/cmdline").exists(), reason="looks for processes in /proc"
)


def readers(process):
    """Child processes of the page that read a log, as folders of /proc."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            parent = (entry / "stat").read_text().rpartition(")")[2].split()[1]
            words = (entry / "cmdline").read_bytes()
        except OSError:  # it has ended
            continue
        if int(parent) == process.pid and b"allanite.common.isolation" in words:
            found.append(entry)
    return found


def endless_log(path):
    """Eight gigabytes of zeros that take no space on the disk; reading them takes longer than any test."""
    with path.open("wb") as file:
        header = {"descr": "<f8", "fortran_order": False, "shape": (10**9,)}
        np.lib.format.write_array_header_1_0(file, header)
        file.truncate(file.tell() + 8 * 10**9)
    return path


def is_running(entry):
    """True if the process of a folder of /proc still runs; a zombie has ended."""
    try:
        return (entry / "stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_nothing_goes_on_reading(tmp_path, number):
    log, temporary = endless_log(tmp_path / "log.npy"), tmp_path / "tmp"
    temporary.mkdir()
    environment = {**os.environ, "TMPDIR": str(temporary)}
    words = ("explore", "--no-browser", "--rate", "10", log)
    with started(*words, env=environment) as process:
        address = process.stdout.readline().decode().strip()
        tab = urllib.request.Request(f"{address}tabs", data=b"{}", method="POST")
        with urllib.request.urlopen(tab, timeout=60) as answer:
            assert json.load(answer)["tab"]
        until(lambda: readers(process))
        children = readers(process)
        process.send_signal(number)
        process.wait(60)
        until(lambda: not any(map(is_running, children)))
    if number == signal.SIGINT:
        assert process.returncode == 130
    assert not list(temporary.iterdir())


@pytest.mark.slow
def test_eight_gigabytes_hold_nothing_up(tmp_path):
    """The processor time of the server after the signal counts, because a busy machine makes the server wait."""
    path = endless_log(tmp_path / "x.npy")
    words = ("explore", "--no-browser", "--rate", "10", path)
    with started(*words, stderr=None) as process:
        address = process.stdout.readline().decode().strip()
        tab = urllib.request.Request(f"{address}tabs", data=b"{}", method="POST")
        with urllib.request.urlopen(tab, timeout=60):
            until(lambda: readers(process))
        children = readers(process)
        before = spent(process)
        process.send_signal(signal.SIGINT)
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    assert process.returncode == 130
    assert used.ru_utime + used.ru_stime - before < 1.0
    until(lambda: not any(map(is_running, children)))
