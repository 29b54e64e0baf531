"""Files that the page hands out and takes in."""

from __future__ import annotations

import json
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from allanite.common.errors import AllaniteError, InputError, about
from allanite.common.numbers import number
from allanite.effects.files import model_from_dict
from allanite.fit import fit_model
from allanite.page.source import Reading
from allanite.page.tab import Ladder, Step
from allanite.page.views import VIEWS, figure_of
from allanite.page.words import WORDS
from allanite.plots.words import unit_text
from allanite.study import Rung
from allanite.study.ladder import misfit_left

if TYPE_CHECKING:
    from allanite.common.parameters import Estimate
    from allanite.comparison.datasheet import Row
    from allanite.page.jobs import Job
    from allanite.page.source import Source
    from allanite.page.tab import Tab

__all__ = ["accept", "compare_with", "make", "open_study", "sheet_rows", "study"]

#: What the page asks for when a reader lacks nothing else.
ASKED = ("rate", "unit", "quantity", "column")
SCHEMA = "allanite/page-study/1"

KINDS = {".svg": "image/svg+xml", ".png": "image/png"}
TARGETS = {
    "parameters.json": "json",
    "kalibr.yaml": "kalibr",
    "matlab.m": "matlab",
    "ros.yaml": "ros",
    "vins.yaml": "vins",
    "gtsam.txt": "gtsam",
}


def accept(tab: Tab, source: Source, role: str) -> None:
    """Take an uploaded file: a log to work on (``log``) or to compare with (``compare``), a data sheet (``sheet``).

    Raises
    ------
    InputError
        A log that cannot be read whatever its rate and unit (pickled objects, damaged), no data sheet; nothing is
        kept of it.
    """
    if role == "sheet":
        _accept_sheet(tab, source)
        return
    if role == "compare":
        compare_with(tab, source)
        return
    try:
        source.read(Reading())
    except AllaniteError as error:
        # What only lacks a rate or a unit is asked for; anything else is refused.
        if error.missing not in ASKED:
            raise
    tab.sources.append(source)
    tab.open(len(tab.sources) - 1)


def _accept_sheet(tab: Tab, source: Source) -> None:
    from allanite.comparison.datasheet import read_datasheet

    _ = tab.log
    assert source.path is not None
    with about(source.name, instead=source.path):
        sheet = read_datasheet(source.path)
    # A sheet without a name of its own is called as its file.
    named = sheet.name if sheet.name != source.path.stem else Path(source.name).stem
    tab.sheet = replace(sheet, name=named)
    tab.changed()


def compare_with(tab: Tab, source: Source) -> None:
    """Show the columns of a log beside the one that is looked at.

    Raises
    ------
    InputError
        The log cannot be read, or its rate or unit is not known.
    """
    _ = tab.log
    try:
        other = source.read(source.reading)
    except AllaniteError as error:
        if error.missing not in ASKED:
            raise
        raise InputError(
            f"{source.name}: its rate or unit is not known: open it as a log, say how to read it, then go back and"
            " compare with it"
        ) from None
    names = {name for name, _ in tab.others}
    found = [(f"{source.name} {c.columns[0]}", c) for c in other]
    tab.others += [(name, c) for name, c in found if name not in names]
    tab.changed()


def sheet_rows(tab: Tab) -> dict[str, Any] | None:
    """The data sheet beside the model that is looked at, for a table; None without a sheet."""
    if tab.sheet is None or not tab.ladder.steps:
        return None
    from allanite.comparison.datasheet import compare_datasheet

    try:
        found = compare_datasheet(tab.step.fit, tab.sheet)
    except InputError as error:
        return {"name": tab.sheet.name, "rows": [], "remarks": [error.worded(WORDS)]}
    rows = [
        {
            "figure": row.figure.name.replace("_", " "),
            "sheet": f"{number(row.figure.value, 4)} {unit_text(row.figure.unit)}",
            "measured": _measured(row),
            "ratio": _interval(row.ratio) if row.ratio.detected else "–",
            "remark": row.remark,
        }
        for row in found.rows
    ]
    return {"name": tab.sheet.name, "rows": rows, "remarks": list(found.remarks)}


