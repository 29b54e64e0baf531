"""Functions that crash, hang, fill the memory or fail in a child process end as one error in the parent."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.common.errors import InternalError
from allanite.common.isolation import Limits, call_isolated

posix = pytest.mark.skipif(os.name != "posix", reason="limits of a process are POSIX")

FUNCTIONS = """
import os, time
import numpy as np
from allanite.common.errors import InputError, TooShortError

def answer(n):
    days = np.datetime64("2026-01-31", "us") + np.arange(3)
    return {"x": np.arange(n, dtype="<i2"), "t": days, "names": ("a", "b"), "nothing": None}
def strided(n): return np.arange(3.0 * n).reshape(n, 3)[:, 1]
def crash(): os.kill(os.getpid(), 11)
def spin():
    while True: pass
def sleep(): time.sleep(1000)
def fill(): return len([bytearray(50_000_000) for _ in range(1000)])
def refuse(): raise InputError("no rate", missing="rate", remedy=": give {rate}")
def short(): raise TooShortError("no row")
def fail(): return {}["bug"]
def missing(): import a_library_that_nobody_has
def objects(): return np.array([object()])
def chatter(): print("on stdout"); os.write(2, b"on stderr"); return 7
def place(): import os.path; return [os.getcwd(), __import__("json").__file__]
"""


@pytest.fixture
def call(tmp_path, monkeypatch):
    """Call a function of a module that lies in a folder of `sys.path`."""
    folder = tmp_path / "library"
    folder.mkdir()
    (folder / "isolated_functions.py").write_text(FUNCTIONS)
    monkeypatch.syspath_prepend(folder)

    def call(name, limits=None, watch=None, **arguments):
        limits = limits or Limits(cpu=20, wall=200, memory=1e9)
        return call_isolated(
            f"isolated_functions:{name}", arguments, limits, worker="the library", watch=watch
        )

    return call


@pytest.mark.parametrize("n", [0, 10, 3_000_000])
def test_values_and_arrays_come_back(call, n):
    found = call("answer", n=n)
    np.testing.assert_array_equal(found["x"], np.arange(n, dtype="<i2"))
    assert found["x"].dtype == np.dtype("<i2")
    assert found["t"].dtype == np.dtype("<M8[us]")
    assert (found["names"], found["nothing"]) == (["a", "b"], None)
    assert found["x"].flags.aligned


def test_a_column_of_a_matrix_comes_back_contiguous(call):
    found = call("strided", n=700_000)
    np.testing.assert_array_equal(found, 3.0 * np.arange(700_000) + 1.0)
    assert found.flags.c_contiguous


@posix
def test_a_crash_is_one_line(call):
    with pytest.raises(al.InputError, match=r"the library crashes on this file \(SIGSEGV\)"):
        call("crash")


@pytest.mark.slow
@posix
def test_a_function_that_never_ends_is_stopped(call):
    before = time.monotonic()
    with pytest.raises(
        al.InputError, match=r"does not finish .*stopped after 1 s of processor time"
    ):
        call("spin", Limits(cpu=1, wall=300))
    with pytest.raises(al.InputError, match=r"does not finish .*stopped after 0.5 s"):
        call("sleep", Limits(cpu=20, wall=0.5))
    assert time.monotonic() - before < 60


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="macOS does not limit the address space")
def test_the_memory_is_limited(call, monkeypatch):
    with pytest.raises(al.InputError, match="needs more memory than"):
        call("fill", Limits(cpu=20, wall=300, memory=3e8))
    monkeypatch.setenv("ALLANITE_MEMORY", "300M")
    with pytest.raises(al.InputError, match=r"more memory than 0\.3 GB \(ALLANITE_MEMORY=300M\)"):
        call("fill", Limits(cpu=20, wall=300))


@pytest.mark.slow
def test_errors_come_back(call):
    with pytest.raises(al.InputError, match="no rate: give rate=") as caught:
        call("refuse")
    assert caught.value.missing == "rate"
    with pytest.raises(al.TooShortError, match="no row"):
        call("short")
    with pytest.raises(InternalError, match=r"KeyError: 'bug' \(.*isolated_functions\.py:\d+\)"):
        call("fail")
    with pytest.raises(ModuleNotFoundError) as absent:
        call("missing")
    assert absent.value.name == "a_library_that_nobody_has"
    with pytest.raises(InternalError, match="cannot be transferred"):
        call("objects")


def test_what_a_library_prints_is_not_the_result(call, capfd):
    assert call("chatter") == 7
    assert capfd.readouterr() == ("", "")


def test_watching_ends_the_child(call):
    class Enough(Exception):
        pass

    def watch():
        raise Enough

    with pytest.raises(Enough):
        call("sleep", watch=watch)


@posix
def test_ctrl_c_ends_the_wait_within_a_second(call):
    begun = time.monotonic()
    threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        call("sleep")
    assert time.monotonic() - begun < 2.5


def test_modules_of_the_working_folder_are_not_executed(call, tmp_path, monkeypatch):
    poisoned = tmp_path / "logs"
    poisoned.mkdir()
    for name in ("json", "numpy", "allanite", "typing", "signal", "struct"):
        (poisoned / f"{name}.py").write_text("import os; os._exit(99)")
    monkeypatch.chdir(poisoned)
    monkeypatch.syspath_prepend(str(poisoned))
    folder, module = call("place")
    assert Path(folder) == poisoned
    assert Path(module).parent != poisoned


@pytest.mark.slow
@posix
@pytest.mark.skipif(sys.platform != "linux", reason="ulimit -v is Linux's")
def test_a_limit_of_the_shell_stays_and_no_abort_follows(tmp_path):
    """`ulimit -v` below the budget was once a ValueError, and a thread on stdin once aborted a successful child."""
    np.save(tmp_path / "x.npy", np.random.default_rng(1).standard_normal(500))
    code = (
        "import resource; resource.setrlimit(resource.RLIMIT_AS, (2 << 30, 2 << 30))\n"
        "import sys; from pathlib import Path; from allanite.common import isolation\n"
        "from allanite.page.child import read_in_child\n"
        "from allanite.common.read_options import ReadOptions\n"
        "run, codes = isolation.run_child, []\n"
        "isolation.run_child = lambda *order: codes.append(run(*order)) or codes[-1]\n"
        "print(read_in_child(Path('x.npy'), ReadOptions(10.0), {}).n, codes)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
    )  # fmt: skip
    assert (done.stdout.strip(), done.stderr) == ("500 [0]", "")
