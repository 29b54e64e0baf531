"""The notebooks, run, as pages with what their cells show."""

from __future__ import annotations

import tempfile
from typing import TYPE_CHECKING

import nbformat
from nbclient import NotebookClient
from nbconvert import MarkdownExporter
from traitlets.config import Config

if TYPE_CHECKING:
    from pathlib import Path


def write(notebooks: Path, pages: Path) -> None:
    """A page for each notebook, its figures beside it; a cell that fails stops the build."""
    pages.mkdir()
    for path in sorted(notebooks.glob("*.ipynb")):
        notebook = nbformat.read(path, as_version=4)
        with tempfile.TemporaryDirectory() as folder:
            # Sockets in a folder of the user's: TCP on this machine would not be encrypted, and the kernel warns of it.
            client = NotebookClient(
                notebook,
                resources={"metadata": {"path": folder}},
                timeout=300,
                config=Config({"KernelManager": {"transport": "ipc"}}),
            )
            client.execute()
        text, resources = MarkdownExporter().from_notebook_node(notebook)
        for name, figure in resources["outputs"].items():
            own = f"{path.stem}-{name}"
            text = text.replace(f"]({name})", f"]({own})")
            (pages / own).write_bytes(figure)
        (pages / f"{path.stem}.md").write_text(text, encoding="utf-8")
