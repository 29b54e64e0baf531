"""Every command: a full disk, little address space, SIGINT and SIGTERM while it starts or computes."""

import os
import signal
import subprocess
import sys

import pytest

from allanite.cli import COMMANDS
from command_line import HEARS_INTERRUPT
from every_command import RUNS, write_logs

pytestmark = pytest.mark.skipif(os.name != "posix", reason="faults are made the POSIX way")
CODE = "from allanite.cli import main; main()"
#: Limits the address space to so many MB.
LIMITED = (
    "import resource, sys; most = int(sys.argv.pop(1)) << 20\n"
    "resource.setrlimit(resource.RLIMIT_AS, (most, most))\n" + CODE
)
#: The command receives a signal from itself at the n-th import after its start.
AT_IMPORT = """
import os, signal, sys
from allanite.cli import main
left, number = int(sys.argv.pop(1)), int(sys.argv.pop(1))
class Finder:
    def find_spec(self, name, path=None, target=None):
        global left
        left -= 1
        if left == 0:
            os.kill(os.getpid(), number)
sys.meta_path.insert(0, Finder())
main()
"""
#: The demo takes a minute, and the page waits for a browser.
ENDLESS = {"demo", "explore"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("logs")
    write_logs(place)
    return place


@pytest.fixture
def command(folder, tmp_path):
    """Run a command with its line of arguments; return the finished process."""

    def run(name, *before, code=CODE, **options):
        words = [word.format(out=tmp_path) for word in RUNS[name]]
        return subprocess.run(
            [sys.executable, "-c", HEARS_INTERRUPT + code, *map(str, before), name, *words],
            cwd=folder, text=True, check=False, timeout=300, stdin=subprocess.DEVNULL,
            **{"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | options,
        )  # fmt: skip

    return run


def test_every_command_has_a_line():
    assert set(RUNS) == set(COMMANDS)


@pytest.mark.long
@pytest.mark.parametrize("name", sorted(set(RUNS) - {"report"}))
def test_a_full_disk_is_one_line(command, name):
    if not os.path.exists("/dev/full"):  # noqa: PTH110
        pytest.skip("no /dev/full")
    with open("/dev/full", "w", encoding="utf-8") as full:  # noqa: PTH123
        done = command(name, stdout=full)
    said = done.stderr.splitlines()
    assert done.returncode == 2, said
    assert said[-1].startswith("allanite: standard output: No space left on device"), said
    assert "Traceback" not in done.stderr


@pytest.mark.long
@pytest.mark.parametrize("name", sorted(set(RUNS) - ENDLESS))
def test_a_command_in_little_address_space(command, name):
    done = command(name, 800, code=LIMITED, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"})
    # With so few samples accept decides nothing.
    assert done.returncode in ((0, 1, 3) if name == "accept" else (0,)), done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.long
@pytest.mark.parametrize("at", [10, 60])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["SIGINT", "SIGTERM"])
@pytest.mark.parametrize("name", RUNS)
def test_a_signal_ends_a_command(command, tmp_path, name, number, at):
    done = command(name, at, int(number), code=AT_IMPORT)
    # Watch and explore save their state on SIGTERM; the others end at once.
    code, said = {
        signal.SIGINT: ((130,), "allanite: interrupted\n"),
        signal.SIGTERM: ((-15, 143), ""),
    }[number]
    assert done.returncode in code, done.stderr
    assert done.stderr.lstrip() == said
    if number == signal.SIGINT:
        # A journal of a fleet is kept, and the demo makes its folder first.
        left = [path.name for path in tmp_path.rglob("*") if path.is_file()]
        assert [name for name in left if not name.endswith(".journal")] == []
