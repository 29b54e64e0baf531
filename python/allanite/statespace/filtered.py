"""State space of noise behind a filter: one block of states for all noise and the filter."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from allanite.effects._filter import Filter
from allanite.statespace.sections import Section, stationary_covariance


def filtered_section(sections: Sequence[Section], filtering: Filter, rate: float) -> Section:
    """`Section` (block of a state space) for the sum of all `sections` after the filter, at the sampling rate `rate` (Hz).

    White noise becomes a state, because it drives the filter's states as well as the sample. A state of unknown level comes
    first, unless the filter blocks this level; then it is omitted. The filter's states are relative to their equilibrium at
    the level, so that they are stationary.
    """
    from scipy.linalg import block_diag

    terms = filtering.passed(tuple(t for s in sections for t in s.terms), rate)
    white = np.array([[sum(s.R for s in sections)]])
    if white.any():
        zero = np.zeros((1, 1))
        sections = [*sections, Section(zero, white, np.ones(1), white, ())]
    F, Q = (block_diag(*(getattr(s, name) for s in sections)) for name in ("F", "Q"))
    H = np.concatenate([s.H for s in sections])
    # Marks the states of unknown level.
    levels = np.concatenate([np.arange(s.states) < s.diffuse for s in sections])
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
    P0[np.ix_(stationary, stationary)] = stationary_covariance(
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
