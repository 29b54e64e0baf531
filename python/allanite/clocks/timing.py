"""Analysis of the log of a clock or time server: time error, masks, jumps, frequency and drift, noise, and holdover."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels, deviation
from allanite.clocks.holdover import Holdover, PhaseModels, holdovers_of
from allanite.clocks.jumps import Jump, jumps_of
from allanite.clocks.masks import Mask, mask_named
from allanite.clocks.noise import clock_noise, thinned_indices
from allanite.clocks.verdicts import Verdict, verdicts, window_means
from allanite.clocks.words import powered_text, time_text
from allanite.common.documents import fields_dict, plain_value
from allanite.common.errors import InputError, TooShortError
from allanite.common.numbers import duration_text, number
from allanite.common.parameters import NORMAL, Estimate
from allanite.common.printing import printed
from allanite.common.several import Several, results_by_column
from allanite.common.showing import text_html
from allanite.common.units import FREQUENCY, is_frequency, parse_unit
from allanite.common.validation import positive, require_one_column, require_recording
from allanite.effects.sheet_units import sheet_unit
from allanite.fit.stamped.likelihood import StampedSeries

if TYPE_CHECKING:
    from collections.abc import Callable

    from allanite.deviation import Deviation
    from allanite.effects import Model
    from allanite.fit.stamped.candidates import FittedNoise
    from allanite.recording import Recording

Array = NDArray[np.float64]
#: Minimum number of samples for a fit of noise and frequency. Chosen by judgment; not measured.
MIN_SAMPLES = 32
#: Maximum number of steps that are fitted. If a record has more, the others count as noise. Chosen by judgment; not
#: measured.
MAX_JUMPS = 32
#: Times after the last sample for which holdover is predicted, s.
AFTER = (3600.0, 86400.0)
#: Deviations in the result.
KINDS = ("tdev", "mdev", "mtie")
#: Names of columns that are used as temperatures.
TEMPERATURE = ("temp", "temperature")


@dataclass(frozen=True, eq=False)
class Timing:
    """One clock.

    Attributes
    ----------
    column : str
    n, missing : int
        Number of samples, and number of rows of the regular grid without a sample.
    duration : float
        Length of the record, s.
    spacing : (float, float, float)
        Median, smallest and largest distance between neighboring samples, s.
    uneven : bool
        True if the samples have uneven times. Noise and holdover then use these times; deviations use the nearest row
        of a regular grid.
    mean, largest, spread : float
        Mean time error, largest |time error|, and largest minus smallest time error, s.
    constant : float or None
        Largest |mean time error over 1000 s|, s; None for a shorter record.
    constant_error : float or None
        Standard error of the mean under the fitted noise, s. None if the noise contains frequency noise, which has no
        finite mean, or if the clock was steered.
    frequency, drift : Estimate
        Fractional frequency at the last sample, with flicker and random-walk FM but without white FM, which has no
        value at an instant; and its change per day. A drift that the evidence does not support is not detected.
    noise : Model
        Noise of the fractional frequency: Q white PM, F flicker PM, N white FM, B flicker FM, K random-walk FM.
    candidates : tuple of (str, float)
        Noise models that were compared, each with ln of its evidence minus that of the best.
    deviations : mapping of str to Deviation
    verdicts : tuple of Verdict
    jumps : tuple of Jump
    holdover : tuple of Holdover
        Predicted phase. The servo of a steered clock keeps the frequency that it set last.
    temperature : Estimate or None
        Change of the fractional frequency per unit of the logged temperature.
    steered : str or None
        Column with the frequency that a servo set. It was subtracted before noise and frequency were computed.

    Examples
    --------
    >>> clock = al.parse_model("Q(Q=1e-9)+N(N=1e-10)").simulate(n=4000, rate=1.0, seed=1, unit="1")
    >>> phase = np.concatenate([[0.0], np.cumsum(clock.samples)])
    >>> found = al.timing(al.Recording(phase, rate=1.0, quantity="angle"), masks=["G.8272-A"])
    >>> found.noise.name, [v.result for v in found.verdicts if v.kind == "tdev"]
    ('Q+N', ['undecided'])
    >>> hour = found.holdover[0]
    >>> bool(hour.low < hour.expected < hour.high), found.to_dict()["schema"]
    (True, 'allanite/timing/1')
    """

    column: str
    path: str | None
    n: int
    missing: int
    duration: float
    spacing: tuple[float, float, float]
    uneven: bool
    mean: float
    largest: float
    spread: float
    constant: float | None
    constant_error: float | None
    frequency: Estimate
    drift: Estimate
    noise: Model
    candidates: tuple[tuple[str, float], ...]
    deviations: Mapping[str, Deviation]
    verdicts: tuple[Verdict, ...]
    jumps: tuple[Jump, ...]
    holdover: tuple[Holdover, ...]
    temperature: Estimate | None
    steered: str | None

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON, schema ``allanite/timing/1``, with all attributes."""
        time_error = {
            "mean_s": self.mean,
            "largest_s": self.largest,
            "range_s": self.spread,
            "constant_s": self.constant,
            "mean_std_error_s": self.constant_error,
        }
        candidates = [{"model": name, "log_evidence": value} for name, value in self.candidates]
        grouped = ("mean", "largest", "spread", "constant", "constant_error", "candidates")
        keys = {"duration": "duration_s", "spacing": "spacing_s", "verdicts": "masks"}
        return {
            "schema": "allanite/timing/1",
            "version": _kernels.version(),
            **fields_dict(self, **keys, **dict.fromkeys(grouped, "")),
            "time_error": time_error,
            "noise": {"model": str(self.noise), "candidates": candidates},
            "deviations": plain_value(list(self.deviations.values())),
        }

    def __str__(self) -> str:
        usual, least, most = self.spacing
        low, typical, high = (number(seconds, 4) for seconds in (least, usual, most))
        apart = f"{typical} s apart" + (
            f" ({low} to {high} s)" if (low, high) != (typical,) * 2 else ""
        )
        lines = [
            f"{self.column}: {self.n} samples in {duration_text(self.duration)}, {self.missing} missing; {apart}"
        ]
        if self.uneven:
            lines.append(
                "  uneven times: noise and holdover use the exact times; TDEV, MDEV and MTIE use a regular grid"
            )
        error = "" if self.constant_error is None else f" ± {time_text(self.constant_error)}"
        line = (
            f"  time error: mean {time_text(self.mean)}{error}, largest {time_text(self.largest)}"
        )
        line += f", range {time_text(self.spread)}"
        if self.constant is not None:
            line += f", constant (1000 s) up to {time_text(self.constant)}"
        lines.append(line)
        of = "" if self.steered is None else f" without the servo's {self.steered}"
        lines.append(
            f"  frequency{of}: {_value_text(self.frequency)}; drift {_value_text(self.drift)} per day"
        )
        if self.temperature is not None:
            lines.append(
                f"  temperature: {_value_text(self.temperature)} per unit of the logged temperature"
            )
        lines.append(f"  noise: {_noise_text(self.noise)}")
        lines += [
            f"  {'jump' if jump.stays else 'single sample off'} of {time_text(jump.height)} at {jump.time:.6g} s"
            for jump in self.jumps[:5]
        ]
        if len(self.jumps) > 5:
            lines.append(f"  {len(self.jumps) - 5} more jumps")
        lines += [f"  {_verdict_text(verdict, self.duration)}" for verdict in self.verdicts]
        lines += [f"  {one}" for one in self.holdover]
        curve = self.deviations["tdev"]
        lines.append(f"  {'τ / s':>10}" + "".join(f"{head:>14}" for head in self.deviations))
        for i, (tau, factor) in enumerate(zip(curve.tau, curve.factors, strict=True)):
            if np.log2(factor) % 1.0 == 0.0:
                cells = [
                    f"{_deviation_text(kind, c.deviation[i]) if i < len(c) else '':>14}"
                    for kind, c in self.deviations.items()
                ]
                lines.append(f"  {tau:10.6g}" + "".join(cells))
        return "\n".join(lines)

    _repr_html_ = text_html


