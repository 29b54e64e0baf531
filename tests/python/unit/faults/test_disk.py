"""A disk that fails, is full or is slow, and kill -9 while a file is written, with every reader and writer.

A small preloaded library (`faults.c`) makes the faults; it needs Linux and a C compiler.
"""

import ast
import json
import os
import re
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from fuzz.logs import SAMPLES_OF

HERE = Path(__file__).resolve().parent
FUZZ = HERE.parents[1] / "fuzz"
PACKAGE = Path(__file__).parents[4] / "python" / "allanite"
COMPILER = shutil.which("cc")
needs_compiler = pytest.mark.skipif(
    sys.platform != "linux" or COMPILER is None, reason="faults are made by a preloaded library: needs Linux and cc"
)  # fmt: skip


def named(path, what):
    return re.findall(rf'^        "(.+)": {what}', path.read_text("utf-8"), re.MULTILINE)


# Read as text: what the files import need not be installed.
FORMATS = [*named(FUZZ / "targets.py", r"lambda: reader\("), *SAMPLES_OF]
WRITERS = named(HERE / "writers.py", r"\(")


@pytest.fixture(scope="session")
def driven(tmp_path_factory):
    """Results of the driver, run once for the readers and once for the writers."""
    folder = tmp_path_factory.mktemp("faults")
    library = folder / "faults.so"
    subprocess.run([COMPILER, "-O1", "-shared", "-fPIC", "-o", library, HERE / "faults.c", "-ldl"], check=True)  # fmt: skip

    @cache
    def run(what):
        done = subprocess.run(
            [sys.executable, HERE / "driver.py", what, folder, *(FORMATS if what == "reads" else [])],
            env={**os.environ, "LD_PRELOAD": str(library), "OPENBLAS_NUM_THREADS": "1"},
            capture_output=True, text=True, check=False, timeout=600,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout.splitlines()[-1])

    return run


@pytest.mark.long
@needs_compiler
@pytest.mark.parametrize("name", FORMATS)
def test_reading_from_a_disk_that_fails(driven, name):
    found = driven("reads")[name]
    if "No module named" in found.get("traceback", ""):
        pytest.skip(found["traceback"].splitlines()[-1])
    assert not {"traceback", "signal"} & found.keys(), found
    clean = found["none"]
    assert clean["library"][0] == clean["command"][0] == 0
    for fault in ("EINTR", "short"):
        assert found[fault] == clean, fault
    for fault in ("EIO", "EIO later", "EIO much later"):
        for code, *said in found[fault].values():
            if code:
                one_line(code, said[-1])
            else:  # the file had been read by then
                assert fault != "EIO"
                assert [code, *said] in clean.values()


@pytest.mark.long
@needs_compiler
@pytest.mark.parametrize("name", WRITERS)
def test_writing_to_a_disk_that_fails(driven, name):
    found = dict(driven("writes")[name])
    clean = found.pop("none")
    assert (clean["code"], clean["same"]) == (0, False), clean
    for fault, got in found.items():
        assert "traceback" not in got, got
        if fault in ("EINTR", "short"):
            assert (got["code"], got["left"]) == (0, clean["left"]), fault
        elif got.get("code") == 0:  # all was written by then
            assert fault.endswith("later")
        elif fault.startswith("kill"):
            assert (got["signal"], got["same"]) == (9, True)
        else:
            assert (got["same"], got["alone"]) == (True, True), got
            one_line(got["code"], got["said"])


def one_line(code, said):
    assert code == 2, said
    assert said.rstrip("\n").isprintable()
    assert len(said) <= 310
    assert re.search(r"/faulty[^/]*/x[._]", said), said


@pytest.mark.slow
def test_everything_that_writes_is_whole():
    """Only `whole_file` opens files for writing; other files are temporary, or report what is lost."""
    known = {
        "cli/pipe.py", "cli/unexpected.py", "page/server.py", "readers/packed.py",
        "cli/output.py",  # standard output, or a draft under another name
        "readers/texts/_lines.py", "cli/first_rows.py",  # a temporary file
        "scale/journal.py",  # the journal, a line a log
    }  # fmt: skip
    found = set()
    for path in PACKAGE.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if (
                isinstance(node, ast.Call)
                and isinstance(node.func, ast.Attribute)
                and _writes(node)
            ):
                owner = node.func.value
                if not (isinstance(owner, ast.Name) and owner.id == "draft"):
                    found.add(path.relative_to(PACKAGE).as_posix())
    assert found <= known


def _writes(call):
    if call.func.attr in ("write_text", "write_bytes"):
        return True
    modes = [a.value for a in call.args[:1] if isinstance(a, ast.Constant)]
    return call.func.attr == "open" and bool(modes) and str(modes[0])[:1] in "wax"


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="Windows does not let a mapped file be cut")
@pytest.mark.parametrize("command", ["adev", "fit"])
def test_a_file_that_is_cut_under_its_memory_map_is_one_line(tmp_path, command):
    code = f"""
import os, sys
import numpy as np
path = {str(tmp_path / "x.npy")!r}
np.save(path, np.random.default_rng(1).standard_normal(9_000_000))  # above 64 MiB it is mapped
load = np.load
def cut(*arguments, **options):
    data = load(*arguments, **options)
    if options.get("mmap_mode"):
        os.truncate(path, 5000)
    return data
np.load = cut
from allanite.cli import main
sys.argv = ["allanite", {command!r}, path, "--rate", "10", *(["--model", "N"] if {command!r} == "fit" else [])]
main()
"""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=120
    )
    said = "allanite: a log became shorter while it was read, or its disk failed\n"
    assert (done.returncode, done.stdout, done.stderr) == (2, "", said)
