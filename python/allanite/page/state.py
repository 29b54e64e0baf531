"""What a tab tells the browser, and what the browser may ask of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from allanite.common.errors import InputError
from allanite.common.parameters import Estimate
from allanite.common.units import conversion, parse_unit
from allanite.effects import standard
from allanite.page.cards import cards, chips, rung
from allanite.page.documents import compare_with, open_study, sheet_rows
from allanite.page.edits import SHEET, effect, shown_unit
from allanite.page.source import Reading
from allanite.page.words import WORDS
from allanite.plots.words import duration_text, unit_text
from allanite.report.words import many

if TYPE_CHECKING:
    from collections.abc import Callable

    from allanite.page.tab import Tab

__all__ = ["act", "state", "work"]

#: Units offered; any other can be typed on the command line.
UNITS = ("rad/s", "deg/s", "deg/h", "mrad/s", "m/s^2", "g", "mg", "ug", "1")


def state(tab: Tab) -> dict[str, Any]:
    """Everything but the curves."""
    with tab.lock:
        # The version first: what changes from here on is seen the next time.
        version, ladder, place, length = tab.version, tab.ladder, tab.place, len(tab.history)
        preview, recording = tab.preview, tab.recording
    step = ladder.steps[ladder.at] if ladder.steps else None
    shown = preview or (None if step is None else step.fit)
    check = None if step is None else step.check
    reading = tab.source.reading if tab.source is not None else Reading()
    return {
        "version": version,
        **work(tab),
        "problem": tab.problem,
        "logs": [s.name for s in tab.sources],
        "log": None if tab.source is None else tab.source.name,
        "log_number": tab.place_of_source,
        "fixed": tab.source is not None and tab.source.recording is not None,
        "units": [{"value": u, "text": unit_text(u) if u != "1" else "1 (a ratio)"} for u in UNITS],
        "reading": {
            "rate": reading.rate or (None if recording is None else recording.rate),
            "unit": reading.unit or (None if recording is None else recording.units[tab.column]),
            "quantity": reading.quantity or (None if recording is None else recording.quantity),
            "columns": ", ".join(
                reading.columns or (() if recording is None else recording.columns)
            ),
            "time_column": reading.time_column,
        },
        "recording": None if recording is None else _recording(tab),
        "chips": [] if shown is None else chips(shown, tab.unit),
        "chip_unit": tab.unit,
        "chip_units": [] if shown is None else _chip_units(shown.recording.unit),
        "preview": None
        if preview is None
        else {
            "chi2": preview.misfit.reduced,
            "before": None if step is None else step.fit.misfit.reduced,
        },
        "checked": check is not None,
        "adequate": None if check is None else check.adequate,
        "where": [] if check is None else check.where.sentences(),
        "cards": [] if check is None else cards(check),
        "ladder": [rung(s) for s in ladder.steps],
        "at": ladder.at,
        "undo": place > 0,
        "redo": place < length - 1,
        "others": [name for name, _ in tab.others],
        "sheet": sheet_rows(tab),
    }


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
    assert tab.recording is not None
    column = tab.log
    return {
        "columns": [
            {"name": n, "unit": unit_text(u)}
            for n, u in zip(tab.recording.columns, tab.recording.units, strict=True)
        ],
        "column": tab.column,
        "n": column.n,
        "rate": column.rate,
        "unit": unit_text(column.unit),
        "text": f"{many(column.n)} samples · {duration_text(column.duration)} at {column.rate:.6g} Hz",
        "audit": [{"severity": f.severity, "message": f.worded(WORDS)} for f in column.audit],
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
    except (TypeError, ValueError):
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
        raise InputError("no log is open: drop a file or choose one")
    names = (_text(order, "columns") or "").split(",")
    reading = Reading(
        _number(order, "rate"),
        _text(order, "unit"),
        _text(order, "quantity"),
        _text(order, "time_column"),
        columns=tuple(name.strip() for name in names if name.strip()),
    )
    tab.open(tab.place_of_source, reading)


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
    "improve": lambda tab, _order: tab.improve(),
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
