"""A process with `faults.c` preloaded: what each reader and writer does when the disk fails, as JSON."""

import ctypes
import errno
import hashlib
import io
import json
import os
import sys
import tempfile
import warnings
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parents[1]), str(HERE.parents[1] / "fuzz")]

NONE, FAILS, INTERRUPTED, SHORT, KILLED = range(5)
READS, WRITES = range(2)
# Name → kind, errno, calls that go through before it.
FAULTS = {
    "EIO": (FAILS, errno.EIO, 0),
    "EIO later": (FAILS, errno.EIO, 1),
    "EIO much later": (FAILS, errno.EIO, 4),
    "ENOSPC": (FAILS, errno.ENOSPC, 0),
    "EINTR": (INTERRUPTED, 0, 0),
    "short": (SHORT, 0, 0),
    "kill": (KILLED, 0, 0),
    "kill later": (KILLED, 0, 1),
}
ON_WRITING = ("ENOSPC", "EIO later", "EINTR", "short", "kill", "kill later")
ON_READING = ("EIO", "EIO later", "EIO much later", "EINTR", "short")


def set_fault(name, side, mark):
    kind, code, after = FAULTS.get(name, (NONE, 0, 0))
    ctypes.CDLL(None).fault_set(kind, side, code, ctypes.c_long(after), str(mark).encode())


def commanded(words):
    """Exit code, stdout and stderr of a command in this process."""
    from allanite.cli import main

    out, err = io.StringIO(), io.StringIO()
    code = 0
    try:
        with redirect_stdout(out), redirect_stderr(err):
            main(list(map(str, words)))
    except SystemExit as ended:
        code = ended.code or 0
    return code, out.getvalue(), err.getvalue()


def forked(work, folder):
    """Return value of `work` in a fork, so that a signal or a hang only concerns the fork."""
    at = Path(folder) / "found.json"
    at.unlink(missing_ok=True)
    child = os.fork()
    if not child:
        import signal
        import traceback

        signal.alarm(120)
        try:
            found = work()
        except BaseException:
            set_fault("", 0, "")
            found = {"traceback": traceback.format_exc()}
        at.write_text(json.dumps(found))
        os._exit(0)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    return json.loads(at.read_text()) if at.exists() else {"signal": -code}


def reads(names, folder):
    """Name of a format → fault → messages of the library and of a command."""
    import run
    import targets

    run.fork_children(files=1)  # a new interpreter would not have the faults
    targets.reader = lambda suffix, seeds, _text=False, **options: (suffix, seeds, options)
    return {name: forked(lambda n=name: _read(*targets.targets()[n](), folder), folder) for name in names}  # fmt: skip


def _read(suffix, seeds, options, folder):
    import allanite as al

    path = Path(folder) / "faulty" / f"x{suffix}"
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(seeds[0])
    # Some seeds state another rate than the one given for all seeds of their formats.
    options = {name: f"{value}!" if name == "rate" else value for name, value in options.items()}
    words = [w for name, value in options.items() for w in (f"--{name}", str(value))]
    found = {}
    for fault in ("none", *ON_READING):
        found[fault] = said = {}
        set_fault(fault, READS, path.parent)
        try:
            samples = al.read(path, **options).samples
            said["library"] = [0, hashlib.sha256(samples.tobytes()).hexdigest()]
        except al.AllaniteError as error:
            said["library"] = [2, str(error)]
        set_fault(fault, READS, path.parent)
        said["command"] = commanded(["adev", path, *words, "--json"])
        set_fault("none", READS, "")
    path.unlink()
    return found


def writes(_names, folder):
    """Name of a writer → fault → message, and files in the folder afterwards."""
    from writers import writers

    draw_once()
    tried = writers(Path(folder))
    for target, write in tried.values():  # what they import is then there for all forks
        with tempfile.TemporaryDirectory(dir=folder) as place:
            write(Path(place) / target)
    return {
        name: {
            fault: forked(lambda w=write, t=target, f=fault: _written(w, t, f, folder), folder)
            for fault in ("none", *ON_WRITING)
        }
        for name, (target, write) in tried.items()
    }


def draw_once():
    """Draw one figure of each kind, because drawing is not tested here."""
    from allanite.plots import matplotlib_painter

    drawn, render = {}, matplotlib_painter.render

    def one(figure, kind, *rest, **style):
        if kind not in drawn:
            drawn[kind] = render(figure, kind, *rest, **style)
        return drawn[kind]

    matplotlib_painter.render = one


def _written(write, target, fault, folder):
    import allanite as al

    with tempfile.TemporaryDirectory(dir=folder, prefix="faulty-") as place:
        path = Path(place) / target
        path.write_text("before")
        if "kill" in fault:
            return {**forked(lambda: _write(write, path, fault, al), folder), **_left(path)}
        return {**_write(write, path, fault, al), **_left(path)}


def _write(write, path, fault, al):
    set_fault(fault, WRITES, path.parent)
    try:
        code, said = write(path) or (0, "")
    except al.AllaniteError as error:
        code, said = 2, str(error)
    set_fault("none", WRITES, "")
    return {"code": code, "said": said}


def _left(path):
    files = sorted(str(p.relative_to(path.parent)) for p in path.parent.rglob("*") if p.is_file())
    same = path.read_bytes() == b"before"
    alone = files == [path.name]
    return {
        "alone": alone,
        "left": files,
        "same": same,
        "content": hashlib.sha256(path.read_bytes()).hexdigest(),
    }


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    what, folder, *names = sys.argv[1:]
    sys.stdout.write(
        "\n" + json.dumps({"reads": reads, "writes": writes}[what](names, folder)) + "\n"
    )
