"""The lowest version of everything that pyproject.toml lets a user have, a line each: `make floors` installs them."""

import re
import tomllib
from pathlib import Path

project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text("utf-8"))[
    "project"
]
extras = project["optional-dependencies"].values()
wanted = [*project["dependencies"], *(need for extra in extras for need in extra)]
pins = {re.sub(r">=([\d.]+).*", r"==\1", need) for need in wanted if ">=" in need}
# matplotlib 3.9 calls what later versions of it deprecate, on standard error of every first figure.
print("\n".join(sorted({*pins, "pyparsing<3.3"})))
