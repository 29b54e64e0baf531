"""Run the notebooks and store their outputs: python docs/make_notebooks.py [NAME …] (a minute)."""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from traitlets.config import Config

NOTEBOOKS = Path(__file__).parent / "notebooks"
#: Forms of an output that are kept, the first of them that exists: figures, tables, text.
KEPT = ("image/svg+xml", "text/html", "text/plain")
#: Settings of the figures: the same identifiers in each run, so that a figure changes only with its contents.
FIGURES = "svg.hashsalt: allanite\n"


def executed(path: Path) -> nbformat.NotebookNode:
    """The notebook with the outputs of a run in an empty folder."""
    notebook = nbformat.read(path, as_version=4)
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as sockets:
        settings = Path(sockets) / "matplotlibrc"
        settings.write_text(FIGURES, encoding="utf-8")
        # Unlike TCP, this transport needs no encryption, so the kernel does not warn.
        ipc = {"transport": "ipc", "ip": str(Path(sockets) / "kernel")}
        client = NotebookClient(
            notebook,
            resources={"metadata": {"path": folder}},
            timeout=300,
            config=Config({"KernelManager": ipc}),
        )
        client.execute(env={**os.environ, "MATPLOTLIBRC": str(settings)})
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)  # times of this run
        for output in cell.get("outputs", []):
            if "data" in output:
                form = next(name for name in KEPT if name in output["data"])
                output["data"] = {form: output["data"][form]}
    notebook.metadata["language_info"] = {"name": "python"}
    return notebook


def main() -> None:
    """Run the named notebooks, or all."""
    names = sys.argv[1:] or sorted(path.stem for path in NOTEBOOKS.glob("*.ipynb"))
    for name in names:
        path = NOTEBOOKS / f"{name}.ipynb"
        nbformat.write(executed(path), path)
        print(f"{path.name}: {path.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
