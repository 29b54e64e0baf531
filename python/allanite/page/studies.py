"""What was done to a log as one document: saved in the browser as it grows, or to a file, and opened again."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from allanite.common.errors import InputError
from allanite.effects.files import kept_of, model_from_dict
from allanite.fit import fit_model
from allanite.fit.result import plain
from allanite.page.bench import look
from allanite.page.edits import parse_model_string
from allanite.page.ladder import Ladder, Step
from allanite.page.source import Stretch, joined, part_of
from allanite.study import Rung

if TYPE_CHECKING:
    from allanite.effects import Effect
    from allanite.fit import Fit
    from allanite.page.jobs import Job
    from allanite.page.tab import Tab

__all__ = ["open_study", "study"]

SCHEMA = "allanite/page-study/2"
#: Steps of one column.
MOST = 100


def study(tab: Tab) -> dict[str, Any]:
    """The ladders of all columns: models with values, not the samples."""
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
    return {
        "model": fit.model.name,
        "effects": [
            {
                "kind": effect.kind,
                "parameters": {n: plain(v) for n, v in values.items()},
                **kept_of(effect),
            }
            for effect, values in zip(fit.model.effects, fit.estimates, strict=True)
        ],
    }


def open_study(tab: Tab, document: Any) -> None:
    """Fit the models of a saved study to the open log, column by column and step by step.

    Raises
    ------
    InputError
        Not a study, a damaged one, or one of other columns; no log is open.
    """
    if not isinstance(document, dict) or document.get("schema") != SCHEMA:
        raise InputError("Not a study: a JSON file saved from this page is needed")
    work = tab.work
    columns = work.recording.columns
    axes = document.get("axes")
    if not isinstance(axes, list) or not 0 < len(axes) <= len(columns):
        raise InputError("The study holds no ladder of this log")
    try:
        found = [_axis(axis, columns) for axis in axes]
        span = _span(document.get("span"))
        out = joined(_stretch(one) for one in document.get("left_out", [])[:MOST])
    except (AttributeError, TypeError, LookupError, ValueError, ArithmeticError) as error:
        raise InputError(f"The study is damaged ({error})") from None
    seen = document.get("column")

    def bring(job: Job) -> None:
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
                job.say(f"Bringing back {columns[column]}, step {i}: {model.name}")
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
    tab.run("Bringing the study back", bring)


def _span(said: Any) -> tuple[float, float] | None:
    return None if said is None else _stretch(said)


def _stretch(said: Any) -> Stretch:
    start, end = float(said[0]), float(said[1])
    if not 0.0 <= start < end < float("inf"):
        raise ValueError("a stretch ends before it begins")
    return start, end


def _axis(
    axis: dict[str, Any], columns: tuple[str, ...]
) -> tuple[int, list[Any], list[str], int, list[Effect]]:
    name, rungs, at = axis["column"], axis["ladder"], axis["at"]
    if name not in columns:
        raise InputError(f"The study is of a column {str(name)[:40]!r}, which this log has not")
    if not isinstance(rungs, list) or not 0 < len(rungs) <= MOST:
        raise InputError("The study holds no ladder")
    models = [model_from_dict({**r, "schema": "allanite/fit/1"}, "study") for r in rungs]
    last = len(rungs) - 1
    labels = [str(r.get("label", ""))[:80] for r in rungs]
    return (
        columns.index(name),
        models,
        labels,
        at if isinstance(at, int) and 0 <= at <= last else last,
        [e for text in axis.get("tray", [])[:MOST] for e in parse_model_string(str(text)).effects],
    )