class Timings(Several[Timing]):
    """Mapping from the name of a column to the `Timing` of its clock.

    Examples
    --------
    >>> x = np.cumsum(np.random.default_rng(1).standard_normal((200, 2)), axis=0) * 1e-9
    >>> log = al.Recording(x, rate=1.0, quantity="angle", columns=["a", "b"])
    >>> found = al.timing_columns(log)
    >>> list(found), len(found.to_dict()["columns"])
    (['a', 'b'], 2)
    """

    def __str__(self) -> str:
        return "\n\n".join(map(str, self.values()))


class TimingOptions(TypedDict, total=False):
    """Keyword arguments of `allanite.timing`, all optional, for `timing_columns`."""

    masks: Sequence[str | Mask]
    after: Sequence[float]
    steering: tuple[str, float] | None
    progress: Callable[[str, int], None] | None


def timing(
    recording: Recording,
    *,
    masks: Sequence[str | Mask] = (),
    after: Sequence[float] = AFTER,
    steering: tuple[str, float] | None = None,
    progress: Callable[[str, int], None] | None = None,
) -> Timing:
    """`Timing` of a clock: time error, verdicts on masks, jumps, frequency, drift, noise and holdover.

    Parameters
    ----------
    recording : Recording
        Phase in s, with ``quantity="angle"``, in one column; `timing_columns` takes several.
    masks : sequence of str or Mask
        Names such as ``G.8272-A``; `allanite.clocks.MASKS` contains all of them.
    after : sequence of float
        Times after the last sample for which holdover is predicted, s.
    steering : (str, float), optional
        Name of a covariate with the frequency that a servo set, and the phase in s that a value of 1 adds per second.
        Its integral is subtracted from the phase, so that noise, frequency and drift are those of the free-running
        clock. In holdover the last frequency is kept.
    progress : callable, optional
        Called with a column and the number of noise models fitted.

    Returns
    -------
    Timing

    Raises
    ------
    InputError
        The samples or their unit are not those of a phase, a mask or column is unknown, or a time in `after` is not
        positive.
    TooShortError
        There are fewer than 32 samples.

    References
    ----------
    ITU-T G.810 (08/1996): time interval error, time deviation.

    Examples
    --------
    >>> x = np.cumsum(np.random.default_rng(1).standard_normal(1500)) * 1e-10
    >>> x[700:] += 5e-9
    >>> found = al.timing(al.Recording(x, rate=1.0, quantity="angle"), after=[60.0])
    >>> found.noise.name, [jump.time for jump in found.jumps], found.holdover[0].std < 2e-9
    ('N', [700.0], True)
    """
    require_one_column(recording, "al.timing_columns(recording)")
    _require_phase(recording)
    chosen = [mask if isinstance(mask, Mask) else mask_named(mask) for mask in masks]
    times = [positive(t, "after", "s", "give times after the last sample") for t in after]
    report = None if progress is None else partial(progress, recording.columns[0])
    return _timing_of_column(recording, chosen, times, steering, report)


