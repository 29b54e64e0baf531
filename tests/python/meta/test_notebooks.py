"""The notebooks of docs/ run without errors and are stored with their outputs."""

import json
from pathlib import Path

import pytest

NOTEBOOKS = sorted((Path(__file__).parents[3] / "docs" / "notebooks").glob("*.ipynb"))


def cells(path):
    """Code cells of a notebook."""
    return [c for c in json.loads(path.read_text("utf-8"))["cells"] if c["cell_type"] == "code"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_outputs_are_stored(path):
    """`python docs/make_notebooks.py` runs the cells and stores their outputs."""
    assert cells(path)
    assert all(cell["execution_count"] for cell in cells(path))
    outputs = [output for cell in cells(path) for output in cell["outputs"]]
    assert not [output for output in outputs if output["output_type"] == "error"]
    assert [o for o in outputs if "image/svg+xml" in o.get("data", {})]
    texts = "".join("".join(o.get("text", "")) for o in outputs)
    assert "/tmp" not in texts
    assert "Warning" not in texts


@pytest.mark.long
@pytest.mark.filterwarnings("default")  # the messaging library of notebooks warns
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(path, tmp_path):
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient")
    notebook = nbformat.read(path, as_version=4)
    nbclient.NotebookClient(
        notebook,
        kernel_name="python3",
        timeout=300,
        resources={"metadata": {"path": str(tmp_path)}},
    ).execute()
    # A cell that ends with `.plot()` must show its figure.
    shown = [c for c in notebook.cells if c.cell_type == "code" and c.source.endswith(".plot()")]
    assert shown
    assert all(o.data["image/svg+xml"] for c in shown for o in c.outputs[-1:])


def test_the_site_has_every_notebook():
    site = (NOTEBOOKS[0].parents[1] / "site" / "mkdocs.yml").read_text("utf-8")
    assert [p.stem for p in NOTEBOOKS if f"notebooks/{p.stem}.md" not in site] == []
