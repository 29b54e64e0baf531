"""Stretches in which one value stands."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

__all__ = ["longest_run"]


def longest_run(pieces: Iterable[tuple[int, NDArray[np.float64]]], n: int) -> tuple[int, int, int]:
    """First sample and length of the longest run of one value, and how many of n samples equal the one before.

    `pieces` are (first sample, samples), each reaching one sample into the next; NaN equals nothing.
    """
    longest, start, run_start, equal = 1, 0, 0, 0
    for at, piece in pieces:
        changes = np.flatnonzero(piece[1:] != piece[:-1])
        equal += piece.size - 1 - changes.size
        if changes.size:
            ends = changes + at + 1
            runs = np.diff(ends, prepend=run_start)
            i = int(np.argmax(runs))
            if runs[i] > longest:
                longest, start = int(runs[i]), int(ends[i] - runs[i])
            run_start = int(ends[-1])
    if n - run_start > longest:
        longest, start = n - run_start, run_start
    return start, longest, equal
