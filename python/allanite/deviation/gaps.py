"""Remarks on terms of a deviation that missing samples remove."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.common.numbers import percent_text

if TYPE_CHECKING:
    from numpy.typing import NDArray

#: Share of lost terms of an averaging time above which decimation is advised. Chosen by judgment; not measured.
MAX_LOST_SHARE = 0.5
#: Decimation is advised only below this share of the longest averaging time. Chosen by judgment; not measured.
MAX_ADVICE_TAU = 0.1


def gap_notes(
    missing: int,
    samples: int,
    tau: NDArray[np.float64],
    n: NDArray[np.int64],
    lost: NDArray[np.int64],
) -> tuple[str, ...]:
    """One to three remarks on missing samples of a deviation curve; empty if no sample is missing.

    `n` and `lost`, shape (k,), count the differences that were averaged, and those that gaps remove. The third remark
    advises to average samples, if gaps remove over half of the differences at short averaging times.
    """
    if not missing:
        return ()
    notes = [f"{missing} of {samples} samples are missing"]
    share = lost / np.maximum(n + lost, 1)
    if share.any():
        worst = int(np.argmax(share))
        notes.append(
            f"differences that touch them are not used: {percent_text(share[0], 2)} at {tau[0]:g} s,"
            f" {percent_text(share[worst], 2)} at {tau[worst]:g} s"
        )
        many = np.flatnonzero(share > MAX_LOST_SHARE)
        # A single long gap costs only the longest τ most of their terms; decimation would not help.
        if many.size and tau[many[0]] < MAX_ADVICE_TAU * tau[-1]:
            notes.append(
                f"gaps leave less than half of the differences from τ = {tau[many[0]]:g} s on:"
                " average neighboring samples first (decimate)"
            )
    return tuple(notes)
