"""Actions that the browser can request from a tab; each action validates its arguments."""

from __future__ import annotations

from dataclasses import replace
from math import isclose
from typing import TYPE_CHECKING, Any

from allanite.common.errors import InputError
from allanite.common.parameters import Estimate
from allanite.common.read_options import ReadOptions
from allanite.common.units import parse_unit
from allanite.effects import parse_model
from allanite.page.edits import effect_at, factor_of, shown_unit
from allanite.page.shown.documents import compare_with
from allanite.page.source import Segment, Source, merged_segments
from allanite.page.state import chip_units
from allanite.page.studies import open_study
from allanite.recording.at_rest import quiet_span

if TYPE_CHECKING:
    from collections.abc import Callable

    from allanite.page.tab import Tab

#: Model of the example: a gyroscope with N, B, K, a Gauss-Markov process and a sinusoid.
EXAMPLE = "N(N=1e-4)+B(B=2e-5)+K(K=2e-7)+GM(q_c=3e-5,correlation_time=20)+SIN(frequency=1.7,amplitude=3e-5)"


def carry_out(tab: Tab, request: Any) -> None:
    """Carry out the action ``request["do"]`` of the browser, or raise `InputError` with one line for the user."""
    if not isinstance(request, dict):
        raise InputError("an action must be a JSON object")
    action = _ACTIONS.get(str(request.get("do")))
    if action is None:
        raise InputError(f"unknown action {str(request.get('do'))[:40]!r}")
    action(tab, request)


def _integer_of(request: dict[str, Any], name: str) -> int:
    """Integer in the key `name` of a request of the browser (a dict); raises `InputError` if missing or no integer."""
    value = request.get(name)
    if not isinstance(value, int) or isinstance(value, bool):
        raise InputError(f"{name} must be a whole number")
    return value


def _number_of(request: dict[str, Any], name: str) -> float | None:
    """Float in the key `name` of a request of the browser; None if it is missing or an empty text.

    Raises `InputError` if it is no number.
    """
    value = request.get(name)
    if value is None or value == "":
        return None
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{name} must be a number, found {str(value)[:40]!r}") from None


def _text_of(request: dict[str, Any], name: str) -> str | None:
    """Text of up to 2000 characters in the key `name` of a request of the browser; None if it is missing or empty.

    Raises `InputError` for a longer text or another type.
    """
    value = request.get(name)
    if value is None or value == "":
        return None
    if not isinstance(value, str) or len(value) > 2000:
        raise InputError(f"{name} must be a short text")
    return value


def _read_again(tab: Tab, request: dict[str, Any]) -> None:
    """Start a job that reads the open log again with the settings of the request."""
    if tab.source_index is None:
        raise InputError("No log is open: drop a file or choose one")
    names, units = request.get("columns") or [], request.get("units") or {}
    if not isinstance(names, list) or not all(isinstance(n, str) for n in names):
        raise InputError("The columns must be a list of names")
    if not isinstance(units, dict) or not all(isinstance(u, str) for u in units.values()):
        raise InputError("The units must be texts, one per column")
    for unit in units.values():
        parse_unit(unit[:80])
    before = tab.sources[tab.source_index].reading
    rate = _number_of(request, "rate")
    # The form returns a rate that was confirmed before with eight digits.
    confirmed = before.options.rate_hz if before.options.overrides_rate else None
    same = rate is not None and confirmed is not None and isclose(rate, confirmed, rel_tol=1e-7)
    options = ReadOptions(
        rate=f"{rate!r}!" if same else rate,
        unit=_text_of(request, "unit"),
        quantity=_text_of(request, "quantity"),
        time_column=_text_of(request, "time_column"),
        column=tuple(names),
    )
    tab.open(tab.source_index, replace(before, options=options, units=dict(units)))


def _analyze_part(tab: Tab, request: dict[str, Any]) -> None:
    """Start a job that analyzes a part of the log: the longest quiet segment, a time range in s, or the whole log.

    With a time range, excluded segments stay excluded; else none are.
    """
    if request.get("quiet") is True:
        tab.analyze_part((quiet_span(tab.work.whole), ()))
        return
    chosen = _time_range(tab, request)
    tab.analyze_part((None, ()) if chosen is None else (chosen, tab.work.part[1]))


