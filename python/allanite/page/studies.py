"""Studies: the work on a log as a JSON document, which the browser stores and files can hold."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from allanite.common.errors import InputError
from allanite.effects.files import held_and_limits, model_from_dict
from allanite.fit import fit_model
from allanite.fit.result import parameter_dict
from allanite.page.edits import parse_model_string
from allanite.page.source import Segment, merged_segments, part_of
from allanite.page.tab_state import cache_results
from allanite.page.work import ColumnSteps, Step
from allanite.study import Rung

if TYPE_CHECKING:
    from allanite.effects import Effect
    from allanite.fit import Fit
    from allanite.page.jobs import Job
    from allanite.page.tab import Tab

SCHEMA = "allanite/page-study/2"
#: Maximum number of steps per column.
MOST = 100


def study_document(tab: Tab) -> dict[str, Any]:
    """Dict of the steps of all columns for a file: models with values, without samples.

    Columns without steps are left out. Raises `InputError` if the current column has no step.
    """
    _ = tab.step
    source, work = tab.source, tab.work
    assert source is not None
    return {
        "schema": SCHEMA,
        "log": source.name,
        "digest": work.whole_digest,
        "column": tab.log.columns[0],
        "span": work.part[0],
        "left_out": work.part[1],
        "axes": [
            {
                "column": name,
                "unit": unit,
                "at": column_steps.at,
                "ladder": [
                    {"label": s.label, **_model_document(s.fit)} for s in column_steps.steps
                ],
                "tray": [str(effect) for effect in tray],
            }
            for name, unit, column_steps, tray in zip(
                work.recording.columns,
                work.recording.units,
                work.board.columns,
                work.removed,
                strict=True,
            )
            if column_steps.steps
        ],
    }


def _model_document(fit: Fit) -> dict[str, Any]:
    """Dict for JSON of the model of a fit: name, and for each effect its kind, estimates, held parameters and limits."""
    return {
        "model": fit.model.name,
        "effects": [
            {
                "kind": effect.kind,
                "parameters": {n: parameter_dict(v) for n, v in values.items()},
                **held_and_limits(effect),
            }
            for effect, values in zip(fit.model.effects, fit.estimates, strict=True)
        ],
    }


def open_study(tab: Tab, document: Any) -> None:
    """Start a job that fits the models of a saved study to the open log, column by column and step by step.

    Raises `InputError` if the document is not a study, is damaged or belongs to other columns, or if no log is open.
    """
    if not isinstance(document, dict) or document.get("schema") != SCHEMA:
        raise InputError("Not a study: choose a JSON file saved from this page")
    work = tab.work
    columns = work.recording.columns
    axes = document.get("axes")
    if not isinstance(axes, list) or not 0 < len(axes) <= len(columns):
        raise InputError("The study contains no steps for this log")
    try:
        found = [_axis_of_document(axis, columns) for axis in axes]
        saved_span = document.get("span")
        span = None if saved_span is None else _checked_segment(saved_span)
        out = merged_segments(_checked_segment(one) for one in document.get("left_out", [])[:MOST])
    except (AttributeError, TypeError, LookupError, ValueError, ArithmeticError) as error:
        raise InputError(f"The study is damaged ({error})") from None
    seen = document.get("column")

    def fit_models(job: Job) -> None:
        """Fit each model of the study, which replace the former steps, and check the current step."""
        job.take_turn()
        if (span, out) != tab.work.part:
            tab.switch_to_part(job, (span, out), part_of(tab.work.whole, span, out))
        if seen in columns:
            with tab.changing(job):
                tab.work.select_column(columns.index(seen))
        for column, models, labels, at, tray in found:
            log = tab.work.log(column)
            steps = []
            for i, (model, label) in enumerate(zip(models, labels, strict=True)):
                job.begin_stage(f"Restoring {columns[column]}, step {i}: {model.name}")
                step = Step(label, Rung(fit_model(log, model)))
                step.error = step.fit.error
                cache_results(step.fit)
                steps.append(step)
            with tab.changing(job):
                tab.set_steps(ColumnSteps(tuple(steps), at), column)
                tab.work.removed[column] = tray
        tab.check_until_interrupted(job, tab.step)

    if tab.busy:
        tab.cancel()
    tab.start_job("Restoring the study", fit_models)


def _checked_segment(said: Any) -> Segment:
    """Pair (start, end) in s from a list of a study document; raises `ValueError` unless 0 ≤ start < end < ∞."""
    start, end = float(said[0]), float(said[1])
    if not 0.0 <= start < end < float("inf"):
        raise ValueError("a segment ends before it starts")
    return start, end


def _axis_of_document(
    axis: dict[str, Any], columns: tuple[str, ...]
) -> tuple[int, list[Any], list[str], int, list[Effect]]:
    """Tuple (column index, models, labels, index of the current step, removed effects) of one axis of a saved study.

    An invalid index of the current step is replaced by that of the last step. Raises `InputError` for an unknown column
    or effect, or unless there are 1 to 100 steps.
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
