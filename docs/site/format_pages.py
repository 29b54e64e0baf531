"""The page of log formats and parameter files, made from the tables of the package."""

from pathlib import Path

from allanite.exports import TARGETS
from allanite.readers import FORMATS

HEAD = """# Log formats and parameter files

## Logs

Any delimited text file is read, with or without a header, also packed by gzip. These formats are recognized by their
suffix, by their first lines, or by the files in a folder:

| format | suffixes | columns |
|---|---|---|
"""
EXPORTS = """
A package can add [a log format of its own](own-format.md).

## Parameter files

`allanite export MODEL --format NAME` and `allanite characterize LOG --export NAME` write:

| name | consumer | file |
|---|---|---|
"""


def write(page: Path) -> None:
    """Write the page with one row for each log format and each parameter file."""
    text = HEAD
    for one in sorted(FORMATS, key=lambda f: f.title.lower()):
        suffixes = [*(f"`{s}`" for s in one.suffixes), *(["a folder"] if one.log_in else [])]
        files = ", ".join(suffixes) or "any; by its first lines"
        text += f"| {one.title} | {files} | {one.reads} |\n"
    text += EXPORTS
    for target in TARGETS.values():
        text += f"| `{target.name}` | {target.title} | `{target.file_name}` |\n"
    text += "\nA package can add [a parameter file of its own](own-export.md).\n"
    page.write_text(text, encoding="utf-8")
