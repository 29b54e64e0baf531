"""Fits of a model to a recording, to each of its columns, and to several recordings; fits of another model again."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.common.choices import METHODS
from allanite.common.errors import InputError
from allanite.common.several import results_by_column
from allanite.common.validation import require_one_column, require_recording
from allanite.effects import Effect, Model, as_model
from allanite.fit.classical.refit import refit
from allanite.fit.engine import solve
from allanite.fit.likelihood.data import Data, prepare
from allanite.fit.locked import locked_error
from allanite.fit.missing.completion import complete_and_fit, is_still_complete, without_ends
from allanite.fit.result import Fit
from allanite.fit.several import Fits, ManyFits, of_fits
from allanite.fit.summarized import of_summary, require_summary_supports
from allanite.recording import Recording
from allanite.summary import Summary

if TYPE_CHECKING:
    from collections.abc import Sequence


def fit_model(
    recording: Recording | Summary, model: Model | Effect | str, method: str = "whittle"
) -> Fit:
    """`Fit` of a model to a recording of one column.

    Parameters
    ----------
    recording : Recording or Summary
        One column; `fit_columns` fits several columns.
    model : Model, Effect or str
        Values are start values; held values stay; None is estimated without a start value.
    method : {"whittle", "gls", "lines"}
        Whittle likelihood of the cosine ordinates; generalized least squares on the overlapping Allan
        variance with its covariance under the fitted model; or the classical reading of straight lines.

    Returns
    -------
    Fit

    Raises
    ------
    InputError
        Infinite samples, an unknown method, a line above half the sampling rate, more than 64 effects, or held values
        or limits with `gls` or `lines`.
    TooShortError
        Fewer than 32 samples, or constant samples.

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
    require_one_column(recording, "al.fit_columns(recording, model)")
    return _fit(recording, as_model(model).limited("a fit"), method)


def _fit(recording: Recording | Summary, model: Model, method: str = "whittle") -> Fit:
    """`Fit` of a model of any size by one method (`fit_model` limits the number of effects).

    Missing samples are replaced by draws from the model. The first and last sample count as missing if the jump between
    them distorts the spectrum (`without_ends`). `InputError` for an unknown method or values that do not suit the record,
    `TooShortError` for rates of which nearly all have one code, and the errors of `prepare`.
    """
    if method not in METHODS:
        raise InputError(f"unknown method {method!r}; use one of {', '.join(METHODS)}")
    if recording.keeps_all_samples:
        recording = recording.recording().measured
        if (error := locked_error(recording)) is not None:
            raise error
    model = _with_followed_column(model, list(recording.covariates))
    _check_values(model, recording.n, recording.rate)
    if isinstance(recording, Summary):
        require_summary_supports(recording, model, method)
        data: Data = of_summary(recording)
    else:
        # n angles give n − 1 rates.
        n = recording.n - (recording.quantity == "angle")
        data = prepare(recording, model.missing(n, recording.rate))
    if data.missing is not None:
        data, solution = complete_and_fit(data, model)
    else:
        solution = solve(data, model)
    inside = without_ends(data, solution)
    if inside is not None:
        data, solution = complete_and_fit(inside, model)
    fit = Fit(recording, solution.model, "whittle", data, solution)
    if method == "whittle":
        return fit
    return refit(fit, method)


def fit_columns(recording: Recording, model: Model | Effect | str, method: str = "whittle") -> Fits:
    """`Fits` of one model to each column of a recording.

    Parameters
    ----------
    recording : Recording
        One or more columns.
    model, method
        See `fit_model`.

    Returns
    -------
    Fits
        Mapping from column names to `Fit`; columns of the same unit are also pooled.

    Raises
    ------
    InputError, TooShortError
        See `fit_model`.

    Examples
    --------
    >>> white = np.random.default_rng(1).standard_normal((5000, 2))
    >>> log = al.Recording(white, rate=100, unit="deg/s", columns=["gyro_x", "gyro_y"])
    >>> fits = al.fit_columns(log, "N")
    >>> list(fits), round(fits["gyro_x"]["N"].value, 2)
    (['gyro_x', 'gyro_y'], 0.1)
    """
    require_recording(recording)
    parsed = as_model(model)
    return Fits(
        results_by_column(recording.measured, lambda column: fit_model(column, parsed, method))
    )


