"""New effects, readers, exports and estimators are registered, public and tested; messages say what is missing."""

from __future__ import annotations

import importlib
import inspect
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

import allanite as al
from allanite.cli import main
from allanite.deviation import ESTIMATORS
from allanite.effects.registry import effects_in
from allanite.exports import TARGETS
from allanite.readers import FORMATS, text

ROOT = Path(__file__).parents[3]
PACKAGE = ROOT / "python" / "allanite"


def _modules(room):
    """Modules of a package folder, except for private ones."""
    for path in sorted((PACKAGE / room).rglob("*.py")):
        if not path.stem.startswith("_"):
            inside = path.relative_to(PACKAGE).with_suffix("")
            yield importlib.import_module(".".join(("allanite", *inside.parts)))


def _own(module, name):
    """The object with this name if the module itself defines it, else None."""
    found = vars(module).get(name)
    return found if getattr(found, "__module__", None) == module.__name__ else None


def test_every_effect_and_deviation_is_in_the_lists(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "docs")
    import make_lists

    old = [str(p) for p, text in make_lists.lists().items() if p.read_text("utf-8") != text]
    assert not old, f"run python docs/make_lists.py: {old}"


def test_an_effect_is_one_file_with_its_place_in_the_catalog():
    own = {
        cls
        for module in _modules("effects")
        for cls in vars(module).values()
        if inspect.isclass(cls) and cls.__module__ == module.__name__ and hasattr(cls, "kind")
    }
    assert own == set(al.CATALOG.built_in)
    places = [cls.catalog_place for cls in al.CATALOG.built_in]
    assert places == sorted(set(places))
    assert all(getattr(al.effects, cls.__name__) is cls for cls in own)
    new = ModuleType("new")
    for name, place in (("Last", {}), ("First", {"catalog_place": 2.5})):
        made = {"__module__": "new", "kind": name.lower(), **place}
        setattr(new, name, type(name, (al.Sinusoid,), made))
    found = effects_in([importlib.import_module("allanite.effects.rate_ramp"), new])
    assert found == [new.First, al.RateRamp, new.Last]


def test_new_effects_and_deviations_are_sorted_into_the_lists(monkeypatch):
    pytest.importorskip("ruff")
    monkeypatch.syspath_prepend(ROOT / "docs")
    import make_lists

    new = [
        type(name, (), {"kind": module, "short": "NEW", "parameters": ()})
        for module, name in (("zigzag", "Zigzag"), ("aging", "Aging"), ("zigzag", "Ascent"))
    ]
    for cls in new:
        cls.__module__ = f"allanite.effects.{cls.kind}"
    effects = [*make_lists.effects(), *new]
    monkeypatch.setattr(make_lists, "effects", lambda: effects)
    deviations = dict.fromkeys((*ESTIMATORS, "zdev", "aadev", "newdev"))
    monkeypatch.setattr(make_lists, "ESTIMATORS", deviations)
    texts = make_lists.lists()
    assert "\n| `zigzag` | NEW |" in texts.pop(make_lists.CONTRACT)
    for path, listed in texts.items():
        assert "Zigzag" in listed or "zdev" in listed
        for command in (("check",), ("format", "--check")):
            ruff = [sys.executable, "-m", "ruff", *command, "--stdin-filename", path, "-"]
            done = subprocess.run(
                ruff, input=listed, cwd=ROOT, capture_output=True, encoding="utf-8", check=False
            )
            assert done.returncode == 0, done.stdout


def test_every_reader_declares_a_format():
    readers = {_own(m, "read"): m for m in _modules("readers") if _own(m, "read")}
    loose = set(readers) - {one.read for one in FORMATS} - {text.read, al.read}
    assert not loose, (
        f"declare FORMAT in {[r.__module__ for r in loose]}, in a folder: arrays, clocks, texts or topics"
    )


def test_every_export_has_a_name_a_consumer_and_a_place_on_the_page():
    loose = [
        m.__name__ for m in _modules("exports") if _own(m, "render") and not hasattr(m, "TARGETS")
    ]
    assert not loose, f"declare TARGETS in {loose}"
    # test_export.py covers the readers of MATLAB and JSON.
    tests = (ROOT / "tests" / "python" / "unit" / "exports").glob("test_export*.py")
    tried = "\n".join(path.read_text(encoding="utf-8") for path in tests)
    missing = [name for name in TARGETS if f'"{name}"' not in tried]
    assert not missing, (
        f"carry through the consumer's update in test_export_consumers.py: {missing}"
    )


def test_every_kernel_has_a_row_and_every_row_is_public():
    files = (ROOT / "rust" / "deviation").glob("*.rs")
    source = "\n".join(path.read_text(encoding="utf-8") for path in files)
    kernels = re.findall(r'fn name\(&self\) -> &\'static str \{\s+"(\w+)"', source)
    assert kernels
    rowless = sorted(set(kernels) - set(ESTIMATORS))
    assert not rowless, f"add a row to deviation/estimators.py: {rowless}"


def test_every_deviation_is_in_the_help_once(capsys):
    with pytest.raises(SystemExit):
        main(["adev", "--help"])
    table = capsys.readouterr().out.split("  --kind ")[1].split("Options:")[0]
    rows = re.findall(r"^  ((?:\w+, )*\w+)(?:  |$)", table, re.MULTILINE)
    assert sorted(", ".join(rows).split(", ")) == sorted(ESTIMATORS)
