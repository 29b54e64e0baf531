"""Fit of a model to a recording: estimates, intervals, and goodness of fit.

Input: a recording (or a summary, or several recordings) and a model. Output: a `Fit`. Add a likelihood in
`likelihood/`, a search for shapes in `shapes/`, and a further fitting method in `classical/`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

from allanite.common.errors import InputError
from allanite.common.several import by_column, former_use
from allanite.common.validation import require_recording
from allanite.effects import Modifier, Periodic, as_model
from allanite.fit.engine import solve
from allanite.fit.likelihood.data import prepare
from allanite.fit.locked import locked_error
from allanite.fit.measures import Error, Misfit
from allanite.fit.missing.completion import settle
from allanite.fit.missing.ends import without_ends
from allanite.fit.result import Fit
from allanite.fit.summarised import of_summary, require_summary_supports
from allanite.recording import Recording
from allanite.summary import Summary

if TYPE_CHECKING:
    from allanite.effects import Effect, Model
    from allanite.fit.several.columns import Fits

__all__ = [
    "METHODS",
    "Error",
    "Fit",
    "Misfit",
    "completed",
    "fit_columns",
    "fit_model",
    "refitted",
    "removes",
]

METHODS = ("whittle", "gls", "lines")


def fit_model(
    recording: Recording | Summary, model: Model | Effect | str, method: str = "whittle"
) -> Fit:
    """Fit a model to a recording.

    Parameters
    ----------
    recording : Recording or Summary
        One column; `fit_columns` fits each of several.
    model : Model, Effect or str
        Values are starting values, held ones stay, None is found.
    method : {"whittle", "gls", "lines"}
        Whittle likelihood of the cosine ordinates; generalised least squares on the overlapping Allan
        variance with its covariance under the fitted mixture; or the classical reading of straight lines.

    Returns
    -------
    Fit

    Raises
    ------
    InputError
        Infinities, an unknown method, a line beyond half of the rate, more than 64 effects.
    TooShortError
        Fewer than 32 samples, or constant ones.

    References
    ----------
    Whittle, P. (1953). Estimation and information in stationary time series. Arkiv för Matematik 2, 423.

    Examples
    --------
    >>> truth = al.parse_model("N(N=0.1)+K(K=0.01)")
    >>> fit = al.fit_model(truth.simulate(duration=1000, rate=10, seed=1, unit="deg/s"), "N+K")
    >>> low, high = fit["N"].interval
    >>> bool(low < 0.1 < high)
    True
    """
    require_recording(recording)
    return _fit(recording, as_model(model).limited("a fit"), method)


def _fit(recording: Recording | Summary, model: Model, method: str = "whittle") -> Fit:
    """As `fit_model`, of a model of any size: one that was built step by step may have grown beyond its limit."""
    if method not in METHODS:
        raise InputError(f"method {method!r} is unknown (known: {', '.join(METHODS)})")
    if isinstance(recording, Summary) and recording.whole:
        recording = recording.recording()
    if isinstance(recording, Recording):
        recording = recording.measured
    if isinstance(recording, Recording) and len(recording.columns) > 1:
        former_use(recording.columns, "al.fit_columns(recording, model)")
        several: Any = fit_columns(recording, model, method)
        return several
    if isinstance(recording, Recording) and (error := locked_error(recording)) is not None:
        raise error
    model = _following(model, list(recording.covariates))
    _check_values(model, recording.n, recording.rate)
    if isinstance(recording, Summary):
        require_summary_supports(recording, model, method)
        data = of_summary(recording)
    else:
        # Angles have one difference fewer than samples.
        n = recording.n - (recording.quantity == "angle")
        data = prepare(recording, model.missing(n, recording.rate))
    if data.missing is None:
        solution = solve(data, model)
    else:
        data, solution = settle(data, model)
    inside = without_ends(data, solution)
    if inside is not None:
        data, solution = settle(inside, model)
    # A summary that does not keep its samples answers what a fit asks of a recording.
    source = cast("Recording", recording)
    fit = Fit(source, solution.model, "whittle", data, solution)
    if method == "whittle":
        return fit
    from allanite.fit.classical.refit import refit

    return refit(fit, method)


def fit_columns(recording: Recording, model: Model | Effect | str, method: str = "whittle") -> Fits:
    """Fit one model to each column of a recording.

    Parameters
    ----------
    recording : Recording
        One or more columns.
    model, method
        As of `fit_model`.

    Returns
    -------
    Fits
        A mapping from the name of a column to its `Fit`; columns of one unit are also pooled.

    Raises
    ------
    InputError, TooShortError
        As of `fit_model`.

    Examples
    --------
    >>> white = np.random.default_rng(1).standard_normal((5000, 2))
    >>> log = al.Recording(white, rate=100, unit="deg/s", columns=["gyro_x", "gyro_y"])
    >>> fits = al.fit_columns(log, "N")
    >>> list(fits), round(fits["gyro_x"]["N"].value, 2)
    (['gyro_x', 'gyro_y'], 0.1)
    """
    from allanite.fit.several.columns import Fits

    require_recording(recording)
    parsed = as_model(model)
    return Fits(by_column(recording.measured, lambda column: fit_model(column, parsed, method)))


def _following(model: Model, columns: list[str]) -> Model:
    """The model, of which an effect that names no column follows the only one there is."""
    if len(columns) != 1:
        return model
    follow = [
        e.with_values(column=columns[0]) if e.values.get("column", "") is None else e for e in model
    ]
    return type(model)(tuple(follow))


def refitted(fit: Fit, model: Model) -> Fit:
    """The recording of a fit with another model; its transforms are used again where the same samples are missing.

    What stands for missing samples stays, so that the two likelihoods are of the same numbers.
    """
    if [e for e in model if removes(e)] != [e for e in fit.model if removes(e)]:
        return _fit(fit.recording, model)
    _check_values(model, fit.recording.n, fit.recording.rate)
    solution = solve(fit.data, model, like=fit.solution)
    return Fit(fit.recording, solution.model, "whittle", fit.data, solution)


def completed(fit: Fit, model: Model) -> Fit:
    """The recording of a fit with another model by the same method; missing samples are completed under that one."""
    if fit.method == "whittle" and fit.data.missing is None:
        found = refitted(fit, model)
        if without_ends(found.data, found.solution) is None:
            return found
    return _fit(fit.recording, model, method=fit.method)


def removes(effect: Effect) -> bool:
    """Whether an effect takes samples out of the record."""
    return isinstance(effect, Modifier) and effect.removes


def _check_values(model: Model, n: int, rate: float) -> None:
    if missing := [
        f"{e.kind}.{p.name}"
        for e in model
        for p in e.parameters
        if p.role == "time" and e.values[p.name] is None and not p.optional
    ]:
        raise InputError(f"{missing[0]} has no value: give one, or let check find it over time")
    for line in (e for e in model if isinstance(e, Periodic)):
        if (line.frequency or 0.0) > 0.5 * rate:
            raise InputError(
                f"{line.kind}: frequency = {line.frequency:g} Hz is beyond half of the sampling rate,"
                f" {rate / 2:g} Hz: give the one at which the samples show it"
            )
    for effect in model:
        for name in effect.limits:
            if effect.parameter(name).unit in {"s", "Hz"}:
                _check_limits(effect, name, n, rate)


def _check_limits(effect: Effect, name: str, n: int, rate: float) -> None:
    """Refuse limits of a time or a frequency between which a record of n samples tells nothing."""
    grids = [variant.grid(name, n, rate) for variant in effect.variants()]
    first, last = 0.5 * min(g.min() for g in grids), 2.0 * max(g.max() for g in grids)
    if isinstance(effect, Periodic):
        last = 0.5 * rate
    low, high = effect.limits[name]
    if high < first or low >= last:
        raise InputError(
            f"{effect.kind}: the limits of {name}, {low:g} … {high:g}, leave nothing that this record can tell,"
            f" {first:g} … {last:g} {effect.parameter(name).unit}"
        )
