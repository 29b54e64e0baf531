"""The Python names and the JSON Schemas, from the package itself."""

from __future__ import annotations

import inspect
import json
import re
from importlib import import_module
from importlib.resources import files
from typing import TYPE_CHECKING

import allanite as al
from allanite.effects import Effect

if TYPE_CHECKING:
    from pathlib import Path

#: Pages by the room in which a name lives; every other room has a page of its own name.
ROOMS = {
    "_kernels": "memory",
    "axes": "all axes",
    "common": "errors and numbers",
    "deviation": "deviations",
}
#: What the pages send the reader to, and what `allanite` itself does not offer: they stand under their full names.
EXTRA = (
    "allanite.effects.Deterministic",
    "allanite.effects.Modifier",
    "allanite.effects.Parameter",
    "allanite.effects.Periodic",
    "allanite.effects.Stochastic",
    "allanite.plots.Figure",
    "allanite.plots.plot_check",
    "allanite.plots.plot_compare",
    "allanite.plots.plot_deviation",
    "allanite.plots.plot_dynamic",
    "allanite.plots.plot_fit",
    "allanite.plots.plot_recording",
    "allanite.plots.plot_study",
    "allanite.scale.summarize",
    "allanite.simulate.simulate",
    "allanite.simulate.simulate_chunks",
    "allanite.statespace.state_space",
    "allanite.suggestion.check_fit",
    "allanite.testing.check_effect",
)


def named() -> dict[str, object]:
    """What has an entry, by the name under which a program calls it."""
    ours = {f"al.{name}": getattr(al, name) for name in al.__all__}
    things = {name: thing for name, thing in ours.items() if callable(thing) and not _kind(thing)}
    for name in EXTRA:
        module, _, last = name.rpartition(".")
        things[name] = getattr(import_module(module), last)
    return things


def _kind(thing: object) -> bool:
    """Whether it is an effect of the catalogue: those have pages of their own."""
    return isinstance(thing, type) and issubclass(thing, Effect) and thing is not Effect


def write(pages: Path) -> None:
    """A page for each room of the package, and one of the schemas."""
    rooms: dict[str, dict[str, object]] = {}
    for name, thing in named().items():
        room = thing.__module__.split(".")[1]
        rooms.setdefault(ROOMS.get(room, room), {})[name] = thing
    folder = pages / "api"
    folder.mkdir()
    index = [
        "# Python",
        "",
        "The examples begin with `import allanite as al` and `import numpy as np`. The classes of effects have [pages of their own](../effects/index.md).",
        "",
    ]
    texts, places = {}, {}
    for room, things in sorted(rooms.items()):
        file = room.replace(" ", "-") + ".md"
        names = sorted(things, key=lambda n: (n.count("."), n.rpartition(".")[2][0].isupper(), n))
        links = ", ".join(f"[`{n}`]({file}#{n})" for n in names)
        index.append(f"* **{room}**: {links}")
        parts = [described(n, things[n]) for n in names]
        texts[file] = f"# {room[0].upper()}{room[1:]}\n\n" + "\n\n".join(parts) + "\n"
        places |= dict.fromkeys(re.findall(r"^##+ .* \{#(.*)\}$", texts[file], re.M), file)
    for file, text in texts.items():
        (folder / file).write_text(linked(text, places), encoding="utf-8")
    (folder / "index.md").write_text("\n".join(index) + "\n", encoding="utf-8")
    (pages / "schemas.md").write_text(schemas(pages), encoding="utf-8")


def linked(text: str, places: dict[str, str]) -> str:
    """The text with a link where it names something that has an entry: `Model.fit`, `allanite.psd`."""

    def link(found: re.Match[str]) -> str:
        name = found[1]
        target = next((n for n in (name, f"al.{name}") if n in places), None)
        short = f"al.{name.removeprefix('allanite.')}"
        target = target or (short if short in places else None)
        return f"[`{name}`]({places[target]}#{target})" if target else found[0]

    # A word without a dot is a parameter, whatever function has its name.
    parts = re.split(r"(^```.*?^```)", text, flags=re.M | re.S)
    return "".join(
        part if i % 2 else re.sub(r"(?<!`)`([A-Za-z]\w*(?:\.\w+)+)`(?!`)", link, part)
        for i, part in enumerate(parts)
    )


def described(name: str, thing: object) -> str:
    """One public name: its call, its docstring, and the methods of a class."""
    title = name.removeprefix("al.")
    parts = [f"## {title} {{#{name}}}", call(name, thing), markdown(thing)]
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
            parts.append(f"### .{method} {{#{name}.{method}}}")
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
    names = [p for p in signature.parameters.values() if p.name not in {"self", "cls"}]
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
