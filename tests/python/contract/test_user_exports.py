"""A parameter file of an installed package: the example of the docs, and one that is broken."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import allanite as al

DOCS = Path(__file__).parents[3] / "docs" / "own-export.md"


@pytest.fixture
def installed(tmp_path):
    """The example as an installer leaves it."""
    page = DOCS.read_text(encoding="utf-8")
    code = re.search(r"```python\n(.*?)```", page, re.DOTALL)[1]
    folder = tmp_path / "site"
    (folder / "my_package").mkdir(parents=True)
    (folder / "my_package" / "my_filter.py").write_text(code, encoding="utf-8")
    info = folder / "mine-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: mine\nVersion: 1.0\n")
    points = info / "entry_points.txt"
    points.write_text(re.search(r"\[project.(entry-points.*?)```", page, re.DOTALL)[1].replace(
        'entry-points."allanite.exports"]', "[allanite.exports]"
    ).replace('"', ""))  # fmt: skip
    here = str(Path(al.__file__).parents[1])
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join((here, str(folder)))}
    return points, environment


def command(environment, *words):
    return subprocess.run(
        [sys.executable, "-c", "from allanite.cli import main; main()", *words],
        env=environment,
        capture_output=True,
        text=True,
    )


def test_the_command_and_the_page_know_an_export_of_another_package(installed):
    _, environment = installed
    model = ("N(N=0.001)+K(K=1e-6)", "--unit", "rad/s", "--rate", "100")
    answer = command(environment, "export", *model, "--format", "my-filter")
    assert answer.returncode == 0, answer.stderr
    assert "gyro_sigma: 1.000000e-02" in answer.stdout
    program = """
import json, numpy as np, allanite as al
from allanite.page.shown.documents import targets
print(json.dumps(targets(al.Recording(np.zeros(9), 1.0, unit="deg/s"))))
"""
    page = subprocess.run(
        [sys.executable, "-c", program], env=environment, capture_output=True, text=True
    )
    assert ["my-filter.yaml", "My filter"] in json.loads(page.stdout)


@pytest.mark.parametrize(
    ("point", "told"),
    [
        ("mine = my_package.my_filter:render", "not an allanite.exports.Target"),
        ("mine = my_package.missing:TARGET", "No module"),
        ("mine = allanite.exports.filters.kalibr:TARGETS", "not an allanite.exports.Target"),
    ],
)
def test_an_export_that_is_broken_is_left_out_aloud(installed, point, told):
    points, environment = installed
    points.write_text(f"[allanite.exports]\n{point}\n")
    answer = subprocess.run(
        [sys.executable, "-c", "from allanite.exports import TARGETS; print(len(TARGETS))"],
        env=environment, capture_output=True, text=True,
    )  # fmt: skip
    assert answer.returncode == 0
    assert f"the export {point}" in answer.stderr
    assert "of mine was not loaded" in answer.stderr
    assert told in answer.stderr
