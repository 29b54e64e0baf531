"""Shortest record that answers a question: find an effect, know a parameter, or distinguish two effects."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite import _kernels
from allanite.common.errors import InputError
from allanite.common.numbers import duration_text
from allanite.common.showing import text_html
from allanite.common.validation import positive, positive_rate
from allanite.effects import Deterministic, Model, as_model, parse_model
from allanite.fit.likelihood.whittle import log_likelihood
from allanite.planning import expected as _expected
from allanite.planning.detection import Power, as_effect, detection_power, predicted_detection
from allanite.planning.standard_errors import standard_errors

if TYPE_CHECKING:
    from collections.abc import Callable

    from allanite.effects import Effect
    from allanite.fit.likelihood.data import Data
    from allanite.planning.expected import Columns

#: Maximum duration of a planned record, s: ten years.
MAX_DURATION = 10 * 365.25 * 86400.0
#: The search for a duration ends if its upper bound divided by its lower bound is below this ratio.
DURATION_RATIO = 1.02
#: Sampling rates that are compared if none is given, Hz.
RATES = (0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0)
#: The chosen rate is the lowest one whose duration divided by the shortest duration is at most this ratio. Chosen by
#: judgment.
MAX_DURATION_RATIO = 1.1
#: Two effects are distinguished if the expected odds reach this value. Chosen by judgment; not measured.
MIN_ODDS = 1000.0


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """Result of `plan`: the shortest record that answers a question.

    Attributes
    ----------
    duration, rate : float
        Length of the record, s, and sampling rate, Hz.
    power : Power
        What that record will show.
    question : str
        The question, in words.
    alternatives : tuple of (float, float or None)
        Rate in Hz and duration in s of each rate compared; None if ten years do not suffice.

    Examples
    --------
    >>> found = al.plan("N(N=0.01)+K(K=1e-4)", know="K", to=0.2, rate=1.0)
    >>> found.rate, found.to_dict()["schema"]
    (1.0, 'allanite/plan/1')
    """

    duration: float
    rate: float
    power: Power
    question: str
    alternatives: tuple[tuple[float, float | None], ...]

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON, schema ``allanite/plan/1``: question, duration, rate, alternatives and power."""
        return {
            "schema": "allanite/plan/1",
            "version": _kernels.version(),
            "question": self.question,
            "duration_s": self.duration,
            "rate_hz": self.rate,
            "alternatives": [{"rate_hz": r, "duration_s": d} for r, d in self.alternatives],
            "power": self.power.to_dict(),
        }

    def __str__(self) -> str:
        lines = [
            f"{self.question}: record {duration_text(self.duration)} at {self.rate:g} Hz",
            "",
            str(self.power),
        ]
        if len(self.alternatives) > 1:
            lines += ["", f"{'rate (Hz)':>12} {'duration':>14}"]
            lines += [
                f"{rate:12g} {'not in 10 years' if d is None else duration_text(d):>14}"
                for rate, d in self.alternatives
            ]
        return "\n".join(lines)

    _repr_html_ = text_html


