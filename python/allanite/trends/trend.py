"""Rate, offset, steps and periodic terms of a series, by generalized least squares with the noise fitted to the series.

The noise is white noise, flicker noise, a random walk, a power law, or a sum of these, chosen by evidence. The likelihood
is exact for the actual times of the samples, so that missing days and uneven spacing cause no error.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite import _kernels
from allanite.common.arrays import Array
from allanite.common.documents import fields_dict
from allanite.common.errors import InputError, TooShortError
from allanite.common.numbers import YEAR, duration_text, with_readable_numbers
from allanite.common.parameters import Estimate
from allanite.common.several import Several, results_by_column
from allanite.common.showing import text_html
from allanite.common.threads import stop_if_unwanted
from allanite.common.validation import require_one_column, require_recording
from allanite.effects import Model, parse_model
from allanite.fit.stamped.candidates import (
    Candidate,
    FittedNoise,
    fit_noise,
    power_law_exponent,
)
from allanite.fit.stamped.likelihood import Regressed, StampedSeries, innovations
from allanite.fit.stamped.noise import sampled_noise
from allanite.trends.design import J2000, PER, Functions, date_of, seconds_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from allanite.fit.stamped.noise import StampedNoise
    from allanite.recording import Recording

#: Default periods: annual and semi-annual terms, s.
PERIODS = (YEAR, 0.5 * YEAR)
#: Default periodic terms are fitted to records of at least this length, years.
MIN_YEARS = 1.0
#: Minimum number of samples, in addition to one for each known function. Chosen by judgment; not measured.
MIN_SAMPLES = 16
#: Maximum number of steps that the search adds. Chosen by judgment; not measured.
MAX_STEPS = 50
#: Multiples of the length of the record for which the standard error of the rate is predicted.
LENGTH_MULTIPLES = (1.0, 2.0, 4.0)
#: Probability that a record without steps has a false step.
FALSE_ALARM_PROBABILITY = 0.01
#: Number of candidate steps that are whitened together; limits memory.
STEPS_PER_BLOCK = 256
#: Distance in samples of the candidate steps of the first pass. The second pass tries every sample near the best one.
COARSE_DISTANCE = 8


@dataclass(frozen=True)
class Step:
    """Step of a series at `time` (s from the first sample), with its fitted height.

    `date` is a date, or days from the first sample. `found` is True if the search found the step, False if it was given.
    """

    time: float
    date: str
    height: Estimate
    found: bool = False


@dataclass(frozen=True)
class Wave:
    """Periodic term: cosine · cos(2πt/period) + sine · sin(2πt/period), where t, s, is the time from `Trend.origin`."""

    period: float
    cosine: Estimate
    sine: Estimate
    amplitude: Estimate


@dataclass(frozen=True, eq=False)
class Trend:
    """Result of `trend`: rate of a series, and the other functions and the noise that were fitted with the rate.

    Attributes
    ----------
    column : str
    unit : str
        Unit of the series.
    per : str
        Unit of time of the rate: year, day, hour or second.
    rate : Estimate
        Its standard error and interval include the uncertainty of the noise.
    offset : Estimate
        Value at the middle of the record.
    steps : tuple of Step
    waves : tuple of Wave
        Annual and semi-annual terms.
    noise : Model
        Noise model, in seconds and the unit of the series.
    parts : tuple of (str, float, str)
        Each part of the noise as in geodesy: name, size, unit with years.
    candidates : tuple of (str, float)
        Noise models that were compared, best first, each with ln of its evidence minus that of the best.
    residual : float
        Standard deviation of the series after subtraction of the known functions.
    n, missing : int
        Number of samples, and number of rows of the regular grid without a sample.
    duration : float
        Length of the record, s.
    uneven : bool
        True if the samples have uneven times, which were then used.
    longer : tuple of (float, float)
        Duration in s and predicted standard error of the rate, for this record and longer ones.
    epoch : float or None
        Time of the first sample, s since 1970.
    origin : str
        Date or time at which the periodic terms have phase 0.

    Examples
    --------
    >>> day = 86400.0
    >>> x = al.AngleRandomWalk(N=300.0).simulate(duration=2000 * day, rate=1 / day, seed=1, unit="1")
    >>> heights = x.samples + 2.0 * np.arange(2000) / 365.25
    >>> found = al.trend(al.Recording(heights, rate=1 / day), unit="mm")
    >>> print(round(found.rate.value, 1), found.rate.unit, found.noise.name)
    2.0 mm/year N
    >>> bool(found.predicted(4.0) < 0.2 * found.rate.std_error)
    True
    >>> found.signal([0.0]).shape, found.to_dict()["unit"]
    ((1,), 'mm')
    """

    column: str
    unit: str
    per: str
    rate: Estimate
    offset: Estimate
    steps: tuple[Step, ...]
    waves: tuple[Wave, ...]
    noise: Model
    parts: tuple[tuple[str, float, str], ...]
    candidates: tuple[tuple[str, float], ...]
    residual: float
    n: int
    missing: int
    duration: float
    uneven: bool
    longer: tuple[tuple[float, float], ...]
    epoch: float | None
    origin: str
    _series: StampedSeries
    _fitted: FittedNoise
    _functions: Functions

    def predicted(self, times: float) -> float:
        """Predicted standard error of `rate`, in its unit, for a record that is `times` times as long as this record.

        The longer record is assumed to have the same noise, sampling interval and periodic terms, and no further steps. The
        uncertainty of the noise, which `rate.std_error` includes, is left out.
        """
        return _predicted_error(self._fitted, self._series, self._functions, times)

    def signal(self, times: ArrayLike) -> Array:
        """Fitted sum of offset, rate, steps and periodic terms at times in s since the first sample, shape (n,)."""
        return np.asarray(
            self._fitted.regressed.amplitudes @ self._functions.at(np.asarray(times, dtype=float))
        )

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON with the results of this column: rate, offset, steps, waves, noise, residual and more."""
        hidden = dict.fromkeys(("_series", "_fitted", "_functions", "parts", "candidates"), "")
        keys = ("name", "size", "unit")
        return fields_dict(self, duration="duration_s", epoch="epoch_s", **hidden) | {
            "steps": [fields_dict(step, time="time_s") for step in self.steps],
            "waves": [fields_dict(wave, period="period_s") for wave in self.waves],
            "noise": {
                "model": str(self.noise),
                "parts": [dict(zip(keys, part, strict=True)) for part in self.parts],
                "candidates": [
                    {"model": name, "log_evidence": value} for name, value in self.candidates
                ],
            },
            "longer": [
                {"duration_s": duration, "std_error": error} for duration, error in self.longer
            ],
        }

    def __str__(self) -> str:
        low, high = self.rate.interval or (np.nan, np.nan)
        noise = ", ".join(f"{name} {size:.3g} {unit}" for name, size, unit in self.parts)
        record = f"{duration_text(self.duration)}{', uneven times' if self.uneven else ''}"
        lines = [
            f"{self.column}: rate {self.rate} (95 %: {low:.4g} to {high:.4g}) under {noise}",
            f"  offset {self.offset} at the middle; {self.n} samples, {self.missing} missing, {record}",
        ]
        lines += [f"  step {s.date}: {s.height}{' (found)' if s.found else ''}" for s in self.steps]
        lines += [
            f"  period {w.period / 86400.0:.6g} d: amplitude {w.amplitude}" for w in self.waves
        ]
        others = [f"{name} ({value:.1f})" for name, value in self.candidates[1:4]]
        if others:
            lines.append(
                f"  noise {self.candidates[0][0]}; ln evidence of others: {', '.join(others)}"
            )
        lines.append(
            "  standard error with record length: "
            + ", ".join(f"{duration_text(duration)} {error:.2g}" for duration, error in self.longer)
        )
        return with_readable_numbers("\n".join(lines))

    _repr_html_ = text_html


