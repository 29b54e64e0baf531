"""Helpers for tests of the command line: running commands and checking their results."""

import json
import os
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import pytest


def needs(module):
    """The module of the package; the test is skipped without it."""
    return pytest.importorskip(f"allanite.{module}")


def refused(result, code, *words):
    """Check that a command failed with this exit code and a one-line message that contains these words."""
    got, out, err = result
    assert got == code
    assert out == ""
    assert err.count("\n") == 1, err
    assert err.startswith("allanite: ")
    for word in words:
        assert word in err


def strict(text):
    """Parsed JSON; an error if it contains NaN or Infinity."""

    def refuse(name):
        raise AssertionError(f"{name} in JSON")

    return json.loads(text, parse_constant=refuse)


def piped(data, *arguments):
    """Exit code, output and errors of a command that reads `data` from standard input."""
    code = "from allanite.cli import main; main()"
    command = [sys.executable, "-c", code, *map(str, arguments)]
    done = subprocess.run(command, input=data, capture_output=True, check=False)
    return done.returncode, done.stdout.decode(), done.stderr.decode()


#: A shell lets background processes ignore SIGINT, and their children inherit this; this line restores the default.
HEARS_INTERRUPT = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"


@contextmanager
def started(*arguments, code="from allanite.cli import main; main()", **options):
    """Context with a command that runs in parallel to the test, handles SIGINT and is killed at the end."""
    command = [sys.executable, "-c", HEARS_INTERRUPT + code, *map(str, arguments)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | options
    process = subprocess.Popen(command, **pipes)
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def until(ready, seconds=60.0):
    """Wait until a condition holds."""
    end = time.monotonic() + seconds
    while not ready():
        assert time.monotonic() < end, f"not within {seconds} s"
        time.sleep(0.01)


def spent(process):
    """Processor time of a process so far, in s."""
    fields = Path(f"/proc/{process.pid}/stat").read_text("ascii").rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
