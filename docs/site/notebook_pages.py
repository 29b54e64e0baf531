"""The notebooks, run, as pages with what their cells show."""

from __future__ import annotations

import tempfile
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from nbconvert import MarkdownExporter
from traitlets.config import Config


def write(notebooks: Path, pages: Path) -> None:
    """A page for each notebook, its figures beside it; a cell that fails stops the build."""
    pages.mkdir()
    for path in sorted(notebooks.glob("*.ipynb")):
        notebook = nbformat.read(path, as_version=4)
        with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as sockets:
            # TCP is not encrypted, and the kernel warns of it. The path is absolute: the kernel runs in another folder.
            ipc = {"transport": "ipc", "ip": str(Path(sockets) / "kernel")}
            client = NotebookClient(
                notebook,
                resources={"metadata": {"path": folder}},
                timeout=300,
                config=Config({"KernelManager": ipc}),
            )
            client.execute()
        text, resources = MarkdownExporter().from_notebook_node(notebook)
        for name, figure in resources["outputs"].items():
            own = f"{path.stem}-{name}"
            text = text.replace(f"]({name})", f"]({own})")
            (pages / own).write_bytes(figure)
        (pages / f"{path.stem}.md").write_text(text, encoding="utf-8")
