"""What tests of the command line share: running it, and what its answers must be."""

import json
import os
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import pytest


def needs(module):
    return pytest.importorskip(f"allanite.{module}")


def refused(result, code, *words):
    got, out, err = result
    assert got == code
    assert out == ""
    assert err.count("\n") == 1, err
    assert err.startswith("allanite: ")
    for word in words:
        assert word in err


def strict(text):
    """JSON without NaN or Infinity."""

    def refuse(name):
        raise AssertionError(f"{name} in JSON")

    return json.loads(text, parse_constant=refuse)


def piped(data, *arguments):
    code = "from allanite.cli import main; main()"
    command = [sys.executable, "-c", code, *map(str, arguments)]
    done = subprocess.run(command, input=data, capture_output=True, check=False)
    return done.returncode, done.stdout.decode(), done.stderr.decode()


#: A shell ignores SIGINT in what it starts in the background, and children inherit that: they ask for it again.
HEARS_INTERRUPT = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"


@contextmanager
def started(*arguments, code="from allanite.cli import main; main()", **options):
    """A command that runs beside the test, hears SIGINT and is ended with the test."""
    command = [sys.executable, "-c", HEARS_INTERRUPT + code, *map(str, arguments)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | options
    process = subprocess.Popen(command, **pipes)
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def until(ready, seconds=60.0):
    """Wait until something is so."""
    end = time.monotonic() + seconds
    while not ready():
        assert time.monotonic() < end, f"not within {seconds} s"
        time.sleep(0.01)


def spent(process):
    """Seconds of processor time of a process so far."""
    fields = Path(f"/proc/{process.pid}/stat").read_text("ascii").rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
