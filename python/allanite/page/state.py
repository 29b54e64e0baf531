"""What a tab tells the browser, and what the browser may ask of it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from allanite.common.errors import InputError
from allanite.common.parameters import Estimate
from allanite.common.units import conversion, parse_unit
from allanite.effects import standard
from allanite.page.documents import compare_with, sheet_rows
from allanite.page.edits import SHEET, effect, shown_unit
from allanite.page.shown.cards import cards, chips, rung
from allanite.page.shown.figures import colors_of
from allanite.page.shown.offers import offers, sentence
from allanite.page.source import Reading
from allanite.page.studies import open_study
from allanite.page.words import WORDS
from allanite.plots.words import duration_text, unit_text
from allanite.recording.at_rest import quiet_span
from allanite.report.words import many

if TYPE_CHECKING:
    from collections.abc import Callable

    from allanite.fit import Fit
    from allanite.page.ladder import Work
    from allanite.page.tab import Tab

__all__ = ["act", "state", "work"]

#: A gyroscope with a lag and a line beside the standard's three effects.
EXAMPLE = "N(N=1e-4)+B(B=2e-5)+K(K=2e-7)+GM(q_c=3e-5,correlation_time=20)+SIN(frequency=1.7,amplitude=3e-5)"
#: Units offered; any other can be typed on the command line.
UNITS = ("rad/s", "deg/s", "deg/h", "mrad/s", "m/s^2", "g", "mg", "ug", "1")


def state(tab: Tab) -> dict[str, Any]:
    """Everything but the curves."""
    with tab.lock:
        # The version first: what changes from here on is seen the next time.
        version, now, board = tab.version, tab.now, tab.board
        preview = tab.preview
        place, length = (now.place, len(now.history)) if now is not None else (0, 1)
    ladder = board.ladders[board.column]
    step = ladder.step
    shown = preview or (None if step is None else step.fit)
    check = None if step is None else step.check
    source = tab.source
    return {
        "version": version,
        **work(tab),
        "problem": tab.problem,
        "logs": [s.name for s in tab.sources],
        "log": None if source is None else source.name,
        "log_number": tab.place_of_source,
        "fixed": source is not None and source.recording is not None,
        "units": [{"value": u, "text": unit_text(u) if u != "1" else "1 (a ratio)"} for u in UNITS],
        "reading": _reading(tab),
        "recording": None if now is None else _recording(tab),
        "axes": [] if now is None else _axes(now),
        "covariates": [] if now is None else list(now.recording.covariates),
        "chips": []
        if shown is None or now is None
        else chips(shown, tab.unit, colors_of(now, shown)),
        "chip_unit": tab.unit,
        "chip_units": [] if shown is None else _chip_units(shown.recording.unit),
        "tray": [] if now is None or step is None else _tray(now, board.column, step.fit),
        "model": None if shown is None else str(shown.model),
        "preview": None
        if preview is None
        else {
            "chi2": preview.misfit.reduced,
            "before": None if step is None else step.fit.misfit.reduced,
        },
        "checked": check is not None,
        "adequate": None if check is None else check.adequate,
        "where": [] if check is None else check.left,
        "cards": [] if check is None else cards(check),
        "ladder": [rung(s) for s in ladder.steps],
        "at": ladder.at,
        "undo": place > 0,
        "redo": place < length - 1,
        "others": [name for name, _ in tab.others],
        "sheet": sheet_rows(tab),
    }


def _reading(tab: Tab) -> dict[str, Any]:
    """How the log is read: what was said, and what was found."""
    reading = tab.source.reading if tab.source is not None else Reading()
    found = None if tab.now is None else tab.now.recording
    return {
        "rate": reading.rate or (None if found is None else found.rate),
        "said_rate": reading.rate,
        "quantity": reading.quantity or (None if found is None else found.quantity),
        "columns": list(reading.columns or (() if found is None else found.columns)),
        "time_column": reading.time_column,
        "column_units": {
            **({} if found is None else dict(zip(found.columns, found.units, strict=True))),
            **reading.units,
        },
    }


def _axes(work: Work) -> list[dict[str, Any]]:
    """One record a column: its name, unit and state."""
    out = []
    names, units = work.recording.columns, work.recording.units
    for name, unit, ladder in zip(names, units, work.board.ladders, strict=True):
        step = ladder.step
        check = None if step is None else step.check
        kind = "new" if step is None else "fitted"
        if check is not None:
            kind = "adequate" if check.adequate else "fails"
        error = None if step is None else step.error
        out.append(
            {
                "name": name,
                "unit": unit_text(unit),
                "state": kind,
                "steps": len(ladder.steps),
                "model": None if step is None else step.fit.model.name,
                "values": {}
                if step is None
                else {
                    v["symbol"]: f"{v['text']}"
                    for c in chips(step.fit)
                    for v in c["values"]
                    if v["name"] in ("N", "B", "K")
                },
                "error": None if error is None else rung(step)["error_text"] if step else None,
                "missing": None
                if check is None or not check.significant
                else check.fit.display_name(check.significant[0].effect),
            }
        )
    return out


def _tray(work: Work, column: int, fit: Fit) -> list[dict[str, Any]]:
    there = {e.kind for e in fit.model}
    return [
        {"place": i, "kind": e.kind, "name": fit.display_name(e), "text": str(e)}
        for i, e in enumerate(work.tray[column])
        if e.kind not in there
    ]


def work(tab: Tab) -> dict[str, Any]:
    """What may change without a new version: the progress of the job."""
    return {"job": None if tab.job is None else tab.job.to_dict()}


def _chip_units(unit: str) -> list[dict[str, str]]:
    """Units in which the values of a model can be shown, the recording's first."""
    kind = parse_unit(unit).kind
    sheet = [
        e.parameter(name).sheet[kind]
        for name, e in standard().items()
        if kind in e.parameter(name).sheet
    ]
    if not sheet:
        return []
    other = [u for u in UNITS if u != unit and parse_unit(u).kind == kind]
    texts = [unit_text(u) for u in sheet]
    return [
        *({"value": u, "text": unit_text(u)} for u in (unit, *other)),
        {"value": SHEET, "text": f"{texts[1]}, {texts[2]}, …"},
    ]


