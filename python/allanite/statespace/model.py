"""State-space form of a model: the matrices F, Q, H, R and P0 for a Kalman filter."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.common.arrays import Array
from allanite.common.errors import InputError
from allanite.common.validation import positive_rate
from allanite.effects import Deterministic, Effect, Model, Modifier, Stochastic, as_model
from allanite.effects.terms import Term
from allanite.statespace.sections import (
    Section,
    allan_variance_of,
    density_of,
    filtered_section,
    line,
    sections_of,
)

if TYPE_CHECKING:
    from allanite.statespace.reduction import Cost

#: Record length, in samples, for which the slowest noise is approximated if no duration is given.
DEFAULT_SAMPLES = 1_000_000
#: Initial variance of an unknown level divided by the variance of all other noise over the record.
UNKNOWN_LEVEL_RATIO = 1e7


@dataclass(frozen=True, eq=False)
class StateSpace:
    """State-space form of a model: the matrices F, Q, H, R and P0 of its noise.

    s(k+1) = F s(k) + w(k), x(k) = H s(k) + v(k) with cov w = Q, var v = R, s(0) ~ (0, P0).

    F is block diagonal; the blocks are independent of each other.

    Attributes
    ----------
    sections : tuple of Section
        The blocks, in the order of the model's effects.
    owners : tuple of str
        Label of the effect of each section (``N``, ``GM2``).
    rate : float
        Sampling rate, Hz.
    samples : int
        Record length, in samples, for which the slowest noise is approximated.
    known : tuple of Effect
        Effects that are not in the matrices: known functions of time, which the filter must subtract or estimate, and
        changes of the noise level, by which it must scale R.
    exact : tuple of Term
        Terms of the exact model, with which a reduced form is compared.

    Examples
    --------
    >>> space = al.parse_model("N(N=0.1)+GM(q_c=0.01,T=30)").state_space(rate=10.0)
    >>> print(space.F.round(4), space.R.round(4), space.labels)
    [[0.9967]] [[0.1]] ('GM',)
    >>> print(space.psd([0.1]).round(4), space.allan_variance([1.0]).round(5))
    [0.0103] [0.01003]
    >>> space.with_level().diffuse, sorted(space.to_dict())[:3]
    (array([False,  True]), ['F', 'H', 'P0'])
    """

    sections: tuple[Section, ...]
    owners: tuple[str, ...]
    rate: float
    samples: int
    known: tuple[Effect, ...] = ()
    exact: tuple[Term, ...] = field(default=(), repr=False)

    @property
    def states(self) -> int:
        """Number of states."""
        return sum(s.states for s in self.sections)

    @property
    def labels(self) -> tuple[str, ...]:
        """Tuple of texts, one per state: label of the effect to which the state belongs."""
        return tuple(
            owner
            for owner, s in zip(self.owners, self.sections, strict=True)
            for _ in range(s.states)
        )

    def _block_diagonal(self, name: str) -> Array:
        """Block-diagonal matrix, shape (d, d), of the attribute `name` (``F``, ``Q`` or ``P0``) of all sections."""
        from scipy.linalg import block_diag

        blocks = (getattr(section, name) for section in self.sections)
        return np.asarray(block_diag(np.zeros((0, 0)), *blocks))

    @property
    def F(self) -> Array:
        """Transition matrix, shape (d, d)."""
        return self._block_diagonal("F")

    @property
    def Q(self) -> Array:
        """Covariance of the process noise per step, U², shape (d, d)."""
        return self._block_diagonal("Q")

    @property
    def H(self) -> Array:
        """Measurement matrix, shape (1, d): the sample is H times the state, plus white noise."""
        return np.concatenate([np.zeros(0), *(s.H for s in self.sections)])[None, :]

    @property
    def R(self) -> Array:
        """Variance of the white noise in each sample, U², shape (1, 1)."""
        return np.array([[sum(s.R for s in self.sections)]])

    @property
    def diffuse(self) -> NDArray[np.bool_]:
        """Mask of the state whose initial level is unknown (the bias), shape (d,): at most one is True."""
        each = (np.arange(s.states) < s.diffuse for s in self.sections)
        unknown = np.concatenate([np.zeros(0, dtype=bool), *each])
        # One unknown level is enough: the samples determine only the sum of several.
        return unknown & (np.cumsum(unknown) == 1)

    @property
    def P0(self) -> Array:
        """Initial covariance of the state, U², shape (d, d).

        It is stationary. An unknown level has 10⁷ times the variance of everything else over the record.
        """
        out = self._block_diagonal("P0")
        H = self.H[0]
        spread = float(self.R[0, 0] + H @ out @ H + self.samples * (H @ self.Q @ H))
        out[np.diag_indices(self.states)] += np.where(
            self.diffuse, UNKNOWN_LEVEL_RATIO * spread, 0.0
        )
        return out

    @property
    def terms(self) -> tuple[Term, ...]:
        """Tuple of `Term` (white noise, exponential, …) whose sum is the noise of the matrices, lines included."""
        return tuple(t for s in self.sections for t in s.terms)

    @property
    def cost(self) -> Cost:
        """`Cost`: error of the Allan deviation and loss of likelihood relative to the exact model."""
        from allanite.statespace.reduction import cost

        return cost(self)

    def psd(self, f: ArrayLike) -> Array:
        """Two-sided power spectral density at the frequencies `f` (Hz), without lines, in U²/Hz; shape of `f`."""
        w = 2.0 * np.pi * np.asarray(f, dtype=float) / self.rate
        return density_of(self.terms, w) / self.rate

    def allan_variance(self, tau: ArrayLike) -> Array:
        """Allan variance at the averaging times `tau` (s), in U²; shape of `tau`. Times are rounded to samples."""
        m = np.maximum(np.round(np.asarray(tau, dtype=float) * self.rate), 1.0)
        return allan_variance_of(self.terms, m.ravel()).reshape(m.shape)

    def with_level(self) -> StateSpace:
        """State space with one more state, a constant of unknown value.

        If the state space has a state of unknown initial level already, `self` is returned.
        """
        if self.diffuse.any():
            return self
        one = np.ones((1, 1))
        constant = Section(one, 0.0 * one, np.ones(1), 0.0 * one, (), diffuse=True)
        return replace(self, sections=(*self.sections, constant), owners=(*self.owners, "level"))

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON, schema ``allanite/state_space/1``: the matrices by rows, and the effect of each state."""
        cost = self.cost
        matrices = {
            name: getattr(self, name).tolist() for name in ("F", "Q", "H", "R", "P0", "diffuse")
        }
        return {
            "schema": "allanite/state_space/1",
            "rate_hz": self.rate,
            "states": list(self.labels),
            **matrices,
            "known": [e.kind for e in self.known],
            "cost": {
                "allan_error_percent": 100.0 * cost.allan_error,
                "log_likelihood_per_sample": cost.log_likelihood,
            },
        }

    def __str__(self) -> str:
        lines = [
            f"state space at {self.rate:g} Hz: {self.states} states ({', '.join(self.labels)})",
            str(self.cost),
        ]
        if self.known:
            kinds = ", ".join(e.kind for e in self.known)
            lines.append(f"known functions of time, not in the matrices: {kinds}")
        return "\n".join(lines)


