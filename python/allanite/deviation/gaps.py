"""Terms that missing samples cost."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["gap_notes"]

#: Share of the terms of one averaging time whose loss deserves advice.
MANY = 0.5
#: Share of the longest averaging time below which it does.
FAR = 0.1


def gap_notes(
    missing: int, samples: int, tau: NDArray[np.float64], lost: NDArray[np.float64]
) -> tuple[str, ...]:
    """What to know of a curve whose samples are partly missing.

    Parameters
    ----------
    missing, samples : int
        Missing samples, and all of them.
    tau : ndarray of shape (k,)
        Averaging times, s.
    lost : ndarray of shape (k,)
        Share of the terms that is lost at each.
    """
    if not missing:
        return ()
    notes = [f"{missing} of {samples} samples are missing"]
    if lost.size and lost.any():
        worst = int(np.argmax(lost))
        notes.append(
            f"terms that touch them are left out: {lost[0]:.2g} of all at {tau[0]:g} s,"
            f" {lost[worst]:.2g} at {tau[worst]:g} s"
        )
        many = np.flatnonzero(lost > MANY)
        # Of one long gap the longest τ alone lose most of theirs, and averaging first does not help.
        if many.size and tau[many[0]] < FAR * tau[-1]:
            notes.append(
                f"more than half of the terms are lost from {tau[many[0]]:g} s on: decimate the recording,"
                " which averages the samples that are there"
            )
    return tuple(notes)
