"""Pages generated from the package: anchors are unique, and links lead to anchors."""

import importlib.util
import re
from pathlib import Path

import pytest

SITE = Path(__file__).parents[3] / "docs" / "site"


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """Text of each generated page by file name."""
    spec = importlib.util.spec_from_file_location("reference_pages", SITE / "reference_pages.py")
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    folder = tmp_path_factory.mktemp("pages")
    made.write(folder)
    return {p.name: p.read_text("utf-8") for p in (folder / "api").iterdir()}


def ids(text):
    """Anchors of a page."""
    return re.findall(r"\{#(\S+)\}$", text, re.MULTILINE)


def test_no_two_entries_have_one_place(pages):
    for name, text in pages.items():
        assert len(set(ids(text))) == len(ids(text)), name
    assert {"al.plan", "al.Plan"} <= set(ids(pages["planning.md"]))


def test_links_lead_to_an_entry(pages):
    links = [
        link for text in pages.values() for link in re.findall(r"\]\(([\w-]+\.md)#(\S+?)\)", text)
    ]
    assert len(links) > 80
    assert not [(file, place) for file, place in links if place not in ids(pages[file])]


@pytest.mark.parametrize(
    "name",
    ["allanite.simulate.simulate", "allanite.testing.check_effect", "allanite.effects.Parameter"],
)
def test_what_others_send_the_reader_to_is_there(pages, name):
    assert any(name in ids(text) for text in pages.values())
