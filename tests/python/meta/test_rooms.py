"""What the rooms promise of each other: one way between modules, kinds named by their own files, paths that are there."""

from __future__ import annotations

import ast
import re
import tomllib
from pathlib import Path

import allanite as al

ROOT = Path(__file__).parents[3]
PACKAGE = ROOT / "python" / "allanite"
#: Words that are a kind and something else too: where they are the other thing.
OTHERWISE = {
    "covariate": "an option: which column is one",
    "unexplained": "a verdict of a check",
    "outliers": "a finding of the audit",
    "bandwidth": "a figure of a data sheet",
}


def _name(path):
    parts = ("allanite", *path.relative_to(PACKAGE).with_suffix("").parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def _imports(path, known):
    """Modules of the package that a file imports, inside functions too; imports for types alone do not count."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    typing = {
        id(inner)
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
        for inner in ast.walk(node)
    }
    for node in ast.walk(tree):
        if id(node) not in typing and isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                full = f"{node.module}.{alias.name}"
                yield full if full in known else node.module


def _circle(graph):
    """Nodes that need each other: what is left when those that need nobody are taken away, again and again."""
    rest = {node: set(needs) for node, needs in graph.items()}
    while free := {node for node, needs in rest.items() if not needs & rest.keys()}:
        rest = {node: needs for node, needs in rest.items() if node not in free}
    return sorted(rest)


def _graph():
    files = {_name(path): path for path in PACKAGE.rglob("*.py")}
    return {name: set(_imports(path, files)) for name, path in files.items()}


def _room(graph, room):
    """What the modules of a room need of each other; a folder in it counts as one."""
    inside = {name: needs for name, needs in graph.items() if name.startswith(f"{room}.")}
    out = {}
    for name, needs in inside.items():
        short = name.removeprefix(f"{room}.").split(".")[0]
        own = {n.removeprefix(f"{room}.").split(".")[0] for n in needs if n.startswith(f"{room}.")}
        out.setdefault(short, set()).update(own - {short})
    return out


def test_modules_of_a_room_depend_one_way():
    graph = _graph()
    # The verbs of results reach forward, from one module. An effect plus an effect is a model: these two know each other.
    del graph["allanite.common.verbs"]
    graph["allanite.effects._base"].discard("allanite.effects.model")
    rooms = {"allanite"} | {n.rsplit(".", 1)[0] for n in graph if n.count(".") > 1}
    circles = {room: _circle(_room(graph, room)) for room in sorted(rooms)}
    assert {room: names for room, names in circles.items() if names} == {}


def test_a_circle_is_found():
    assert _circle({"a": {"b"}, "b": {"a"}, "c": {"a"}, "d": set()}) == ["a", "b", "c"]


def test_few_lines_outside_effects_name_a_kind():
    kinds = {cls.kind for cls in al.CATALOGUE} - OTHERWISE.keys()
    classes = {cls.__name__ for cls in al.CATALOGUE}
    homes = {cls.__module__ for cls in al.CATALOGUE}
    found = []
    for path in PACKAGE.rglob("*.py"):
        place = path.relative_to(PACKAGE)
        # What the package offers by name stands in its own `__init__`.
        if place.parts[0] == "effects" or place == Path("__init__.py"):
            continue
        tree = ast.parse(path.read_text(encoding="utf-8"))
        imported = [
            n for n in ast.walk(tree) if isinstance(n, ast.ImportFrom) and n.module in homes
        ]
        names = {alias.asname or alias.name for node in imported for alias in node.names} & classes
        lines = {node.lineno for node in imported}
        for node in ast.walk(tree):
            if isinstance(node, ast.Constant) and node.value in kinds:
                lines.add(node.lineno)
            if isinstance(node, ast.Name) and node.id in names:
                lines.add(node.lineno)
        found += [f"{place}:{line}" for line in sorted(lines)]
    assert len(found) <= 8, found


def test_few_imports_are_ignored():
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    contracts = tomllib.loads(text)["tool"]["importlinter"]["contracts"]
    ignored = [line for contract in contracts for line in contract.get("ignore_imports", ())]
    assert len(ignored) <= 3
    assert all(line.startswith("allanite.common.verbs -> ") for line in ignored)
    assert all(contract["exhaustive"] for contract in contracts)


def test_no_text_of_an_exception_is_searched():
    searching = {
        "startswith",
        "endswith",
        "find",
        "index",
        "count",
        "lower",
        "replace",
        "partition",
    }
    found = []
    for path in PACKAGE.rglob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        for handler in ast.walk(tree):
            if not isinstance(handler, ast.ExceptHandler) or handler.name is None:
                continue
            told = {f"str({handler.name})", f"{handler.name}.args[0]", f"repr({handler.name})"}
            # A variable that has the text is the text.
            for node in ast.walk(handler):
                if isinstance(node, ast.Assign) and ast.unparse(node.value) in told:
                    told |= {ast.unparse(target) for target in node.targets}
            for node in ast.walk(handler):
                parts = []
                if isinstance(node, ast.Compare):
                    parts = [node.left, *node.comparators]
                elif isinstance(node, ast.Attribute) and node.attr in searching:
                    parts = [node.value]
                elif isinstance(node, ast.Call) and ast.unparse(node.func).startswith("re."):
                    parts = node.args
                if any(ast.unparse(part) in told for part in parts):
                    found.append(f"{path.relative_to(PACKAGE)}:{node.lineno}")
    assert not found


def test_what_was_dead_or_double_is_gone():
    """One name, one thing; what was kept twice or for nobody is not back."""
    text = "\n".join(p.read_text(encoding="utf-8") for p in PACKAGE.rglob("*.py"))
    for gone in ("terms_model", "of_measured"):
        assert gone not in text, gone
    engine = (PACKAGE / "fit" / "engine.py").read_text(encoding="utf-8")
    assert "components" not in engine
    for once in ("def fill_gaps", "class Source", "class Figure", "class Curve"):
        assert len(re.findall(rf"^{once}\b", text, re.MULTILINE)) <= 1, once
    assert len(re.findall(r"^LINES\b", text, re.MULTILINE)) <= 1


def _paths(text):
    """What is named as a file or a folder, with the place that the first of a row gives those after it."""
    return [p for p in re.findall(r"`([\w./]+(?:\.py|\.rs|\.toml|\.md|/))`", text) if "/" in p]


def test_what_the_map_names_is_there():
    text = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    bases = (ROOT, PACKAGE, PACKAGE / "readers", PACKAGE / "export")
    alone = [p.name for p in PACKAGE.rglob("*")]
    missing = [
        path
        for path in _paths(text)
        if not any((base / path).exists() for base in bases) and path.rstrip("/") not in alone
    ]
    assert not missing


def test_the_ways_of_three_things_are_those_of_the_code():
    text = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    ways = text[
        text.index("## The way of three things") : text.index("## What a new thing touches")
    ]
    # A file, then what it holds of the thing.
    steps = re.findall(r"`([\w/]+\.(?:py|rs))`(?: `([\w.]+)`)?", ways)
    assert len(steps) >= 12
    for path, thing in steps:
        file = (ROOT if path.startswith("rust/") else PACKAGE) / path
        assert file.exists(), path
        word = thing.split(".")[-1]
        assert not word or re.search(rf"\b{word}\b", file.read_text(encoding="utf-8")), (
            path,
            thing,
        )