def _recording(tab: Tab) -> dict[str, Any]:
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
        "span": now.span,
        "audited": now.audited,
        "n": column.n,
        "rate": column.rate,
        "duration": column.duration,
        "unit": unit_text(column.unit),
        "text": f"{many(column.n)} samples · {duration_text(column.duration)} at {column.rate:.6g} Hz",
        "audit": [
            {
                "severity": f.severity,
                "message": sentence(f.worded(WORDS)),
                "offers": offers(f, column.rate, column.duration),
            }
            for f in found
        ],
    }


def act(tab: Tab, order: Any) -> None:
    """Do what the browser asks.

    Raises
    ------
    InputError
        An unknown action, or one that cannot be done now; one line for the user.
    """
    if not isinstance(order, dict):
        raise InputError("an action must be a JSON object")
    action = _ACTIONS.get(str(order.get("do")))
    if action is None:
        raise InputError(f"unknown action {str(order.get('do'))[:40]!r}")
    action(tab, order)


def _integer(order: dict[str, Any], name: str) -> int:
    value = order.get(name)
    if not isinstance(value, int) or isinstance(value, bool):
        raise InputError(f"{name} must be a whole number")
    return value


def _number(order: dict[str, Any], name: str) -> float | None:
    value = order.get(name)
    if value is None or value == "":
        return None
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{name} must be a number, found {str(value)[:40]!r}") from None


def _text(order: dict[str, Any], name: str) -> str | None:
    value = order.get(name)
    if value is None or value == "":
        return None
    if not isinstance(value, str) or len(value) > 2000:
        raise InputError(f"{name} must be a short text")
    return value


def _read(tab: Tab, order: dict[str, Any]) -> None:
    if tab.place_of_source is None:
        raise InputError("No log is open: drop a file or choose one")
    names, units = order.get("columns") or [], order.get("units") or {}
    if not isinstance(names, list) or not all(isinstance(n, str) for n in names):
        raise InputError("The columns must be a list of names")
    if not isinstance(units, dict) or not all(isinstance(u, str) for u in units.values()):
        raise InputError("The units must be texts, one a column")
    for unit in units.values():
        parse_unit(unit[:80])
    before = tab.sources[tab.place_of_source].reading
    reading = replace(
        before,
        rate=_number(order, "rate"),
        unit=_text(order, "unit"),
        quantity=_text(order, "quantity"),
        time_column=_text(order, "time_column"),
        columns=tuple(names),
        units=dict(units),
    )
    tab.open(tab.place_of_source, reading)


def _take(tab: Tab, order: dict[str, Any]) -> None:
    """A part of the log: from … to s, the quiet one, or the whole."""
    if order.get("quiet") is True:
        tab.take(quiet_span(tab.work.whole))
        return
    start, end = _number(order, "from"), _number(order, "to")
    if start is None or end is None:
        tab.take(None)
        return
    offset = 0.0 if tab.work.span is None else tab.work.span[0]
    tab.take((start + offset, end + offset))


