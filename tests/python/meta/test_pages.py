"""The programs on the pages of docs/ run unchanged, and the pages are complete."""

import re
from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.cli import main
from six_axes import six_axes, write_csv

DOCS = Path(__file__).parents[3] / "docs"
PAGES = [
    *(DOCS / f"{n}.md" for n in ("start", "tutorial", "contract")),
    *sorted((DOCS / "howto").glob("*.md")),
]


@pytest.mark.long
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_programs_of_a_page_run(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_csv(six_axes(2000), tmp_path / "imu.csv")
    blocks = re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
    assert blocks
    exec("\n".join(blocks), {})


def test_the_contract_names_every_command(capsys):
    text = (DOCS / "contract.md").read_text(encoding="utf-8")
    with pytest.raises(SystemExit):
        main(["--help"])
    listed = capsys.readouterr().out.split("Commands:")[1]
    commands = re.findall(r"^  ([a-z]+) ", listed, re.MULTILINE)
    assert set(commands) == set(re.findall(r"`allanite ([a-z]+)", text))


def test_links_of_the_readme_lead_somewhere():
    root = DOCS.parent
    text = (root / "README.md").read_text(encoding="utf-8")
    links = re.findall(r"\]\(([^)]+)\)", text)
    assert [link for link in links if not (root / link).exists()] == []


def test_places_of_the_architecture_exist():
    root = DOCS.parent
    text = (root / "ARCHITECTURE.md").read_text(encoding="utf-8")
    table = text.split("## Where to add things")[1]
    named = set(re.findall(r"`((?:\w+/)+[\w.]*|\w+\.(?:py|rs))`", table))
    assert len(named) > 15
    places = [root, root / "python" / "allanite", root / "rust" / "deviation"]
    places += [root / "python" / "allanite" / room for room in ("readers", "exports")]
    assert [name for name in named if not any((p / name).exists() for p in places)] == []


def test_every_effect_can_be_pictured(monkeypatch):
    """The page of an effect draws it with white noise, at the middle of its grids."""
    pytest.importorskip("matplotlib")
    monkeypatch.syspath_prepend(DOCS / "site")
    import effect_pages

    for kind in al.CATALOG:
        plain, whole, _ = effect_pages.beside_white(effect_pages.example(kind))
        assert np.isfinite(plain).all()
        assert whole is None or (whole != plain).any(), kind.kind


def test_the_table_of_validation_is_up_to_date(monkeypatch):
    monkeypatch.syspath_prepend(DOCS)
    import make_validation

    assert make_validation.PAGE.read_text(encoding="utf-8") == make_validation.page(), (
        "run python docs/make_validation.py"
    )