def timing_columns(recording: Recording, **options: Unpack[TimingOptions]) -> Timings:
    """`Timings`: mapping from the name of each column of a recording to the `Timing` of its clock.

    Parameters
    ----------
    recording : Recording
        Phases in s, one clock for each column, with ``quantity="angle"``.
    options
        Keyword arguments of `allanite.timing`, such as ``masks`` and ``after``.

    Returns
    -------
    Timings

    Raises
    ------
    InputError, TooShortError
        As for `allanite.timing`.

    Examples
    --------
    >>> x = np.cumsum(np.random.default_rng(1).standard_normal((200, 2)), axis=0) * 1e-9
    >>> found = al.timing_columns(al.Recording(x, rate=1.0, quantity="angle", columns=["a", "b"]))
    >>> list(found)
    ['a', 'b']
    """
    require_recording(recording)
    return Timings(results_by_column(recording, lambda column: timing(column, **options)))


def _require_phase(recording: Recording) -> None:
    """Raise `InputError` unless the samples can be the phase of a clock.

    A phase in s and a fractional frequency both have the unit 1 in a recording, so the unit of the column in the log is
    examined.
    """
    other = next((u for u in recording.units if parse_unit(u).kind != FREQUENCY), None)
    if other is not None:
        kind = parse_unit(other).kind
        raise InputError(
            f"timing needs a phase in s; this column is an {kind} (unit {other}): give the log of a clock"
        )
    for column in recording.log_columns:
        if column.name in recording.columns and is_frequency(column.unit):
            raise InputError(
                f"timing needs a phase in s; this column is a fractional frequency (unit {column.unit}): integrate it,"
                " or use adev and fit"
            )
    if recording.quantity != "angle":
        raise InputError(
            "timing needs the phase of a clock in s",
            missing="unit",
            remedy=": state the unit of the phase with {this_unit:s} (or ms, us, ns)",
        )