def _time_range(tab: Tab, request: dict[str, Any]) -> Segment | None:
    """Time range ``from`` … ``to`` of a request, in s from the start of the whole log; None without a start or end.

    The keys count from the start of the analyzed part, and the range is limited to this part. Raises `InputError` if
    nothing of it remains.
    """
    start, end = _number_of(request, "from"), _number_of(request, "to")
    if start is None or end is None:
        return None
    span, _out = tab.work.part
    offset = 0.0 if span is None else span[0]
    start, end = max(start, 0.0) + offset, min(end, tab.log.duration) + offset
    if not end > start:
        raise InputError("This time range contains no samples")
    return start, end


def _exclude_segment(tab: Tab, request: dict[str, Any]) -> None:
    """Start a job that excludes the time range of the request, in addition to the excluded segments."""
    chosen, (span, out) = _time_range(tab, request), tab.work.part
    if chosen is None:
        raise InputError("A time range needs two numbers, in seconds")
    tab.analyze_part((span, merged_segments([*out, chosen])))


def _include_segment(tab: Tab, request: dict[str, Any]) -> None:
    """Start a job that analyzes the log with the excluded segment at the index ``number`` of the request included again."""
    span, out = tab.work.part
    number = _integer_of(request, "number")
    if not 0 <= number < len(out):
        raise InputError("This segment is already included")
    tab.analyze_part((span, (*out[:number], *out[number + 1 :])))


def _read_with_rate(tab: Tab, request: dict[str, Any]) -> None:
    """Start a job that reads the log again with the ``rate`` (Hz) of the request, even if the log contradicts it.

    Raises `InputError` for a recording that was passed in Python.
    """
    source, rate = tab.source, _number_of(request, "rate")
    if source is None or tab.source_index is None or rate is None:
        raise InputError("Give a rate, in Hz")
    if source.recording is not None:
        raise InputError("The rate was set in Python: change it in `al.Recording(…, rate=…)`")
    options = replace(source.reading.options, rate=f"{rate!r}!")
    tab.open(tab.source_index, replace(source.reading, options=options))


def _read_moving_log(tab: Tab, request: dict[str, Any]) -> None:
    """Start a job that reads again a log that was refused because it is mostly motion.

    The key ``how`` of the request is ``"quiet"`` (longest quiet segment) or ``"anyway"`` (all of the log).
    """
    source, how = tab.source, _text_of(request, "how")
    if source is None or tab.source_index is None or how not in ("quiet", "anyway"):
        raise InputError('Choose the part of the log: "quiet" or "anyway"')
    tab.open(tab.source_index, replace(source.reading, motion=how))


def _open_example(tab: Tab) -> None:
    """Add a simulated recording with two hidden effects to the logs (only once), and start a job that opens it."""
    name = "example.npz"
    if name not in [s.name for s in tab.sources]:
        found = parse_model(EXAMPLE).simulate(duration=3600.0, rate=50.0, seed=1, unit="rad/s")
        tab.sources.append(Source(name, recording=found.with_path(name)))
    tab.open([s.name for s in tab.sources].index(name))


def _improve(tab: Tab, request: dict[str, Any]) -> None:
    """Start a job that improves the model of the current column or, if the request says ``all``, of all columns."""
    every = range(len(tab.work.recording.columns))
    tab.improve(every if request.get("all") is True else None)


def _hold_parameter(tab: Tab, request: dict[str, Any]) -> None:
    """Start a job that fits with a parameter held at a value (in the displayed unit), or free if there is no value."""
    place, name = _integer_of(request, "place"), _text_of(request, "name") or ""
    value = _number_of(request, "value")
    tab.hold(place, name, None if value is None else value * _factor_to_own_unit(tab, place, name))


def _limit_parameter(tab: Tab, request: dict[str, Any]) -> None:
    """Start a job that fits with new limits of one parameter: ``low`` and ``high`` of the request in the displayed unit."""
    place, name = _integer_of(request, "place"), _text_of(request, "name") or ""
    factor = _factor_to_own_unit(tab, place, name)
    ends = (_number_of(request, end) for end in ("low", "high"))
    low, high = (None if end is None else end * factor for end in ends)
    tab.limit(place, name, low, high)