def fit_many(
    recordings: Sequence[Recording] | Recording,
    model: Model | Effect | str,
    method: str = "whittle",
) -> ManyFits:
    """`ManyFits`: one model fitted to several recordings, with pooled coefficients and tests of agreement.

    Parameters
    ----------
    recordings : sequence of Recording, or Recording of several columns
        Every column counts as a recording. All must have the same unit.
    model : Model, Effect or str
    method : {"whittle", "gls", "lines"}

    Returns
    -------
    ManyFits

    Raises
    ------
    InputError
        No recordings, or recordings of different units.

    References
    ----------
    Hartung, J. & Knapp, G. (2001). Statistics in Medicine 20, 1771: the interval of a mean over recordings that differ.
    Paule, R. C. & Mandel, J. (1982). J. Res. Natl. Bur. Stand. 87, 377: the spread between them.

    Examples
    --------
    One of three units has twice the noise:

    >>> noises = [al.AngleRandomWalk(N=N) for N in (0.1, 0.1, 0.2)]
    >>> logs = [one.simulate(duration=300, rate=10, seed=k) for k, one in enumerate(noises)]
    >>> al.fit_many(logs, al.AngleRandomWalk()).agree
    False
    """
    given = [recordings] if isinstance(recordings, Recording) else list(recordings)
    for one in given:
        require_recording(one)
    columns = [column for recording in given for column in recording]
    if not columns:
        raise InputError("no recordings: give at least one")
    return of_fits([fit_model(column, model, method=method) for column in columns])


def _with_followed_column(model: Model, columns: list[str]) -> Model:
    """Copy of a model in which effects that follow an unnamed logged column follow the only one in `columns`.

    `model` itself unless there is exactly one column.
    """
    if len(columns) != 1:
        return model
    follow = [
        e.with_values(column=columns[0]) if e.values.get("column", "") is None else e for e in model
    ]
    return type(model)(tuple(follow))


def refitted(fit: Fit, model: Model) -> Fit:
    """`Fit` of another model to the recording of `fit` by Whittle likelihood, whatever the method of `fit`.

    If both models exclude the same samples, the prepared data of `fit` are reused, with the draws for missing samples. Both
    likelihoods then refer to the same data.
    """
    if [e for e in model if e.removes] != [e for e in fit.model if e.removes]:
        return _fit(fit.recording, model)
    _check_values(model, fit.recording.n, fit.recording.rate)
    solution = solve(fit.data, model, like=fit.solution)
    return Fit(fit.recording, solution.model, "whittle", fit.data, solution)


def fit_again(fit: Fit, model: Model) -> Fit:
    """`Fit` of another model to the recording of `fit` by the same method.

    A Whittle fit starts from the solution and the data of `fit`, and completes missing samples again (`completed_again`).
    """
    if fit.method == "whittle":
        return completed_again(refitted(fit, model), fit)
    return _fit(fit.recording, model, method=fit.method)


def completed_again(found: Fit, before: Fit) -> Fit:
    """`Fit` of the model of `found` whose missing samples are completed under this model; `found` itself if they are.

    `found` is a Whittle fit to the data of `before`, or to other data, which are complete. Missing samples are drawn again
    if draws from the new model would change logL by 0.02 nats or more.
    """
    if found.data is not before.data:
        return found
    if not is_still_complete(before.data, before.solution, found.solution):
        data, solution = complete_and_fit(before.data, found.model, found.solution)
        found = Fit(found.recording, solution.model, found.method, data, solution)
    if without_ends(found.data, found.solution) is None:
        return found
    return _fit(found.recording, found.model, method=found.method)


def _check_values(model: Model, n: int, rate: float) -> None:
    """Raise InputError if values of a model do not suit a record of `n` samples at `rate` Hz.

    Refused are missing times of events (except optional ones), lines above half the sampling rate, and limits in s or Hz
    that the record cannot resolve.
    """
    if missing := [
        f"{e.kind}.{p.name}"
        for e in model
        for p in e.parameters
        if p.role == "time" and e.values[p.name] is None and not p.optional
    ]:
        raise InputError(f"{missing[0]} has no value; give one, or let `check` find the event")
    for line in model.deterministic:
        if (line.base_frequency or 0.0) > 0.5 * rate:
            raise InputError(
                f"{line.kind}: frequency = {line.base_frequency:g} Hz is above half the sampling rate,"
                f" {rate / 2:g} Hz; give the alias frequency at which the samples show the line"
            )
    for effect in model:
        for name in effect.limits:
            if effect.parameter(name).unit in {"s", "Hz"}:
                _check_limits(effect, name, n, rate)


def _check_limits(effect: Effect, name: str, n: int, rate: float) -> None:
    """Raise InputError if the limits of the parameter `name` (s or Hz) exclude all values that the record can resolve."""
    grids = [variant.grid(name, n, rate) for variant in effect.variants()]
    first, last = 0.5 * min(g.min() for g in grids), 2.0 * max(g.max() for g in grids)
    if effect.periodic:
        last = 0.5 * rate
    low, high = effect.checked_limits[name]
    if high < first or low >= last:
        raise InputError(
            f"{effect.kind}: the limits of {name}, {low:g} … {high:g}, are outside the range that this record can resolve,"
            f" {first:g} … {last:g} {effect.parameter(name).unit}"
        )
