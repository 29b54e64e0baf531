"""The table of search constants gives unit and basis of each constant; the search defines none of them elsewhere."""

import re
from pathlib import Path

PACKAGE = Path(__file__).parents[3] / "python" / "allanite"
TABLE = PACKAGE / "suggestion" / "constants.py"


def entries() -> dict[str, str]:
    """The comment of each constant of the table."""
    found = re.findall(r"((?:^#: .*\n)+)^([A-Z_0-9]+) = ", TABLE.read_text(encoding="utf-8"), re.M)
    return {name: comment for comment, name in found}


def test_every_constant_has_a_unit_and_a_basis() -> None:
    names = re.findall(r"^([A-Z_0-9]+) = ", TABLE.read_text(encoding="utf-8"), re.M)
    assert len(names) == len(set(names))
    assert set(entries()) == set(names)
    for name, comment in entries().items():
        assert comment.startswith("#: Unit: "), name
        assert comment.count("#: Basis: ") == 1, name


def test_no_module_of_the_search_defines_a_constant_of_the_table() -> None:
    names = set(entries())
    for path in (*PACKAGE.glob("suggestion/**/*.py"), *PACKAGE.glob("study/*.py")):
        if path != TABLE:
            defined = set(re.findall(r"^([A-Z_0-9]+) = ", path.read_text(encoding="utf-8"), re.M))
            assert not defined & names, path
