"""What tests of the command line share: running it, and what its answers must be."""

import json
import subprocess
import sys

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