def _try_value(tab: Tab, request: dict[str, Any]) -> None:
    """Start a job that evaluates the model, without a new fit, with one parameter at ``value``, in the displayed unit."""
    place, name = _integer_of(request, "place"), _text_of(request, "name") or ""
    value = _number_of(request, "value")
    if value is None:
        raise InputError("enter a number")
    tab.try_value(place, name, value * _factor_to_own_unit(tab, place, name))


def _factor_to_own_unit(tab: Tab, place: int, name: str) -> float:
    """Factor from the displayed unit of a parameter to the parameter's own unit; 1 for parameters without a unit."""
    fit = tab.preview or tab.step.fit
    one = effect_at(fit.model, place)
    value = fit.estimates[place].get(name)
    if not isinstance(value, Estimate):
        return 1.0
    shown = shown_unit(one.parameter(name), value, fit.recording.unit, tab.unit)
    return 1.0 / factor_of(value, shown)


def _set_unit(tab: Tab, request: dict[str, Any]) -> None:
    """Set the unit of the displayed values of this tab; a request without a unit resets it."""
    unit = _text_of(request, "unit")
    offered = [u["value"] for u in chip_units(tab.log.unit)]
    if unit is not None and unit not in offered:
        raise InputError(f"values of this log cannot be shown in {unit[:40]!r}")
    tab.unit = unit
    tab.announce_change()


def _compare_steps(tab: Tab, request: dict[str, Any]) -> None:
    """Compare the current step with the step at the index ``rung`` of the request; without ``rung``, end the comparison."""
    tab.compare_steps(None if request.get("rung") is None else _integer_of(request, "rung"))


def _compare_log(tab: Tab, request: dict[str, Any]) -> None:
    """Add the columns of another log of the list to the comparison."""
    number = _integer_of(request, "log")
    if not 0 <= number < len(tab.sources):
        raise InputError(f"there is no log {number}")
    compare_with(tab, tab.sources[number])


def _end_comparison(tab: Tab, request: dict[str, Any]) -> None:
    """Remove the recording with the ``name`` of the request from the comparison; without a name, remove the data sheet."""
    name = _text_of(request, "name")
    tab.others = [(n, r) for n, r in tab.others if n != name]
    if name is None:
        tab.sheet = None
    tab.announce_change()


_ACTIONS: dict[str, Callable[[Any, dict[str, Any]], None]] = {
    "open": lambda tab, request: tab.open(
        _integer_of(request, "log"),
        column=None if request.get("column") is None else _integer_of(request, "column"),
    ),
    "read": _read_again,
    "column": lambda tab, request: tab.open_column(_integer_of(request, "column")),
    "model": lambda tab, request: tab.fit(_text_of(request, "model") or ""),
    "add": lambda tab, request: tab.add(_integer_of(request, "number")),
    "remove": lambda tab, request: tab.remove(_integer_of(request, "place")),
    "hold": _hold_parameter,
    "limits": _limit_parameter,
    "what-if": _try_value,
    "drop": lambda tab, _request: tab.discard_trial(),
    "fit-tried": lambda tab, _request: tab.fit_from_trial(),
    "put": lambda tab, request: tab.add_by_name(_text_of(request, "effect") or ""),
    "back": lambda tab, request: tab.restore(_integer_of(request, "place")),
    "example": lambda tab, _request: _open_example(tab),
    "take": _analyze_part,
    "leave-out": _exclude_segment,
    "put-back": _include_segment,
    "rate": _read_with_rate,
    "motion": _read_moving_log,
    "improve": _improve,
    "tolerance": lambda tab, request: tab.set_tolerance(_number_of(request, "percent")),
    "go": lambda tab, request: tab.go_to_step(_integer_of(request, "rung")),
    "undo": lambda tab, _request: tab.undo(),
    "redo": lambda tab, _request: tab.redo(),
    "cancel": lambda tab, _request: tab.cancel(),
    "check": lambda tab, _request: tab.recheck(),
    "unit": _set_unit,
    "compare": _compare_log,
    "alone": _end_comparison,
    "beside": _compare_steps,
    "study": lambda tab, request: open_study(tab, request.get("study")),
}
