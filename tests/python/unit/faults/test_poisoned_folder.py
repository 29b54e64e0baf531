"""No command and no page executes a file of the folder in which a log is.

The folder holds a module of every name that Python or an installed package can import. Each leaves a mark when it is
executed. Commands run like the installed script: Python puts the folder of the script first on its path, not the
working directory.
"""

import json
import os
import signal
import subprocess
import sys
import time
import urllib.request
from importlib.metadata import packages_distributions

import numpy as np
import pytest

from allanite.cli import COMMANDS
from command_line import until
from every_command import LOG, RUNS, write_logs

pytestmark = pytest.mark.slow

SCRIPT = """
from allanite.cli import main

if __name__ == "__main__":
    import signal
    signal.signal(signal.SIGINT, signal.default_int_handler)
    main()
"""
#: Executed at every start of Python that finds them.
AT_START = {"sitecustomize", "usercustomize"}
#: Formats that a library reads.
FOREIGN = ("log.npy", "log.npz", "log.h5", "log.parquet", "log.mat")


class Poisoned:
    """A folder with logs and modules that must not run."""

    def __init__(self, folder):
        self.folder, self.marks, self.out = (folder / name for name in ("here", "marks", "out"))
        for place in (self.folder, self.marks, self.out, folder / "bin", self.folder / "logs"):
            place.mkdir()
        self.script = folder / "bin" / "command.py"
        self.script.write_text(SCRIPT)
        names = {*sys.stdlib_module_names, *packages_distributions(), *AT_START}
        for name in names:
            if name.isidentifier():
                self.poison(self.folder, name)
                self.poison(self.folder / "logs", name)
        write_logs(self.folder)

    def poison(self, folder, name):
        mark = str(self.marks / name)
        (folder / f"{name}.py").write_text(f"open({mark!r}, 'w').close()\nraise SystemExit(99)\n")

    def command(self, *arguments):
        """The command line of a process, and its options."""
        words = [word.format(out=self.out) for word in arguments]
        return [sys.executable, str(self.script), *words], {"cwd": self.folder}

    def run(self, *arguments):
        words, options = self.command(*arguments)
        return subprocess.run(
            words, capture_output=True, text=True, check=False, timeout=300, **options
        )

    def executed(self):
        """Names of the modules that were executed since the last call."""
        marks = sorted(self.marks.iterdir())
        for mark in marks:
            mark.unlink()
        return [mark.name for mark in marks]


@pytest.fixture(scope="module")
def poisoned(tmp_path_factory):
    return Poisoned(tmp_path_factory.mktemp("poisoned"))


def test_every_command_is_run():
    assert set(RUNS) == set(COMMANDS)


def test_the_poison_works(poisoned):
    """Python started in the folder in another way executes the modules."""
    subprocess.run([sys.executable, "-c", "import json"], cwd=poisoned.folder, check=False)
    assert poisoned.executed() == ["json"]


#: Each command starts an interpreter that looks for thousands of names.
@pytest.mark.long
@pytest.mark.parametrize("name", sorted(set(RUNS) - {"demo", "explore"}))
def test_a_command(poisoned, name):
    done = poisoned.run(name, *RUNS[name])
    assert poisoned.executed() == []
    # What accept says is not tried here: with so few samples nothing need be decided.
    assert done.returncode in ((0, 1, 3) if name == "accept" else (0,)), done.stderr


@pytest.mark.skipif(os.name != "posix", reason="a pipe of POSIX")
@pytest.mark.parametrize(
    "content", ["text.usetex: True\nfigure.dpi: x\n", None], ids=["LaTeX", "pipe"]
)
def test_settings_of_figures_beside_a_log_are_not_read(tmp_path, content):
    """They once started LaTeX on the texts of a log."""
    pytest.importorskip("matplotlib")
    write_logs(tmp_path)
    settings = tmp_path / "matplotlibrc"
    os.mkfifo(settings) if content is None else settings.write_text(content)
    code = "from allanite.cli import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", code, "adev", "log.csv", "--plot", "x.svg"],
        cwd=tmp_path, capture_output=True, text=True, check=False, timeout=60,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "x.svg").read_text().startswith("<?xml")


def test_watch(poisoned):
    poisoned.run("fit", *LOG, "--save", "{out}/model.json")
    words, options = poisoned.command("watch", "log.csv", "--follow", "--model", "{out}/model.json")
    with subprocess.Popen(words, stdout=subprocess.PIPE, **options) as process:
        time.sleep(3.0)
        process.send_signal(signal.SIGTERM if os.name == "posix" else signal.CTRL_C_EVENT)
        process.communicate(timeout=60)
    assert poisoned.executed() == []


def test_the_demo(poisoned):
    """Everything is imported before the loop begins, which takes a minute."""
    words, options = poisoned.command("demo", *RUNS["demo"])
    with subprocess.Popen(words, stdout=subprocess.PIPE, **options) as process:
        assert process.stdout.readline()
        time.sleep(3.0)
        process.kill()
    assert poisoned.executed() == []


@pytest.mark.long
@pytest.mark.parametrize("log", FOREIGN)
def test_a_format_that_a_library_reads(poisoned, log):
    path = poisoned.folder / log
    x = np.random.default_rng(1).standard_normal(300)
    if path.suffix == ".h5":
        with pytest.importorskip("h5py").File(path, "w") as file:
            file["gyro"] = x
    elif path.suffix == ".parquet":
        table = pytest.importorskip("pyarrow").table({"gyro": x})
        pytest.importorskip("pyarrow.parquet").write_table(table, path)
    elif path.suffix == ".mat":
        from scipy.io import savemat

        savemat(path, {"gyro": x})
    rate = () if log == "log.npz" else ("--rate", "10")
    done = poisoned.run("adev", log, *rate)
    assert poisoned.executed() == []
    assert done.returncode == 0, done.stderr


@pytest.mark.long
@pytest.mark.skipif(os.name != "posix", reason="ended by a signal")
def test_the_page(poisoned):
    """The page opens the log, and another tab opens an uploaded one."""
    pytest.importorskip("starlette")
    pytest.importorskip("uvicorn")
    pytest.importorskip("multipart")
    words, options = poisoned.command("explore", *RUNS["explore"])
    with subprocess.Popen(words, stdout=subprocess.PIPE, **options) as process:
        try:
            address = process.stdout.readline().decode().strip()

            def ask(path, data=None):
                request = urllib.request.Request(f"{address}{path}", data=data)
                with urllib.request.urlopen(request, timeout=60) as answer:
                    return json.load(answer)

            for upload in (False, True):
                tab = ask("tabs", b"{}")["tab"]
                if upload:
                    content = (poisoned.folder / "log.csv").read_bytes()
                    ask(f"tabs/{tab}/upload?name=log.csv", content)

                def is_done(tab=tab):
                    state = ask(f"tabs/{tab}")
                    assert not (state["job"] or {}).get("error"), state
                    return state["job"] and not state["job"]["busy"]

                until(is_done, 120)
        finally:
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=60)
    assert poisoned.executed() == []
