"""Score on the second half of a record of a model fitted to its first half."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.effects import Model, Periodic
from allanite.fit.data import column, density
from allanite.fit.deterministic import line_ordinates, regress, window
from allanite.fit.engine import solve
from allanite.fit.shape import ZOOM

if TYPE_CHECKING:
    from allanite.effects.terms import Term
    from allanite.fit.data import Data

__all__ = ["held_out"]


def held_out(data: Data, model: Model, raw: Data | None = None) -> float | None:
    """Mean negative log-likelihood per bin of the second half above the saturated model.

    Coefficients come from the first half; shapes start from the values given. Slow deterministic effects are
    extrapolated. A line is scored by its power (its phase is not extrapolated: the frequency is not known that well):
    the logarithm of the Rice against the Rayleigh likelihood of its ordinates. Effects that happen once (steps, bursts)
    say nothing about another time and are taken out of both halves.

    Where the model takes outliers out, `raw` is the record with them: the saturated model is always the raw record's, and
    each outlier costs ln n, the price of pointing at it.

    Returns None where a half would be too short to fit.
    """
    if data.n < 128:
        return None
    once = [e for e in model.deterministic if e.happens_once]
    if once:
        data = replace(data, samples=data.samples - data.signal(once))
        model = Model(tuple(e for e in model.effects if e not in once))
    first, second = data.half(0), data.half(1)
    fitted = solve(first, model, polish=data.n < 200_000, rounds=3).model
    bins = second.bins
    own = bins.power(second.ordinates)
    saturated = own if raw is None else bins.power(raw.half(1).ordinates)
    slow = [e for e in fitted.deterministic if not isinstance(e, Periodic)]
    power = own
    if slow:
        power = bins.power(second.without(second.signal(slow)))
    terms = second.terms(fitted)
    spectrum = np.maximum(column(terms, second), 1e-300)
    loss = float(0.5 * (bins.count @ (np.log(spectrum / saturated) + power / spectrum - 1.0)))
    for effect in fitted.deterministic:
        if isinstance(effect, Periodic):
            for multiple, amplitude, _ in effect.lines:
                frequency = multiple * (effect.frequency or 0.0)
                loss -= _line_gain(frequency, amplitude, terms, second)
    removed = model.missing(data.n, data.rate)
    if removed is not None:
        loss += float(np.log(second.n)) * int(removed[data.n - second.n :].sum())
    return loss / bins.count.size


def _line_gain(
    frequency: float,
    amplitude: float,
    terms: tuple[Term, ...],
    data: Data,
) -> float:
    """Ln p(ordinates | line of this power, any phase) − ln p(ordinates | no line)."""
    j = window(frequency, data, ZOOM)
    variance = density(terms, j, data.n)
    matrix = line_ordinates(frequency, j, data)
    seen = regress(matrix, data.ordinates[j], variance).gain
    expected = 0.5 * amplitude**2 * float(np.mean([(m**2 / variance).sum() for m in matrix.T]))
    return -expected + _log_bessel(2.0 * np.sqrt(expected * seen))


def _log_bessel(x: float) -> float:
    """Ln I0(x), for any x."""
    from scipy.special import i0e

    value: NDArray[np.float64] = np.log(i0e(x))
    return float(value) + x