def _timing_of_column(
    column: Recording,
    masks: Sequence[Mask],
    after: Sequence[float],
    steering: tuple[str, float] | None,
    report: Callable[[int], None] | None,
) -> Timing:
    """`Timing` of one column; `report`, if given, is called with the number of noise models fitted so far.

    The phase that a servo added (`steering`, as in `timing`) is subtracted before the fit and added to the holdover.
    With `steering`, ``constant_error`` is None. Raises `TooShortError` for fewer than 32 samples that are not missing.
    """
    name = column.columns[0]
    # Samples may be in a multiple of seconds: the scale of the unit converts them.
    scale = parse_unit(column.unit).scale
    phase = np.asarray(column.samples, dtype=np.float64) * scale
    there = np.isfinite(phase)
    if np.count_nonzero(there) < MIN_SAMPLES:
        raise TooShortError(
            f"{name}: {np.count_nonzero(there)} samples are too few: at least {MIN_SAMPLES} are needed"
        )
    times = column.seconds()
    jumps = jumps_of(times[there], phase[there])
    steered, last = (
        (np.zeros(times.size), 0.0)
        if steering is None
        else _steered_phase(column, *steering, times)
    )
    temperature = next((k for k in column.covariates if k.lower() in TEMPERATURE), None)
    warmth = None if temperature is None else np.asarray(column.covariates[temperature], float)
    fitted = _PhaseFit.from_phase(times, phase - steered, there, jumps, warmth, column.rate, report)
    curves = {
        kind: getattr(deviation, kind)(phase, rate=column.rate, quantity="angle") for kind in KINDS
    }
    steps = np.diff(times[there])
    constant = window_means(phase, column.rate)
    values = phase[there]
    return Timing(
        column=name,
        path=column.path,
        n=int(np.count_nonzero(there)),
        missing=int(np.count_nonzero(~there)),
        duration=column.duration,
        spacing=(float(np.median(steps)), float(steps.min()), float(steps.max())),
        uneven=column.times is not None,
        mean=float(values.mean()),
        largest=float(np.abs(values).max()),
        spread=float(np.ptp(values)),
        constant=float(np.abs(constant).max()) if constant.size else None,
        # The mean of a steered phase depends on the servo, not only on the noise of the clock.
        constant_error=None if steering is not None else fitted.error_of_mean(),
        frequency=fitted.frequency(),
        drift=fitted.drift(),
        noise=fitted.best.model,
        candidates=tuple(
            (f.candidate.name, f.evidence - fitted.best.evidence) for f in fitted.fits
        ),
        deviations=curves,
        verdicts=tuple(v for mask in masks for v in verdicts(mask, phase, column.rate)),
        jumps=tuple(jumps),
        holdover=tuple(
            one.shifted(float(steered[there][-1]) + last * one.after)
            for one in fitted.holdover(after)
        ),
        temperature=fitted.temperature(),
        steered=None if steering is None else steering[0],
    )


def _steered_phase(column: Recording, name: str, scale: float, times: Array) -> tuple[Array, float]:
    """(phase that a servo has added since the first sample, s, shape (n,); fractional frequency that it set last).

    The frequency is the covariate `name` times `scale`, held until the next sample. A missing value is replaced by the
    previous one, or by the first known one. Raises `InputError` if the covariate does not exist or is empty.
    """
    if name not in column.covariates:
        raise InputError(
            f"the log has no column {name!r}; columns other than the phase: {', '.join(column.covariates) or 'none'}"
        )
    values = scale * np.asarray(column.covariates[name], dtype=np.float64)
    there = np.isfinite(values)
    if not there.any():
        raise InputError(f"column {name} is empty")
    last = np.maximum.accumulate(np.where(there, np.arange(values.size), 0))
    held = np.where(there[last], values[last], values[there][0])
    return np.concatenate([[0.0], np.cumsum(held[:-1] * np.diff(times))]), float(held[-1])


