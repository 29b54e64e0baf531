"""Every public name is documented, with an example that runs."""

from __future__ import annotations

import doctest
import importlib
import inspect
import re

import numpy as np
import pytest

import allanite as al

#: Public names that are neither classes nor functions.
VALUES = {"CATALOG", "__version__"}
#: Public objects by name, including all effects.
PUBLIC = {n: getattr(al, n) for n in al.__all__} | {e.__name__: e for e in al.CATALOG}
CLASSES = [n for n, thing in PUBLIC.items() if inspect.isclass(thing)]
FUNCTIONS = [n for n in al.__all__ if n not in VALUES and n not in CLASSES]
PARSER = doctest.DocTestParser()


def ours(cls):
    """The class and its base classes within the package."""
    return [c for c in cls.__mro__ if c.__module__.startswith("allanite")]


THINGS = [thing for name, thing in PUBLIC.items() if name not in VALUES] + [type(al.CATALOG)]
#: Docstrings by the name of the documented object, including base classes.
DESCRIBED = {
    thing.__qualname__: inspect.getdoc(thing) or ""
    for public in THINGS
    for thing in (ours(public) if inspect.isclass(public) else [public])
}
EXAMPLES = {name: PARSER.get_examples(text) for name, text in DESCRIBED.items()}


def methods(cls):
    """Public methods of a class by name, including inherited ones."""
    return {
        name: member
        for one in reversed(ours(cls))
        for name, member in vars(one).items()
        if not name.startswith("_")
        and (inspect.isfunction(member) or isinstance(member, classmethod | staticmethod))
    }


@pytest.mark.parametrize("name", sorted(set(PUBLIC) - VALUES))
def test_every_public_name_has_an_example(name):
    assert EXAMPLES[PUBLIC[name].__qualname__], f"al.{name}: add Examples to its docstring"


def test_the_catalogue_has_an_example():
    assert EXAMPLES[type(al.CATALOG).__qualname__]


@pytest.mark.parametrize("name", CLASSES)
def test_every_method_is_described(name):
    mute = [m for m, member in methods(PUBLIC[name]).items() if not inspect.getdoc(member)]
    assert not mute, f"al.{name}: describe {mute}"


@pytest.mark.parametrize("name", CLASSES)
def test_every_property_is_described(name):
    cls = PUBLIC[name]
    found = inspect.getmembers(cls, lambda v: isinstance(v, property))
    mute = [m for m, p in found if not m.startswith("_") and not p.__doc__]
    assert not mute


def callables():
    """Public functions and methods by name; inherited methods appear under the defining class."""
    found = {name: PUBLIC[name] for name in FUNCTIONS}
    for cls in {one for name in CLASSES for one in ours(PUBLIC[name])}:
        for name, member in methods(cls).items():
            if name in vars(cls):
                found[f"{cls.__name__}.{name}"] = getattr(member, "__func__", member)
    return found


CALLABLES = callables()


def named(parameter, text):
    """True if a text mentions a parameter."""
    return re.search(rf"(?<![\w]){re.escape(parameter)}(?!\w)", text) is not None


def referred(text):
    """Docstrings to which a docstring refers for its parameters."""
    for name in re.findall(r"(?:[Aa]s of|see)\s+`([\w.]+)`", text):
        known = CALLABLES.get(name) or CALLABLES.get(name.removeprefix("allanite."))
        if known is None:
            module, _, last = name.rpartition(".")
            known = getattr(importlib.import_module(module), last)
        yield inspect.getdoc(known) or ""


@pytest.mark.parametrize("name", sorted(CALLABLES))
def test_every_parameter_is_named(name):
    """The docstring, or one to which it refers, must mention every parameter."""
    function = CALLABLES[name]
    text = inspect.getdoc(function) or ""
    parameters = [p for p in inspect.signature(function).parameters if p not in {"self", "cls"}]
    missing = [p for p in parameters if not named(p, text)]
    if missing:
        others = list(referred(text))
        missing = [p for p in missing if not any(named(p, other) for other in others)]
    assert not missing, f"{name}: say in its docstring what {missing} are"


@pytest.mark.parametrize("effect", list(al.CATALOG), ids=lambda e: e.short)
def test_help_of_an_effect_shows_what_it_declares(effect):
    text = inspect.getdoc(effect)
    for section in ("Parameters", "Raises"):
        assert text.count(f"\n{section}\n---") == 1
    for p in effect.parameters:
        assert f"\n{p.name} : " in text
        assert p.description in text
    assert text.index("\nParameters\n") < text.index("\nExamples\n")


def test_what_help_says_of_a_parameter():
    text = inspect.getdoc(al.effects.Bandwidth)
    assert "cutoff : Hz\n    −3 dB frequency; range 1e-12 … ∞." in text
    assert "floor : 1, optional\n" in text
    assert "design : a choice\n" in text
    assert "sigma : U, derived\n" in inspect.getdoc(al.GaussMarkov)
    assert inspect.getdoc(al.effects.BiasStep.grid).endswith(
        "For the parameters see `Effect.grid`."
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(n for n, examples in EXAMPLES.items() if examples))
def test_examples_run(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    test = PARSER.get_doctest(DESCRIBED[name], {"al": al, "np": np}, name, None, 0)
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    said: list[str] = []
    runner.run(test, out=said.append)
    assert runner.failures == 0, "".join(said)
