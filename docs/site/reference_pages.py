"""The Python names and the JSON Schemas, from the package itself."""

from __future__ import annotations

import inspect
import json
import re
from importlib.resources import files
from typing import TYPE_CHECKING

import allanite as al
from allanite.effects import Effect

if TYPE_CHECKING:
    from pathlib import Path

#: Pages by the room in which a name lives; every other room has a page of its own name.
ROOMS = {"common": "errors and numbers", "axes": "all axes", "deviation": "deviations"}


def write(pages: Path) -> None:
    """A page for each room of the package, and one of the schemas."""
    rooms: dict[str, list[str]] = {}
    for name in al.__all__:
        thing = getattr(al, name)
        if callable(thing) and not (
            isinstance(thing, type) and issubclass(thing, Effect) and thing is not Effect
        ):
            room = thing.__module__.split(".")[1]
            rooms.setdefault(ROOMS.get(room, room), []).append(name)
    folder = pages / "api"
    folder.mkdir()
    index = [
        "# Python",
        "",
        "The examples begin with `import allanite as al` and `import numpy as np`. The classes of effects have [pages of their own](../effects/index.md).",
        "",
    ]
    for room in sorted(rooms):
        file = room.replace(" ", "-") + ".md"
        names = sorted(rooms[room], key=lambda n: (n[0].isupper(), n))
        links = ", ".join(f"[`al.{n}`]({file}#{n.lower()})" for n in names)
        index.append(f"* **{room}**: {links}")
        parts = [described(n, getattr(al, n)) for n in names]
        text = f"# {room[0].upper()}{room[1:]}\n\n" + "\n\n".join(parts) + "\n"
        (folder / file).write_text(text, encoding="utf-8")
    (folder / "index.md").write_text("\n".join(index) + "\n", encoding="utf-8")
    (pages / "schemas.md").write_text(schemas(pages), encoding="utf-8")


def described(name: str, thing: object) -> str:
    """One public name: its call, its docstring, and the methods of a class."""
    parts = [f"## {name} {{#{name.lower()}}}", call(f"al.{name}", thing), markdown(thing)]
    if inspect.isclass(thing):
        for method, member in sorted(vars(thing).items()):
            raw = member.__func__ if isinstance(member, (classmethod, staticmethod)) else member
            doc = inspect.getdoc(raw)
            if (
                method.startswith("_")
                or not doc
                or not (callable(raw) or isinstance(raw, property))
            ):
                continue
            parts.append(f"### .{method} {{#{name.lower()}-{method.lower()}}}")
            if callable(raw):
                parts.append(call(f".{method}", raw))
            parts.append(markdown(raw))
    return "\n\n".join(p for p in parts if p)


def call(name: str, thing: object) -> str:
    """How it is called."""
    try:
        signature = inspect.signature(thing)
    except (TypeError, ValueError):
        return ""
    names = [p for p in signature.parameters.values() if p.name != "self"]
    plain = [p.replace(annotation=inspect.Parameter.empty) for p in names]
    text = str(signature.replace(parameters=plain, return_annotation=inspect.Signature.empty))
    return f"```python\n{name}{text}\n```"


def markdown(thing: object) -> str:
    """A numpy docstring as Markdown: sections in bold, entries as lists, examples as code."""
    lines = (inspect.getdoc(thing) or "").splitlines()
    out: list[str] = []
    section, code = "", False
    for i, line in enumerate(lines):
        if re.fullmatch(r"-{3,}", line) and i:
            continue
        if i + 1 < len(lines) and re.fullmatch(r"-{3,}", lines[i + 1]):
            section = line
            out += ["", f"**{line}**", ""]
            continue
        if line.startswith(">>>") and not code:
            out += ["", "```pycon"]
            code = True
        elif code and not line.strip():
            out.append("```")
            code = False
        entry = section in {"Parameters", "Attributes", "Returns", "Raises", "Yields"}
        if not code and entry and line and not line.startswith(" "):
            head, _, kind = line.partition(" : ")
            out.append(f"* `{head}`" + (f" {kind}" if kind else ""))
        elif not code and entry and line.strip():
            out.append(f"    {line.strip()}")
        else:
            out.append(line)
    return "\n".join([*out, "```"] if code else out)


def schemas(pages: Path) -> str:
    """What each document is, and the files themselves."""
    target = pages / "schemas"
    target.mkdir()
    rows = ["| schema | document | file |", "|---|---|---|"]
    for path in sorted((files("allanite") / "schemas").iterdir(), key=lambda p: p.name):
        text = path.read_text("utf-8")
        schema = json.loads(text)
        (target / path.name).write_text(text, encoding="utf-8")
        name = schema["$id"].removeprefix("urn:").replace(":", "/")
        rows.append(f"| `{name}` | {schema['title']} | [{path.name}](schemas/{path.name}) |")
    return f"""# JSON schemas

Every command with `--json`, and every `to_dict()`, writes a document whose `schema` names one of these (JSON Schema 2020-12). They are in the
package (`importlib.resources.files("allanite") / "schemas"`), and its tests hold what the commands write against them. Their `$ref`s are URNs: give all files
to the validator as one registry.

{chr(10).join(rows)}

```python
import json
from importlib.resources import files

from jsonschema import Draft202012Validator
from referencing import Registry, Resource

schemas = {{p.name: json.loads(p.read_text("utf-8")) for p in (files("allanite") / "schemas").iterdir()}}
registry = Registry().with_resources((s["$id"], Resource.from_contents(s)) for s in schemas.values())
Draft202012Validator(schemas["fit.json"], registry=registry).validate(document)
```
"""
