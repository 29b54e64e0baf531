"""The dependence of the bias of one axis on temperature (its thermal law), and the noise after correction."""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.polynomial import Polynomial

from allanite.calibration.forms import law_of, with_near_best_evidence
from allanite.common.documents import fields_dict, plain_value
from allanite.common.numbers import number, value_and_interval_text
from allanite.common.parameters import Estimate
from allanite.common.printing import printed
from allanite.common.showing import brief
from allanite.effects import Stochastic

if TYPE_CHECKING:
    from allanite.calibration.band import Curve
    from allanite.calibration.forms import Form, Tried
    from allanite.calibration.runs import Runs
    from allanite.common.arrays import Array
    from allanite.fit import Fit
    from allanite.statespace.growth import Growth


@dataclass(frozen=True, slots=True)
class NoiseLaw:
    """Dependence of the white noise on the temperature.

    Attributes
    ----------
    percent : float
        Change of its standard deviation per °C, %.
    interval : (float, float)
        95 % interval of `percent`, %.
    detected : bool
        True if noise alone causes a change this large in less than 1 % of records.
    """

    percent: float
    interval: tuple[float, float]
    detected: bool

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON: percent_per_degree, interval and detected."""
        return fields_dict(self, percent="percent_per_degree")


@dataclass(frozen=True, slots=True)
class Loop:
    """Bias while cooling minus bias while warming, at the same temperature.

    Attributes
    ----------
    value : float
        Mean over the temperatures that were passed in both directions, in the unit of the samples.
    interval : (float, float)
        95 % interval.
    low, high : float
        Range of these temperatures, °C.
    """

    value: float
    interval: tuple[float, float]
    low: float
    high: float

    @property
    def detected(self) -> bool:
        """True if the 95 % interval of the loop excludes zero."""
        return self.interval[0] > 0.0 or self.interval[1] < 0.0

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON: value, interval, detected and range_celsius."""
        limits = {"detected": self.detected, "range_celsius": [self.low, self.high]}
        return fields_dict(self, low="", high="") | limits


