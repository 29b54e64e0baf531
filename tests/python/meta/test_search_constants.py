"""The search defines none of the constants of the table elsewhere."""

import re
from pathlib import Path

PACKAGE = Path(__file__).parents[3] / "python" / "allanite"
TABLE = PACKAGE / "suggestion" / "constants.py"


def test_no_module_of_the_search_defines_a_constant_of_the_table() -> None:
    names = set(re.findall(r"^([A-Z_0-9]+) = ", TABLE.read_text(encoding="utf-8"), re.M))
    for path in (*PACKAGE.glob("suggestion/**/*.py"), *PACKAGE.glob("study/*.py")):
        if path != TABLE:
            defined = set(re.findall(r"^([A-Z_0-9]+) = ", path.read_text(encoding="utf-8"), re.M))
            assert not defined & names, path
