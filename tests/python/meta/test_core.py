"""What the house promises about the core."""

from __future__ import annotations

import re
from pathlib import Path

RUST = Path(__file__).parents[3] / "rust"

# Inner modules of a file (tests, code of one processor) are part of it.
PATH = re.compile(r"\b(crate|super)::((?:super::)*)(\{[^}]*\}|\w+)")


def uses(path):
    """Modules named in a file as paths from the root: ("deviation", "sums")."""
    here = path.relative_to(RUST).with_suffix("").parts
    here = here[:-1] if here[-1] in ("mod", "lib") else here
    text = re.sub(r"//.*", "", path.read_text(encoding="utf-8"))
    # `super` of an inner module is the file itself, which stands four blanks further in.
    for line in re.sub(r"\{[^{}]*\}", lambda m: " ".join(m[0].split()), text).splitlines():
        inner = line.startswith("    ") and "use super" in line
        for root, more, names in PATH.findall(line):
            if root == "super" and inner and not more:
                continue
            base = () if root == "crate" else here[: len(here) - 1 - more.count("super") + inner]
            for name in re.findall(r"\w+(?:::\w+)*", names):
                yield base + tuple(name.split("::"))


def circle(graph):
    """Nodes that remain when those that need nobody are taken away, again and again."""
    rest = {node: set(needs) for node, needs in graph.items()}
    while free := {node for node, needs in rest.items() if not needs & rest.keys()}:
        rest = {node: needs for node, needs in rest.items() if node not in free}
    return sorted(rest)


def graph(folder, files):
    """What the modules of a folder need of each other; a folder counts as one module."""
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