def state_space(
    model: Model | Effect | str,
    rate: float,
    *,
    states: int | None = None,
    duration: float | None = None,
) -> StateSpace:
    """State-space form of the random part of a model.

    Flicker and other power laws become sums of AR(1) processes, two per decade of frequency. A low-pass filter and
    quantization become short recursions with their spectrum. Lines become undamped pairs of unknown phase. If a filter
    acts on the whole signal, all noise is one block.

    Parameters
    ----------
    model : Model, Effect or str
        Model with all values.
    rate : float
        Sampling rate, Hz.
    states : int, optional
        Largest number of states; `StateSpace.cost` gives the loss of a reduction.
    duration : float, optional
        Record length for which the slowest noise is approximated, s; by default a million samples.

    Returns
    -------
    StateSpace

    Raises
    ------
    InputError
        A missing value, a rate that is not positive, a duration above 2⁴⁰ samples, no random part, or fewer `states`
        than the model needs. Also if `states` would reduce a power law steeper than −2.
    """
    model = as_model(model)
    fs = positive_rate(rate)
    n = DEFAULT_SAMPLES if duration is None else max(16, round(duration * fs))
    if n > 2**40:
        raise InputError(f"duration = {duration:g} s at {fs:g} Hz is too long: give a shorter one")
    if model.filters:
        found = _filtered_state_space(model, fs, states, duration)
        if states is not None and found.states > states:
            raise InputError(f"states = {states}: {model.name} needs {found.states} at least")
        return found
    sections: list[Section] = []
    owners: list[str] = []
    exact: list[Term] = []
    known: list[Effect] = []
    for effect, label in zip(model.effects, model.labels, strict=True):
        if isinstance(effect, Stochastic):
            square = effect.squared_coefficient
            terms = [term.scaled(square) for term in model.unit_terms(effect, fs)]
            own = sections_of(terms, n)
            exact += terms
        elif isinstance(effect, Deterministic) and effect.periodic:
            if effect.base_frequency is None:
                raise InputError(
                    f"{effect.kind}: frequency has no value: give a value, or fit the model first"
                )
            own = [line(a, 2 * np.pi * m * effect.base_frequency / fs) for m, a, _ in effect.lines]
            exact += [t for s in own for t in s.terms]
        else:
            if _is_known_in_time(effect):
                known.append(effect)
            continue
        sections += own
        owners += [label] * len(own)
    if not any(s.R or s.P0.any() or s.Q.any() for s in sections):
        raise InputError(f"the model {model.name} has no random part: a filter needs one")
    whole = StateSpace(tuple(sections), tuple(owners), fs, n, tuple(known), tuple(exact))
    if states is None or states >= whole.states:
        return whole
    from allanite.statespace.reduction import reduced

    return reduced(whole, states)


