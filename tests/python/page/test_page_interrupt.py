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


def readers(log):
    """Processes that read a log."""
    found = []
    for entry in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            said = entry.read_bytes()
        except OSError:  # it has ended
            continue
        if b"allanite.page.child" in said and str(log).encode() in said:
            found.append(entry.parent.name)
    return found


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_nothing_goes_on_reading(tmp_path, number):
    # A pipe that nobody writes to: a log that takes for ever.
    log, temporary = tmp_path / "log.csv", tmp_path / "tmp"
    os.mkfifo(log)
    temporary.mkdir()
    environment = {**os.environ, "TMPDIR": str(temporary)}
    words = ("explore", "--no-browser", "--rate", "10", log)
    code = (
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "from allanite.cli import main; main()"
    )
    with started(*words, code=code, env=environment) as process:
        address = process.stdout.readline().decode().strip()
        tab = urllib.request.Request(f"{address}tabs", data=b"{}", method="POST")
        with urllib.request.urlopen(tab, timeout=60) as answer:
            assert json.load(answer)["tab"]
        until(lambda: readers(log))
        process.send_signal(number)
        process.wait(60)
        until(lambda: not readers(log))
    if number == signal.SIGINT:
        assert process.returncode == 130
    until(lambda: not list(temporary.glob("allanite-read-*")))


def test_eight_gigabytes_hold_nothing_up(tmp_path):
    """Processor time of the server from the signal on: a busy machine makes it wait, and that is not ours."""
    path = tmp_path / "x.npy"
    with path.open("wb") as file:
        header = {"descr": "<f8", "fortran_order": False, "shape": (10**9,)}
        np.lib.format.write_array_header_1_0(file, header)
        file.truncate(file.tell() + 8 * 10**9)  # a hole: it takes no room on the disk
    code = (
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "from allanite.cli import main; main()"
    )
    words = ("explore", "--no-browser", "--rate", "10", path)
    with started(*words, code=code, stderr=None) as process:
        address = process.stdout.readline().decode().strip()
        tab = urllib.request.Request(f"{address}tabs", data=b"{}", method="POST")
        with urllib.request.urlopen(tab, timeout=60):
            until(lambda: readers(path))
        before = spent(process)
        process.send_signal(signal.SIGINT)
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    assert process.returncode == 130
    assert used.ru_utime + used.ru_stime - before < 1.0
    until(lambda: not readers(path))
