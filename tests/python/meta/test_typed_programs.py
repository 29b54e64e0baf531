"""The programs on the pages, in the README and in examples/ pass mypy --strict as the file of a user."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]


@pytest.mark.slow
def test_programs_pass_mypy_strict(tmp_path):
    pytest.importorskip("mypy")
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    for page in pages:
        blocks = re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
        if blocks:
            name = f"page_{page.stem.replace('-', '_')}.py"
            (tmp_path / name).write_text("\n".join(blocks), encoding="utf-8")
    for path in (ROOT / "examples").glob("*.py"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    # Dask has no types of its own: its functions are untyped, whatever a user writes.
    (tmp_path / "mypy.ini").write_text("[mypy]\nstrict = true\nuntyped_calls_exclude = dask\n")
    found = subprocess.run(
        [sys.executable, "-m", "mypy", "--no-incremental", "."],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=500,
    )
    assert found.returncode == 0, found.stdout + found.stderr