@dataclass(frozen=True, slots=True, eq=False)
class Remainder:
    """Allan deviation before and after correction, over all runs.

    Attributes
    ----------
    tau : ndarray, shape (k,)
        Averaging times, s.
    before, after : ndarray, shape (k,)
        Allan deviations, in the unit of the samples.
    """

    tau: Array
    before: Array
    after: Array

    __repr__ = brief

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON: lists tau_s, before and after."""
        return fields_dict(self, tau="tau_s")


@dataclass(frozen=True, slots=True, eq=False)
class AxisLaw:
    """Thermal law of one axis (how its bias depends on temperature), and the noise after correction.

    Attributes
    ----------
    runs : Runs
        The logs, joined one after the other.
    form : Form
        The chosen form of the law, such as quadratic.
    fit : Fit
        Noise, offsets of the runs and the law, fitted together.
    tried : tuple of Tried
        All forms, fitted to averages of the record.
    curve : Curve
        The law b(T) with its 95 % band.
    offsets : tuple of float
        Bias of each run at the reference temperature, in the unit of the samples.
    noise : NoiseLaw or None
        None if the record is too short to follow the white noise over time.
    walk_of_steps : float
        Largest K that the steps of a coarse thermometer can cause, in the unit of the samples per √s; 0 without steps.
    loop : Loop or None
        None if no temperature was passed both warming and cooling.
    remainder : Remainder
    growth_before, growth_after : tuple of Growth
        Error after the last fix, without and with the correction; empty for sensors without such an error.
    """

    runs: Runs
    form: Form
    fit: Fit
    tried: tuple[Tried, ...]
    curve: Curve
    offsets: tuple[float, ...]
    noise: NoiseLaw | None
    walk_of_steps: float
    loop: Loop | None
    remainder: Remainder
    growth_before: tuple[Growth, ...]
    growth_after: tuple[Growth, ...]

    __repr__ = brief

    @property
    def name(self) -> str:
        """Name of the column."""
        return self.fit.recording.columns[0]

    @property
    def unit(self) -> str:
        """Unit of the samples."""
        return self.fit.recording.unit

    @property
    def range(self) -> tuple[float, float]:
        """Tuple (lowest, highest temperature of the logs), °C."""
        return float(self.curve.temperature[0]), float(self.curve.temperature[-1])

    @property
    def offset(self) -> float:
        """Mean over the logs of the bias at the reference temperature, in the unit of the samples."""
        return float(np.mean(self.offsets))

    @property
    def alternatives(self) -> tuple[Form, ...]:
        """Tuple of `Form`: forms of the law, other than the chosen one, with log evidence within 3 nats of the highest."""
        near = (one.form for one in with_near_best_evidence(self.tried))
        return tuple(form for form in near if form != self.form)

    @property
    def _law(self) -> Polynomial:
        """Law as a `numpy` `Polynomial` in T − reference temperature of the curve: bias averaged over the logs."""
        return Polynomial([self.offset, *self.curve.coefficients])

    def polynomial(self, reference: float) -> Array:
        """Coefficients x0, x1, x2, x3 of the bias as a polynomial in T − `reference`, an array of shape (4,).

        `reference` is in °C. x0 includes the mean offset of the logs.
        """
        law, shift = self._law, reference - self.curve.reference
        return np.array([law.deriv(k)(shift) / factorial(k) for k in range(4)])

    def bias(self, temperature: float | Array) -> Array:
        """Bias that the law predicts at a temperature (°C), in the unit of the samples; array of the shape of the argument.

        The bias differs between logs; the mean over the logs is taken. Temperatures outside of `range` are clipped to it.
        """
        low, high = self.range
        u = np.clip(np.asarray(temperature, dtype=float), low, high) - self.curve.reference
        return np.asarray(self._law(u))

    @property
    def random(self) -> dict[str, Estimate]:
        """Dict from parameter name (``N``, ``GM.q_c``) to `Estimate`, for all noise processes of the fit.

        The steps of a coarse thermometer can look like a rate random walk K. The lower end of K's interval is therefore
        reduced by `walk_of_steps` (difference of squares). If it becomes 0, K counts as not detected.
        """
        out = {
            name if name == effect.short else f"{effect.short}.{name}": value
            for effect, values in zip(self.fit.model, self.fit.estimates, strict=True)
            for name, value in values.items()
            if isinstance(effect, Stochastic) and isinstance(value, Estimate)
        }
        walk = out.get("K")
        if walk is not None and walk.interval is not None and self.walk_of_steps > 0.0:
            low = max(walk.interval[0] ** 2 - self.walk_of_steps**2, 0.0) ** 0.5
            ends = (low, walk.interval[1])
            out["K"] = Estimate(
                walk.value, walk.std_error, ends, walk.unit, walk.detected and low > 0.0, "K"
            )
        return out

    @property
    def numbers(self) -> dict[str, Estimate]:
        """`Estimate` of each fitted parameter of the temperature law with an interval, by name: ``COV.coefficient``."""
        return {
            f"{effect.short}.{name}": value
            for effect, values in zip(self.fit.model, self.fit.estimates, strict=True)
            for name, value in values.items()
            if effect.follows is not None and isinstance(value, Estimate) and value.interval
        }

    @property
    def headline(self) -> str:
        """One sentence: form, size and temperature range of the law, and the effect of the correction.

        Without a dependence, it says so with the 95 % limit of a slope, if known.
        """
        name, (low, high) = self.name, self.range
        covered = f"{number(low, 3)} to {number(high, 3)} °C"
        unit = printed(self.unit)
        after = self._correction_clause()
        if not law_of(self.fit):
            text = f"{name}: no dependence on temperature detected over {covered}"
            return f"{text}; 95 % limit {number(self.limit, 2)} {unit}/°C" if self.limit else text
        change = float(np.ptp(self.curve.bias))
        half = 0.5 * float(np.max(self.curve.high - self.curve.low))
        text = f"{name}: {self.form.name}, changes by {number(change)} ± {number(half, 2)} {unit} over {covered}"
        slope = next((v for k, v in self.numbers.items() if k == "COV.coefficient"), None)
        if self.form.power == 1 and self.form.memory != "hysteresis" and slope is not None:
            assert slope.interval is not None
            text += f", slope {value_and_interval_text(slope.value, slope.interval)} {unit}/°C"
        return text + after

    @property
    def limit(self) -> float | None:
        """95 % limit of the magnitude of the slope of a linear law, unit/°C; None if not tried or without interval."""
        linear = next((one for one in self.tried if one.form.name == "linear"), None)
        if linear is None:
            return None
        found = linear.fit["COV.coefficient"]
        return None if found.interval is None else float(max(map(abs, found.interval)))

    def _correction_clause(self) -> str:
        """Clause on the largest ratio by which the correction divides the Allan deviation; empty below 1.1."""
        remainder = self.remainder
        if not remainder.tau.size:
            return ""
        place = int(np.argmax(remainder.before / remainder.after))
        ratio = remainder.before[place] / remainder.after[place]
        if ratio < 1.1:
            return ""
        return f"; correcting divides the Allan deviation at {number(remainder.tau[place])} s by {number(ratio, 2)}"

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON with all results of the axis; ``noise_over_temperature`` and ``hysteresis`` may be None."""
        curve = self.curve
        return {
            "column": self.name,
            "unit": self.unit,
            "thermometer": self.runs.column,
            "thermometer_step_celsius": self.runs.step,
            "range_celsius": list(self.range),
            "runs": len(self.offsets),
            "headline": self.headline,
            "law": {
                "power": self.form.power,
                "memory": self.form.memory,
                "name": self.form.name,
                "detected": bool(law_of(self.fit)),
                "reference_celsius": curve.reference,
                "coefficients": curve.coefficients.tolist(),
                "numbers": plain_value(self.numbers),
                "offsets": list(self.offsets),
                "alternatives": [form.name for form in self.alternatives],
                "model": str(self.fit.model),
            },
            "curve": fields_dict(
                curve, temperature="temperature_celsius", reference="", coefficients="", loop=""
            ),
            "measured": _binned_means(self),
            "noise": plain_value(self.random),
            "noise_over_temperature": plain_value(self.noise),
            "hysteresis": plain_value(self.loop),
            "tried": [
                {
                    "name": one.form.name,
                    "delta_log_likelihood": one.log_likelihood,
                    "delta_log_evidence": one.log_evidence,
                }
                for one in self.tried
            ],
            "remainder": self.remainder.to_dict(),
            "growth_before": plain_value(self.growth_before),
            "growth_after": plain_value(self.growth_after),
            "mean_temperature_celsius": float(self.runs.temperature.mean()),
        }


def _binned_means(axis: AxisLaw, bins: int = 60) -> dict[str, list[float]]:
    """Means in bins of temperature: lists temperature_celsius, bias and direction (1 while warming, −1 while cooling).

    The offset of each log is subtracted first.
    """
    out: dict[str, list[float]] = {"temperature_celsius": [], "bias": [], "direction": []}
    runs = axis.runs
    values = np.asarray(runs.recording.samples, dtype=float).copy()
    for part, offset in zip(runs.parts, axis.offsets, strict=True):
        values[part] -= offset
    low, high = axis.range
    place = np.clip(((runs.temperature - low) / (high - low) * bins).astype(int), 0, bins - 1)
    good = np.isfinite(values)
    for sign in (1, -1):
        own = good & (runs.direction * -sign > 0.0)
        count = np.bincount(place[own], minlength=bins)
        total = np.bincount(place[own], values[own], minlength=bins)
        heat = np.bincount(place[own], runs.temperature[own], minlength=bins)
        for k in np.flatnonzero(count):
            out["temperature_celsius"].append(float(heat[k] / count[k]))
            out["bias"].append(float(total[k] / count[k]))
            out["direction"].append(float(sign))
    return out
