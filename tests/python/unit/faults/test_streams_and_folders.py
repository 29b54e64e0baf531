"""Full disks, closed pipes, folders that may not be written, names and homes that are missing: one line and a code."""

import os
import signal
import stat
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest

from command_line import started, until

pytestmark = pytest.mark.skipif(os.name != "posix", reason="faults are made the POSIX way")
CODE = "from allanite.cli import main; main()"
SIMULATE = ("simulate", "N(N=1)", "--rate", "100", "-n", "200000")


def command(*arguments, code=CODE, shell="", **options):
    """Exit code, stdout and stderr of a command; `shell` redirects."""
    words = [sys.executable, "-c", code, *map(str, arguments)]
    done = subprocess.run(
        ["sh", "-c", f'"$@" {shell}', "sh", *words],
        capture_output=True, check=False, timeout=300, **options,
    )  # fmt: skip
    return done.returncode, done.stdout, done.stderr.decode("utf-8", "replace")


def one_line(result, code, *words):
    got, _, err = result
    assert (got, err.count("\n")) == (code, 1), err
    assert err.startswith("allanite: ")
    assert err.rstrip("\n").isprintable()
    assert len(err) <= 301
    for word in words:
        assert word in err


@pytest.fixture
def log(tmp_path):
    path = tmp_path / "x.npy"
    np.save(path, np.random.default_rng(1).standard_normal(3000))
    return path


@pytest.mark.long
@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full")  # noqa: PTH110
def test_a_full_disk_is_named(log, tmp_path):
    one_line(command(*SIMULATE, shell=">/dev/full"), 2, "standard output", "space")
    one_line(command("adev", log, "--rate", 1, shell=">/dev/full"), 2, "standard output")
    fill = """
import errno, pathlib, sys
from allanite.cli import main
def full(*_, **__):
    raise OSError(errno.ENOSPC, "No space left on device")
pathlib.Path.write_text = pathlib.Path.write_bytes = full
main()
"""
    report = tmp_path / "r.html"
    found = command("report", log, "--rate", 1, "-o", report, "--quiet", code=fill)
    one_line(found, 2, "r.html", "space")
    assert [p.name for p in tmp_path.iterdir()] == ["x.npy"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lines", "arguments"),
    [
        (0, SIMULATE),
        (1, SIMULATE),
        (0, (*SIMULATE[:-1], 10)),
        (0, ("--help",)),
        (0, ("fit", "--help")),
        (0, ("--version",)),
    ],
)
def test_a_command_ends_with_0_when_the_reader_of_its_pipe_ends(lines, arguments):
    with started(*arguments) as process:
        for _ in range(lines):
            assert process.stdout.readline()
        process.stdout.close()
        said = process.stderr.read()
        assert (process.wait(60), said) == (0, b"")


@pytest.mark.slow
@pytest.mark.parametrize("shell", [">&-", "<&-", "2>&-", "<&- >&- 2>&-"])
def test_closed_streams(log, shell):
    code, _, err = command("adev", log, "--rate", 1, shell=shell)
    assert "Traceback" not in err
    assert code == (2 if ">&- " in f"{shell} " and shell != "2>&-" else 0)
    code, _, err = command("fit", "-", "--rate", 1, "--model", "N", shell=shell)
    assert code == 2
    assert "Traceback" not in err


@pytest.mark.slow
def test_bare_environments(log, tmp_path):
    bare = {
        k: v for k, v in os.environ.items() if k not in ("HOME", "LANG", "LC_ALL", "PYTHONUTF8")
    }
    bare |= {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "HOME": "/nonexistent"}
    got, out, err = command("fit", log, "--rate", 1, "--model", "N", env=bare)
    assert (got, err) == (0, "")
    assert b"samples" in out
    figure = tmp_path / "x.svg"
    got, _, err = command("adev", log, "--rate", 1, "--plot", figure, env=bare)
    assert got == 0, err
    assert figure.stat().st_size > 1000
    one_line(command("adev", "gyro\udcff\x1b[31m.csv", env=bare), 2, "no such file", r"\x1b")


