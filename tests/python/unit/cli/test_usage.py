"""Help costs nothing; wrong usage is one line and a code."""

import subprocess
import sys

import pytest

from allanite.cli import COMMANDS
from command_line import refused


def test_help_lists_every_command(run):
    code, out, err = run("--help")
    assert (code, err) == (0, "")
    for command in COMMANDS:
        assert command in out


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help(run, command):
    code, out, _ = run(command, "--help")
    assert code == 0
    assert "Usage" in out


def test_version(run):
    code, out, _ = run("--version")
    assert code == 0
    assert out.startswith("allanite ")


def test_python_m_runs_the_command(run):
    for arguments in (["--version"], ["fit"]):
        python = [sys.executable, "-m", "allanite", *arguments]
        done = subprocess.run(python, capture_output=True, text=True, check=False)
        assert (done.returncode, done.stdout, done.stderr) == run(*arguments)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nothing"], "nothing"),
        (["adev"], "LOG"),
        (["adev", "x.csv", "--rat", "3"], "--rat"),
        (["adev", "x.csv", "--rate", "fast"], "fast"),
        (["adev", "x.csv", "--quantity", "speed"], "speed"),
        (["simulate", "N(N=1)", "--rate", "1"], "--duration"),
        (["simulate", "N(N=1)", "--duration", "1"], "--rate"),
        (["simulate", "N(N=1)", "--rate", "-1", "--duration", "1"], "positive"),
        (["simulate", "N(N=1)", "--rate", "1", "--duration", "-1"], "positive"),
        (["simulate", "N(N=1)", "--rate", "1", "-n", "9", "-o", "x.wav"], ".wav"),
        (["simulate", "N(N=1)", "--rate", "1", "-n", "9", "-o", "no/where.npy"], "no"),
        (["export", "N(N=1)", "--format", "simulink"], "simulink"),
        (["export", "N(N=1)"], "--unit"),
        (["export", "absent.json"], "absent.json"),
    ],
)
def test_usage_errors_are_one_line(run, arguments, words):
    refused(run(*arguments), 2, words)


def test_imports_nothing_heavy_for_help():
    code = (
        "import sys\nfrom allanite.cli import main\n"
        "try:\n    main(['--help'])\nexcept SystemExit:\n    pass\n"
        "print([m for m in ('numpy', 'scipy', 'matplotlib') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"
