"""Studies: the work on a log as a JSON document, which the browser stores and files can hold."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from allanite.common.errors import InputError
from allanite.effects.files import held_and_limits, model_from_dict
from allanite.fit import fit_model
from allanite.fit.result import plain
from allanite.page.bench import look
from allanite.page.edits import parse_model_string
from allanite.page.ladder import Ladder, Step
from allanite.page.source import Segment, joined, part_of
from allanite.study import Rung

if TYPE_CHECKING:
    from allanite.effects import Effect
    from allanite.fit import Fit
    from allanite.page.jobs import Job
    from allanite.page.tab import Tab

SCHEMA = "allanite/page-study/2"
#: Maximum number of steps per column.
MOST = 100


def study(tab: Tab) -> dict[str, Any]:
    """Dict of the steps of all columns for a file: models with values, without samples.

    Columns without steps are left out. Raises `InputError` if nothing is fitted.
    """
    _ = tab.step
    source, work = tab.source, tab.work
    assert source is not None
    return {
        "schema": SCHEMA,
        "log": source.name,
        "digest": work.home,
        "column": tab.log.columns[0],
        "span": work.part[0],
        "left_out": work.part[1],
        "axes": [
            {
                "column": name,
                "unit": unit,
                "at": ladder.at,
                "ladder": [{"label": s.label, **_model(s.fit)} for s in ladder.steps],
                "tray": [str(effect) for effect in tray],
            }
            for name, unit, ladder, tray in zip(
                work.recording.columns,
                work.recording.units,
                work.board.ladders,
                work.tray,
                strict=True,
            )
            if ladder.steps
        ],
    }


def _model(fit: Fit) -> dict[str, Any]:
    """Dict of the model of a fit with its values, held values and limits."""
    return {
        "model": fit.model.name,
        "effects": [
            {
                "kind": effect.kind,
                "parameters": {n: plain(v) for n, v in values.items()},
                **held_and_limits(effect),
            }
            for effect, values in zip(fit.model.effects, fit.estimates, strict=True)
        ],
    }


def open_study(tab: Tab, document: Any) -> None:
    """Start a job that fits the models of a saved study to the open log, column by column and step by step.

    Raises
    ------
    InputError
        The document is not a study, is damaged or belongs to other columns; or no log is open.
    """
    if not isinstance(document, dict) or document.get("schema") != SCHEMA:
        raise InputError("Not a study: choose a JSON file saved from this page")
    work = tab.work
    columns = work.recording.columns
    axes = document.get("axes")
    if not isinstance(axes, list) or not 0 < len(axes) <= len(columns):
        raise InputError("The study contains no steps for this log")
    try:
        found = [_axis(axis, columns) for axis in axes]
        span = _span(document.get("span"))
        out = joined(_segment(one) for one in document.get("left_out", [])[:MOST])
    except (AttributeError, TypeError, LookupError, ValueError, ArithmeticError) as error:
        raise InputError(f"The study is damaged ({error})") from None
    seen = document.get("column")

    def bring(job: Job) -> None:
        """Fit the models of the study step by step, and replace the steps of its columns by them.

        Part and current column become those of the study; the current step is then checked.
        """
        job.take_turn()
        if (span, out) != tab.work.part:
            tab.cut(job, (span, out), part_of(tab.work.whole, span, out))
        if seen in columns:
            with tab.change(job):
                tab.work.look(columns.index(seen))
        for column, models, labels, at, tray in found:
            log = tab.work.log(column)
            steps = []
            for i, (model, label) in enumerate(zip(models, labels, strict=True)):
                job.say(f"Restoring {columns[column]}, step {i}: {model.name}")
                step = Step(label, Rung(fit_model(log, model)))
                step.error = step.fit.error
                look(step.fit)
                steps.append(step)
            with tab.change(job):
                tab.push(Ladder(tuple(steps), at), column)
                tab.work.tray[column] = tray
        tab.rest(job, tab.step)

    if tab.busy:
        tab.cancel()
    tab.run("Restoring the study", bring)


def _span(said: Any) -> tuple[float, float] | None:
    """Pair (start, end) in s from a study document; None for the whole log."""
    return None if said is None else _segment(said)


def _segment(said: Any) -> Segment:
    """Pair (start, end) in s from a document; raises `ValueError` unless 0 ≤ start < end < ∞."""
    start, end = float(said[0]), float(said[1])
    if not 0.0 <= start < end < float("inf"):
        raise ValueError("a segment ends before it starts")
    return start, end


def _axis(
    axis: dict[str, Any], columns: tuple[str, ...]
) -> tuple[int, list[Any], list[str], int, list[Effect]]:
    """Tuple (column index, models, labels, index of the current step, removed effects) of one axis of a study.

    An invalid index becomes the last step. Raises `InputError` for an unknown column, or unless there are 1 to 100
    steps.
    """
    name, saved_steps, at = axis["column"], axis["ladder"], axis["at"]
    if name not in columns:
        raise InputError(f"The study contains column {str(name)[:40]!r}, which this log lacks")
    if not isinstance(saved_steps, list) or not 0 < len(saved_steps) <= MOST:
        raise InputError("The study contains no steps")
    models = [model_from_dict({**r, "schema": "allanite/fit/1"}, "study") for r in saved_steps]
    last = len(saved_steps) - 1
    labels = [str(r.get("label", ""))[:80] for r in saved_steps]
    return (
        columns.index(name),
        models,
        labels,
        at if isinstance(at, int) and 0 <= at <= last else last,
        [e for text in axis.get("tray", [])[:MOST] for e in parse_model_string(str(text)).effects],
    )
