"""Panels of a fit: Allan deviation and spectrum, each with a strip of residuals below."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.numbers import number
from allanite.common.parameters import Estimate
from allanite.effects import Deterministic, Effect, Stochastic
from allanite.fit.bands import expected_variance
from allanite.fit.curve import MIN_FAILING_SCORE, components_at
from allanite.fit.likelihood.expected import density
from allanite.fit.likelihood.peaks import has_all_ordinates, is_narrow
from allanite.fit.likelihood.whittle import normal_scores
from allanite.fit.solution import Process
from allanite.plots.axes import log_axis, score_axis
from allanite.plots.scaling import density_axis, deviation_axis
from allanite.plots.spec import Axis, Band, Line, Mark, Panel, Points, Rule, Span
from allanite.plots.themes import COMPONENTS
from allanite.plots.words import effect_text, values_text
from allanite.spectrum.spectrum import cells_of

if TYPE_CHECKING:
    from allanite.effects.terms import Term
    from allanite.fit.result import Fit
    from allanite.suggestion import Check

Array = NDArray[np.float64]
Ordinates = NDArray[np.int64]

#: Label of the axis of averaging times, and legend of single ordinates.
TAU = "averaging time τ (s)"
SINGLE = "single frequencies (full resolution)"
SCATTER = "expected scatter (95 %) if the model is true"
TOGETHER = "expected scatter for all τ together (95 %)"
#: Opacity of the expected scatter. The wider band for all τ together is paler.
SCATTER_OPACITY = 0.26
#: Residuals, in standard deviations, at which a strip has guide lines: 95 % limit of one point, and about the 99 % limit of
#: the largest residual of a whole curve.
GUIDES = (2.0, 3.5)
#: Number of averaging times per decade at which model and effects are drawn, so that lines look smooth.
PER_DECADE = 32
#: Neighboring τ whose |z| exceeds this value belong to one failing range.
RANGE_Z = 2.0
#: Single ordinates are drawn in a failing range or narrow band, and on each side over this multiple of its width.
MARGIN_WIDTHS = 1.0
#: Number of single ordinates drawn on each side of a spectral line.
LINE_ORDINATES = 40
#: Maximum number of points for single ordinates in one range; with more, neighbors are averaged.
MAX_SINGLE = 600
#: Minimum number of degrees of freedom of a point of the spectrum. With fewer, its interval spans decades.
MIN_DOF = 4
#: The density before removing deterministic effects is shown where its logarithm differs by more than this.
MIN_LOG_CHANGE = 0.1


@dataclass(frozen=True, slots=True)
class ComponentStyle:
    """Style and label with which the effect at index `place` of a model is drawn.

    `frequency` (Hz) is that of a spectral line. `limit` is the upper 95 % limit of the coefficient of a noise process
    that is not detected, with which the effect is drawn.
    """

    color: str
    dash: str
    label: str
    place: int
    frequency: float | None = None
    limit: float | None = None


def component_styles(fit: Fit) -> tuple[ComponentStyle, ...]:
    """One `ComponentStyle` per effect, in the order of ``fit.curve.components``: noise processes, then known functions.

    An effect that was not detected is dashed and labeled as a 95 % limit. From the seventh effect on, colors repeat and
    lines are dotted.
    """
    placed = list(enumerate(fit.model))
    random = [(k, e) for k, e in placed if isinstance(e, Stochastic)]
    known = [(k, e) for k, e in placed if isinstance(e, Deterministic)]
    out = []
    for i, (place, effect) in enumerate([*random, *known]):
        numbers = values_text(effect, fit.estimates[place])
        name = effect_text(fit, effect)
        label = f"{name}: {numbers}" if numbers else name
        dash = "solid" if i < len(COMPONENTS) else "dot"
        frequency = effect.base_frequency if isinstance(effect, Deterministic) else None
        limit = _upper_limit(effect, fit.estimates[place])
        if limit is not None:
            label, dash = f"{label} (95 % limit)", "dash"
        out.append(
            ComponentStyle(COMPONENTS[i % len(COMPONENTS)], dash, label, place, frequency, limit)
        )
    return tuple(out)


def _upper_limit(effect: Effect, values: dict[str, Any]) -> float | None:
    """Upper 95 % limit of the coefficient of a noise process that was not detected; otherwise None."""
    value = values.get(effect.coefficient) if isinstance(effect, Stochastic) else None
    if not isinstance(value, Estimate) or value.detected or value.interval is None:
        return None
    return value.interval[1]


def failing_tau_ranges(fit: Fit) -> list[tuple[float, float, float]]:
    """(low, high, measured/model) of the ranges of τ (s) in which the measured curve deviates from the model.

    In a range, all residuals z (in σ) have the same sign and |z| > 2, and the largest |z| is at least 4. The ratio is
    that at the τ with this largest |z|.
    """
    curve = fit.curve
    z = np.where(np.isfinite(curve.z), curve.z, 0.0)
    out, start = [], 0
    sign = np.where(np.abs(z) > RANGE_Z, np.sign(z), 0.0)
    for i in range(1, z.size + 1):
        if i < z.size and sign[i] == sign[start]:
            continue
        inside = np.abs(z[start:i])
        if sign[start] and inside.max() >= MIN_FAILING_SCORE:
            # The same factor as in the text of the verdict.
            at = start + int(inside.argmax())
            ratio = float(curve.measured[at] / curve.model[at])
            out.append((float(curve.tau[start]), float(curve.tau[i - 1]), ratio))
        start = i
    return out


def tau_spans(fit: Fit) -> tuple[Span, ...]:
    """Shaded ranges of τ in which a model fails, labeled by the factor between model and measurement: ``×2 too low``."""
    return tuple(
        Span(
            low / 1.06,
            high * 1.06,
            "fail",
            "where the model fails",
            f"×{number(max(ratio, 1 / ratio), 3)} too {'low' if ratio > 1 else 'high'}",
        )
        for low, high, ratio in failing_tau_ranges(fit)
    )


def spectrum_spans(fit: Fit, worst: tuple[float, float] | None) -> tuple[Span, ...]:
    """The shaded frequency range `worst` (Hz) in which the model fails; empty for None.

    Its text states the ratio measured/model of the frequency bin in this range with the largest |z|.
    """
    if worst is None:
        return ()
    low, high = fit.data.bins.limits(fit.data.rate)
    inside = (low >= worst[0] * (1 - 1e-9)) & (high <= worst[1] * (1 + 1e-9))
    ratio = (fit.solution.power / fit.solution.spectrum)[inside]
    peak = np.abs(fit.z[inside]).argmax()
    at = 0.5 * float((low + high)[inside][peak])
    text = f"{number(float(ratio[peak]), 3)} × the model at {number(at, 3)} Hz"
    return (Span(*worst, "fail", "where the model fails", text),)


def interval(deviation: Array, edf: Array) -> tuple[Array, Array]:
    """Tuple (low, high): χ² 95 % interval of a deviation with `edf` equivalent degrees of freedom, shape of `deviation`."""
    from scipy.special import chdtri

    low = deviation * np.sqrt(edf / chdtri(edf, 0.025))
    return low, deviation * np.sqrt(edf / chdtri(edf, 0.975))


def _model_curves(fit: Fit) -> tuple[Array, Array, list[Array]]:
    """(τ in s, Allan deviation of the model, list with one array of Allan deviations per effect).

    The effects are in the order of `component_styles`; an effect that was not detected is drawn at its 95 % limit. The
    τ are those of the measured curve and up to 32 more per decade, in whole samples.
    """
    data, model = fit.curve.of
    own = fit.curve.factors
    grid = 10 ** np.arange(0.0, np.log10(own[-1]), 1.0 / PER_DECADE)
    factors = np.unique(np.concatenate([own, np.round(grid).astype(np.int64)]))
    factors = factors[factors >= own[0]]
    total = expected_variance(data.terms(model), factors)
    if model.deterministic:
        total = total + data.deviation_of(data.signal(model.deterministic), factors) ** 2
    drawn = []
    components = components_at(data, model, factors).values()
    for part, values in zip(component_styles(fit), components, strict=True):
        if part.limit is None:
            drawn.append(values)
            continue
        effect = model.effects[part.place]
        assert isinstance(effect, Stochastic)
        unit = expected_variance(data.unit_terms(model, effect), factors)
        drawn.append(part.limit * np.sqrt(unit))
    return factors / data.rate, np.sqrt(total), drawn


def allan_panels(fit: Fit, spans: Sequence[Span]) -> tuple[Panel, ...]:
    """Two panels: Allan deviation with intervals, model, band and effects; strip of residuals in σ below.

    The y range covers both curves, and upper ends of intervals with at least 2 degrees of freedom; effects may lie
    outside.
    """
    curve, band = fit.curve, fit.band
    low, high = interval(curve.measured, curve.edf)
    tau, total, drawn = _model_curves(fit)
    marks: tuple[Mark, ...] = (
        *spans,
        Band(band.tau, band.low_everywhere, band.high_everywhere, "model", TOGETHER, 0.12),
        Band(band.tau, band.low, band.high, "model", SCATTER, SCATTER_OPACITY),
        *(
            Line(tau, values, part.color, part.label, 1.2, part.dash)
            for part, values in zip(component_styles(fit), drawn, strict=True)
        ),
        Line(tau, total, "model", "model", 2.2),
        Points(curve.tau, curve.measured, "measured", "measured ± 95 %", low, high),
    )
    x = log_axis(TAU, curve.tau)
    # Effects may lie decades below, so only the curve determines the limits.
    sure = curve.edf >= 2.0
    shown = (curve.measured, curve.model, high[sure], 0.5 * curve.measured)
    y = deviation_axis(fit.recording.unit, log_axis("", *shown))
    panel = Panel(x, y, marks, title="Allan deviation", show_x=False)
    return panel, _residual_panel(x, curve.tau, curve.z, 0, spans)


def ordinates_between(
    fit: Fit, low: float, high: float, whole: bool = False, most: int = MAX_SINGLE
) -> tuple[Array, Array]:
    """(frequencies in Hz, two-sided densities) of the single ordinates between `low` and `high` Hz.

    The model's known functions of time are removed, unless `whole`. With more than `most` ordinates, groups of
    neighbors are averaged. Both arrays are empty for summaries, and if over 10 % of the samples are missing.
    """
    data = fit.data
    j, starts = _ordinate_groups(fit, low, high, most)
    source = data.ordinates if whole else fit.solution.ordinates
    frequency, power = j * data.rate / (2.0 * data.n), source[j] ** 2 / data.rate
    return _group_means(frequency, starts), _group_means(power, starts)


def residuals_between(
    fit: Fit, low: float, high: float, most: int = MAX_SINGLE
) -> tuple[Array, Array]:
    """(frequencies in Hz, standard normal scores of measured versus expected power), otherwise like `ordinates_between`."""
    data = fit.data
    j, starts = _ordinate_groups(fit, low, high, most)
    if not j.size:
        return np.zeros(0), np.zeros(0)
    power = _group_means(fit.solution.ordinates[j] ** 2, starts)
    expected = _group_means(density(data.terms(fit.model), j, data.n), starts)
    count = np.diff(np.append(starts, j.size)).astype(np.float64)
    frequency = _group_means(j * data.rate / (2.0 * data.n), starts)
    return frequency, normal_scores(power, count, expected)


def _ordinate_groups(fit: Fit, low: float, high: float, most: int) -> tuple[Ordinates, Ordinates]:
    """(j, starts): single ordinates from `low` to `high` Hz, and the indices into j at which at most `most` groups begin.

    Ordinate j of the cosine transform has the frequency j·rate/(2 n). Both are empty for summaries, and if over 10 % of
    the samples are missing.
    """
    data = fit.data
    step = data.rate / (2.0 * data.n)
    first, last = max(1, int(np.ceil(low / step))), min(data.n - 1, int(high / step))
    j = np.arange(first, max(first, last + 1) if has_all_ordinates(data) else first)
    return j, np.arange(0, j.size, max(1, -(-j.size // most)))


def _group_means(values: NDArray[np.floating[Any]], starts: Ordinates) -> Array:
    """1-D array with the mean of each group of `values`; the groups begin at the indices `starts`. Empty without values."""
    if not values.size:
        return np.zeros(0)
    return np.asarray(np.add.reduceat(values, starts) / np.diff(np.append(starts, values.size)))


def _narrow_band_ranges(fit: Fit) -> list[tuple[float, float]]:
    """(low, high) in Hz around and beyond the bands of the model that are narrower than a frequency bin.

    Empty for summaries, and if over 10 % of the samples are missing.
    """
    if not has_all_ordinates(fit.data):
        return []
    aside = LINE_ORDINATES * fit.data.rate / (2.0 * fit.data.n)
    out = []
    for low, high in (band for e in fit.model if is_narrow(e) for band in e.peaks):
        margin = MARGIN_WIDTHS * (high - low) + aside
        out.append((low - margin, high + margin))
    return out


def _single_ordinates(fit: Fit, spans: Sequence[Span], lines: Sequence[float]) -> list[Line]:
    """Lines that show single ordinates of the spectrum instead of averages.

    They are drawn in failing ranges `spans` with margins, near spectral lines and narrow bands of the model, and near
    `lines`, the frequencies (Hz) of missing spectral lines.
    """
    out = [
        Line(*ordinates_between(fit, *near), "raw", SINGLE, 1.0)
        for near in _narrow_band_ranges(fit)
    ]
    for span in spans:
        aside = MARGIN_WIDTHS * (span.high - span.low)
        f, power = ordinates_between(fit, span.low - aside, span.high + aside)
        out.append(Line(f, power, "raw", SINGLE, 1.0))
    step = fit.data.rate / (2.0 * fit.data.n)
    known = [(p.frequency, True) for p in component_styles(fit) if p.frequency is not None]
    for frequency, whole in (*known, *((f, False) for f in lines)):
        low, high = frequency - LINE_ORDINATES * step, frequency + LINE_ORDINATES * step
        out.append(Line(*ordinates_between(fit, low, high, whole), "raw", SINGLE, 1.0))
    return [line for line in out if line.x.size]


def missing_lines(check: Check | None) -> tuple[float, ...]:
    """Tuple of the frequencies in Hz of the spectral lines that a check suggests as significant effects; () for None."""
    found = () if check is None else check.significant
    return tuple(
        frequency
        for s in found
        if isinstance(s.effect, Deterministic)
        and (frequency := s.effect.base_frequency) is not None
    )


@dataclass(frozen=True, slots=True, eq=False)
class _SpectrumGrid:
    """Frequencies at which the spectrum of a fit is drawn: points that average bins, and vertices of the model's lines.

    Points have the index of their `first` bin, `count` (degrees of freedom) and `frequency` (Hz). The vertices `at`
    (Hz), `order` and `ordinates` are those of `_line_frequencies`.
    """

    fit: Fit
    first: NDArray[np.int64]
    count: Array
    frequency: Array
    at: Array
    order: NDArray[np.intp]
    ordinates: Ordinates

    def point_densities(self, power: Array) -> Array:
        """Two-sided density (U²/Hz, U the unit of the samples) at each drawn point; `power` has a value per bin."""
        data = self.fit.data
        weights = data.bins.count
        total, width = (np.add.reduceat(v, self.first) for v in (weights * power, weights))
        return np.asarray(total / width / data.rate)

    def line_densities(self, power: Array, terms: tuple[Term, ...], theta: float) -> Array:
        """Two-sided density (U²/Hz) of a model at the frequencies `at`, to be drawn as a line.

        At points that average bins, it is `point_densities` of `power`. At single ordinates near narrow bands, it is
        exact: `theta` times the spectrum of `terms`.
        """
        near, data = self.ordinates, self.fit.data
        exact = theta * density(terms, near, data.bins.n) / data.rate if near.size else np.zeros(0)
        return np.concatenate([self.point_densities(power), exact])[self.order]


def _spectrum_grid(fit: Fit) -> _SpectrumGrid:
    """`_SpectrumGrid` of a fit.

    The frequency of a point is the geometric mean of the lower limit of its first and the upper limit of its last bin.
    """
    bins, rate = fit.data.bins, fit.data.rate
    first, count = _merged_bins(fit.solution.count)
    bottom, top = bins.limits(rate)
    last = np.append(first[1:], bottom.size) - 1
    frequency = np.sqrt(np.maximum(bottom[first], rate / (2.0 * bins.n)) * top[last])
    lines = _line_frequencies(fit, frequency, (bottom[first], top[last]))
    return _SpectrumGrid(fit, first, count, frequency, *lines)


def _effect_marks(grid: _SpectrumGrid) -> list[Mark]:
    """A `Line` for the density of each noise process, or of its 95 % limit; a dashed `Rule` per spectral line."""
    fit, marks = grid.fit, list[Mark]()
    for part in component_styles(fit):
        own = fit.solution.effects[part.place]
        if isinstance(own, Process):
            theta = own.theta if part.limit is None else part.limit**2
            terms = fit.data.unit_terms(fit.model, own.effect)
            values = grid.line_densities(own.column * theta, terms, theta)
            marks.append(Line(grid.at, values, part.color, part.label, 1.2, part.dash))
        elif part.frequency is not None:
            marks.append(Rule(part.frequency, "x", part.color, "dash", part.label))
    return marks


def _points_before_removal(grid: _SpectrumGrid, measured: Array) -> list[Points]:
    """At most one `Points`: spectrum before the removal of known functions of time, where over 10 % off `measured`."""
    if not grid.fit.model.deterministic:
        return []
    raw = grid.point_densities(grid.fit.data.bins.power(grid.fit.data.ordinates))
    changed = np.abs(np.log(raw / measured)) > MIN_LOG_CHANGE
    if not changed.any():
        return []
    words = "before removing steps, lines and drifts"
    return [Points(grid.frequency[changed], raw[changed], "raw", words, size=4.5, hollow=True)]


def spectrum_panels(
    fit: Fit, column: int = 1, spans: Sequence[Span] = (), lines: Sequence[float] = ()
) -> tuple[Panel, ...]:
    """Two panels: power spectral density (two-sided) with model and effects, and below it residuals in σ.

    Single ordinates are drawn in the failing ranges `spans` and at `lines`, the frequencies (Hz) of missing lines.
    """
    from scipy.special import chdtri

    solution, grid = fit.solution, _spectrum_grid(fit)
    frequency, count = grid.frequency, grid.count
    measured, model = map(grid.point_densities, (solution.power, solution.spectrum))
    drawn = grid.line_densities(solution.spectrum, fit.data.terms(fit.model), 1.0)
    low, high = count / chdtri(count, 0.025), count / chdtri(count, 0.975)
    singles = _single_ordinates(fit, spans, lines)
    before = _points_before_removal(grid, measured)
    ends = measured * low, measured * high
    marks: tuple[Mark, ...] = (
        *spans,
        *singles,
        Band(frequency, model / high, model / low, "model", SCATTER, SCATTER_OPACITY),
        *_effect_marks(grid),
        *before,
        Line(grid.at, drawn, "model", "model", 2.2),
        Points(frequency, measured, "measured", "measured ± 95 %", *ends, 3.0),
    )
    x = log_axis("frequency f (Hz)", frequency)
    sure = count >= min(MIN_DOF, count.max())
    y = log_axis(
        "",
        measured,
        drawn,
        *(values[sure] for values in (*ends, model / low)),
        0.5 * measured,
        *(points.y for points in before),
        *(line.y.max() for line in singles),
    )
    title = "Power spectral density, two-sided"
    y = density_axis(fit.recording.unit, y)
    panel = Panel(x, y, marks, 0, column, title=title, show_x=False)
    power = solution.count * solution.power / solution.spectrum
    ratio = np.add.reduceat(power, grid.first) / count
    z = normal_scores(ratio, count, np.ones(count.size))
    return panel, _residual_panel(x, frequency, z, column, spans)


def _line_frequencies(
    fit: Fit, frequency: Array, limits: tuple[Array, Array]
) -> tuple[Array, NDArray[np.intp], Ordinates]:
    """(vertices in Hz, order, ordinates): frequencies at which the curve of a model is drawn in the spectrum.

    Most vertices are the measured points at `frequency` (Hz), each a mean over bins between the `limits` (low, high).
    Near bands of the model that are narrower than bins, single ordinates replace the points. `ordinates` are their
    indices in the cosine transform. `order` is an index array into the points followed by the ordinates: it sorts them
    by frequency and omits the replaced points.
    """
    step = fit.data.rate / (2.0 * fit.data.n)
    near, kept = [np.zeros(0, dtype=np.int64)], np.ones(frequency.size, dtype=bool)
    for low, high in _narrow_band_ranges(fit):
        f, _ = ordinates_between(fit, low, high)
        near.append(np.round(f / step).astype(np.int64))
        kept &= (limits[1] < low) | (limits[0] > high)
    ordinates = np.unique(np.concatenate(near))
    joined = np.concatenate([frequency, ordinates * step])
    order = np.argsort(joined, kind="stable")
    order = order[np.append(kept, np.ones(ordinates.size, dtype=bool))[order]]
    return joined[order], order, ordinates


def _merged_bins(count: Array) -> tuple[NDArray[np.int64], Array]:
    """(index of the first bin, degrees of freedom) of each plotted point, because a screen cannot resolve all bins.

    `count` has the degrees of freedom of each bin. A point has at least 4 degrees of freedom, unless all bins together
    have fewer.
    """
    cells = cells_of(count.size)
    first, total = [0], 0.0
    for cell, value in zip(cells, np.add.reduceat(count, cells), strict=True):
        if total >= MIN_DOF:
            first.append(cell)
            total = 0.0
        total += value
    if total < MIN_DOF and len(first) > 1:
        first.pop()
    starts = np.array(first, dtype=np.int64)
    return starts, np.maximum(np.add.reduceat(count, starts), 1e-9)


def _residual_panel(x: Axis, at: Array, z: Array, column: int, spans: Sequence[Span]) -> Panel:
    """`Panel` of residuals below a curve: standard normal scores `z` at the x values `at`, and guides at 0, ±2 and ±3.5."""
    marks: list[Mark] = [
        *(replace(span, text="") for span in spans),
        Rule(0.0, "y", "guide", "solid"),
    ]
    for guide, dash in zip(GUIDES, ("dash", "dot"), strict=True):
        marks += [Rule(sign * guide, "y", "guide", dash) for sign in (-1.0, 1.0)]
    kept = np.isfinite(z)
    marks.append(Points(at[kept], z[kept], "measured", size=3.5))
    return Panel(x, score_axis("residual (σ)", z), tuple(marks), 1, column, grid=False)