@pytest.mark.slow
def test_a_folder_that_may_not_be_written():
    """Root can write everywhere, so it becomes another user, who cannot read the library.

    Therefore the same command runs once before, in its own folder, and imports everything that it needs.
    """
    code = """
import contextlib, os, pathlib, sys, tempfile
from allanite.cli import main
if os.geteuid() == 0:
    with tempfile.TemporaryDirectory() as own, contextlib.suppress(SystemExit):
        main([*sys.argv[1:-1], str(pathlib.Path(own) / "x.csv")])
    os.setgid(65534)
    os.setuid(65534)
main()
"""
    # Not below pytest's own folder, which no other user may enter.
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folder.chmod(stat.S_IRUSR | stat.S_IXUSR | stat.S_IROTH | stat.S_IXOTH)
        one_line(command(*SIMULATE, "-o", folder / "x.csv", code=code), 2, "x.csv", "ermission")
        assert list(folder.iterdir()) == []
        folder.chmod(stat.S_IRWXU)


@pytest.mark.slow
def test_what_a_killed_process_left_is_removed_by_the_next(tmp_path):
    target = tmp_path / "x.csv"
    with started(*SIMULATE[:-1], 30_000_000, "-o", target) as process:
        until(lambda: any(tmp_path.iterdir()) or process.poll() is not None)
        process.send_signal(signal.SIGKILL)
        process.wait(60)
    left = [p.name for p in tmp_path.iterdir()]
    assert len(left) == 1
    assert left != ["x.csv"]
    code, _, err = command(*SIMULATE, "-o", target)
    assert (code, err) == (0, "")
    assert [p.name for p in tmp_path.iterdir()] == ["x.csv"]


def test_an_error_of_our_own_says_how_to_report_it(log, tmp_path):
    broken = """
from allanite.cli import main
import allanite.readers
def fails(*_, **__):
    raise ZeroDivisionError("gx\\nsystem('…') \\x1b[2J")
allanite.readers.read = fails
import allanite
allanite.read = fails
main()
"""
    found = command(
        "fit",
        log,
        "--rate",
        1,
        "--model",
        "N",
        code=broken,
        env={**os.environ, "TMPDIR": str(tmp_path)},
    )
    one_line(found, 70, "ZeroDivisionError", "report", str(tmp_path))
    (written,) = tmp_path.glob("allanite-error-*.txt")
    assert "Traceback" in written.read_text(encoding="utf-8")


def test_a_core_that_is_missing_is_one_line():
    """The report of an unexpected error named the core's version, for which it asked the missing core."""
    code = "import sys; sys.modules['allanite._core'] = None\n" + CODE
    got = command("fit", "x.csv", code=code)
    one_line(got, 70, "an internal error of allanite", "allanite._core")
    report = Path(got[2].split("attach ")[1].split(",")[0])
    assert report.read_text().startswith("allanite without its compiled core, Python 3.")
    report.unlink()


def test_a_pipe_without_end_does_not_fill_the_disk(run, monkeypatch):
    from types import SimpleNamespace

    with Path("/dev/zero").open("rb") as zeros:
        monkeypatch.setattr("sys.stdin", SimpleNamespace(buffer=zeros))
        monkeypatch.setattr("shutil.disk_usage", lambda _: SimpleNamespace(free=10_000_000))
        found = run("fit", "-", "--rate", 1, "--model", "N")
        one_line(found, 2, "standard input is longer than 5 MB", "half of the free space")


def test_a_pipe_that_cannot_be_copied_names_itself(run, monkeypatch):
    import resource
    from types import SimpleNamespace

    hard = resource.getrlimit(resource.RLIMIT_FSIZE)[1]
    with Path("/dev/zero").open("rb") as zeros:
        monkeypatch.setattr("sys.stdin", SimpleNamespace(buffer=zeros))
        resource.setrlimit(resource.RLIMIT_FSIZE, (3_000_000, hard))
        try:
            found = run("fit", "-", "--rate", 1, "--model", "N")
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, (hard, hard))
    one_line(found, 2, "standard input cannot be copied", "too large")


def test_a_loop_of_links_is_a_log_that_cannot_be_read_and_a_name_that_can_be_written(log, tmp_path):
    from allanite.common.files import whole_file
    from allanite.scale.logs import logs_of, logs_without_table

    loop = tmp_path / "loop.csv"
    loop.symlink_to("loop.csv")
    assert logs_without_table(logs_of(tmp_path), tmp_path / "table.csv") == [loop, log]
    with whole_file(loop) as draft:
        draft.write_text("1")
    assert loop.read_text() == "1"
