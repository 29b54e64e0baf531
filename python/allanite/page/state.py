"""State of a tab as the browser receives it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from allanite.common.numbers import count_text, duration_text
from allanite.common.units import SI_UNITS, parse_unit
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
from allanite.page.shown.deviations import KINDS
from allanite.page.shown.documents import sheet_rows, targets
from allanite.page.shown.figures import effect_colors
from allanite.page.shown.offers import capitalized, remedy_buttons
from allanite.page.shown.two_steps import differences
from allanite.page.source import Reading
from allanite.page.words import WORDS
from allanite.plots.words import effect_text, unit_text
from allanite.recording.sensor_names import sensor_kind

if TYPE_CHECKING:
    from allanite.fit import Fit
    from allanite.page.tab import Tab
    from allanite.page.work import Step, Work

#: Offered units; the command line accepts any other.
UNITS = ("rad/s", "deg/s", "deg/h", "mrad/s", "m/s^2", "g", "mg", "ug", "1")


def state(tab: Tab) -> dict[str, Any]:
    """Dict with the complete state of a tab, except for the curves; entries are None or empty before they are known."""
    with tab.lock:
        # Read the version first, so that later changes are noticed next time.
        version, now, board, preview = tab.version, tab.open_work, tab.board, tab.preview
        place, length = (now.state_index, len(now.history)) if now is not None else (0, 1)
    column_steps = board.columns[board.column]
    step = column_steps.step
    return {
        "version": version,
        **job_state(tab),
        **_log_entries(tab, now),
        **_model_entries(tab, now, board.column, step, preview),
        **_check_entries(tab, step),
        "chip_unit": tab.unit,
        "tolerance": tab.tolerance,
        "ladder": step_rows(column_steps.steps),
        "at": column_steps.at,
        "undo": place > 0 or (now is not None and now.before is not None),
        "redo": place < length - 1 or (now is not None and now.after is not None),
        "others": [name for name, _ in tab.others],
        "sheet": sheet_rows(tab),
        "beside": differences(tab),
    }


def _log_entries(tab: Tab, now: Work | None) -> dict[str, Any]:
    """Entries of `state` about the logs, the open recording and its axes; `now` is the work on it, or None.

    Entries about the open recording are None or empty if `now` is None.
    """
    source = tab.source
    return {
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
        "covariates": [] if now is None else list(now.recording.covariates),
    }


def _model_entries(
    tab: Tab, now: Work | None, column: int, step: Step | None, preview: Fit | None
) -> dict[str, Any]:
    """Entries of `state` about the model of the current step; a `preview` with trial values replaces its fit.

    All entries are None or empty without a step or an open log.
    """
    if step is None or now is None:
        empty: dict[str, Any] = {"chips": [], "chip_units": [], "tray": [], "model": None}
        return {**empty, "preview": None, "discrepancy": None}
    fit, study = preview or step.fit, step.study
    explained = study is not None and study.fit is fit and study.adequate
    tried = None
    if preview is not None:
        tried = {"chi2": preview.misfit.reduced, "before": step.fit.misfit.reduced}
    return {
        "chips": chips(
            fit,
            tab.unit,
            effect_colors(now, fit),
            study.undecided if study is not None and explained else None,
        ),
        "chip_units": chip_units(fit.recording.unit),
        "tray": _removed_effects(now, column, step.fit),
        "model": str(fit.model),
        "preview": tried,
        "discrepancy": step.fit.discrepancy.percent,
    }


def _check_entries(tab: Tab, step: Step | None) -> dict[str, Any]:
    """Dict of the entries of `state` about the check of the current step; None, False or empty before the check."""
    if step is None or step.study is None:
        return {
            "checked": False,
            "adequate": None,
            "verdict": None,
            "within": False,
            "where": [],
            "view": None,
            "alternatives": None,
            "cards": [],
        }
    study, check = step.study, step.study.check
    return {
        "checked": True,
        "adequate": study.adequate,
        "verdict": (study if check.adequate else check).verdict,
        "within": tab.is_within_tolerance(step),
        "where": failures(study),
        "view": most_informative_view(study),
        "alternatives": alternatives_sentence(study),
        "cards": cards(check, tab.unit),
    }


def _reading_settings(tab: Tab) -> dict[str, Any]:
    """Settings with which the log is read: the user's, else those found by the reader, else None or empty.

    ``unitless`` lists columns that belong to a sensor and have no unit. ``said_rate`` (Hz) and ``time_column`` are the
    user's only.
    """
    reading = tab.source.reading if tab.source is not None else Reading()
    given = reading.options
    found = None if tab.open_work is None else tab.open_work.recording
    units = {} if found is None else dict(zip(found.columns, found.units, strict=True))
    return {
        "rate": given.rate_hz or (None if found is None else found.rate),
        "said_rate": given.rate_hz,
        "quantity": given.quantity or (None if found is None else found.quantity),
        "columns": list(given.columns or (() if found is None else found.columns)),
        "time_column": given.time_column,
        "unitless": [
            name
            for name, unit in units.items()
            if unit == "1" and name not in reading.units and _is_sensor(name)
        ],
        "column_units": {**units, **reading.units},
    }


def _is_sensor(name: str) -> bool:
    """True if a column without a unit belongs to a sensor, judging by its name or the letter of an axis."""
    return sensor_kind(name) is not None or name.strip().lower() in {"x", "y", "z"}


def _column_state(tab: Tab, step: Step | None) -> str:
    """State of a column: ``new``, ``fitted`` (not checked), ``adequate``, ``within`` (the tolerance) or ``fails``."""
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
    """One dict per column: name, unit, state, steps, model, values, error, missing effect; None before known."""
    out = []
    names, units = work.recording.columns, work.recording.units
    for name, unit, column_steps in zip(names, units, work.board.columns, strict=True):
        step = column_steps.step
        record: dict[str, Any] = {
            "name": name,
            "unit": unit_text(unit),
            "state": _column_state(tab, step),
            "steps": len(column_steps.steps),
            "model": None,
            "values": {},
            "error": None,
            "missing": None,
        }
        if step is not None:
            values = [v for chip in chips(step.fit, tab.unit) for v in chip["values"]]
            record["model"] = step.fit.model.name
            record["values"] = {
                v["symbol"]: v["text"] for v in values if v["name"] in ("N", "B", "K")
            }
            if step.error is not None:
                row = step_row(step)
                record["error"] = f"{row['error_text']} ({row['chance_text']})"
            if step.check is not None and step.check.significant:
                record["missing"] = effect_text(step.fit, step.check.significant[0].effect)
        out.append(record)
    return out


def _removed_effects(work: Work, column: int, fit: Fit) -> list[dict[str, Any]]:
    """List of one dict (place, kind, name, text) per removed effect of a column whose kind is not in the fitted model."""
    there = {e.kind for e in fit.model}
    return [
        {"place": i, "kind": e.kind, "name": fit.display_name(e), "text": str(e)}
        for i, e in enumerate(work.removed[column])
        if e.kind not in there
    ]


def job_state(tab: Tab) -> dict[str, Any]:
    """Dict with the key ``job``: `Job.to_dict` of the last job, or None. It changes without a new version of the state."""
    return {"job": None if tab.job is None else tab.job.to_dict()}


def chip_units(unit: str) -> list[dict[str, str]]:
    """Units in which values can be displayed, for samples in `unit`: dicts with value and text; may be empty."""
    kind = parse_unit(unit).kind
    sheet = [
        e.parameter(name).sheet[kind]
        for name, e in standard().items()
        if kind in e.parameter(name).sheet
    ]
    if not sheet:
        return []
    si = SI_UNITS[kind]
    other = [u for u in (unit, *UNITS) if u != si and parse_unit(u).kind == kind]
    texts = [unit_text(u) for u in sheet]
    return [
        {"value": SHEET, "text": f"{texts[1]}, {texts[2]}, …"},
        {"value": si, "text": f"SI: {unit_text(si)}"},
        *({"value": u, "text": unit_text(u)} for u in dict.fromkeys(other)),
    ]


def _excluded_text(work: Work) -> str:
    """Text `` · from 2 h · 40 s excluded``: duration of the whole log, then of the excluded segments; each only if any."""
    span, out = work.part
    said = "" if span is None else f" · from {duration_text(work.whole.duration)}"
    return said + (f" · {duration_text(sum(b - a for a, b in out))} excluded" if out else "")


def _recording_record(tab: Tab) -> dict[str, Any]:
    """Dict that describes the open recording: columns, units, duration, analyzed part, findings of its audit.

    ``audit`` has the findings on the current column and on the whole log. It is empty until the audit is finished
    (``audited``).
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
        "deviations": list(KINDS.items()),
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
