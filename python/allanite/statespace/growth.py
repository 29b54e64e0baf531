"""Growth of the error since the last fix: the contribution of each effect to an angle, velocity, position or phase.

During aiding the bias is estimated as the mean of the samples; at its end attitude, velocity and position are right. From
there on the samples are integrated. The error after t is a weighted sum of samples, Σ w(k) x(k), whose weights have the
sum 0. Its variance is −Σ c(h) g(h), with the correlation c of the weights and the variogram g(h) = ½ E(x(k+h) − x(k))²
(`coasting`). After a t equal to the time of aiding, the angle's error is √2 t σ(t) with the Allan deviation σ.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.common.arrays import Array
from allanite.common.documents import fields_dict
from allanite.common.errors import InputError, TooShortError
from allanite.common.former import Former
from allanite.common.numbers import number
from allanite.common.units import parse_unit
from allanite.common.validation import positive, positive_rate, require_recording
from allanite.effects import Deterministic, Effect, Model, Modifier, Stochastic, as_model
from allanite.effects.terms import Term
from allanite.recording import Recording
from allanite.statespace.coasting import Coasting, Sums, integration_weights

if TYPE_CHECKING:
    from allanite.fit.result import Fit

#: Standard gravity, m/s² (CGPM 1901).
GRAVITY = 9.80665
#: Maximum number of samples of aiding and coasting, so that variograms fit into memory.
MAX_SAMPLES = 2**24
#: Kind of sensor → tuples (quantity, SI unit of its error, number of integrations, factor on the integral). The factor of a
#: tilt is gravity.
QUANTITIES = {
    "angular rate": (
        ("angle", "rad", 1, 1.0),
        ("velocity by tilt", "m/s", 2, GRAVITY),
        ("position by tilt", "m", 3, GRAVITY),
    ),
    "acceleration": (("velocity", "m/s", 1, 1.0), ("position", "m", 2, 1.0)),
    "fractional frequency": (("phase", "s", 1, 1.0),),
}


@dataclass(frozen=True, eq=False)
class Growth:
    """Standard deviation of an error over time since the last fix.

    Attributes
    ----------
    quantity : str
        ``angle``, ``velocity``, ``position``, ``velocity by tilt``, ``position by tilt``, ``phase``.
    unit : str
        SI unit of the error.
    tau : ndarray, shape (k,)
        Time since the fix, s.
    total : ndarray, shape (k,)
        Standard deviation; a ramp counts with its size.
    budget : dict of str to ndarray, shape (k,)
        Contribution of each effect, by its label; the squares add up.
    left_out : tuple of str
        Effects that depend on the time of the record (a step, a temperature, a louder segment) and are not included.
    aided : float
        Seconds of aiding before the fix.
    following : tuple of str
        Effects in `left_out` that follow a column.

    Examples
    --------
    >>> drift = al.AngleRandomWalk(N=0.01) + al.RateRandomWalk(K=1e-4)
    >>> angle = al.error_growth(drift, aided=100.0, tau=[10.0], unit="deg/s", rate=10)[0]
    >>> print(angle.quantity, angle.unit, sorted(angle.to_dict()["budget"]))
    angle rad ['K', 'N']
    >>> print(angle.table().splitlines()[0][:27])
    angle since the fix, deg (s
    """

    quantity: str
    unit: str
    tau: Array
    total: Array
    budget: dict[str, Array]
    left_out: tuple[str, ...]
    aided: float
    following: tuple[str, ...] = ()

    shown = Former("display_unit")

    @property
    def display_unit(self) -> tuple[str, float]:
        """Tuple (unit in which errors are printed, with deg instead of rad; factor from `unit` to this unit)."""
        return ("deg", 180.0 / np.pi) if self.unit == "rad" else (self.unit, 1.0)

    def table(self, measured: Measured | None = None) -> str:
        """Text table, one row per time: standard deviation in total and by effect; with columns of `measured` if given."""
        unit, factor = self.display_unit
        head = ["after / s", "total", *self.budget]
        columns = [self.tau, factor * self.total, *(factor * v for v in self.budget.values())]
        if measured is not None:
            head += ["measured rms", "within 95 %", "segments"]
            columns += [
                factor * measured.rms,
                100.0 * measured.inside,
                measured.segments.astype(float),
            ]
        lines = [
            f"{self.quantity} since the fix, {unit} (standard deviation), bias averaged over {self.aided:g} s before it",
            "".join(f"{name:>13}" for name in head),
        ]
        lines += ["".join(f"{number(v, 4):>13}" for v in row) for row in zip(*columns, strict=True)]
        timed = [kind for kind in self.left_out if kind not in self.following]
        for kinds, one, more in (
            (timed, "it happens at times of its own", "they happen at times of their own"),
            (
                self.following,
                "it follows a column whose future is not known",
                "they follow columns whose future is not known",
            ),
        ):
            if kinds:
                several = len(kinds) > 1
                line = f"not predicted, {more if several else one}: {', '.join(kinds)}"
                # The measured errors include these effects.
                with_it = f" (measured with {'them' if several else 'it'})"
                lines.append(line + (with_it if measured is not None else ""))
        return "\n".join(lines)

    def __str__(self) -> str:
        return self.table()

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON: quantity, unit, aided_s, tau_s, sigma, budget by effect, and left_out."""
        return fields_dict(self, aided="aided_s", tau="tau_s", total="sigma", following="")


@dataclass(frozen=True, eq=False)
class Measured:
    """Error growth measured in segments of a recording at rest; all arrays have shape (k,).

    `rms` is the root mean square over the segments, `inside` the share of them within ±1.96 of the predicted standard
    deviation. Both are NaN at times without a segment.
    """

    tau: Array
    rms: Array
    inside: Array
    segments: NDArray[np.int64]

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON: tau_s, rms, inside_95 and segments; None instead of NaN."""
        return {
            "tau_s": self.tau.tolist(),
            "rms": _floats_or_none(self.rms),
            "inside_95": _floats_or_none(self.inside),
            "segments": self.segments.tolist(),
        }


def _floats_or_none(values: Array) -> list[float | None]:
    """List of the values as floats, with None for NaN."""
    return [None if np.isnan(v) else float(v) for v in values]


def error_growth(
    model: Model | Effect | str | Fit,
    *,
    aided: float,
    unit: str | None = None,
    rate: float | None = None,
    tau: ArrayLike | None = None,
    duration: float | None = None,
) -> tuple[Growth, ...]:
    """Tuple of `Growth` of the error since the last fix, one for each quantity to which this sensor is integrated.

    Only effects in the model count. True errors are larger if the record is too short to show slow noise.

    Parameters
    ----------
    model : Model, Effect, str or Fit
        Model with all values.
    aided : float
        Seconds of aiding before the fix, over which the bias was averaged.
    unit : str, optional
        Unit of the samples; by default that of a fit's recording.
    rate : float, optional
        Sampling rate, Hz; by default that of a fit's recording.
    tau : array_like, optional
        Times since the fix, s; by default eleven times from a hundredth of `aided` to ten times `aided`.
    duration : float, optional
        Length of the record over which a changing noise level is averaged, s; by default that of a fit's recording.
        Without a duration, white noise has its coefficient N, and the level changes are listed in `Growth.left_out`.

    Returns
    -------
    tuple of Growth

    Raises
    ------
    InputError
        No unit or rate, a unit of a magnetic field, a missing value, or more than 64 effects. Also times that are not
        positive or too long.

    Examples
    --------
    White noise adds N √t to the angle, and N t/√T through the bias averaged over T seconds:

    >>> angle = al.error_growth(al.AngleRandomWalk(N=0.01), aided=1e4, tau=[100.0], unit="rad/s", rate=1)[0]
    >>> print(angle.total.round(2))
    [0.1]
    """
    recording = getattr(model, "recording", None)
    model = as_model(model)
    unit = unit or getattr(recording, "unit", None)
    rate = rate or getattr(recording, "rate", None)
    duration = duration or getattr(recording, "duration", None)
    if unit is None or rate is None:
        raise InputError("error growth needs the unit and the rate of the samples: give both")
    fs, parsed = positive_rate(rate), parse_unit(unit)
    if parsed.kind not in QUANTITIES:
        raise InputError(
            f"samples in {unit} are a {parsed.kind}, whose integral is no navigation error: "
            f"give the unit of one of {', '.join(QUANTITIES)}"
        )
    aided = positive(aided, "aided", "s", "give the seconds of aiding before the fix")
    times = np.geomspace(max(1.0 / fs, aided / 100), 10 * aided, 11) if tau is None else tau
    back, ahead = sample_counts(aided, np.atleast_1d(np.asarray(times, dtype=float)), fs)
    if duration is not None:
        model = model.steady((0.0, positive(duration, "duration", "s", "give that of the record")))
    parts, left = terms_by_label(model, fs)
    left_out = tuple(effect.kind for effect in left)
    following = tuple(effect.kind for effect in left if effect.follows is not None)
    sums = {k: Sums(variogram_of(terms, back + max(ahead))) for k, terms in parts.items() if terms}
    out = []
    for quantity, si, order, factor in QUANTITIES[parsed.kind]:
        budget: dict[str, list[float]] = {k: [] for k in parts}
        for m in ahead:
            coasting = Coasting(back, m, fs, order)
            for label, terms in parts.items():
                found = (
                    coasting.deviation(sums[label])
                    if terms
                    else _known_error(model, label, coasting)
                )
                budget[label].append(factor * found)
        sizes = {k: parsed.scale * np.array(v) for k, v in budget.items()}
        total = np.sqrt(sum((v**2 for v in sizes.values()), np.zeros(len(ahead))))
        out.append(
            Growth(quantity, si, np.array(ahead) / fs, total, sizes, left_out, aided, following)
        )
    return tuple(out)


def measured_growth(recording: Recording, growth: Growth) -> Measured:
    """`Measured`: error growth in segments of a recording at rest, compared with the prediction.

    Parameters
    ----------
    recording : Recording
        One column. Segments with missing samples are omitted.
    growth : Growth
        Prediction from a model of this sensor.

    Returns
    -------
    Measured
        Root mean square in the unit of `growth` at its τ, and the share of segments within its 95 %.

    Raises
    ------
    InputError
        The recording is of another kind of sensor than the prediction.
    TooShortError
        The recording has no complete segment of aiding and coasting.

    Examples
    --------
    >>> noise = al.AngleRandomWalk(N=0.01)
    >>> angle = al.error_growth(noise, aided=10.0, tau=[1.0], unit="rad/s", rate=10)[0]
    >>> log = noise.simulate(duration=5000, rate=10, seed=1, unit="rad/s")
    >>> seen = al.measured_growth(log, angle)
    >>> print((seen.rms / angle.total).round(1), seen.segments)
    [1.] [454]
    """
    require_recording(recording)
    parsed = parse_unit(recording.unit)
    known = {q: (order, factor) for q, _, order, factor in QUANTITIES.get(parsed.kind, ())}
    if growth.quantity not in known:
        raise InputError(
            f"samples in {recording.unit} have no error of {growth.quantity}: "
            "give a recording of the sensor of the prediction"
        )
    order, factor = known[growth.quantity]
    x = np.asarray(recording.rate_samples(), dtype=np.float64) * parsed.scale
    back = round(growth.aided * recording.rate)
    ahead = np.round(growth.tau * recording.rate).astype(int)
    columns = [_measured_errors(x, back, int(m), recording.rate, order) for m in ahead]
    if not any(map(len, columns)):
        length = (back + int(ahead.min())) / recording.rate
        raise TooShortError(
            f"no segment of {length:g} s without gaps in {x.size / recording.rate:g} s: predict shorter times"
        )
    rms, inside = (np.full(len(columns), np.nan) for _ in range(2))
    for i, (errors, limit) in enumerate(zip(columns, 1.96 * growth.total, strict=True)):
        if len(errors):
            rms[i] = factor * np.sqrt((errors**2).mean())
            inside[i] = (np.abs(factor * errors) <= limit).mean()
    return Measured(growth.tau, rms, inside, np.array([len(errors) for errors in columns]))


def _measured_errors(x: Array, back: int, m: int, rate: float, order: int) -> Array:
    """Error after coasting, one per segment of `back` + m samples without NaN, shape (segments,).

    It is the `order`-fold integral of the last m samples after subtraction of the mean of the first `back` samples.
    """
    length = back + m
    segments = x[: x.size // length * length].reshape(-1, length)
    segments = segments[~np.isnan(segments).any(axis=1)]
    unbiased = segments[:, back:] - segments[:, :back].mean(axis=1, keepdims=True)
    return np.asarray(unbiased @ integration_weights(m, rate, order))


def sample_counts(aided: float, tau: Array, rate: float) -> tuple[int, list[int]]:
    """Tuple (number of samples of aiding, list with the number of samples of each coasting), rounded, each at least 1.

    `aided` and `tau` are in s. `InputError` for a `tau` that is not positive and finite, and for more than 2²⁴ samples in
    all.
    """
    for seconds in tau.tolist():
        positive(seconds, "tau", "s", "give positive seconds")
    back, *ahead = (max(1, round(seconds * rate)) for seconds in (aided, *tau.tolist()))
    top = back + max(ahead)
    if top > MAX_SAMPLES:
        raise InputError(
            f"{top / rate:g} s at {rate:g} Hz are {top} samples, more than {MAX_SAMPLES}: predict a shorter time"
        )
    return back, ahead


def terms_by_label(
    model: Model, rate: float
) -> tuple[dict[str, tuple[Term, ...]], tuple[Effect, ...]]:
    """Tuple (dict from the label of each predictable effect to its noise terms, tuple of the effects that are left out).

    Ramps and lines that are not 0 are predictable, but have no terms: (). Left out are other functions of time, and changes
    of the noise level over time. Outliers, disturbances and filters are in neither. `InputError` if a random effect has no
    value, or for more than 64 effects.
    """
    out: dict[str, tuple[Term, ...]] = {}
    left_out: list[Effect] = []
    for effect, label in zip(model.limited("a prediction").effects, model.labels, strict=True):
        if isinstance(effect, Stochastic):
            square = effect.squared_coefficient
            out[label] = tuple(t.scaled(square) for t in model.unit_terms(effect, rate))
        elif isinstance(effect, Deterministic):
            # An effect with an Allan variance is the same at every time of the record.
            if effect.own_allan_variance(np.ones(1), rate)[0] > 0.0:
                out[label] = ()
            else:
                left_out.append(effect)
        elif isinstance(effect, Modifier) and effect.changes_level:
            left_out.append(effect)
    return out, tuple(left_out)


def variogram_of(terms: Sequence[Term], count: int) -> Array:
    """Variogram ½ E(x(k+h) − x(k))² of the sum x of all terms, h = 0 … count, shape (count + 1,)."""
    return np.asarray(sum((t.variogram(count + 1) for t in terms), np.zeros(count + 1)))


def _known_error(model: Model, label: str, coasting: Coasting) -> float:
    """Error after coasting due to the known function `label` of the model, in U·s^order.

    For lines, the rms over all phases. For a ramp, the absolute error, with the ramp starting at the start of aiding.
    """
    effect = model.effects[model.labels.index(label)]
    assert isinstance(effect, Deterministic)
    if effect.periodic:
        turn = 2.0 * np.pi * (effect.base_frequency or 0.0) / coasting.rate
        power = (
            0.5 * (amplitude * coasting.line_error(multiple * turn)) ** 2
            for multiple, amplitude, _ in effect.lines
        )
        return float(np.sqrt(sum(power)))
    time = np.arange(coasting.back + coasting.m) / coasting.rate
    return coasting.signal_error(effect.signal(time, {}))
