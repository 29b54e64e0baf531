"""Limits of the shell: ``ulimit -v`` (address space) and ``ulimit -f`` (size of a file, as a disk that fills up)."""

import json
import os
import resource
import signal
import subprocess
import sys
import urllib.request

import numpy as np
import pytest

from command_line import HEARS_INTERRUPT, refused, until

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="limits of processes as on Linux")
CODE = "from allanite.cli import main; main()"
LOG = ("{log}", "--model", "N")
MODEL = ("N(N=1)", "--rate", "10", "--unit", "rad/s")
#: Command → its arguments; {new} is a file that is written.
WRITING = {
    "adev": ("{log}", "--plot", "{new}.svg"),
    "fit": (*LOG, "--save", "{new}.json"),
    "characterize": (*LOG, "--save", "{new}.json"),
    "report": (*LOG, "-o", "{new}.html"),
    "compare": ("{log}", "N(N=1)", "--plot", "{new}.svg"),
    "export": (*MODEL, "--format", "c-header", "-o", "{new}.h"),
    "simulate": (*MODEL, "-n", "3000", "-o", "{new}.csv"),
    "fleet": ("{log}", "--out", "{new}.csv", "--model", "N"),
    "watch": ("{log}", "--model", *MODEL, "--column", "gyro", "--state", "{new}.json"),
}
READING = {
    "inspect": ("{log}",),
    "predict": ("--aided", "1", "--model", *MODEL),
    "adev": ("{log}",),
    "check": LOG,
    "improve": LOG,
    "plan": ("--model", *MODEL[:3], "--find", "K(K=1)", "--duration", "100"),
}


@pytest.fixture
def words(tmp_path):
    """Arguments of a command, with the paths of a log and of a new file put in."""
    x = np.random.default_rng(1).standard_normal(2000)
    rows = "".join(f"{i / 10},{v!r}\n" for i, v in enumerate(x.tolist()))
    (tmp_path / "log.csv").write_text("time [s],gyro [rad/s]\n" + rows)
    names = {"log": tmp_path / "log.csv", "new": tmp_path / "out" / "new"}
    (tmp_path / "out").mkdir()
    return lambda arguments: [word.format(**names) for word in arguments]


@pytest.mark.slow
@pytest.mark.parametrize("name", WRITING)
def test_a_file_that_cannot_grow_leaves_the_old_one(run, words, tmp_path, name):
    """Neither a draft nor a part of the file is left."""
    arguments = words(WRITING[name])
    target = next(word for word in arguments if "/out/" in word)
    with open(target, "w", encoding="utf-8") as file:  # noqa: PTH123
        file.write("" if name == "watch" else "as before")
    if name == "watch":
        os.unlink(target)  # noqa: PTH108
    hard = resource.getrlimit(resource.RLIMIT_FSIZE)[1]
    # A watch first copies the first 100 rows to a temporary file.
    resource.setrlimit(resource.RLIMIT_FSIZE, (4000 if name == "watch" else 100, hard))
    try:
        code, _, err = run(name, *arguments)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (hard, hard))
    assert (code, err.count("\n")) == (2, 1), err
    assert "new" in err
    assert "too large" in err
    assert len(err) <= 301
    # A journal of a fleet is a line a log: one that is cut is reported by the next run, and its log is done again.
    left = [path.name for path in (tmp_path / "out").iterdir() if path.suffix != ".journal"]
    assert left == ([] if name == "watch" else [target.rsplit("/", 1)[-1]])
    if left:
        assert (tmp_path / "out" / left[0]).read_text() == "as before"


def limited(megabytes, *arguments):
    """Run a command in a process with little address space."""
    code = (
        "import resource, sys; most = int(sys.argv.pop(1)) << 20\n"
        "resource.setrlimit(resource.RLIMIT_AS, (most, most))\n" + CODE
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(megabytes), *arguments],
        capture_output=True, text=True, check=False, timeout=300, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
    )  # fmt: skip
    return done.returncode, done.stdout, done.stderr


def test_too_little_address_space_is_said_before_a_library_fails(words):
    refused(
        limited(300, "inspect", *words(("{log}",))), 2, "limited to 315 MB", "ulimit -v", "500 MB"
    )


@pytest.mark.long
@pytest.mark.parametrize("name", [*READING, *(name for name in WRITING if name != "adev")])
def test_a_command_in_little_address_space(words, name):
    code, out, err = limited(800, name, *words((READING | WRITING)[name]))
    assert (code, err) == (0, "")
    assert out or name in ("report",)


@pytest.mark.long
def test_the_page_in_little_address_space(words):
    """A child of the page reads the log, and the page ends normally."""
    for module in ("starlette", "uvicorn", "multipart"):
        pytest.importorskip(module)
    most = 800 << 20
    limit = f"import resource; resource.setrlimit(resource.RLIMIT_AS, ({most}, {most}))\n"
    log = words(("{log}",))
    with subprocess.Popen(
        [sys.executable, "-c", HEARS_INTERRUPT + limit + CODE, "explore", *log, "--no-browser"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
    ) as process:  # fmt: skip
        try:
            address = process.stdout.readline().decode().strip()

            def ask(path, data=None):
                request = urllib.request.Request(f"{address}{path}", data=data)
                with urllib.request.urlopen(request, timeout=60) as answer:
                    return json.load(answer)

            tab = ask("tabs", b"{}")["tab"]

            def is_done():
                job = ask(f"tabs/{tab}")["job"]
                assert not (job or {}).get("error"), job
                return job and not job["busy"]

            until(is_done, 120)
        finally:
            process.send_signal(signal.SIGINT)
            said = process.communicate(timeout=60)[1]
    assert (process.returncode, said.decode().strip()) == (130, "allanite: interrupted")