def _rate(tab: Tab, order: dict[str, Any]) -> None:
    """Read again at the rate that the time stamps say."""
    source, rate = tab.source, _number(order, "rate")
    if source is None or tab.place_of_source is None or rate is None:
        raise InputError("Give a rate, in Hz")
    if source.recording is not None:
        raise InputError("The recording was given with its rate: give it another there")
    tab.open(tab.place_of_source, replace(source.reading, rate=rate))


def _example(tab: Tab) -> None:
    """A recording with hidden effects, simulated."""
    from allanite.effects import parse_model
    from allanite.page.source import Source

    name = "example.npz"
    if name not in [s.name for s in tab.sources]:
        found = parse_model(EXAMPLE).simulate(duration=3600.0, rate=50.0, seed=1, unit="rad/s")
        tab.sources.append(Source(name, recording=found.called(name)))
    tab.open([s.name for s in tab.sources].index(name))


def _improve(tab: Tab, order: dict[str, Any]) -> None:
    every = range(len(tab.work.recording.columns))
    tab.improve(every if order.get("all") is True else None)


def _hold(tab: Tab, order: dict[str, Any]) -> None:
    place, name = _integer(order, "place"), _text(order, "name") or ""
    value = _number(order, "value")
    tab.hold(place, name, None if value is None else value * _factor(tab, place, name))


def _what_if(tab: Tab, order: dict[str, Any]) -> None:
    place, name = _integer(order, "place"), _text(order, "name") or ""
    value = _number(order, "value")
    if value is None:
        raise InputError("type a number")
    tab.what_if(place, name, value * _factor(tab, place, name))


def _factor(tab: Tab, place: int, name: str) -> float:
    """From the unit of a chip to the parameter's own."""
    fit = tab.preview or tab.step.fit
    one = effect(fit, place)
    value = fit.estimates[place].get(name)
    if not isinstance(value, Estimate):
        return 1.0
    shown = shown_unit(one.parameter(name), value, fit.recording.unit, tab.unit)
    return conversion(shown, value.unit)


def _unit(tab: Tab, order: dict[str, Any]) -> None:
    unit = _text(order, "unit")
    offered = [u["value"] for u in _chip_units(tab.log.unit)]
    if unit is not None and unit not in offered:
        raise InputError(f"values of this log are not shown in {unit[:40]!r}")
    tab.unit = unit
    tab.changed()


def _compare(tab: Tab, order: dict[str, Any]) -> None:
    """Compare with a log of the list."""
    number = _integer(order, "log")
    if not 0 <= number < len(tab.sources):
        raise InputError(f"there is no log {number}")
    compare_with(tab, tab.sources[number])


def _alone(tab: Tab, order: dict[str, Any]) -> None:
    """No longer compare with something: a recording by its name, or the data sheet."""
    name = _text(order, "name")
    tab.others = [(n, r) for n, r in tab.others if n != name]
    if name is None:
        tab.sheet = None
    tab.changed()


_ACTIONS: dict[str, Callable[[Any, dict[str, Any]], None]] = {
    "open": lambda tab, order: tab.open(_integer(order, "log")),
    "read": _read,
    "column": lambda tab, order: tab.choose(_integer(order, "column")),
    "model": lambda tab, order: tab.fit(_text(order, "model") or ""),
    "add": lambda tab, order: tab.add(_integer(order, "number")),
    "remove": lambda tab, order: tab.remove(_integer(order, "place")),
    "hold": _hold,
    "what-if": _what_if,
    "drop": lambda tab, _order: tab.drop_what_if(),
    "fit-tried": lambda tab, _order: tab.fit_what_if(),
    "put": lambda tab, order: tab.put(_text(order, "effect") or ""),
    "back": lambda tab, order: tab.back(_integer(order, "place")),
    "example": lambda tab, _order: _example(tab),
    "take": _take,
    "rate": _rate,
    "improve": _improve,
    "go": lambda tab, order: tab.go(_integer(order, "rung")),
    "undo": lambda tab, _order: tab.undo(),
    "redo": lambda tab, _order: tab.redo(),
    "cancel": lambda tab, _order: tab.cancel(),
    "check": lambda tab, _order: tab.recheck(),
    "unit": _unit,
    "compare": _compare,
    "alone": _alone,
    "study": lambda tab, order: open_study(tab, order.get("study")),
}
