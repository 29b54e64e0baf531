"""Draw the gallery of real recordings: python docs/make_gallery.py [NAME…], with their folder in ALLANITE_DATA.

It takes some minutes. The recordings were measured by other people and are not part of the project; what is written here
are figures of them and numbers. The page is kept by sections, so that some of them can be made anew.
"""

from __future__ import annotations

import os
import re
import sys
import time
from pathlib import Path

from gallery_records import RECORDS, Record
from pictures import picture

import allanite as al
from allanite._kernels import version
from allanite.common.numbers import number, with_readable_numbers
from allanite.effects import find
from allanite.plots import plot_check, plot_study
from allanite.plots.words import values_text
from allanite.report.words import tone_and_verdict

ROOT = Path(__file__).parents[1]
FOLDER = ROOT / "docs" / "gallery"
PAGE = FOLDER / "README.md"
#: Discrepancy, in per cent, within which a model is good enough for most uses.
WITHIN = 5.0
HEAD = """# Real sensors

Other people made these recordings of sensors at rest, and nobody prepared them for allanite. `make gallery` writes each
section from the results of the program. The expectations were written down before the program saw a recording. The page
also shows expectations that were not met. The recordings are not part of this project; their sources are named.

[Reading the numbers](../reading-the-numbers.md) explains the columns of the tables.
"""


def main(names: list[str]) -> None:
    """Make the sections named, or all."""
    data = Path(os.environ.get("ALLANITE_DATA", ROOT.parent / "shared" / "data"))
    FOLDER.mkdir(exist_ok=True)
    sections = read_sections()
    known = [record.name for record in RECORDS]
    if unknown := set(names) - set(known):
        sys.exit(f"no such section: {', '.join(unknown)} (there are: {', '.join(known)})")
    for record in RECORDS:
        if names and record.name not in names:
            continue
        if not (data / record.file).exists():
            print(f"{record.name}: no {record.file} in {data}, left as it is")
            continue
        began = time.perf_counter()
        sections[record.name] = section(record, data / record.file)
        write(sections)
        print(f"{record.name}: {time.perf_counter() - began:.0f} s", flush=True)


def read_sections() -> dict[str, str]:
    """Sections of the present page by name."""
    if not PAGE.exists():
        return {}
    text = PAGE.read_text(encoding="utf-8")
    found = re.findall(r"<!-- (\w+) -->\n(.*?)(?=<!-- \w+ -->|\Z)", text, re.DOTALL)
    return {name: body.strip() for name, body in found}


def write(sections: dict[str, str]) -> None:
    """Write the page: a list of contents, then the sections in the order of the records."""
    there = [record for record in RECORDS if record.name in sections]
    contents = "\n".join(f"* [{r.title}](#{anchor(r.title)})" for r in there)
    parts = [f"<!-- {r.name} -->\n{sections[r.name]}" for r in there]
    head = f"{HEAD}\n{share([sections[r.name] for r in there])}\n\n{contents}"
    PAGE.write_text("\n\n".join([head, *parts]) + "\n", encoding="utf-8")


def share(sections: list[str]) -> str:
    """Sentences that count the adequate models and the expectations that were met."""
    adequate = sum("Nothing significant is left." in text for text in sections)
    near = 0
    for text in sections:
        rungs = [line for line in text.splitlines() if line.startswith("|") and " × " not in line]
        discrepancy = rungs[-1].split("|")[4].strip()
        near += "Nothing significant is left." not in text and float(discrepancy) <= WITHIN
    hold, fail = (sum(text.count(word) for text in sections) for word in ("| yes |", "| **no** |"))
    believed = sum("| **no** |" not in text for text in sections)
    return (
        f"Stepwise model building was run on {len(sections)} records. In {adequate} records the last model is adequate."
        f" In {near} others the last model differs from the spectrum by at most {WITHIN:g} %. Before the runs,"
        f" {hold + fail} findings were expected; {hold} were found. {believed} records showed every expected finding."
    )


def anchor(title: str) -> str:
    """Anchor of a heading in Markdown."""
    return re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")


def section(record: Record, path: Path) -> str:
    """Markdown of the section on one recording."""
    recording = al.read(path, column=record.column).with_path(record.file)
    # The time limit would make results depend on the load of the machine.
    study = al.improve(recording, record.model, seconds=3600.0)
    first = study.check if len(study.ladder) == 1 else study.ladder[0].fit.check()
    first_png, ladder_png = f"{record.name}-first.png", f"{record.name}-ladder.png"
    picture(plot_check(first), FOLDER / first_png)
    picture(plot_study(study), FOLDER / ladder_png)
    expected = record.expect(recording, first, study)
    _, words = tone_and_verdict(study, first)
    out = [
        f"## {record.title}",
        f"{record.what} *Source: {record.source}.*",
        f"{recording.n} samples at {recording.rate:g} Hz, {recording.unit}. The audit:",
        bullets([f.message for f in recording.audit] or ["nothing odd"]),
        f"**{words}**",
        table(
            ("expected", "found", ""),
            [(e.claim, e.found, "yes" if e.holds else "**no**") for e in expected],
        ),
        f"![Where {record.model} fails]({first_png})",
        "Missing in the first model, best evidence first:",
        bullets(suggestions(first) or ["nothing significant"]),
        f"![The steps of model building]({ladder_png})",
        ladder(study),
        left(study),
    ]
    if record.remark:
        out.append(record.remark(first))
    out.append(f"*allanite {version()}*")
    return "\n\n".join(out)


def suggestions(check: al.Check) -> list[str]:
    """First three suggestions with their parameters and alternatives, as texts."""
    told = []
    for s in check.significant[:3]:
        titles = [cls.title for kind in s.rivals if (cls := find(kind)) is not None]
        rivals = f"; alternatives {', '.join(titles)}" if titles else ""
        numbers = values_text(s.effect, s.estimates)
        told.append(
            f"{check.fit.display_name(s.effect)} ({numbers}; ΔlogL {number(s.delta_log_likelihood)}{rivals})"
        )
    return told


def ladder(study: al.Study) -> str:
    """Table of the steps of model building."""
    rows = []
    for rung, misfit in zip(study.ladder, study.misfit_left, strict=True):
        fit, e = rung.fit, rung.fit.error
        added = ", ".join(rung.changes) or "start"
        worst = "–"
        if e.adev_worst is not None:
            worst = f"×{number(e.adev_worst[0], 3)} at {number(e.adev_worst[1], 3)} s"
        values = (misfit, fit.discrepancy.percent, e.adev_rms_percent, e.predictive_score)
        left_over, discrepancy, rms, score = ("–" if v is None else number(v) for v in values)
        rows.append((added, fit.model.name, left_over, discrepancy, rms, worst, score))
    head = (
        "step",
        "model",
        "unexplained misfit, %",
        "model discrepancy, %",
        "Allan error, % rms",
        "worst ratio",
        "predictive score",
    )
    return table(head, rows)


def left(study: al.Study) -> str:
    """Markdown that states why the search ended and what its last model does not explain."""
    if study.adequate:
        return "Nothing significant is left."
    sentences = bullets([with_readable_numbers(s) for s in study.left])
    return f"The search ended: {study.ending}. Left unexplained:\n\n{sentences}"


def bullets(items: list[str]) -> str:
    """Markdown list."""
    return "\n".join(f"* {item}" for item in items)


def table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """Markdown table."""
    lines = [head, ("---",) * len(head), *rows]
    return "\n".join(f"| {' | '.join(cell.replace('|', '/') for cell in row)} |" for row in lines)


if __name__ == "__main__":
    main(sys.argv[1:])