class Trends(Several[Trend]):
    """Mapping from column name to `Trend`.

    Examples
    --------
    >>> x = np.random.default_rng(1).standard_normal((500, 2))
    >>> found = al.trend_columns(al.Recording(x, rate=1 / 86400, columns=["north", "up"]), unit="mm")
    >>> list(found), found["up"].column, found.to_dict()["schema"]
    (['north', 'up'], 'up', 'allanite/trend/1')
    """

    def __init__(self, trends: Mapping[str, Trend], path: str | None = None) -> None:
        super().__init__(trends)
        self.path = path

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON with the trends of all columns, schema ``allanite/trend/1``."""
        return {
            "schema": "allanite/trend/1",
            "version": _kernels.version(),
            "path": self.path,
            "columns": [one.to_dict() for one in self.values()],
        }

    def __str__(self) -> str:
        return "\n\n".join(map(str, self.values()))


class TrendOptions(TypedDict, total=False):
    """Options of `allanite.trend`."""

    unit: str | None
    per: str
    steps: Sequence[float | str]
    find_steps: bool
    periods: Sequence[float] | None
    model: str | None
    progress: Callable[[str, int, int], None] | None


def trend(
    recording: Recording,
    *,
    unit: str | None = None,
    per: str = "year",
    steps: Sequence[float | str] = (),
    find_steps: bool = False,
    periods: Sequence[float] | None = None,
    model: str | None = None,
    progress: Callable[[str, int, int], None] | None = None,
) -> Trend:
    """Rate of a series, fitted together with steps, annual and semi-annual terms, and the noise.

    Parameters
    ----------
    recording : Recording
        One column; `trend_columns` takes several. Missing samples are NaN.
    unit : str, optional
        Unit of the series, any text; by default that of the recording.
    per : {"year", "day", "hour", "second"}
        Unit of time of the rate; a year has 365.25 days.
    steps : sequence of float or str
        Times of known steps: s from the first sample, or text such as ``2012-03-04``, ``2012.17``, ``120d``.
    find_steps : bool
        True to search for steps at other times, with a false-alarm probability of 1 % for the whole record.
    periods : sequence of float, optional
        Periods in s; by default one year and half a year, if the record is at least one year long.
    model : str, optional
        Noise model: ``N``, ``B``, ``K``, ``N+B``, ``N+K``, ``N+B+K``, ``PL`` or ``N+PL``. By default all are compared
        and the one with the highest evidence is used.
    progress : callable, optional
        Called with (column, noise models fitted, all noise models to fit), from zero again after each step that is found.

    Returns
    -------
    Trend

    Raises
    ------
    InputError
        The noise model or `per` is unknown, all samples are equal, or a step is outside the record or at the same sample as
        another.
    TooShortError
        There are too few samples for the known functions and the noise.

    References
    ----------
    Bos, M. S., Fernandes, R. M. S., Williams, S. D. P. & Bastos, L. (2013). Fast error analysis of continuous GNSS
    observations with missing data. J. Geod. 87, 351. Kenward, M. G. & Roger, J. H. (1997). Biometrics 53, 983: the
    uncertainty of the noise.

    Examples
    --------
    >>> x = np.random.default_rng(1).standard_normal(1500) + np.where(np.arange(1500) < 700, 0.0, 5.0)
    >>> found = al.trend(al.Recording(x, rate=1 / 86400), unit="mm", steps=["700d"])
    >>> print(round(found.steps[0].height.value), len(found.waves))
    5 2
    """
    require_one_column(recording, "al.trend_columns(recording)")
    if per not in PER:
        raise InputError(f"unknown unit of time per = {per!r}; choose one of {', '.join(PER)}")
    report = partial(progress, recording.columns[0]) if progress is not None else lambda *_: None
    return _trend_of_column(
        recording,
        unit or recording.unit,
        per,
        steps,
        find_steps,
        periods,
        _candidates(model),
        report,
    )


def trend_columns(recording: Recording, **options: Unpack[TrendOptions]) -> Trends:
    """`Trends`: mapping from each column of a recording to its trend.

    Parameters
    ----------
    recording : Recording
        One column or several, each fitted separately.
    options
        Those of `allanite.trend`.

    Returns
    -------
    Trends

    Raises
    ------
    InputError, TooShortError
        As for `allanite.trend`.

    Examples
    --------
    >>> x = np.random.default_rng(1).standard_normal((500, 2))
    >>> found = al.trend_columns(al.Recording(x, rate=1 / 86400, columns=["east", "up"]), model="N")
    >>> list(found)
    ['east', 'up']
    """
    require_recording(recording)
    return Trends(
        results_by_column(recording, lambda column: trend(column, **options)), recording.path
    )


def _candidates(model: str | None) -> tuple[Candidate, ...]:
    """Noise models to compare: all eight if `model` is None, else the one with these parts in any order.

    Raises `InputError` for an unknown name.
    """
    white, flicker, walk, free = parse_model("N+B+K+PL").stochastic
    range_ = (-1.99, -0.01)
    known = (
        Candidate((white,)),
        Candidate((flicker,)),
        Candidate((walk,)),
        Candidate((white, flicker)),
        Candidate((white, walk)),
        Candidate((free,), range_),
        Candidate((white, free), range_),
        Candidate((white, flicker, walk)),
    )
    if model is None:
        return known
    parts = sorted(model.replace(" ", "").split("+"))
    chosen = tuple(c for c in known if sorted(c.name.split("+")) == parts)
    if not chosen:
        raise InputError(
            f"unknown noise {model!r}; choose one of {', '.join(c.name for c in known)}"
        )
    return chosen


def _trend_of_column(
    column: Recording,
    unit: str,
    per: str,
    steps: Sequence[float | str],
    find_steps: bool,
    periods: Sequence[float] | None,
    candidates: tuple[Candidate, ...],
    report: Callable[[int, int], object],
) -> Trend:
    """`Trend` of one column; `report` is called with the number of noise models fitted so far and the number of all.

    With `find_steps`, up to 50 significant steps are added one by one; after each, all noise models are fitted again.
    Raises `TooShortError` for too few samples, and `InputError` if all samples are equal or a step is unsuitable.
    """
    times, values = _finite_samples(column)
    functions = _known_functions(column, times, per, steps, periods)
    found: list[float] = []
    while True:
        series = StampedSeries(times, values, functions.at(times))
        fits = _fits_of_candidates(series, candidates, column.rate, report)
        search = find_steps and len(found) < MAX_STEPS
        step = significant_step(series, fits[0].noise) if search else None
        if step is None:
            break
        found.append(step)
        functions = replace(functions, steps=tuple(sorted((*functions.steps, step))))
    best = fits[0]
    offset, rate, *others = _amplitude_estimates(best, functions, unit, per)
    count, span = len(functions.steps), float(times[-1] - times[0])
    return Trend(
        column=column.columns[0],
        unit=unit,
        per=per,
        rate=rate,
        offset=offset,
        steps=tuple(
            Step(s, date_of(s, column.epoch), height, s in found)
            for s, height in zip(functions.steps, others[:count], strict=True)
        ),
        waves=tuple(
            Wave(period, cosine, sine, _wave_amplitude(best.regressed, 2 + count + 2 * i, unit))
            for i, (period, cosine, sine) in enumerate(
                zip(functions.periods, others[count::2], others[count + 1 :: 2], strict=True)
            )
        ),
        noise=best.model,
        parts=_noise_parts(best.model, column.rate, unit),
        candidates=tuple((f.candidate.name, f.evidence - best.evidence) for f in fits),
        residual=float(np.std(values - best.regressed.amplitudes @ series.design)),
        n=times.size,
        missing=int(column.n - times.size),
        duration=span,
        uneven=column.times is not None,
        longer=tuple(
            (k * span, _predicted_error(best, series, functions, k)) for k in LENGTH_MULTIPLES
        ),
        epoch=column.epoch,
        origin="2000-01-01T12:00:00" if column.epoch is not None else "first sample",
        _series=series,
        _fitted=best,
        _functions=functions,
    )


def _finite_samples(column: Recording) -> tuple[Array, Array]:
    """Tuple (times in s since the first row, values) of the samples that are not missing.

    `TooShortError` for fewer than 16, and `InputError` if all are equal.
    """
    name, samples = column.columns[0], np.asarray(column.samples, dtype=np.float64)
    there = np.isfinite(samples)
    times, values = column.seconds()[there], samples[there]
    if times.size < MIN_SAMPLES:
        raise TooShortError(
            f"{name}: {times.size} samples are too few: at least {MIN_SAMPLES} are needed"
        )
    if np.ptp(values) == 0.0:
        raise InputError(
            f"{name}: all samples are equal",
            missing="column",
            remedy=": select another column with {column}",
        )
    return times, values


def _known_functions(
    column: Recording,
    times: Array,
    per: str,
    steps: Sequence[float | str],
    periods: Sequence[float] | None,
) -> Functions:
    """`Functions` of a trend for samples at `times` (s): offset, rate per unit of time `per`, steps, and periodic terms.

    `steps` are times in s or texts such as dates. If `periods` (s) is None, a year and half a year are used, or none
    for a record shorter than a year. `TooShortError` for fewer than 16 samples in addition to one per function. Raises
    `InputError` for unsuitable `steps`, as `_given_step_times`.
    """
    if periods is None:
        periods = PERIODS if times[-1] - times[0] >= YEAR * MIN_YEARS else ()
    functions = Functions(
        middle=0.5 * float(times[0] + times[-1]),
        per=PER[per],
        steps=_given_step_times(steps, column.epoch, times, column.columns[0]),
        periods=tuple(float(p) for p in periods),
        # For a log with dates, phases refer to J2000.0.
        origin=0.0 if column.epoch is None else J2000 - column.epoch,
    )
    count = len(functions.names)
    if times.size < MIN_SAMPLES + count:
        raise TooShortError(
            f"{column.columns[0]}: {times.size} samples are too few for {count} known functions:"
            f" at least {MIN_SAMPLES + count} are needed"
        )
    return functions


def _amplitude_estimates(
    best: FittedNoise, functions: Functions, unit: str, per: str
) -> list[Estimate]:
    """List of `Estimate`, the amplitude of each of `Functions.names` with its 95 % interval (Student's t)."""
    from scipy.special import stdtrit

    errors, freedom = best.amplitude_errors()
    halves = stdtrit(freedom, 0.975) * errors
    columns = (best.regressed.amplitudes.tolist(), errors.tolist(), halves.tolist())
    # A rate or a height can have either sign, so that it always counts as detected.
    return [
        Estimate(
            value,
            error,
            (value - half, value + half),
            f"{unit}/{per}" if name == "rate" else unit,
            True,
            name,
        )
        for name, value, error, half in zip(functions.names, *columns, strict=True)
    ]


def _given_step_times(
    steps: Sequence[float | str], epoch: float | None, times: Array, name: str
) -> tuple[float, ...]:
    """Tuple of the times of the given steps, s since the first row, ascending; `name` is that of the column, for messages.

    `steps` are such times, or texts (date or time span). Dates need `epoch`, the time of the first row, s since 1970.
    `InputError` for a text that is no time, for a step outside the samples, and for two steps between the same samples.
    """
    out = sorted(seconds_of(s, epoch) if isinstance(s, str) else float(s) for s in steps)
    rows = np.searchsorted(times, out)
    for step, row in zip(out, rows.tolist(), strict=True):
        if not 0 < row < times.size:
            first, last = date_of(float(times[0]), epoch), date_of(float(times[-1]), epoch)
            raise InputError(
                f"{name}: the step at {date_of(step, epoch)} is outside of the record, {first} to {last}"
            )
    if len(set(rows.tolist())) < len(out):
        raise InputError(f"{name}: two steps lie between the same two samples: remove one of them")
    return tuple(out)


def _fits_of_candidates(
    series: StampedSeries,
    candidates: tuple[Candidate, ...],
    rate: float,
    report: Callable[[int, int], object],
) -> list[FittedNoise]:
    """List of the fits of all noise candidates, highest evidence first. Larger models start from fits of smaller ones.

    `report` is called with (fits done, all fits) before each fit and at the end.
    """
    fits: list[FittedNoise] = []
    for candidate in candidates:
        stop_if_unwanted()
        report(len(fits), len(candidates))
        inside = [
            f
            for f in fits
            if f.candidate.parameter_count < candidate.parameter_count
            and f.candidate.name.split("+")[0] == candidate.name.split("+")[0]
        ]
        start = max(inside, key=lambda f: f.evidence, default=None)
        fits.append(fit_noise(series, candidate, rate, sampled_noise, start))
    report(len(candidates), len(candidates))
    return sorted(fits, key=lambda f: -f.evidence)


def _wave_amplitude(regressed: Regressed, at: int, unit: str) -> Estimate:
    """`Estimate`: amplitude of the periodic term whose cosine and sine are the functions `at` and `at` + 1.

    `detected` is True if cosine and sine differ from 0 at 95 % (χ²₂).
    """
    pair, covariance = (
        regressed.amplitudes[at : at + 2],
        regressed.covariance[at : at + 2, at : at + 2],
    )
    size = float(np.hypot(*pair))
    direction = pair / size if size > 0.0 else np.array([1.0, 0.0])
    error = float(np.sqrt(direction @ covariance @ direction))
    low, high = max(0.0, size - 1.959964 * error), size + 1.959964 * error
    seen = float(pair @ np.linalg.solve(covariance, pair)) > 5.991  # 95 % of χ² of two
    return Estimate(size, error, (low, high), unit, seen, "amplitude")


def _noise_parts(model: Model, rate: float, unit: str) -> tuple[tuple[str, float, str], ...]:
    """Tuple of (name, size, unit), one per noise process of the model, in the convention of geodesy.

    The size is that of the white noise which, filtered, gives the process. The unit is U for white noise, and U/yr^(−κ/4)
    for a power law whose spectrum is f^κ.
    """
    names = {0.0: "white", -1.0: "flicker", -2.0: "random walk"}
    out = []
    for effect in model.stochastic:
        exponent = power_law_exponent(effect)
        assert exponent is not None
        # Standard deviation of the white noise that is summed (Kasdin 1995), per sample.
        power = effect.psd([0.5 * rate / np.pi], rate=rate)[0] * rate
        level = float(np.sqrt(power / (2.0 * np.sin(0.5)) ** exponent))
        quarter = -0.25 * exponent
        name = names.get(exponent, f"power law κ = {exponent:.2f}")
        size = level * (rate * YEAR) ** quarter
        out.append((name, size, unit if quarter == 0.0 else f"{unit}/yr^{quarter:.2g}"))
    return tuple(out)


def _predicted_error(
    best: FittedNoise, series: StampedSeries, functions: Functions, times: float
) -> float:
    """Predicted standard error of the rate for a record that is `times` times as long, under the noise of `best`.

    The times of the samples are repeated, without further steps. The uncertainty of the noise is left out.
    """
    whole = int(np.ceil(times))
    step = float(np.median(np.diff(series.times)))
    span = float(series.times[-1] - series.times[0])
    every = np.concatenate([series.times + k * (span + step) for k in range(whole)])
    every = every[every <= series.times[0] + times * span + 0.5 * step]
    longer = replace(functions, middle=0.5 * float(every[0] + every[-1]))
    found = StampedSeries(every, np.zeros(every.size), longer.at(every)).regressed(best.noise)
    return float(np.sqrt(found.covariance[1, 1]))


def significant_step(series: StampedSeries, noise: StampedNoise) -> float | None:
    """Time, s, of the first sample after the most significant step; None if no step is significant.

    A step at each time is fitted together with the known functions of `series`. Every eighth sample is tried first, then
    all samples around the best one. The false-alarm probability is 1 % for the whole series (Bonferroni).
    """
    from scipy.special import chdtrc

    there = np.ones(series.n, dtype=bool)
    columns = np.vstack([series.values, series.design])
    found, variances = innovations(noise, series.times, there, columns)
    root = 1.0 / np.sqrt(variances)
    basis, _ = np.linalg.qr((found[1:] * root).T)
    values = found[0] * root
    values = values - basis @ (basis.T @ values)

    def squares(rows: NDArray[np.int64]) -> Array:
        """Square of (height / standard error) of a step that begins at each of these samples; 0 if it is not separable."""
        out = np.zeros(rows.size)
        for first in range(0, rows.size, STEPS_PER_BLOCK):
            stop_if_unwanted()
            some = rows[first : first + STEPS_PER_BLOCK]
            steps = (np.arange(series.n)[None, :] >= some[:, None]).astype(float)
            white, _ = innovations(noise, series.times, there, steps)
            white = white * root
            known = white @ basis
            size = (white**2).sum(axis=1) - (known**2).sum(axis=1)
            # A step that is a sum of the known functions cannot be fitted separately.
            own = size > 1e-9 * (white**2).sum(axis=1)
            out[first : first + STEPS_PER_BLOCK] = np.where(
                own, (white @ values) ** 2 / np.where(own, size, 1.0), 0.0
            )
        return out

    rows = np.arange(2, series.n - 1, COARSE_DISTANCE, dtype=np.int64)
    best = int(rows[np.argmax(squares(rows))])
    near = np.arange(
        max(1, best - COARSE_DISTANCE),
        min(series.n - 1, best + COARSE_DISTANCE + 1),
        dtype=np.int64,
    )
    height = squares(near)
    if series.n * float(chdtrc(1, height.max())) >= FALSE_ALARM_PROBABILITY:
        return None
    return float(series.times[near[np.argmax(height)]])
