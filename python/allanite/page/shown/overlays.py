"""Elements of figures that only the screen shows: hover texts, readings of coefficients, and data for dragging."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.numbers import number
from allanite.common.parameters import Estimate
from allanite.common.units import conversion
from allanite.fit.solution import Process
from allanite.page.edits import deviation_unit, shown_unit
from allanite.page.shown.figures import effect_colors
from allanite.plots.curves import interval
from allanite.plots.words import unit_text

if TYPE_CHECKING:
    from allanite.fit import Fit
    from allanite.page.work import Work
    from allanite.plots.themes import Theme


def set_hover_texts(data: list[dict[str, Any]], fit: Fit | None, name: str, unit: str) -> None:
    """Set in place the text that plotly shows under the mouse, for each trace in the list `data`.

    `name` is the view of the page, `unit` the unit of its values. With a `fit`, each measured point of the Allan
    deviation gets its own text.
    """
    shown = "" if unit == "1" else unit_text(unit)
    across = {
        "allan": "τ = %{x:.3~g} s",
        "psd": "%{x:.3~g} Hz",
        "compare": "τ = %{x:.3~g} s",
        "error": "%{x:.3~g} s since the fix",
        "nis": "τ = %{x:.3~g} s",
    }.get(name, "%{x:.6~g}")
    for trace in data:
        if trace.get("type") == "heatmap" or trace.get("hoverinfo") == "skip":
            continue
        strip = str(trace.get("yaxis")) not in ("y", "y1") and name in ("allan", "psd")
        what = "residual" if strip else (trace.get("name") or "value").split(":")[0]
        tail = " σ" if strip else ("" if name in ("nis", "error", "psd") else f" {shown}")
        height = "%{y:.2f}" if strip else "%{y:.4~g}"
        trace["hovertemplate"] = (
            f"<b>{what[:1].upper()}{what[1:]}</b><br>{across}<br>{height}{tail}<extra></extra>"
        )
        own = "Measured" if name == "allan" and str(what).startswith("measured") else ""
        if own and fit is not None and len(trace["x"]) == fit.curve.tau.size:
            trace["customdata"] = _hover_texts(fit, unit)
            trace["hovertemplate"] = "%{customdata}<extra></extra>"


def _hover_texts(fit: Fit, unit: str) -> list[str]:
    """Hover texts (HTML) of the measured points, in `unit`: value, interval, model, and difference in percent and σ."""
    curve, factor = fit.curve, conversion(fit.recording.unit, unit)
    measured, model = factor * curve.measured, factor * curve.model
    low, high = interval(measured, curve.edf)
    text = "" if unit == "1" else unit_text(unit)
    out = []
    for t, a, b, c, d, z in zip(curve.tau, measured, low, high, model, curve.z, strict=True):
        off = 100.0 * (d / a - 1.0)
        way = "high" if off > 0 else "low"
        beyond = f", {abs(z):.1f} σ" if np.isfinite(z) else ""
        out.append(
            f"<b>Measured {number(float(a))} {text}</b><br>τ = {number(float(t), 3)} s<br>"
            f"95 % interval {number(float(b))} … {number(float(c))}<br>"
            f"model {number(float(d))}: {number(abs(off), 2)} % too {way}{beyond}"
        )
    return out


def coefficient_readings(
    fit: Fit, work: Work, unit: str | None, look: Theme, axes: dict[str, Any]
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Pair (traces, annotations) of plotly that mark where standard coefficients (such as N, B, K) are read off the curve.

    Each has its own τ; only B has none and is read at the τ where the measured deviation is smallest. A point outside
    the y range has no trace, only an annotation at the lower edge. `axes` is plotly's layout with both ranges; heights
    are in the displayed `unit`.
    """
    (left, right), (bottom, top) = axes["xaxis"]["range"], axes["yaxis"]["range"]
    traces, labels = [], []
    curve = fit.curve
    factor = conversion(fit.recording.unit, deviation_unit(fit.recording.unit, unit))
    for effect, values, role in zip(
        fit.model.effects, fit.estimates, effect_colors(work, fit), strict=True
    ):
        line = effect.standard
        value = None if line is None else values.get(line.name)
        if line is None or not isinstance(value, Estimate):
            continue
        if value.value <= 0 or not value.detected:
            continue
        sure = curve.edf >= min(10.0, float(curve.edf.max()))
        tau = line.read_at or float(curve.tau[sure][np.argmin(curve.measured[sure])])
        height = factor * line.level * value.value
        x, y = float(np.log10(tau)), float(np.log10(height))
        if not left <= x <= right:
            continue
        shown = value.to(shown_unit(effect.parameter(line.name), value, fit.recording.unit, unit))
        text = f"{line.name} {number(shown.value, 3)} {unit_text(shown.unit)}"
        time, color = f"{number(tau, 3)} s", look.color(role)
        if bottom <= y <= top:
            hover = f"<b>{text}</b><br>read at τ = {time}<extra></extra>"
            traces.append(
                {
                    "type": "scatter",
                    "mode": "markers",
                    "x": [tau],
                    "y": [height],
                    "name": f"{line.name} is read here",
                    "meta": "reading",
                    "showlegend": False,
                    "xaxis": "x",
                    "yaxis": "y",
                    "marker": {"symbol": "diamond-open", "size": 10, "color": color},
                    "hovertemplate": hover,
                }
            )
            # Near the upper edge there is no space above the point, and a label below it would cover a falling curve.
            high = y > top - 0.08 * (top - bottom)
            label = {"text": text, "y": y, "yref": "y"}
            label |= {"yanchor": "middle" if high else "bottom", "yshift": 0 if high else 3}
        else:
            label = {"text": f"{text} ↓ at {time}", "y": 0.0, "yref": "y domain"}
            label |= {"yanchor": "bottom", "yshift": 3}
        far = x > left + 0.7 * (right - left)
        label |= {"x": x, "xref": "x", "xanchor": "right" if far else "left"}
        label |= {"xshift": -10 if far else 10, "showarrow": False}
        label |= {"font": {"size": 12, "color": color}, "bgcolor": look.panel, "opacity": 0.92}
        labels.append(label)
    return traces, labels


def drag_data(fit: Fit, unit: str) -> dict[str, Any]:
    """Dict of arrays from which the browser computes χ²/dof and curve while the user drags an effect's line.

    ``count`` (degrees of freedom), ``power`` (measured) and ``spectrum`` (model) have one entry per frequency bin.
    ``own`` maps the index of each process to its part of the spectrum. ``groups`` are the bins of each term of χ². The
    measured curve has one entry per τ.
    """
    solution, curve = fit.solution, fit.curve
    return {
        "count": solution.count,
        "power": solution.power,
        "spectrum": solution.spectrum,
        "own": {
            str(place): own.power
            for place, own in enumerate(solution.effects)
            if isinstance(own, Process)
        },
        "groups": fit.data.bins.groups,
        # Nothing is fitted while a line is dragged.
        "dof": len(fit.data.bins.groups),
        "before": fit.misfit.reduced,
        "measured": conversion(fit.recording.unit, unit) * curve.measured,
        "edf": curve.edf,
        "tau": curve.tau,
    }
