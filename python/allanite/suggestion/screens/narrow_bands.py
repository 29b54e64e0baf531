"""Narrow bands: where single ordinates stand out over less than a bin.

The screen of the spectrum compares bins, which hide such bands. It refits those that are found here.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.fit.likelihood.peaks import MAX_NARROW_WIDTH

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Solution

#: Tried widths of a band within a bin, in ordinates; the largest is the width of a bin of a million samples.
WIDTHS = tuple(2**k for k in range(2, 13))


def widths_tried(n: int) -> int:
    """Number of widths of bands narrower than a bin that are tried in a record of n samples; at least 1."""
    return max(1, sum(width <= MAX_NARROW_WIDTH * n for width in WIDTHS))


def narrow_bands(
    solution: Solution, data: Data, white: NDArray[np.float64]
) -> Iterator[tuple[float, float, float, float]]:
    """Iterator over (ΔlogL, low, high, variance), one for each tried width: the band with the largest excess of power.

    Bands are searched in the whitened ordinates `white`, at frequencies where the bins are wider than the band. ΔlogL is
    that of a flat band: ½k(m − 1 − ln m) for k ordinates with m times the expected power. `low` and `high` are its ends,
    Hz, and `variance` is that of the excess, U². Widths with no excess are skipped.
    """
    total = np.square(white)
    np.cumsum(total, out=total)
    hertz = data.rate / (2.0 * data.n)
    # Ordinates that share information count less.
    share = np.minimum(solution.count / np.diff(data.bins.edges), 1.0)
    for width in WIDTHS[: widths_tried(data.n)]:
        first = max(1, int(width / MAX_NARROW_WIDTH))
        sums = total[first + width :] - total[first:-width]
        if sums.size == 0:
            continue
        top = int(np.argmax(sums))
        mean, at = float(sums[top]) / width, first + 1 + top
        if mean > 1.0:
            power = float(np.sum(solution.ordinates[at : at + width] ** 2)) * (1.0 - 1.0 / mean)
            own = share[int(np.searchsorted(data.bins.edges, at, side="right")) - 1]
            gain = 0.5 * float(own) * width * (mean - 1.0 - float(np.log(mean)))
            yield gain, (at - 0.5) * hertz, (at + width - 0.5) * hertz, power / data.n
