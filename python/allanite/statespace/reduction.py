"""Reduction of a state space: fewer AR(1) processes with fitted time constants replace the given ones.

`cost` computes the loss. AR(1): white noise behind a first-order low-pass filter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from allanite.common.arrays import Array
from allanite.common.errors import InputError
from allanite.common.numbers import number
from allanite.effects.terms import Exponential, Term
from allanite.statespace.sections import Section, allan_variance_of, ar1, density_of, resized

if TYPE_CHECKING:
    from allanite.statespace.model import StateSpace

#: Averaging times, and frequencies, per decade at which the reduced model is fitted.
PER_DECADE = 8
#: Weight of the log density in the least squares; the log Allan variance has the weight 1. Chosen by judgment.
DENSITY_WEIGHT = 0.2
#: Maximum number of Levenberg-Marquardt steps.
MAX_ROUNDS = 60


@dataclass(frozen=True, slots=True)
class Cost:
    """Loss of a state space relative to its model.

    `allan_error` is the largest relative error of the Allan deviation at τ from one sample to a tenth of the record, and
    `tau_s` its averaging time. `log_likelihood` is the expected loss per sample: the Kullback-Leibler rate of the two
    spectra, without lines.
    """

    allan_error: float
    tau_s: float
    log_likelihood: float

    def __str__(self) -> str:
        return (
            f"Allan deviation within {number(100 * self.allan_error, 2)} % of the model's (worst at {self.tau_s:.3g} s), "
            f"log-likelihood {self.log_likelihood:.1e} a sample below it"
        )


def cost(space: StateSpace) -> Cost:
    """`Cost` of a state space: error of its Allan deviation and loss of likelihood, relative to the exact noise terms."""
    m = _averaging_factors(space.samples, 16)
    error = np.sqrt(allan_variance_of(space.terms, m) / allan_variance_of(space.exact, m)) - 1.0
    worst = int(np.argmax(np.abs(error)))
    # Both log and linear spacing: half of the ordinates lie above a quarter of the rate, slow noise below a thousandth.
    low = np.pi / space.samples
    w = np.unique(np.concatenate([np.geomspace(low, np.pi, 2000), np.linspace(low, np.pi, 2000)]))
    ratio = _density(space.exact, w) / _density(space.terms, w)
    loss = 0.5 * (ratio - 1.0 - np.log(ratio))
    return Cost(
        float(np.abs(error[worst])),
        float(m[worst] / space.rate),
        float(np.trapezoid(loss, w) / (w[-1] - w[0])),
    )


def reduced(space: StateSpace, states: int) -> StateSpace:
    """State space of at most `states` states with nearly the same Allan deviation and spectrum.

    Parts that are no AR(1) process (a resonance, quantization, a random walk, a filter) are kept, the largest first, if
    they fit; one state is left for AR(1). New AR(1) processes in the remaining states replace all former ones. `InputError`
    for fewer than one state, and for a power law steeper than −2.
    """
    if states < 1:
        raise InputError(f"states = {states}: at least 1 is needed")
    if not all(s.terms for s in space.sections):
        raise InputError("a power law steeper than −2 cannot be reduced: omit `states`")
    order = sorted(
        (i for i, s in enumerate(space.sections) if s.states and not s.is_ar1),
        key=lambda i: -_largest_share(space.sections[i], space),
    )
    lags = sum(s.is_ar1 for s in space.sections)
    room = states
    kept: set[int] = {i for i, s in enumerate(space.sections) if not s.states}
    for i in order:
        size = space.sections[i].states
        if size <= room - min(lags, 1):
            kept.add(i)
            room -= size
    count = min(lags, room)
    fixed = [s for i, s in enumerate(space.sections) if i in kept]
    owners = [o for i, o in enumerate(space.owners) if i in kept]
    fixed, fitted = _fitted_sections(space, fixed, count)
    merged = "+".join(
        dict.fromkeys(o for o, s in zip(space.owners, space.sections, strict=True) if s.is_ar1)
    )
    return replace(space, sections=(*fixed, *fitted), owners=(*owners, *([merged] * len(fitted))))


def _largest_share(section: Section, space: StateSpace) -> float:
    """Maximum over frequency of the section's spectral density, as a fraction of that of the whole model.

    2 for a line and for a section of unknown initial level.
    """
    if section.diffuse or not section.Q.any():
        return 2.0
    w = np.geomspace(np.pi / space.samples, np.pi, 500)
    return float((_density(section.terms, w) / _density(space.exact, w)).max())


def _fitted_sections(
    space: StateSpace, fixed: list[Section], count: int
) -> tuple[list[Section], list[Section]]:
    """Tuple of two lists of `Section`: copies of `fixed` with fitted variances, and up to `count` fitted AR(1) processes.

    Least squares fits their sum to the exact model, in the logarithms of Allan variance and density. Lines and constants of
    unknown level keep their variances.
    """
    m = _averaging_factors(space.samples, PER_DECADE)
    low = 2.0 * np.pi / space.samples
    w = np.geomspace(low, np.pi, max(8, int(PER_DECADE * np.log10(np.pi / low))))
    target = np.log(_allan_and_density(space.exact, m, w))
    weight = np.concatenate([np.ones(m.size), np.full(w.size, DENSITY_WEIGHT)])
    movable = [i for i, s in enumerate(fixed) if s.Q.any() or s.R > 0.0]
    bound = [i for i in range(len(fixed)) if i not in movable]
    base = sum((_allan_and_density(fixed[i].terms, m, w) for i in bound), np.zeros(target.size))
    plain = np.array([_allan_and_density(fixed[i].terms, m, w) for i in movable]).reshape(
        -1, target.size
    )
    decays = _start_decays(space, count)
    start = np.vstack([plain, _ar1_curves(decays, m, w)])
    sizes = np.log(_start_factors(start, base, np.exp(target), len(movable)))
    logs = np.log(decays)
    damping, best = 1e-3, np.inf

    def evaluate(sizes: Array, logs: Array) -> tuple[Array, Array, Array, float]:
        """Tuple (scaled curve of each fitted section, sum of all curves, weighted residuals, sum of squared residuals).

        A curve holds the Allan variance at all m, then the density at all w. `logs` are the logarithms of 1 − φ.
        """
        parts = np.exp(sizes)[:, None] * np.vstack([plain, _ar1_curves(np.exp(logs), m, w)])
        total = base + parts.sum(axis=0)
        residuals = weight * (np.log(total) - target)
        return parts, total, residuals, float(residuals @ residuals)

    parts, total, residuals, best = evaluate(sizes, logs)
    for _ in range(MAX_ROUNDS):
        up = _ar1_curves(np.exp(logs + 1e-4), m, w)
        moved = np.exp(sizes[len(movable) :])[:, None] * up - parts[len(movable) :]
        jacobian = weight[:, None] * np.vstack([parts, moved / 1e-4]).T / total[:, None]
        normal = jacobian.T @ jacobian
        while damping < 1e6:
            step = np.linalg.solve(
                normal + damping * (np.diag(np.diag(normal)) + 1e-9 * np.eye(len(normal))),
                -jacobian.T @ residuals,
            )
            step = np.clip(step, -1.0, 1.0)
            trial = sizes + step[: sizes.size], np.minimum(logs + step[sizes.size :], -1e-9)
            found = evaluate(*trial)
            if found[3] < best:
                break
            damping *= 4.0
        else:
            break
        gained = best - found[3]
        (sizes, logs), (parts, total, residuals, best) = trial, found
        damping = max(damping / 8.0, 1e-9)
        if gained < 1e-10 * (best + 1e-12):
            break
    scale = np.exp(sizes)
    out = list(fixed)
    for place, factor in zip(movable, scale[: len(movable)], strict=True):
        out[place] = resized(fixed[place], float(factor))
    placed = sorted(zip(np.exp(logs), scale[len(movable) :], strict=True))
    return out, [ar1(float(1.0 - decay), float(v)) for decay, v in placed if v > 0.0]


def _start_decays(space: StateSpace, count: int) -> Array:
    """Start values of 1 − φ for `count` AR(1) processes, shape (count,), spaced logarithmically.

    They span the values of the model's AR(1) sections that exceed 2 % of the density at some frequency, or of all if none
    does. Empty if the model has no AR(1) section.
    """
    own = [(1.0 - s.F[0, 0], s) for s in space.sections if s.is_ar1]
    if not own or not count:
        return np.zeros(0)
    seen = [decay for decay, s in own if _largest_share(s, space) > 0.02] or [
        decay for decay, _ in own
    ]
    low, high = max(min(seen), 1.0 / space.samples), max(seen)
    if count == 1:
        return np.array([np.sqrt(low * high)])
    return np.geomspace(low, max(high, 1.01 * low), count)


def _start_factors(columns: Array, base: Array, target: Array, plain: int) -> Array:
    """Start values of factors a > 0, shape (curves,), so that Σ a·curve + `base` approximates `target` in relative terms.

    They are raised until each curve reaches 0.1 % of `target` somewhere, and the first `plain` factors to at least 0.1.
    """
    from scipy.optimize import nnls

    if not len(columns):
        return np.zeros(0)
    sizes, _ = nnls((columns / target).T, 1.0 - base / target)
    small = 1e-3 / np.array([(c / target).max() for c in columns])
    sizes = np.maximum(sizes, small)
    sizes[:plain] = np.maximum(sizes[:plain], 0.1)
    return np.asarray(sizes)


def _allan_and_density(terms: Sequence[Term], m: Array, w: Array) -> Array:
    """Allan variance, U², of the sum of `terms` at the factors m, then its density (`_density`) at w, rad per sample."""
    return np.concatenate([allan_variance_of(terms, m), _density(terms, w)])


def _ar1_curves(decays: Array, m: Array, w: Array) -> Array:
    """Array, one row per AR(1) process of variance 1 with φ = 1 − decay: Allan variance at all m, then density at all w."""
    curves = [_allan_and_density((Exponential(1.0, 1.0 - g),), m, w) for g in decays]
    return np.array(curves).reshape(-1, m.size + w.size)


def _density(terms: Sequence[Term], w: Array) -> Array:
    """Two-sided spectrum, U² per cycle per sample, without lines; at least 1e-300 to keep logarithms and ratios finite."""
    return np.maximum(density_of(terms, w), 1e-300)


def _averaging_factors(n: int, per_decade: int) -> Array:
    """Array: averaging factors from 1 to a tenth of n samples (at least to 2), about `per_decade` per decade."""
    top = max(2.0, n / 10.0)
    return np.unique(np.round(np.geomspace(1.0, top, int(per_decade * np.log10(top)) + 2)))
