"""Comparison of two models of one column: figure and table of differences."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from allanite.common.numbers import number
from allanite.fit.prediction import compare
from allanite.page.shown.cards import chips, step_row
from allanite.plots.axes import log_axis, score_axis
from allanite.plots.curves import TAU, interval
from allanite.plots.scaling import deviation_axis
from allanite.plots.spec import Figure, Line, Mark, Panel, Points, Rule

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from allanite.fit import Fit
    from allanite.page.tab import Tab
    from allanite.page.work import ColumnSteps, Step

    #: Row of the table that compares two steps: name of a parameter, its value in each step as text, and a remark.
    Row = tuple[str, tuple[str, ...], str]

#: Residual |z| of the guide lines: 95 % of the residuals of a true model are smaller.
GUIDE = 2.0
#: Minimum degrees of freedom of points whose intervals must fit on the axis.
SURE = 2.0


def two_models_figure(column_steps: ColumnSteps, other: Step) -> Figure:
    """`Figure` of the measured Allan deviation with the models of the current step and `other`, and residuals (σ) below."""
    assert column_steps.step is not None
    one, two = column_steps.step.fit, other.fit
    first, second = (
        f"model of step {column_steps.steps.index(s)}" for s in (column_steps.step, other)
    )
    curve, there = one.curve, two.curve
    low, high = interval(curve.measured, curve.edf)
    sure = curve.edf >= SURE
    marks: tuple[Mark, ...] = (
        Line(there.tau, there.model, "before", second, 2.2, "dash"),
        Line(curve.tau, curve.model, "model", first, 2.2),
        Points(curve.tau, curve.measured, "measured", "measured ± 95 %", low, high),
    )
    x = log_axis(TAU, curve.tau)
    y = log_axis("", curve.measured, curve.model, there.model, high[sure])
    y = deviation_axis(one.recording.unit, y)
    guides: tuple[Mark, ...] = tuple(
        Rule(at, "y", "guide", "solid" if at == 0.0 else "dash") for at in (-GUIDE, 0.0, GUIDE)
    )
    rest = (
        *guides,
        Points(there.tau, there.z, "before", size=4.5, hollow=True),
        Points(curve.tau, curve.z, "model", size=3.5),
    )
    panels = (
        Panel(x, y, marks, show_x=False),
        Panel(x, score_axis("residual (σ)", curve.z, there.z), rest, 1, grid=False),
    )
    return Figure("Two models", f"{one.model.name} and {two.model.name}", panels, (3.0, 1.0))


def differences(tab: Tab) -> dict[str, Any] | None:
    """Differences between the current step and the step compared with it; None if either is missing.

    Keys: ``at`` (index of the compared step), ``heads``, ``models`` and ``rows`` of the table.
    """
    column_steps, other = tab.column_steps, tab.compared_step
    if other is None or column_steps.step is None:
        return None
    places = [column_steps.steps.index(s) for s in (column_steps.step, other)]
    rows = (
        *_value_rows(column_steps.step.fit, other.fit, tab.unit, places),
        *_error_rows(column_steps.step, other, places),
    )
    return {
        "at": places[1],
        "heads": [f"Step {k}" for k in places],
        "models": [s.fit.model.name for s in (column_steps.step, other)],
        "rows": [
            {"what": what, "texts": texts, "remark": remark, "differs": texts[0] != texts[1]}
            for what, texts, remark in rows
        ],
    }


def _value_rows(one: Fit, two: Fit, unit: str | None, places: list[int]) -> Iterator[Row]:
    """Yield (name, texts, remark) for each fitted parameter of two models; `texts` has ``–`` if a model lacks it.

    The remark names the step if only one has the parameter. It is empty for equal texts. Otherwise, it is the ratio of
    two detected values, or ``Detected in one`` if only one is.
    """
    first, second = _displayed_values(one, unit), _displayed_values(two, unit)
    for key in [*first, *(k for k in second if k not in first)]:
        a, b = first.get(key), second.get(key)
        texts = tuple("–" if v is None else _value_text(v) for v in (a, b))
        if a is None or b is None:
            remark = f"Only in step {places[1] if a is None else places[0]}"
        elif texts[0] == texts[1]:
            remark = ""
        elif a["detected"] and b["detected"] and a["number"] and b["number"]:
            remark = f"× {number(a['number'] / b['number'], 3)}"
        else:
            remark = "Detected in one" if a["detected"] != b["detected"] else ""
        yield key[0], texts, remark


def _value_text(value: Mapping[str, Any]) -> str:
    """Text of a fitted value with its interval, or the reason why it is held, in brackets: ``0.3 (0.2 … 0.4)``."""
    spread = value["kept"] or value["spread"]
    return f"{value['text']} ({spread})" if spread and value["detected"] else str(value["text"])


def _displayed_values(fit: Fit, unit: str | None) -> dict[tuple[str, int], dict[str, Any]]:
    """Values of a fit that are shown when two steps are compared, as the dicts of `chips`.

    A key is (name, number); values with the same name are numbered from 0.
    """
    out: dict[tuple[str, int], dict[str, Any]] = {}
    for chip in chips(fit, unit):
        shown = [v for v in chip["values"] if v["free"]] or chip["values"][:1]
        for value in shown:
            name = f"{chip['name'][:1].upper()}{chip['name'][1:]}: {value['symbol']}"
            count = sum(k[0] == name for k in out)
            out[name, count] = value
    return out


def _error_rows(one: Step, two: Step, places: list[int]) -> Iterator[Row]:
    """Yield five rows as `_value_rows`: misfit and errors of both steps, and their predictions of unseen data."""
    first, second = step_row(one), step_row(two)
    for what, key, remark in (
        ("Misfit χ²/dof", "chi2_text", ""),
        ("Allan error, rms", "error_text", ""),
        ("Largest error", "max_text", ""),
        ("Model discrepancy", "discrepancy_text", ""),
        ("Unseen data", "predictive_text", _prediction_text(one, two, places)),
    ):
        yield what, (first[key], second[key]), remark


def _prediction_text(one: Step, two: Step, places: list[int]) -> str:
    """Text ``Step 1 better by 3.2 ± 0.8 nats in total`` on the prediction of unseen data; empty if not computed."""
    ends = [None if s.error is None else s.error.predictive for s in (one, two)]
    if ends[0] is None or ends[1] is None:
        return ""
    gain, error = compare(ends[0], ends[1])  # of the first over the second, nats
    better = places[0] if gain > 0 else places[1]
    return f"Step {better} better by {number(abs(gain), 3)} ± {number(error, 2)} nats in total"
