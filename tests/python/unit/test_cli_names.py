"""The public names: each can be had, and none costs anything before it is asked for."""

import subprocess
import sys

import pytest

import allanite


@pytest.mark.parametrize("name", allanite.__all__)
def test_every_public_name_is_there(name):
    pytest.importorskip("allanite.deviation")
    value = getattr(allanite, name)
    assert value is getattr(allanite, name)
    assert type(value).__name__ != "module"


def test_unknown_names_are_refused():
    with pytest.raises(AttributeError, match="nonsense"):
        _ = allanite.nonsense


def test_listing():
    assert dir(allanite) == sorted(allanite.__all__)
    assert set(allanite._HOME) | {"__version__"} == set(allanite.__all__)


def test_the_package_itself_imports_nothing():
    code = "import sys, allanite; print([m for m in ('numpy', 'scipy') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
