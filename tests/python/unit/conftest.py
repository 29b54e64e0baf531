"""A command line to run, and readers that run in forks."""

import os

import pytest

from allanite.cli import main
from allanite.common import isolation


@pytest.fixture
def run(capsys):
    """Run a command line; return exit code, stdout, stderr."""

    def call(*arguments):
        with pytest.raises(SystemExit) as caught:
            main([str(argument) for argument in arguments])
        out, err = capsys.readouterr()
        return caught.value.code, out, err

    return call


@pytest.fixture
def forked(monkeypatch):
    """Run isolated readers in forks, because new interpreters would take ten times as long."""

    def run_child(order, results, _watch):
        child = os.fork()
        if not child:
            try:
                isolation.serve_order(order, results)
            finally:
                os._exit(0)
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])

    if os.name == "posix":
        monkeypatch.setattr(isolation, "run_child", run_child)
