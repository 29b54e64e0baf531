"""Ctrl-C ends a command within a second, whenever it comes."""

import os
import signal
import time

import pytest

from command_line import needs, started, until

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals are sent the POSIX way")
LONG = ("simulate", "N(N=1)+B(B=1)+K(K=1)", "--rate", 100, "-n", 30_000_000, "-o")

# Sends itself the signal at the n-th import after the start, in front of somebody who swallows what it raises.
AT_IMPORT = """
import os, signal, sys
from allanite.cli import main
left, swallow = int(sys.argv.pop(1)), sys.argv.pop(1) == "swallowed"
class Finder:
    def find_spec(self, name, path=None, target=None):
        global left
        left -= 1
        if left == 0:
            try:
                os.kill(os.getpid(), signal.SIGINT)
                for _ in range(1000):
                    pass
            except KeyboardInterrupt:
                if not swallow:
                    raise
sys.meta_path.insert(0, Finder())
main()
"""


def interrupted(process):
    _, err = process.communicate(timeout=30)
    assert process.returncode == 130, err
    # click ends the line that a terminal shows ^C in.
    assert err.strip() == b"allanite: interrupted", err


@pytest.mark.slow
def test_while_a_file_is_written(tmp_path):
    needs("simulate")
    with started(*LONG, tmp_path / "x.csv") as process:
        until(lambda: any(tmp_path.iterdir()) or process.poll() is not None)
        process.send_signal(signal.SIGINT)
        interrupted(process)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@pytest.mark.parametrize("swallowed", ["swallowed", "heard"])
@pytest.mark.parametrize("number", [1, 2, 5, 12, 30])
def test_while_modules_are_imported(tmp_path, number, swallowed):
    target = tmp_path / "x.csv"
    with started(number, swallowed, *LONG, target, code=AT_IMPORT) as process:
        interrupted(process)
    assert list(tmp_path.iterdir()) == []


def test_swallowed_by_a_destructor(tmp_path):
    code = """
import os, signal
from allanite import cli
from allanite.cli import main
class Last:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)
        for _ in range(1000):
            pass
def command(*_, **__):
    thing = Last()
    del thing
cli.cli.main = command
main()
"""
    with started(code=code) as process:
        _, err = process.communicate(timeout=30)
    # Python tells of what a destructor raised; the command is ended all the same.
    assert process.returncode == 130
    assert err.endswith(b"allanite: interrupted\n")


@pytest.mark.slow
def test_twice_is_once(tmp_path):
    with started(*LONG, tmp_path / "x.csv") as process:
        until(lambda: any(tmp_path.iterdir()) or process.poll() is not None)
        for _ in range(20):
            process.send_signal(signal.SIGINT)
            time.sleep(0.002)
        interrupted(process)
    assert list(tmp_path.iterdir()) == []
