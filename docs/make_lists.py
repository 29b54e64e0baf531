"""Add new effects and deviations to the lists that name them: python docs/make_lists.py

| new | added to |
|---|---|
| effect | imports for type checkers (`effects/__init__.py`), table of models (`docs/contract.md`) |
| deviation | names of `deviation/__init__.py` and `__init__.pyi` |

The table of models is written anew. Rows and places of the other lists stay as they are: edit them by hand.
"""

from pathlib import Path

import allanite as al
from allanite.deviation.table import ESTIMATORS
from allanite.effects._base import Effect
from allanite.effects._declared import Parameter, has_several
from allanite.effects._documented import unit_of

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "python" / "allanite"
CATALOG = PACKAGE / "effects" / "__init__.py"
CONTRACT = ROOT / "docs" / "contract.md"
DEVIATIONS = PACKAGE / "deviation" / "__init__.py"
PUBLIC = PACKAGE / "__init__.pyi"
#: Lines around the table of models.
BEGIN = "<!-- models: written by docs/make_lists.py -->\n"
END = "<!-- end of models -->\n"


def effects() -> list[type[Effect]]:
    """Effect classes of the package, in the order of the catalog."""
    return al.CATALOG.built_in


def catalog(text: str, found: list[type[Effect]]) -> str:
    """`effects/__init__.py` with an import of each effect for type checkers."""
    for cls in found:
        text = _with_import(
            text, f"    from {cls.__module__} import {cls.__name__} as {cls.__name__}\n"
        )
    return text


def contract(text: str, found: list[type[Effect]]) -> str:
    """`docs/contract.md` with a new table of models between its markers, in the order of the catalog."""
    rows = [
        f"| `{cls.kind}` | {cls.short} | {'; '.join(_entry(cls, p) for p in cls.parameters)} |\n"
        for cls in found
    ]
    head, rest = text.split(BEGIN)
    table = "| kind | short | parameters (JSON names) |\n|---|---|---|\n" + "".join(rows)
    return f"{head}{BEGIN}\n{table}\n{END}{rest.split(END)[1]}"


def _entry(cls: type[Effect], parameter: Parameter) -> str:
    """Text of a parameter in the table of models: name, unit, what it is, and whether it may be omitted."""
    unit = "" if parameter.unit == "text" else f" {unit_of(parameter)}"
    properties = {
        "list": has_several(cls, parameter.name),
        "derived": parameter.role == "derived",
        "optional": parameter.optional,
    }
    words = "".join(f", {name}" for name, applies in properties.items() if applies)
    return f"`{parameter.name}`{unit}{words}: {parameter.description}"


def deviations(text: str) -> str:
    """`deviation/__init__.py` with the name of each estimator."""
    for name in ESTIMATORS:
        if f'    "{name}",\n' not in text:
            text = _with_entry(text, "estimators import (\n", f"    {name},\n")
            text = _with_entry(text, "__all__ = [\n", f'    "{name}",\n')
    return text


def public(text: str) -> str:
    """`__init__.pyi` with the name of each estimator."""
    for name in ESTIMATORS:
        if f" import {name} as {name}\n" not in text:
            text = _with_import(text, f"from allanite.deviation import {name} as {name}\n")
    return text


def _with_import(text: str, line: str) -> str:
    """`text` with an import line before the first import of its indentation that sorts after it."""
    if line in text:
        return text
    lines = text.splitlines(keepends=True)
    beginning = line[: line.index("from ")] + "from allanite."
    imports = [i for i, one in enumerate(lines) if one.startswith(beginning)]
    later = [i for i in imports if _import_order(lines[i]) > _import_order(line)]
    at = later[0] if later else imports[-1] + 1
    return "".join([*lines[:at], line, *lines[at:]])


def _with_entry(text: str, opening: str, entry: str) -> str:
    """`text` with one more entry, sorted, in the list that begins with `opening` and has an entry on each line."""
    head, rest = text.split(opening)
    lines = rest.splitlines(keepends=True)
    end = next(i for i, one in enumerate(lines) if not one.startswith(" "))
    lines[:end] = sorted([*lines[:end], entry], key=_name_order)
    return head + opening + "".join(lines)


def _import_order(line: str) -> tuple[str, tuple[int, str]]:
    """Key by which ruff sorts lines ``from module import name as name``: the module, then the name."""
    _, module, _, name, *_ = line.split()
    return module, _name_order(name)


def _name_order(entry: str) -> tuple[int, str]:
    """Key by which ruff sorts names: constants, then classes, then others, each without regard to case."""
    name = entry.strip(' ",\n')
    return (0 if name.isupper() else 1 if name[0].isupper() else 2), name.lower()


def lists() -> dict[Path, str]:
    """Text of each file with its list complete."""
    found = effects()
    text = {p: p.read_text(encoding="utf-8") for p in (CATALOG, CONTRACT, DEVIATIONS, PUBLIC)}
    return {
        CATALOG: catalog(text[CATALOG], found),
        CONTRACT: contract(text[CONTRACT], found),
        DEVIATIONS: deviations(text[DEVIATIONS]),
        PUBLIC: public(text[PUBLIC]),
    }


if __name__ == "__main__":
    for path, text in lists().items():
        path.write_text(text, encoding="utf-8")