def _filtered_state_space(
    model: Model, rate: float, states: int | None, duration: float | None
) -> StateSpace:
    """`StateSpace` of a model with filters: one block of states for all filtered noise, then one per spectral line.

    `states` limits the total number of states, but at least one is left for the noise; None keeps all.
    """
    known = tuple(e for e in model if _is_known_in_time(e))
    aside = [e for e in model.modifiers if e.whole is not None]
    noise = Model(tuple(e for e in model if not isinstance(e, Deterministic) and e not in aside))
    more = sum(len(f.response(rate).poles) for f in model.filters) + 1
    lines = Model(tuple(e for e in model.deterministic if e.periodic))
    line_space = state_space(lines, rate, duration=duration) if len(lines) else None
    more += line_space.states if line_space else 0
    within = None if states is None else max(1, states - more)
    inner = state_space(noise, rate, states=within, duration=duration)
    section = filtered_section(inner.sections, model.filters[0], rate)
    for filtering in model.filters[1:]:
        section = filtered_section([section], filtering, rate)
    owner = "+".join(e.short for e in model.filters)
    line_sections = line_space.sections if line_space else ()
    return StateSpace(
        (section, *line_sections),
        (owner, *(line_space.owners if line_space else ())),
        rate,
        inner.samples,
        known,
        (*model.terms(rate), *(t for s in line_sections for t in s.terms)),
    )


def _is_known_in_time(effect: Effect) -> bool:
    """True if the effect is a known function of time (except spectral lines) or changes the noise level for a while."""
    if isinstance(effect, Modifier):
        return effect.changes_level
    return isinstance(effect, Deterministic) and not effect.periodic
