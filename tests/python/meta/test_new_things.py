"""New effects, readers, exports and estimators are registered, public and tested; messages say what is missing."""

from __future__ import annotations

import importlib
import inspect
import re
from pathlib import Path

import allanite as al
from allanite.deviation import ESTIMATORS
from allanite.effects import Effect
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


def test_every_effect_is_in_the_catalogue_and_public():
    for module in _modules("effects"):
        for cls in vars(module).values():
            mine = inspect.isclass(cls) and cls.__module__ == module.__name__
            if mine and issubclass(cls, Effect) and "kind" in vars(cls):
                assert cls in list(al.CATALOGUE), f"{cls.kind}: add it to effects/__init__.py"
                assert hasattr(al.effects, cls.__name__), f"{cls.kind}: import it there"


def test_every_reader_declares_a_format_and_has_a_log_that_is_read():
    readers = {_own(m, "read"): m for m in _modules("readers") if _own(m, "read")}
    loose = set(readers) - {one.read for one in FORMATS} - {text.read, al.read}
    assert not loose, f"declare FORMAT at the end of {[r.__module__ for r in loose]}"
    tests = (ROOT / "tests" / "python" / "unit").glob("test_*reader*.py")
    tried = "\n".join(path.read_text(encoding="utf-8") for path in tests)
    for one in FORMATS:
        told = not one.suffixes or any(s in tried for s in one.suffixes)
        assert told, f"{one.title}: read a log in test_readers_*.py"


def test_every_export_has_a_name_a_consumer_and_a_place_on_the_page():
    loose = [
        m.__name__ for m in _modules("exports") if _own(m, "render") and not hasattr(m, "TARGETS")
    ]
    assert not loose, f"declare TARGETS in {loose}"
    # test_export.py covers the readers of MATLAB and JSON.
    tests = (ROOT / "tests" / "python" / "unit").glob("test_export*.py")
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
    secret = [name for name in ESTIMATORS if name not in al.__all__]
    assert not secret, f"add to deviation/__init__.py and __init__.pyi: {secret}"