@dataclass(frozen=True, eq=False)
class _PhaseFit:
    """Fit of a phase: the noise, and amplitudes of offset, frequency, drift, temperature and jumps.

    `models` are the fits without and with a drift, and `drifts` is True if it is detected. `functions` are the names of
    the known functions; the last one is the drift. `errors` and `freedom` are the standard errors of the amplitudes of
    `names`, and their degrees of freedom.
    """

    models: tuple[PhaseModels, PhaseModels]
    drifts: bool
    functions: tuple[str, ...]
    errors: Array
    freedom: Array

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the fitted functions, such as offset, frequency, temperature and ``jump 0``; drift only if detected."""
        return self.functions if self.drifts else self.functions[:-1]

    @property
    def series(self) -> StampedSeries:
        """The phase and the known functions that were fitted; the drift is among them only if it is detected."""
        return self.models[self.drifts].series

    @property
    def fits(self) -> Sequence[FittedNoise]:
        """Fitted noise models, highest evidence first; they include a frequency drift if one is detected."""
        return self.models[self.drifts].fits

    @property
    def best(self) -> FittedNoise:
        """`FittedNoise` of the noise model with the highest evidence."""
        return self.fits[0]

    @classmethod
    def from_phase(
        cls,
        times: Array,
        phase: Array,
        there: NDArray[np.bool_],
        jumps: Sequence[Jump],
        warmth: Array | None,
        rate: float,
        report: Callable[[int], None] | None,
    ) -> _PhaseFit:
        """`_PhaseFit` of a phase (s): noise, offset, frequency, steps, temperature and drift; single outliers are removed.

        `there` is True where `phase` is finite. The temperature (`warmth`) is omitted if it is None, empty or constant.
        The drift is detected if it raises logL by over ½ ln n. At most 32 steps are fitted; old samples are thinned
        out.
        """
        own, values = times[there], phase[there].copy()
        for jump in jumps:
            if not jump.stays:
                values[jump.row] = np.nan
        kept = np.flatnonzero(np.isfinite(values))
        rows = kept[thinned_indices(kept.size)]
        at = own[rows] - float(own[-1])
        functions = {"offset": np.ones(at.size), "frequency": at}
        if warmth is not None:
            good = np.isfinite(warmth)
            filled = np.interp(times, times[good], warmth[good]) if good.any() else None
            if filled is not None and np.ptp(filled) > 0.0:
                tail = max(1, int(0.1 * filled.size))
                mean = float(filled[-tail:].mean())
                step = np.diff(times) * (0.5 * (filled[1:] + filled[:-1]) - mean)
                integral = np.concatenate([[0.0], np.cumsum(step)])
                functions["temperature"] = (integral - integral[-1])[there][rows]
        for i, jump in enumerate([j for j in jumps if j.stays][:MAX_JUMPS]):
            step = (own[rows] >= jump.time).astype(float)
            # Jumps between the same two kept samples are one step.
            known = any(np.array_equal(step, other) for other in functions.values())
            if 0.0 < step.mean() < 1.0 and not known:
                functions[f"jump {i}"] = step
        design = np.array(list(functions.values()))
        without = StampedSeries(at, values[rows], design)
        # A drift changes the phase in proportion to half the square of time.
        drifting = StampedSeries(at, values[rows], np.vstack([design, 0.5 * at**2]))
        models = (
            PhaseModels(clock_noise(without, rate, report), without),
            PhaseModels(clock_noise(drifting, rate, report), drifting, drifts=True),
        )
        found = drifting.regressed(models[0].fits[0].noise)
        drifts = bool(found.amplitudes[-1] ** 2 / found.covariance[-1, -1] > np.log(at.size))
        errors, freedom = models[drifts].fits[0].amplitude_errors()
        return cls(models, drifts, (*functions, "drift"), errors, freedom)

    def _amplitude(self, name: str, unit: str, factor: float = 1.0) -> Estimate | None:
        """Fitted amplitude of a function such as ``"drift"``, times `factor`; None if this function was not fitted."""
        if name not in self.names:
            return None
        i = self.names.index(name)
        value = factor * float(self.best.regressed.amplitudes[i])
        return _estimate(name, value, factor * float(self.errors[i]), float(self.freedom[i]), unit)

    def frequency(self) -> Estimate:
        """Fractional frequency at the last sample, with 95 % interval.

        It includes the flicker and random-walk FM up to this time, but not white FM, which has no value at an instant.
        """
        slopes = np.array([float(name == "frequency") for name in self.names])
        value, variance = self.series.last_slope(self.best.noise, slopes)
        neighbors = [
            (np.array([near]), np.array([its_variance]))
            for i in range(len(self.best.candidate.effects))
            for sign in (-1.0, 1.0)
            for near, its_variance in [self.series.last_slope(self.best.noise_at(i, sign), slopes)]
        ]
        error, freedom = self.best.combined_errors(neighbors, np.array([variance]))
        return _estimate("frequency", value, float(error[0]), float(freedom[0]), "1")

    def temperature(self) -> Estimate | None:
        """`Estimate` of the change of fractional frequency per unit of temperature; None if it was not fitted."""
        return self._amplitude("temperature", "1")

    def drift(self) -> Estimate:
        """Change of the fractional frequency per day; marked as not detected if the data do not show a drift."""
        found = self._amplitude("drift", "1/d", 86400.0)
        if found is not None:
            return found
        regressed = self.models[1].series.regressed(self.best.noise)
        value = 86400.0 * float(regressed.amplitudes[-1])
        error = 86400.0 * float(np.sqrt(regressed.covariance[-1, -1]))
        half = NORMAL * error
        return Estimate(value, error, (value - half, value + half), "1/d", False, "drift")

    def error_of_mean(self) -> float | None:
        """Standard error of the mean phase under the fitted noise, s; None if the phase noise is not stationary."""
        if self.best.noise.walk > 0.0 or any(
            summed for _, _, summed in self.best.noise.gauss_markov
        ):
            return None
        alone = StampedSeries(self.series.times, self.series.values, self.series.design[:1])
        return float(np.sqrt(alone.regressed(self.best.noise).covariance[0, 0]))

    def holdover(self, after: Sequence[float]) -> list[Holdover]:
        """One `Holdover` for each time in `after` (s after the last sample).

        The temperature, if it was fitted, is assumed to stay at its mean over the last tenth of the record.
        """
        if not after:
            return []
        # The likelihood filter takes the times in ascending order.
        times, places = np.unique(np.asarray(after, dtype=float), return_inverse=True)
        one = np.ones(times.size)
        known = {"frequency": times, "drift": 0.5 * times**2, "temperature": 0.0 * times}
        design = np.array([known.get(name, one) for name in self.functions])
        found = holdovers_of(self.models, times.tolist(), (design[:-1], design))
        return [found[i] for i in places.tolist()]


def _estimate(name: str, value: float, error: float, freedom: float, unit: str) -> Estimate:
    """`Estimate`, marked as detected, whose 95 % interval is that of Student's distribution with `freedom` degrees."""
    from scipy.special import stdtrit

    half = float(stdtrit(freedom, 0.975)) * error
    return Estimate(value, error, (value - half, value + half), unit, True, name)


