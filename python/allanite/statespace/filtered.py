"""State space of noise behind a filter: one block of states for all noise and the filter."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import Array
from allanite.statespace.sections import Section

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.effects._filter import Filter


def filtered_section(sections: Sequence[Section], filtering: Filter, rate: float) -> Section:
    """One `Section` for the sum of all sections after a filter.

    White noise becomes a state, because it drives the filter's states as well as the sample. States of unknown level
    come first. The filter's states are differences from their equilibrium at this level, so that they are stationary.
    States of a level that the filter blocks are omitted.
    """
    terms = filtering.passed(tuple(t for s in sections for t in s.terms), rate)
    F, Q, H, levels = _joined_matrices(sections)
    response = filtering.response(rate)
    a, b = response.a[1:], response.b
    inside, order = H.size, a.size
    # Transposed direct form: f ← A f + B u, output f_0 + b_0 u.
    A = np.eye(order, k=1)
    A[:, 0] = -a
    B = b[1:] - a * b[0]
    size = inside + order
    whole, noise = np.zeros((size, size)), np.zeros((size, size))
    whole[:inside, :inside], noise[:inside, :inside] = F, Q
    whole[inside:, :inside], whole[inside:, inside:] = np.outer(B, H), A
    out = np.concatenate([b[0] * H, np.eye(order)[0]])
    held = np.linalg.solve(np.eye(order) - A, B)
    turn = np.eye(size)
    turn[inside:, :inside] = -np.outer(held, np.where(levels, H, 0.0))
    back = 2.0 * np.eye(size) - turn
    whole, noise, out = turn @ whole @ back, turn @ noise @ turn.T, out @ back
    first = np.flatnonzero(np.pad(levels, (0, order)))
    stationary = np.setdiff1d(np.arange(size), first)
    P0 = np.zeros((size, size))
    P0[np.ix_(stationary, stationary)] = _stationary_covariance(
        whole[np.ix_(stationary, stationary)], noise[np.ix_(stationary, stationary)]
    )
    seen = bool(response.at_zero)
    order_of = np.concatenate([first, stationary]) if seen else stationary
    pick = np.ix_(order_of, order_of)
    return Section(
        whole[pick],
        noise[pick],
        out[order_of],
        P0[pick],
        terms,
        diffuse=seen and first.size > 0,
    )


def _joined_matrices(sections: Sequence[Section]) -> tuple[Array, Array, Array, NDArray[np.bool_]]:
    """Tuple (F, Q, H, mask) of all sections together: block-diagonal F and Q; the mask marks states of unknown level.

    White noise is the last state.
    """
    white = sum(s.R for s in sections)
    size = sum(s.states for s in sections) + bool(white)
    F, Q, H = np.zeros((size, size)), np.zeros((size, size)), np.zeros(size)
    levels = np.zeros(size, dtype=bool)
    at = 0
    for s in sections:
        here = slice(at, at + s.states)
        F[here, here], Q[here, here], H[here] = s.F, s.Q, s.H
        levels[at : at + bool(s.diffuse)] = True
        at += s.states
    if white:
        Q[-1, -1], H[-1] = white, 1.0
    return F, Q, H, levels


def _stationary_covariance(F: Array, Q: Array) -> Array:
    """Array: stationary covariance Σ F^k Q F^kᵀ of states with transition F and process noise Q."""
    total, step = Q, F
    for _ in range(64):
        total, step = total + step @ total @ step.T, step @ step
    return np.asarray(0.5 * (total + total.T))
