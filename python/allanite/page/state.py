"""State of a tab as the browser receives it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from allanite.common.numbers import duration_text
from allanite.common.units import parse_unit
from allanite.effects import standard
from allanite.page.edits import SHEET
from allanite.page.shown.cards import (
    alternatives_sentence,
    cards,
    chips,
    failures,
    most_informative_view,
    step_row,
    step_rows,
)
from allanite.page.shown.documents import sheet_rows, targets
from allanite.page.shown.figures import effect_colors
from allanite.page.shown.offers import capitalized, remedy_buttons
from allanite.page.shown.two_steps import differences
from allanite.page.source import Reading
from allanite.page.words import WORDS
from allanite.plots.words import effect_text, unit_text
from allanite.readers import sensor_kind
from allanite.report.words import count_text

if TYPE_CHECKING:
    from allanite.fit import Fit
    from allanite.page.tab import Tab
    from allanite.page.work import Step, Work

SI = ("rad/s", "m/s^2")
#: Offered units; the command line accepts any other.
UNITS = ("rad/s", "deg/s", "deg/h", "mrad/s", "m/s^2", "g", "mg", "ug", "1")


def state(tab: Tab) -> dict[str, Any]:
    """Dict with the complete state of a tab, except for the curves.

    Before a log is open or a model is fitted or checked, the entries about it are None or empty. A preview replaces the
    fit in ``chips`` and ``model``.
    """
    with tab.lock:
        # Read the version first, so that later changes are noticed next time.
        version, now, board = tab.version, tab.open_work, tab.board
        preview = tab.preview
        place, length = (now.state_index, len(now.history)) if now is not None else (0, 1)
    column_steps = board.columns[board.column]
    step = column_steps.step
    shown = preview or (None if step is None else step.fit)
    study = None if step is None else step.study
    check = None if study is None else study.check
    source = tab.source
    return {
        "version": version,
        **job_state(tab),
        "problem": tab.problem,
        "moving": tab.problem is not None and tab.moving,
        "logs": [s.name for s in tab.sources],
        "log": None if source is None else source.name,
        "log_number": tab.source_index,
        "fixed": source is not None and source.recording is not None,
        "units": [{"value": u, "text": unit_text(u) if u != "1" else "1 (a ratio)"} for u in UNITS],
        "reading": _reading_settings(tab),
        "recording": None if now is None else _recording_record(tab),
        "axes": [] if now is None else _axis_records(tab, now),
        "elsewhere": _axes_of_other_logs(tab),
        "tolerance": tab.tolerance,
        "covariates": [] if now is None else list(now.recording.covariates),
        "chips": []
        if shown is None or now is None
        else chips(
            shown,
            tab.unit,
            effect_colors(now, shown),
            None
            if study is None or study.fit is not shown or not study.adequate
            else study.undecided,
        ),
        "chip_unit": tab.unit,
        "chip_units": [] if shown is None else chip_units(shown.recording.unit),
        "tray": []
        if now is None or step is None
        else _removed_effects(now, board.column, step.fit),
        "model": None if shown is None else str(shown.model),
        "preview": None
        if preview is None
        else {
            "chi2": preview.misfit.reduced,
            "before": None if step is None else step.fit.misfit.reduced,
        },
        "checked": check is not None,
        "adequate": None if study is None else study.adequate,
        "verdict": None
        if study is None or check is None
        else (study if check.adequate else check).verdict,
        "discrepancy": None if step is None else step.fit.discrepancy.percent,
        "within": step is not None and check is not None and tab.is_within_tolerance(step),
        "where": [] if study is None else failures(study),
        "view": None if study is None else most_informative_view(study),
        "alternatives": None if study is None else alternatives_sentence(study),
        "cards": [] if check is None else cards(check, tab.unit),
        "ladder": step_rows(column_steps.steps),
        "at": column_steps.at,
        "undo": place > 0 or (now is not None and now.before is not None),
        "redo": place < length - 1 or (now is not None and now.after is not None),
        "others": [name for name, _ in tab.others],
        "sheet": sheet_rows(tab),
        "beside": differences(tab),
    }


def _reading_settings(tab: Tab) -> dict[str, Any]:
    """Dict of the settings with which the log is read: the user's, else those found by the reader, else None or empty.

    ``unitless`` lists sensors without a unit, and ``said_rate`` is only the user's.
    """
    reading = tab.source.reading if tab.source is not None else Reading()
    found = None if tab.open_work is None else tab.open_work.recording
    return {
        "rate": reading.rate or (None if found is None else found.rate),
        "said_rate": reading.rate,
        "quantity": reading.quantity or (None if found is None else found.quantity),
        "columns": list(reading.columns or (() if found is None else found.columns)),
        "time_column": reading.time_column,
        "unitless": []
        if found is None
        else [
            name
            for name, unit in zip(found.columns, found.units, strict=True)
            if unit == "1" and name not in reading.units and _is_sensor(name)
        ],
        "column_units": {
            **({} if found is None else dict(zip(found.columns, found.units, strict=True))),
            **reading.units,
        },
    }


def _is_sensor(name: str) -> bool:
    """True if a column without a unit belongs to a sensor, judging by its name or the letter of an axis."""
    return sensor_kind(name) is not None or name.strip().lower() in {"x", "y", "z"}


def _column_state(tab: Tab, step: Step | None) -> str:
    """State of a column, given its current step: ``new``, ``fitted``, ``adequate``, ``within`` or ``fails``.

    ``new`` has no fit, and ``fitted`` is not checked yet. ``within`` is not adequate, but within the tolerance.
    """
    if step is None:
        return "new"
    if step.study is None:
        return "fitted"
    if step.study.adequate:
        return "adequate"
    return "within" if tab.is_within_tolerance(step) else "fails"


def _axes_of_other_logs(tab: Tab) -> list[dict[str, Any]]:
    """List of one dict per other opened log, with the names and states of its axes."""
    return [
        {
            "log": place,
            "name": tab.sources[place].name,
            "digest": work.digest,
            "axes": [
                {"name": name, "state": _column_state(tab, column_steps.step)}
                for name, column_steps in zip(
                    work.recording.columns, work.board.columns, strict=True
                )
            ],
        }
        for place, work in sorted(tab.works.items())
        if place != tab.source_index
    ]


def _axis_records(tab: Tab, work: Work) -> list[dict[str, Any]]:
    """List of one dict per column: name, unit, state, steps, model, texts of N, B and K, error, missing effect.

    Model, error and missing effect are None before they are known.
    """
    out = []
    names, units = work.recording.columns, work.recording.units
    for name, unit, column_steps in zip(names, units, work.board.columns, strict=True):
        step = column_steps.step
        check = None if step is None else step.check
        out.append(
            {
                "name": name,
                "unit": unit_text(unit),
                "state": _column_state(tab, step),
                "steps": len(column_steps.steps),
                "model": None if step is None else step.fit.model.name,
                "values": {}
                if step is None
                else {
                    v["symbol"]: f"{v['text']}"
                    for c in chips(step.fit, tab.unit)
                    for v in c["values"]
                    if v["name"] in ("N", "B", "K")
                },
                "error": None
                if step is None or step.error is None
                else _error_text(step_row(step)),
                "missing": None
                if check is None or not check.significant
                else effect_text(check.fit, check.significant[0].effect),
            }
        )
    return out


def _error_text(row: dict[str, Any]) -> str:
    """Text of the Allan error of a step with its expected scatter."""
    return f"{row['error_text']} ({row['chance_text']})"


def _removed_effects(work: Work, column: int, fit: Fit) -> list[dict[str, Any]]:
    """List of one dict (place, kind, name, text) per removed effect of a column whose kind is not in the fitted model."""
    there = {e.kind for e in fit.model}
    return [
        {"place": i, "kind": e.kind, "name": fit.display_name(e), "text": str(e)}
        for i, e in enumerate(work.removed[column])
        if e.kind not in there
    ]


def job_state(tab: Tab) -> dict[str, Any]:
    """Dict with the key ``job``: the progress of the running job, or None.

    It changes without a new version of the state.
    """
    return {"job": None if tab.job is None else tab.job.to_dict()}


def chip_units(unit: str) -> list[dict[str, str]]:
    """List of the offered units of values, dicts with value and text; empty if the samples have no unit."""
    kind = parse_unit(unit).kind
    sheet = [
        e.parameter(name).sheet[kind]
        for name, e in standard().items()
        if kind in e.parameter(name).sheet
    ]
    if not sheet:
        return []
    si = next(u for u in SI if parse_unit(u).kind == kind)
    other = [u for u in (unit, *UNITS) if u != si and parse_unit(u).kind == kind]
    texts = [unit_text(u) for u in sheet]
    return [
        {"value": SHEET, "text": f"{texts[1]}, {texts[2]}, …"},
        {"value": si, "text": f"SI: {unit_text(si)}"},
        *({"value": u, "text": unit_text(u)} for u in dict.fromkeys(other)),
    ]


def _excluded_text(work: Work) -> str:
    """Text `` · from 2 h · 40 s excluded`` on the part of the log that is not analyzed; empty if all is analyzed."""
    span, out = work.part
    said = "" if span is None else f" · from {duration_text(work.whole.duration)}"
    return said + (f" · {duration_text(sum(b - a for a, b in out))} excluded" if out else "")


def _recording_record(tab: Tab) -> dict[str, Any]:
    """Dict that describes the current recording, with the findings of its audit on the current column or on none.

    ``audit`` is empty until the audit is finished; ``audited`` says so.
    """
    now = tab.work
    column, whole = tab.log, now.recording
    every = whole.audit if now.audited else []
    found = [f for f in every if f.column in (None, column.columns[0])]
    return {
        "columns": [
            {"name": n, "unit": unit_text(u)}
            for n, u in zip(whole.columns, whole.units, strict=True)
        ],
        "column": tab.column,
        "digest": now.digest,
        "home": now.whole_digest,
        "targets": targets(whole),
        "span": now.part[0],
        "left_out": [list(one) for one in now.part[1]],
        "audited": now.audited,
        "n": column.n,
        "rate": column.rate,
        "duration": column.duration,
        "unit": unit_text(column.unit),
        "text": f"{count_text(column.n)} samples · {duration_text(column.duration)} at {column.rate:.6g} Hz"
        + _excluded_text(now),
        "audit": [
            {
                "severity": f.severity,
                "message": capitalized(f.worded(WORDS)),
                "offers": remedy_buttons(f, column.rate, column.duration),
            }
            for f in found
        ],
    }
