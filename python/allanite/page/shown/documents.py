"""Files that the page writes and accepts."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from allanite.common.errors import AllaniteError, InputError, about
from allanite.common.files import OwnedFolder
from allanite.common.units import parse_unit
from allanite.page.edits import deviation_unit
from allanite.page.shown.figures import VIEWS, displayed_fit, figure_of
from allanite.page.shown.jobs import LAWS, thermal_calibration
from allanite.page.shown.tables import csv_of, tables_of
from allanite.page.source import Reading, Uploads
from allanite.page.studies import study_document

if TYPE_CHECKING:
    from collections.abc import Mapping

    from allanite.exports import Target
    from allanite.page.source import Source
    from allanite.page.tab import Tab
    from allanite.recording import Recording

#: Missing facts about a log that the page can ask the user for.
ASKED = ("rate", "unit", "quantity", "column")

KINDS = {".svg": "image/svg+xml", ".png": "image/png", ".csv": "text/csv; charset=utf-8"}
PLAIN_TEXT = "text/plain; charset=utf-8"
#: Kind of unit of the samples of a clock, and of sensors with an unknown unit.
RATIO = parse_unit("1").kind


@dataclass(frozen=True, slots=True)
class GeneratedFile:
    """A generated file: bytes, media type, name, and a note for the user."""

    body: bytes
    kind: str
    name: str
    note: str = ""


def targets(recording: Recording) -> list[list[str]]:
    """List of [file name, title] of the export formats for a log; those of an IMU only if no column has the unit 1."""
    from allanite.exports import TARGETS

    other = any(parse_unit(unit).kind == RATIO for unit in recording.units)
    offered = [target for target in TARGETS.values() if not other or target.any_sensor]
    return [[target.file_name, target.title] for target in offered]


def open_upload(tab: Tab, source: Source, role: str) -> None:
    """Open an uploaded file as its `role` says: ``sheet`` for a data sheet, ``compare`` for a log to compare with.

    With any other role, the file is a log that a job opens. Such a log is added to the list of logs even if its rate or
    unit is unknown. Raises `InputError` if the file cannot be read as this `role`; the tab then keeps nothing of it.
    """
    if role == "sheet":
        _open_sheet(tab, source)
        return
    if role == "compare":
        compare_with(tab, source)
        return
    found = None
    try:
        found = source.read(Reading())
    except AllaniteError as error:
        # The page asks for a missing rate or unit; any other error refuses the file.
        if error.missing not in ASKED:
            raise
    tab.sources.append(source)
    tab.open(len(tab.sources) - 1, found=found)


def _open_sheet(tab: Tab, source: Source) -> None:
    """Set the data sheet of the tab to an uploaded one; a sheet without a name gets that of its file."""
    from allanite.sources.datasheet import read_datasheet

    _ = tab.log
    assert source.path is not None
    with about(source.name, instead=source.path):
        sheet = read_datasheet(source.path)
    named = sheet.name if sheet.name != source.path.stem else Path(source.name).stem
    tab.sheet = replace(sheet, name=named)
    tab.announce_change()


def compare_with(tab: Tab, source: Source) -> None:
    """Add the columns of a log to the comparison with the current column, each named "log column": ``b.csv gyro_x``.

    A column whose name is already compared is not added. Raises `InputError` if the rate or unit of the log is not
    known, or if no log is open.
    """
    _ = tab.log
    try:
        other = source.read(source.reading)
    except AllaniteError as error:
        if error.missing not in ASKED:
            raise
        raise InputError(
            f"{source.name}: rate or unit is unknown: open it as a log, set them, then return and"
            " compare with it"
        ) from None
    names = {name for name, _ in tab.others}
    found = [(f"{source.name} {c.columns[0]}", c) for c in other]
    tab.others += [(name, c) for name, c in found if name not in names]
    tab.announce_change()


def sheet_rows(tab: Tab) -> dict[str, Any] | None:
    """Comparison of model and data sheet: its ``name``, ``rows`` of texts, ``remarks``; None without both.

    ``rows`` is empty if the data sheet has no value for this kind of sensor.
    """
    if tab.sheet is None or not tab.column_steps.steps:
        return None
    from allanite.comparison.datasheet import compare_datasheet

    kind = parse_unit(tab.log.unit).kind
    own = tab.sheet.of_kind(kind)
    if not own.figures:
        return {"name": own.name, "rows": [], "remarks": [f"the sheet has no figure for {kind}"]}
    found = compare_datasheet(tab.step.fit, own)
    names = ("sheet", "measured", "ratio")
    rows = [
        {
            "figure": row.figure.name.replace("_", " "),
            **dict(zip(names, row.texts, strict=True)),
            "remark": row.remark,
        }
        for row in found.rows
    ]
    return {"name": tab.sheet.name, "rows": rows, "remarks": list(found.remarks)}


def generated_file(
    tab: Tab, name: str, theme: str, options: Mapping[str, str] | None = None
) -> GeneratedFile:
    """`GeneratedFile` with this name: a figure or its values, the study, an export, a temperature law, or the report.

    Raises `InputError` if the name is unknown, or if there is nothing to write yet.
    """
    from allanite.exports import TARGETS

    path = Path(name)
    if path.suffix in KINDS and path.stem in VIEWS:
        return _figure_file(tab, path, theme, options)
    if name == "study.json":
        body = json.dumps(study_document(tab), indent=1, ensure_ascii=False).encode()
        return GeneratedFile(body, "application/json", f"{_file_stem(tab)}-study.json")
    if name == "report.html":
        return _report_file(tab)
    if name in LAWS:
        text = thermal_calibration(tab.work.recording).export(LAWS[name])
        return GeneratedFile(text.encode(), PLAIN_TEXT, f"{_file_stem(tab)}-{name}")
    for target in TARGETS.values():
        if target.file_name == name:
            return _export_file(tab, target)
    known = [*(f"{v}.svg" for v in VIEWS), "study.json", "report.html", *LAWS]
    known += [one.file_name for one in TARGETS.values()]
    raise InputError(f"No file {name[:60]!r}: one of {', '.join(known)}")


def _figure_file(
    tab: Tab, path: Path, theme: str, options: Mapping[str, str] | None
) -> GeneratedFile:
    """`GeneratedFile` of a view, whose name is the stem of `path`; the suffix is .svg or .png, or .csv for its values."""
    figure = figure_of(tab, path.stem, options)
    if path.suffix == ".csv":
        unit = deviation_unit(tab.log.unit, tab.unit)
        body = csv_of(tables_of(figure, displayed_fit(tab), unit)).encode()
    else:
        with OwnedFolder(Uploads.KIND) as folder:
            target = folder / f"figure{path.suffix}"
            figure.save(target, theme)
            body = target.read_bytes()
    return GeneratedFile(body, KINDS[path.suffix], f"{_file_stem(tab, tab.log.columns[0])}-{path}")


def _export_file(tab: Tab, target: Target) -> GeneratedFile:
    """`GeneratedFile` with the models of all fitted columns in the format `target`; its note names the other columns.

    Raises `InputError` if no column is fitted.
    """
    from allanite.exports import export

    fits = [s.fit for column_steps in tab.board.columns if (s := column_steps.step) is not None]
    if not fits:
        raise InputError("Nothing is fitted yet: open a log first")
    documents = [
        {
            "schema": "allanite/fit/1",
            "recording": f.recording.describe(),
            **f.body(searched=target.alternatives),
        }
        for f in fits
    ]
    body = export(documents, target.name).encode()
    name = f"{_file_stem(tab)}-{target.file_name}"
    return GeneratedFile(body, PLAIN_TEXT, name, _missing_columns_note(tab))


def _file_stem(tab: Tab, column: str = "") -> str:
    """Stem of file names: the name of the log and, if given, of the column."""
    source = tab.source
    name = Path("log" if source is None else source.name).stem
    return re.sub(r"[^\w.-]+", "_", f"{name}-{column}" if column else name)


def _missing_columns_note(tab: Tab) -> str:
    """Text that names the columns without a fit, which a file cannot contain; an empty text if there are none."""
    columns = tab.work.recording.columns
    gone = [c for c, one in zip(columns, tab.board.columns, strict=True) if not one.steps]
    return f"Without {', '.join(gone)}: not yet checked" if gone else ""


def _report_file(tab: Tab) -> GeneratedFile:
    """`GeneratedFile` with the HTML report on the steps of each column up to the current one.

    Columns without a fit or a finished check are left out and named in the note. Raises `InputError` if no column is
    left.
    """
    from allanite.report import Entry, Report

    entries, open_ = [], []
    columns = tab.work.recording.columns
    for column, column_steps in enumerate(tab.board.columns):
        steps = column_steps.steps[: column_steps.at + 1]
        if not steps:
            continue
        first, last = steps[0].check, steps[-1].study
        if first is None or last is None:
            open_.append(columns[column])
            continue
        ending = "adequate" if last.adequate else "stopped by hand"
        log = tab.work.log(column)
        found = replace(last, ladder=tuple(s.rung for s in steps), stopped_because=ending)
        entries.append(Entry(found, first, log.oadev()))
    if not entries:
        raise InputError("The report needs a finished search: wait until the search ends")
    notes = [
        _missing_columns_note(tab),
        f"Without {', '.join(open_)}: not searched yet" if open_ else "",
    ]
    body = Report(tuple(entries)).to_html().encode()
    name = f"{_file_stem(tab)}-report.html"
    return GeneratedFile(body, "text/html; charset=utf-8", name, ". ".join(n for n in notes if n))
