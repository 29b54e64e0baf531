"""The README leads to files of the repository, also from the page on PyPI."""

import importlib.util
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
#: Target of a Markdown link.
TARGET = re.compile(r"\]\(([^)]+)\)")


@pytest.fixture
def release():
    spec = importlib.util.spec_from_file_location("release", ROOT / "docs" / "release.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_released_readme_links_files_that_exist(release):
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    linked = release.linked(text, "https://example.org/files/")
    assert TARGET.findall(linked)
    for target in TARGET.findall(linked):
        path = target.removeprefix("https://example.org/files/").partition("#")[0]
        assert target.startswith("https://")
        assert path.startswith("https://") or (ROOT / path).exists(), target
    assert "![" not in linked  # a page of files is no picture


def test_a_released_readme_keeps_links_to_the_web_and_to_its_headings(release):
    text = "![a](b.svg) [c](d/e.md#f) [g](#h) [i](https://example.com/j) ![k](https://example.com/l.svg)"
    assert release.linked(text, "https://example.org") == (
        "[a](https://example.org/b.svg) [c](https://example.org/d/e.md#f) [g](#h) "
        "[i](https://example.com/j) ![k](https://example.com/l.svg)"
    )


@pytest.mark.parametrize("version", ["", "1.2", "v1.2.3", "1.2.3rc1"])
def test_a_version_has_three_numbers(release, version):
    assert "three numbers are needed" in release.problems(version)[0]
