"""Architecture of the core: modules depend on each other in one direction only."""

from __future__ import annotations

import re
from pathlib import Path

RUST = Path(__file__).parents[3] / "rust"

# Inner modules (tests, code for one processor) belong to their file.
PATH = re.compile(r"\b(crate|super)::((?:super::)*)(\{[^}]*\}|\w+)")


def uses(path):
    """Modules that a file uses, as paths from the root such as ("deviation", "sums")."""
    here = path.relative_to(RUST).with_suffix("").parts
    here = here[:-1] if here[-1] in ("mod", "lib") else here
    text = re.sub(r"//.*", "", path.read_text(encoding="utf-8"))
    # In an inner module, which is indented, `super` is the file itself.
    for line in re.sub(r"\{[^{}]*\}", lambda m: " ".join(m[0].split()), text).splitlines():
        inner = line.startswith("    ") and "use super" in line
        for root, more, names in PATH.findall(line):
            if root == "super" and inner and not more:
                continue
            base = () if root == "crate" else here[: len(here) - 1 - more.count("super") + inner]
            for name in re.findall(r"\w+(?:::\w+)*", names):
                yield base + tuple(name.split("::"))


def circle(graph):
    """Nodes of a dependency graph that belong to or depend on a cycle: those left after removing leaves repeatedly."""
    rest = {node: set(needs) for node, needs in graph.items()}
    while free := {node for node, needs in rest.items() if not needs & rest.keys()}:
        rest = {node: needs for node, needs in rest.items() if node not in free}
    return sorted(rest)


def graph(folder, files):
    """Dependencies between the modules of a folder; a subfolder counts as one module."""
    depth = len(folder)
    needs = {}
    for path in files:
        place = path.relative_to(RUST).with_suffix("").parts
        if place[:depth] != folder or len(place) == depth or place[depth] in ("mod", "lib"):
            continue
        to = {u[depth] for u in uses(path) if u[:depth] == folder and len(u) > depth}
        needs.setdefault(place[depth], set()).update(to - {place[depth]})
    return {name: to & needs.keys() for name, to in needs.items()}


def test_modules_of_the_core_depend_one_way():
    files = sorted(RUST.rglob("*.rs"))
    folders = {path.parent.relative_to(RUST).parts for path in files}
    circles = {"/".join(folder): circle(graph(folder, files)) for folder in folders}
    assert {folder: names for folder, names in circles.items() if names} == {}


def test_a_circle_is_found(tmp_path, monkeypatch):
    monkeypatch.setattr(
        "test_core.RUST" if __name__ == "test_core" else f"{__name__}.RUST", tmp_path
    )
    (tmp_path / "a.rs").write_text(
        "use crate::{\n    b::thing,\n    Error,\n};\n", encoding="utf-8"
    )
    (tmp_path / "b.rs").write_text("mod inner {\n    use super::x;\n}\n", encoding="utf-8")
    files = sorted(tmp_path.rglob("*.rs"))
    assert graph((), files) == {"a": {"b"}, "b": set()}
    (tmp_path / "b.rs").write_text("fn f() { crate::a::thing() }\n", encoding="utf-8")
    assert circle(graph((), files)) == ["a", "b"]
