"""Blocks of samples that a log holds twice: a packet that was sent again, or a buffer that was written again."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.arrays import Array

#: Samples that are searched together, to limit the memory; a copy further away from its original is not found.
SEARCHED = 1 << 18
#: Ln of the expected number of pairs of equal windows in independent samples: one false finding in a million records.
MAX_LOG_PAIRS = -14.0
#: Fewest and most samples of a window. In a record whose samples repeat so often that it would be longer, nothing is found.
#: Chosen by judgment; not measured.
WINDOW = (16, 512)
#: One of so many windows, chosen by its content, is compared with the others: a copy and its original choose the same.
#: Chosen by judgment; not measured.
CHOSEN = 8
#: Odd factor of the hash of a window, and its inverse modulo 2^64.
FACTOR = 0x9E3779B97F4A7C15
INVERSE = pow(FACTOR, -1, 1 << 64)


@dataclass(frozen=True, slots=True)
class Copy:
    """Block of `count` samples from index `start` that equal the samples `lag` earlier."""

    start: int
    count: int
    lag: int


def copies_of(x: NDArray[Any]) -> list[Copy]:
    """Blocks of a column, in order of time, that equal an earlier block sample by sample.

    A block is so long that independent samples with as many equal values would contain no such pair.
    """
    found: list[Copy] = []
    end = 0
    for at in range(0, max(x.size - SEARCHED // 2, 1), SEARCHED // 2):
        for start, count, lag in _copies_in(np.asarray(x[at : at + SEARCHED], dtype=np.float64)):
            if at + start >= end:
                found.append(Copy(at + start, count, lag))
                end = at + start + count
    return found


def _copies_in(x: Array) -> Iterator[tuple[int, int, int]]:
    """Yield (start, count, lag): the `count` samples from index `start` on equal the samples `lag` earlier; no overlap."""
    if x.size < 4 * WINDOW[0]:
        return
    equal = max((float(np.mean(x[k:] == x[:-k])) for k in (1, 2, 5, 17) if x.size > k), default=1.0)
    length = max(WINDOW[0], _min_length(equal, x.size))
    if length > WINDOW[1] or x.size < 4 * length:
        return
    hashes = _hashes(x, length)
    chosen = np.flatnonzero(hashes % np.uint64(CHOSEN) == 0)
    chosen = chosen[np.lexsort((chosen, hashes[chosen]))]
    twice = np.flatnonzero(np.diff(hashes[chosen]) == 0)
    known: dict[int, tuple[NDArray[np.intp], int]] = {}
    end = 0
    for place in np.sort(chosen[twice + 1]).tolist():
        if place < end:
            continue
        own = np.flatnonzero(hashes[chosen] == hashes[place])
        first = int(chosen[own[0]])
        lag = place - first
        if lag < WINDOW[0]:
            continue
        if lag not in known:
            same = x[lag:] == x[:-lag]
            # The probability of equal samples by chance, as in a rounded periodic signal, shows after unequal ones.
            resumed = same[1:][~same[:-1]]
            chance = float(np.mean(resumed)) if resumed.size else 1.0
            known[lag] = np.flatnonzero(~same) + lag, _min_length(chance, x.size)
        differs, needed = known[lag]
        after = int(np.searchsorted(differs, place))
        start = max(end, int(differs[after - 1]) + 1 if after else lag)
        end = int(differs[after]) if after < differs.size else x.size
        # A stuck value is no copy.
        if end - start >= max(length, needed) and np.ptp(x[start:end]) > 0.0:
            yield start, end - start, lag


def _min_length(equal: float, n: int) -> int:
    """Length of a run of equal samples that n samples do not contain twice by chance, if a fraction `equal` is equal."""
    return math.ceil(
        (2.0 * math.log(n) - MAX_LOG_PAIRS) / -math.log(max(min(equal, 0.999), 1.0 / n))
    )


def _hashes(x: Array, length: int) -> NDArray[np.uint64]:
    """Array of a hash of each window of `length` samples, shape (n − length + 1,); NaN equals nothing."""
    mixed = x.view(np.uint64).copy()
    missing = np.flatnonzero(np.isnan(x))
    mixed[missing] = missing.astype(np.uint64)
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        mixed ^= mixed >> np.uint64(shift)
        mixed *= np.uint64(factor)
    powers = np.cumprod(np.full(x.size, FACTOR, dtype=np.uint64))
    sums = np.concatenate([np.zeros(1, dtype=np.uint64), np.cumsum(mixed * powers)])
    back = np.cumprod(np.full(x.size, INVERSE, dtype=np.uint64))
    found = (sums[length:] - sums[:-length]) * back[: x.size - length + 1]
    found ^= found >> np.uint64(31)
    found *= np.uint64(0xBF58476D1CE4E5B9)
    return np.asarray(found ^ (found >> np.uint64(29)))
