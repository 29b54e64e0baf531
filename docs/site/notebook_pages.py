"""Pages of the notebooks with their stored outputs (`docs/make_notebooks.py` stores them)."""

from __future__ import annotations

from pathlib import Path

import nbformat
from nbconvert import MarkdownExporter


def write(notebooks: Path, pages: Path) -> None:
    """Write a page for each notebook, and its figures next to the page."""
    pages.mkdir()
    for path in sorted(notebooks.glob("*.ipynb")):
        notebook = nbformat.read(path, as_version=4)
        text, resources = MarkdownExporter().from_notebook_node(notebook)
        for name, figure in resources["outputs"].items():
            own = f"{path.stem}-{name}"
            text = text.replace(f"]({name})", f"]({own})")
            (pages / own).write_bytes(figure)
        (pages / f"{path.stem}.md").write_text(text, encoding="utf-8")