def plan(
    model: Model | Effect | str,
    *,
    find: Effect | str | None = None,
    power: float = 0.9,
    know: str | None = None,
    to: float = 0.1,
    tell: tuple[str, str] | None = None,
    rate: float | None = None,
    covariates: Columns | None = None,
) -> Plan:
    """Shortest record that answers one question: find an effect, know a parameter, or distinguish two effects.

    Parameters
    ----------
    model : Model, Effect or str
        Model with expected values.
    find : Effect or str, optional
        Effect to be found, with values. Give this, `know` or `tell`.
    power : float
        Required probability that `check` finds the effect.
    know : str, optional
        Parameter of the model to be known: ``K``, ``GM.correlation_time``.
    to : float
        Required standard error of the parameter divided by its value.
    tell : (str, str), optional
        Two effects, such as ``("K", "GM")``, one of which is in the model. The expected odds against the other must be
        1000 : 1.
    rate : float, optional
        Sampling rate, Hz. By default, rates from 0.1 to 1000 Hz are compared, and the lowest rate is taken whose record
        is at most a tenth longer than the shortest. Samples are averages over their interval, so that the densities
        do not depend on the rate.
    covariates : mapping of str to callable, optional
        Expected course of each column as a function of time in s, shape (n,) → (n,).

    Returns
    -------
    Plan

    Raises
    ------
    InputError
        None or several of `find`, `know` and `tell`, a number out of range, or ten years of record do not suffice.

    References
    ----------
    Cowan, G., Cranmer, K., Gross, E. & Vitells, O. (2011). Asymptotic formulae for likelihood-based tests of new
    physics. Eur. Phys. J. C 71, 1554: the expected record ("Asimov data set").

    Examples
    --------
    >>> found = al.plan("N(N=0.01)+K(K=1e-4)", know="K", to=0.2, rate=1.0)
    >>> bool(found.duration > 3600), bool(found.power.relative("K") < 0.21)
    (True, True)
    """
    base = as_model(model)
    effect = None if find is None else as_effect(find)
    if sum(goal is not None for goal in (effect, know, tell)) != 1:
        raise InputError(
            "a plan needs one goal",
            remedy=": give {find} (an effect), {know} (a parameter) or {tell} (two effects)",
        )
    if not 0.0 < power < 1.0:
        raise InputError(f"power = {power}: a probability between 0 and 1, such as 0.9")
    to = positive(to, "to", "", "a positive share of the value, such as 0.1 for 10 %")
    rate = None if rate is None else positive_rate(rate)
    _expected.require_values(base if effect is None else base + effect)
    if tell is not None:
        question = f"to tell {tell[0]} from {tell[1]} at {MIN_ODDS:g} : 1"
        other = _alternative_model(base, tell)

        def is_enough(data: Data, grid: Data) -> bool:
            """True if a record like `data` distinguishes the two models: their expected odds reach 1000 : 1."""
            return _log_odds(base, other, data, grid) >= np.log(MIN_ODDS)
    elif know is not None:
        question = f"to know {know} to {100 * to:g} %"
        value = detection_power(base, duration=1e4, rate=1.0, covariates=covariates).value(know)

        def is_enough(data: Data, grid: Data) -> bool:
            """True if a record like `data` gives the parameter `know` with a relative standard error of at most `to`."""
            return standard_errors(base, data, grid)[know] <= to * abs(value)
    else:
        assert effect is not None
        question = f"to find {effect} with probability {power:g}"

        def is_enough(data: Data, grid: Data) -> bool:
            """True if `check` finds the effect in a record like `data` with a probability of at least `power`."""
            return predicted_detection(base, effect, data, grid).probability >= power

    rates = RATES if rate is None else (rate,)
    tried = tuple((r, _shortest_duration(is_enough, r, covariates)) for r in rates)
    possible = [(d, r) for r, d in tried if d is not None]
    if not possible:
        why = "it cannot be distinguished from the rest of the model"
        if tell is not None:
            why = "the other one can look like it; give the model with that one and its values"
        raise InputError(f"plan: ten years of record do not suffice {question}: {why}")
    best = min(possible)[0]
    duration, chosen = min(
        ((d, r) for d, r in possible if d <= MAX_DURATION_RATIO * best), key=lambda p: p[1]
    )
    return Plan(
        duration,
        chosen,
        detection_power(base, effect, duration=duration, rate=chosen, covariates=covariates),
        question,
        tried,
    )


def _shortest_duration(
    is_enough: Callable[[Data, Data], bool], rate: float, covariates: Columns | None
) -> float | None:
    """Shortest duration, s, of a record for which `is_enough` is True, to 2 %; None if ten years do not suffice.

    `is_enough` is called with the `Data` of a record and of its coarse grid.
    """

    def is_long_enough(duration: float) -> bool:
        """True if `is_enough` for the record of this duration, s, and its coarse grid."""
        data = _expected.blank_data(round(duration * rate), rate)
        return is_enough(data, _expected.coarse_data(data, covariates))

    low = high = 64.0 / rate
    while not is_long_enough(high):
        if high >= MAX_DURATION:
            return None
        low, high = high, min(4.0 * high, MAX_DURATION)
    while high > DURATION_RATIO * low:
        middle = float(np.sqrt(low * high))
        if is_long_enough(middle):
            high = middle
        else:
            low = middle
    return high


def _alternative_model(base: Model, names: tuple[str, str]) -> Model:
    """Copy of the model `base` in which one of two named effects, such as ``GM`` and ``K``, is replaced by the other one.

    `base` must contain exactly one of the two. The other effect has no values and is the last effect of the copy; it
    must not be a known function of time. Raises `InputError` otherwise.
    """
    if len(names) != 2:
        raise InputError(f"tell = {', '.join(names)}: two effects, such as GM,K")
    given = [parse_model(name).effects[0] for name in names]
    held = [e.kind in {b.kind for b in base} for e in given]
    if sum(held) != 1:
        count = "both" if all(held) else "none"
        raise InputError(
            f"tell = {', '.join(names)}: the model {base.name} has {count} of the two, it needs one of them with values"
        )
    own, other = (given[0], given[1]) if held[0] else (given[1], given[0])
    if isinstance(other, Deterministic):
        raise InputError(
            f"tell = {', '.join(names)}: a {other.short} cannot be predicted from a {own.short}; swap them: put"
            f" {other.short} with values in the model and tell it from {own.short}"
        )
    place = next(i for i, e in enumerate(base) if e.kind == own.kind)
    return Model((*base.effects[:place], *base.effects[place + 1 :], other))


def _log_odds(truth: Model, other: Model, data: Data, grid: Data) -> float:
    """Expected log odds of `truth`, nats: loss of logL if the model `other` is fitted to a record of `truth`.

    Known functions of `truth` whose kind is also in `other` cost nothing. `data` and `grid` are from `expected.blank_data`
    and `expected.coarse_data`.
    """
    power = _expected.expected_power(truth, data)
    for effect in truth.deterministic:
        if effect.kind not in {e.kind for e in other}:
            power = power + _expected.signal_power(effect, data, grid) / data.bins.count
    best = _expected.best_fit(_expected.random_part(other), power, data).log_likelihood
    noise = _expected.expected_power(truth, data)
    return log_likelihood(noise, data.bins.count, noise) - best