def _verdict_text(verdict: Verdict, duration: float) -> str:
    """Line of text about one limit of a mask: ``G.8272-A tdev: passes: 1.2 ns at τ = 10 s, limit 3 ns``."""
    head = f"{verdict.mask} {verdict.kind}: {verdict.result}"
    if verdict.measured is None or verdict.limit is None:
        return f"{head}: the mask needs a record of {duration_text(verdict.needs)}"
    at = "" if verdict.tau is None else f" at τ = {number(verdict.tau)} s"
    text = f"{head}: {time_text(verdict.measured)}{at}, limit {time_text(verdict.limit)}"
    if verdict.high is not None and verdict.low is not None:
        text += f" (95 %: {time_text(verdict.low)} to {time_text(verdict.high)})"
    if verdict.result == "undecided" and duration < verdict.needs:
        text += f"; the mask needs a record of {duration_text(verdict.needs)}"
    return text


def _noise_text(model: Model) -> str:
    """Text of the noises of a clock with their usual names, symbols and coefficients: ``white FM N 1.2·10⁻¹⁰ √s``."""
    texts = []
    for e in model.stochastic:
        unit = sheet_unit(e.parameter(e.coefficient), "1")
        text = f"{e.name_for(FREQUENCY)} {e.short} {number(getattr(e, e.coefficient))}"
        texts.append(text if unit == "1" else f"{text} {printed(unit)}")
    return ", ".join(texts)


def _deviation_text(kind: str, value: float) -> str:
    """Text of a deviation: a time such as ``1.2 ns`` for TDEV and MTIE, a number for other kinds, a dash for NaN."""
    if kind in ("tdev", "mtie"):
        return time_text(value)
    return "–" if np.isnan(value) else number(value, power=True)


def _value_text(estimate: Estimate) -> str:
    """Text of an estimate without unit: ``(1.23 ± 0.03)·10⁻¹⁰``, or ``not detected, (−1 to 2)·10⁻¹²``."""
    low, high = estimate.interval or (np.nan, np.nan)
    if not estimate.detected:
        return f"not detected, {powered_text((low, high), ' to ')}"
    return powered_text((estimate.value, estimate.std_error or np.nan), " ± ")
