"""Every public name says what it is, with an example that runs."""

from __future__ import annotations

import ast
import doctest
import inspect

import numpy as np
import pytest

import allanite as al

#: Public, and neither a class nor a function.
VALUES = {"CATALOGUE", "__version__"}
CLASSES = [n for n in al.__all__ if inspect.isclass(getattr(al, n))]
PARSER = doctest.DocTestParser()


def ours(cls):
    """The classes of the package that a class is made of, itself first."""
    return [c for c in cls.__mro__ if c.__module__.startswith("allanite")]


THINGS = [getattr(al, name) for name in al.__all__ if name not in VALUES]
#: Each docstring once, by the name of what it describes: classes that others build on are read by their heirs, too.
DESCRIBED = {
    thing.__qualname__: inspect.getdoc(thing) or ""
    for public in THINGS
    for thing in (ours(public) if inspect.isclass(public) else [public])
}
EXAMPLES = {name: PARSER.get_examples(text) for name, text in DESCRIBED.items()}


def methods(cls):
    return {
        name: member
        for one in reversed(ours(cls))
        for name, member in vars(one).items()
        if not name.startswith("_")
        and (inspect.isfunction(member) or isinstance(member, classmethod | staticmethod))
    }


def attributes(names):
    """Every ``.name`` that the examples of these docstrings use."""
    code = "".join(example.source for name in names for example in EXAMPLES.get(name, ()))
    return {n.attr for n in ast.walk(ast.parse(code)) if isinstance(n, ast.Attribute)}


@pytest.mark.parametrize("name", sorted(set(al.__all__) - VALUES))
def test_every_public_name_has_an_example(name):
    assert EXAMPLES[getattr(al, name).__qualname__], f"al.{name}: add Examples to its docstring"


@pytest.mark.parametrize("name", CLASSES)
def test_every_method_is_described_and_in_an_example(name):
    """In that of its class, or of the class that it comes from."""
    cls = getattr(al, name)
    found = methods(cls)
    mute = [m for m, member in found.items() if not inspect.getdoc(member)]
    assert not mute, f"al.{name}: describe {mute}"
    used = attributes([one.__qualname__ for one in ours(cls)])
    assert not set(found) - used, f"al.{name}: show {sorted(set(found) - used)} in an example"


@pytest.mark.parametrize("name", CLASSES)
def test_every_property_is_described(name):
    cls = getattr(al, name)
    found = inspect.getmembers(cls, lambda v: isinstance(v, property))
    mute = [m for m, p in found if not m.startswith("_") and not p.__doc__]
    assert not mute


@pytest.mark.parametrize("name", [n for n in al.__all__ if n not in VALUES and n not in CLASSES])
def test_parameters_and_errors_of_a_function_are_described(name):
    function = getattr(al, name)
    text = DESCRIBED[function.__qualname__]
    if "Parameters as of" not in text:
        entries = text.partition("Parameters\n---")[2].partition("\n\n")[0]
        for parameter in inspect.signature(function).parameters:
            assert f"{parameter}" in entries, f"al.{name}: describe {parameter}"
    assert "Raises\n------" in text, f"al.{name}: say which errors it raises"


@pytest.mark.parametrize("name", sorted(n for n, examples in EXAMPLES.items() if examples))
def test_examples_run(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    test = PARSER.get_doctest(DESCRIBED[name], {"al": al, "np": np}, name, None, 0)
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    said: list[str] = []
    runner.run(test, out=said.append)
    assert runner.failures == 0, "".join(said)