def _measured(row: Row) -> str:
    """What was measured, in the unit of the sheet."""
    factor = row.figure.value / row.sheet
    unit = unit_text(row.figure.unit)
    if row.measured.detected:
        return f"{number(row.measured.value * factor)} {unit}"
    limit = row.measured.interval
    return "not seen" if limit is None else f"< {number(limit[1] * factor, 2)} {unit}"


def _interval(ratio: Estimate) -> str:
    if ratio.interval is None:
        return number(ratio.value)
    return f"{number(ratio.value)} ({number(ratio.interval[0])} … {number(ratio.interval[1])})"


def make(tab: Tab, name: str, theme: str) -> tuple[bytes, str]:
    """Bytes and media type of a file by its name: a figure, the study, parameters, the report.

    Raises
    ------
    InputError
        An unknown name, or nothing to write yet.
    """
    path = Path(name)
    if path.suffix in KINDS and path.stem in VIEWS:
        with tempfile.TemporaryDirectory(prefix="allanite-page-") as folder:
            target = Path(folder) / f"figure{path.suffix}"
            figure_of(tab, path.stem).save(target, theme)
            return target.read_bytes(), KINDS[path.suffix]
    if name == "study.json":
        return json.dumps(study(tab), indent=1, ensure_ascii=False).encode(), "application/json"
    if name == "report.html":
        return _report(tab).encode(), "text/html; charset=utf-8"
    if name in TARGETS:
        from allanite.export import export
        from allanite.export._axis import axes_of

        axes = axes_of([tab.step.fit.to_dict()])
        return export(axes, TARGETS[name]).encode(), "text/plain; charset=utf-8"
    known = [*(f"{v}.svg" for v in VIEWS), "study.json", "report.html", *TARGETS]
    raise InputError(f"no file {name[:60]!r}: one of {', '.join(known)}")


def _report(tab: Tab) -> str:
    """The ladder up to the rung that is looked at, as a report."""
    from allanite.report import Entry, Report
    from allanite.study import Study

    steps = tab.ladder.steps[: tab.ladder.at + 1]
    last = tab.step.check
    first = steps[0].check if steps else None
    if last is None or first is None:
        rung = 0 if first is None else tab.ladder.at
        raise InputError(
            f"a report says what is missing: let it be looked for at rung {rung} first"
        )
    ending = "adequate" if last.adequate else "stopped by hand"
    study = Study(tab.log, tuple(s.rung for s in steps), last, ending)
    return Report((Entry(study, first, tab.log.oadev()),)).to_html()


def study(tab: Tab) -> dict[str, Any]:
    """The ladder as one JSON document: models with values, not the samples."""
    _ = tab.step
    source = tab.source
    assert source is not None
    return {
        "schema": SCHEMA,
        "log": source.name,
        "column": tab.log.columns[0],
        "recording": tab.log.describe(),
        "at": tab.ladder.at,
        "ladder": [
            {"label": s.label, **s.rung.to_dict(left)}
            for s, left in zip(
                tab.ladder.steps, misfit_left([s.rung for s in tab.ladder.steps]), strict=True
            )
        ],
    }


def open_study(tab: Tab, document: Any) -> None:
    """Fit the models of a saved study to the open log, rung by rung.

    Raises
    ------
    InputError
        Not a study, a damaged one, or one of another kind of sensor; no log is open.
    """
    if not isinstance(document, dict) or document.get("schema") != SCHEMA:
        raise InputError("not a study: a JSON file saved from this page is needed")
    log = tab.log
    rungs = document.get("ladder")
    if not isinstance(rungs, list) or not 0 < len(rungs) <= 100:
        raise InputError("the study holds no ladder")
    try:
        models = [model_from_dict({**r, "schema": "allanite/fit/1"}, "study") for r in rungs]
    except (AttributeError, TypeError, KeyError) as error:
        raise InputError(f"the study is damaged ({error})") from None

    def work(job: Job) -> None:
        steps = []
        for i, (model, rung) in enumerate(zip(models, rungs, strict=True)):
            job.progress(i, len(models))
            step = Step(str(rung.get("label", ""))[:80], Rung(fit_model(log, model)))
            step.error = step.fit.error
            steps.append(step)
        at = document.get("at")
        last = len(steps) - 1
        with tab.change(job):
            tab.push(Ladder(tuple(steps), at if isinstance(at, int) and 0 <= at <= last else last))
        tab.finish(job, tab.step)

    tab.run("opening the study", work)
