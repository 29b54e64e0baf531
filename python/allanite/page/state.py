"""What a tab tells the browser, and what the browser may ask of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from allanite.errors import InputError
from allanite.page.cards import cards, chips, rung
from allanite.page.source import Reading
from allanite.plots.words import duration_text, unit_text

if TYPE_CHECKING:
    from collections.abc import Callable

    from allanite.page.tab import Tab

__all__ = ["act", "state"]

#: Units offered; any other can be typed on the command line.
UNITS = ("rad/s", "deg/s", "deg/h", "mrad/s", "m/s^2", "g", "mg", "ug", "1")


def state(tab: Tab) -> dict[str, Any]:
    """Everything but the curves."""
    with tab.lock:
        ladder, place, length = tab.ladder, tab.place, len(tab.history)
        preview, recording = tab.preview, tab.recording
    step = ladder.steps[ladder.at] if ladder.steps else None
    shown = preview or (None if step is None else step.fit)
    check = None if step is None else step.check
    reading = tab.source.reading if tab.source is not None else Reading()
    return {
        "version": tab.version,
        "job": None if tab.job is None else tab.job.to_dict(),
        "problem": tab.problem,
        "logs": [s.name for s in tab.sources],
        "log": None if tab.source is None else tab.source.name,
        "fixed": tab.source is not None and tab.source.recording is not None,
        "units": [{"value": u, "text": unit_text(u) if u != "1" else "1 (a ratio)"} for u in UNITS],
        "reading": {
            "rate": reading.rate or (None if recording is None else recording.rate),
            "unit": reading.unit or (None if recording is None else recording.units[tab.column]),
            "quantity": reading.quantity or (None if recording is None else recording.quantity),
        },
        "recording": None if recording is None else _recording(tab),
        "chips": [] if shown is None else chips(shown),
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
    }


def _recording(tab: Tab) -> dict[str, Any]:
    assert tab.recording is not None
    column = tab.recording.column(tab.column)
    return {
        "columns": [
            {"name": n, "unit": unit_text(u)}
            for n, u in zip(tab.recording.columns, tab.recording.units, strict=True)
        ],
        "column": tab.column,
        "n": column.n,
        "rate": column.rate,
        "unit": unit_text(column.unit),
        "text": f"{column.n:,} samples · {duration_text(column.duration)} at {column.rate:.6g} Hz".replace(
            ",", " "
        ),
        "audit": [{"severity": f.severity, "message": f.message} for f in column.audit],
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


def _open(tab: Tab, order: dict[str, Any]) -> None:
    number = _integer(order, "log")
    if not 0 <= number < len(tab.sources):
        raise InputError(f"there is no log {number}")
    tab.open(tab.sources[number])


def _read(tab: Tab, order: dict[str, Any]) -> None:
    if tab.source is None:
        raise InputError("no log is open: drop a file or choose one")
    reading = Reading(_number(order, "rate"), _text(order, "unit"), _text(order, "quantity"))
    tab.open(tab.source, reading)


def _hold(tab: Tab, order: dict[str, Any]) -> None:
    tab.hold(_integer(order, "place"), _text(order, "name") or "", _number(order, "value"))


def _what_if(tab: Tab, order: dict[str, Any]) -> None:
    value = _number(order, "value")
    if value is None:
        raise InputError("type a number")
    tab.what_if(_integer(order, "place"), _text(order, "name") or "", value)


_ACTIONS: dict[str, Callable[[Any, dict[str, Any]], None]] = {
    "open": _open,
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
    "study": lambda tab, order: tab.open_study(order.get("study")),
}
