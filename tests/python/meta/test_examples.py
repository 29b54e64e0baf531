"""The examples and the README run as they stand."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

ROOT = Path(__file__).parents[3]


def test_mathworks_example_finds_what_its_last_paragraph_misses(capsys):
    module = runpy.run_path(str(ROOT / "examples" / "mathworks.py"))
    study = module["main"](hours=2.0)
    added = {rung.added.kind for rung in study.ladder if rung.added is not None}
    assert "quantization" in added
    assert "nearest slopes" in capsys.readouterr().out


def test_readme_example_runs():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    code = re.search(r"```python\n(.*?)```", text, re.DOTALL)
    assert code is not None
    names: dict[str, object] = {}
    exec(code[1], names)
    kinds = [rung.added.kind for rung in names["study"].ladder[1:]]
    assert kinds == ["gauss_markov"]
    assert names["fit"]["N"].to("deg/sqrt(h)").unit == "deg/sqrt(h)"
