"""The two views of a fit as panels: Allan curve and spectrum, each with a strip of residuals below."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.effects import Deterministic, Periodic, Stochastic
from allanite.fit.solution import Process
from allanite.plots.axes import log_axis, score_axis
from allanite.plots.spec import Axis, Band, Line, Mark, Panel, Points, Rule, Span
from allanite.plots.themes import COMPONENTS
from allanite.plots.words import bracket, density_unit, effect_text, in_unit, values_text
from allanite.spectrum.spectrum import cells_of

if TYPE_CHECKING:
    from allanite.fit.result import Fit

__all__ = ["Part", "allan_panels", "interval", "parts", "spectrum_panels"]

Array = NDArray[np.float64]
Range = tuple[float, float] | None

TAU = "averaging time τ (s)"
#: Scores beyond which a strip has a guide: 95 % of chance, and about 1 % for the worst of a whole curve.
GUIDES = (2.0, 3.5)
#: Ordinates of a point of the spectrum; with fewer its interval spans decades and hides the curve.
FEWEST = 4
#: Where taking the deterministic effects out changed the density by more than this, both are shown.
CHANGED = 0.1


@dataclass(frozen=True, slots=True)
class Part:
    """The effect at a place of a model as it is drawn: its colour, its name with numbers, its line (if it is one)."""

    color: str
    dash: str
    label: str
    place: int
    frequency: float | None = None


def parts(fit: Fit) -> tuple[Part, ...]:
    """Stochastic effects, then deterministic ones: the order of ``fit.curve.components``."""
    placed = list(enumerate(fit.model))
    random = [(k, e) for k, e in placed if isinstance(e, Stochastic)]
    known = [(k, e) for k, e in placed if isinstance(e, Deterministic)]
    out = []
    for i, (place, effect) in enumerate([*random, *known]):
        numbers = values_text(effect, fit.estimates[place])
        name = effect_text(fit, effect)
        label = f"{name}: {numbers}" if numbers else name
        dash = "solid" if i < len(COMPONENTS) else "dot"
        frequency = effect.frequency if isinstance(effect, Periodic) else None
        out.append(Part(COMPONENTS[i % len(COMPONENTS)], dash, label, place, frequency))
    return tuple(out)


def interval(deviation: Array, edf: Array) -> tuple[Array, Array]:
    """95 % interval of a deviation with `edf` equivalent degrees of freedom."""
    from scipy.special import chdtri

    low = deviation * np.sqrt(edf / chdtri(edf, 0.025))
    return low, deviation * np.sqrt(edf / chdtri(edf, 0.975))


def allan_panels(
    fit: Fit, column: int = 0, worst: Range = None, strip: bool = True
) -> tuple[Panel, ...]:
    """Allan curve with its interval, the model with its band and its effects; residuals in σ below."""
    curve = fit.curve
    low, high = interval(curve.measured, curve.edf)
    marks: list[Mark] = [*_span(worst)]
    band = fit.band
    marks += [
        Band(
            band.tau, band.low_everywhere, band.high_everywhere, "model", "95 %, at all τ together"
        ),
        Band(
            band.tau, band.low, band.high, "model", "expected scatter (95 %) if the model is true"
        ),
    ]
    for part, values in zip(parts(fit), curve.components.values(), strict=True):
        marks.append(Line(curve.tau, values, part.color, part.label, 1.2, part.dash))
    marks.append(Line(curve.tau, curve.model, "model", "model", 2.2))
    marks.append(Points(curve.tau, curve.measured, "measured", "measured ± 95 %", low, high))
    x = log_axis(TAU, curve.tau)
    # Effects may lie decades below: the curve decides what is shown.
    sure = curve.edf >= 2.0
    y = log_axis(
        in_unit("Allan deviation", fit.recording.unit),
        curve.measured,
        curve.model,
        high[sure],
        0.5 * curve.measured,
    )
    panel = Panel(x, y, tuple(marks), 0, column, title="Allan deviation", show_x=not strip)
    if not strip:
        return (panel,)
    return panel, _strip(x, curve.tau, curve.z, column, worst)


def spectrum_panels(fit: Fit, column: int = 1, worst: Range = None) -> tuple[Panel, ...]:
    """Two-sided density with the model and its effects; residuals in σ below."""
    from scipy.special import chdtri

    from allanite.fit.likelihood.whittle import normal_scores

    solution, bins, rate = fit.solution, fit.data.bins, fit.data.rate
    first, count = _merge(solution.count)
    width = np.add.reduceat(bins.count, first)
    bottom, top = bins.limits(rate)
    last = np.append(first[1:], bottom.size) - 1
    frequency = np.sqrt(np.maximum(bottom[first], rate / (2.0 * bins.n)) * top[last])

    def mean(power: Array) -> Array:
        return np.asarray(np.add.reduceat(bins.count * power, first) / width / rate)

    measured, model = mean(solution.power), mean(solution.spectrum)
    low, high = count / chdtri(count, 0.025), count / chdtri(count, 0.975)
    marks: list[Mark] = [*_span(worst)]
    marks.append(
        Band(
            frequency,
            model / high,
            model / low,
            "model",
            "expected scatter (95 %) if the model is true",
        )
    )
    for part in parts(fit):
        own = solution.effects[part.place]
        if isinstance(own, Process):
            power = mean(own.power)
            marks.append(Line(frequency, power, part.color, part.label, 1.2, part.dash))
        elif part.frequency is not None:
            marks.append(Rule(part.frequency, "x", part.color, "dash", part.label))
    if fit.model.deterministic:
        raw = mean(bins.power(fit.data.ordinates))
        changed = np.abs(np.log(raw / measured)) > CHANGED
        if changed.any():
            words = "before steps, lines and drifts were taken out"
            marks.append(
                Points(frequency[changed], raw[changed], "raw", words, size=4.5, hollow=True)
            )
    marks.append(Line(frequency, model, "model", "model", 2.2))
    marks.append(
        Points(
            frequency,
            measured,
            "measured",
            "measured ± 95 %",
            measured * low,
            measured * high,
            3.0,
        )
    )
    x = log_axis("frequency f (Hz)", frequency)
    label = bracket("density", density_unit(fit.recording.unit))
    sure = count >= min(FEWEST, count.max())
    y = log_axis(
        label,
        measured,
        model,
        (measured * high)[sure],
        (measured * low)[sure],
        (model / low)[sure],
        0.5 * measured,
        *_shown(marks),
    )
    panel = Panel(
        x, y, tuple(marks), 0, column, title="Power spectral density, two-sided", show_x=False
    )
    ratio = np.add.reduceat(solution.count * solution.power / solution.spectrum, first) / count
    z = normal_scores(ratio, count, np.ones(count.size))
    return panel, _strip(x, frequency, z, column, worst)


def _shown(marks: list[Mark]) -> list[Array]:
    return [m.y for m in marks if isinstance(m, Points) and m.color == "raw"]


def _merge(count: Array) -> tuple[NDArray[np.int64], Array]:
    """First bin and degrees of freedom of each point: whole cells, neighbours together until they have `FEWEST`.

    The bins of a cell are drawn as one: more than a screen can tell apart, and each of them less certain.
    """
    cells = cells_of(count.size)
    first, total = [0], 0.0
    for cell, value in zip(cells, np.add.reduceat(count, cells), strict=True):
        if total >= FEWEST:
            first.append(cell)
            total = 0.0
        total += value
    if total < FEWEST and len(first) > 1:
        first.pop()
    starts = np.array(first, dtype=np.int64)
    return starts, np.maximum(np.add.reduceat(count, starts), 1e-9)


def _span(worst: Range) -> tuple[Span, ...]:
    return () if worst is None else (Span(*worst, "fail", "where the model fails"),)


def _strip(x: Axis, at: Array, z: Array, column: int, worst: Range) -> Panel:
    """Residuals as standard normal scores, with guides."""
    marks: list[Mark] = [*_span(worst), Rule(0.0, "y", "guide", "solid")]
    for guide, dash in zip(GUIDES, ("dash", "dot"), strict=True):
        marks += [Rule(sign * guide, "y", "guide", dash) for sign in (-1.0, 1.0)]
    kept = np.isfinite(z)
    marks.append(Points(at[kept], z[kept], "measured", size=3.5))
    return Panel(x, score_axis("residual (σ)", z), tuple(marks), 1, column, grid=False)
