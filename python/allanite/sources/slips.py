"""Common mistakes with the figures of a data sheet, recognized by the factor between measured and stated value."""

from __future__ import annotations

import math

#: Square root of a one-sided density divided by that of the two-sided density.
ONE_SIDED = math.sqrt(2)

#: (Measured divided by stated value, mistake that causes this ratio), for figures of N.
SLIPS_OF_N = (
    (60.0, "a density in deg/s/√Hz was read as a random walk in deg/√h (60 times larger)"),
    (60.0 / ONE_SIDED, "a one-sided density in deg/s/√Hz was read as a random walk in deg/√h"),
    (1 / 60.0, "a random walk in deg/√h was read as a density in deg/s/√Hz (60 times smaller)"),
    (ONE_SIDED / 60.0, "a random walk in deg/√h was read as a one-sided density in deg/s/√Hz"),
    (ONE_SIDED, "a two-sided density was read as one-sided"),
    (1 / ONE_SIDED, "a one-sided density was read as two-sided (N is the density divided by √2)"),
    (1 / 3600.0, "a density in deg/h/√Hz was read as deg/s/√Hz"),
)
#: The same for figures of any coefficient.
SLIPS_OF_ALL = (
    (180 / math.pi, "radians were taken for degrees"),
    (math.pi / 180, "degrees were taken for radians"),
    (9.80665, "g was taken for m/s²"),
    (1 / 9.80665, "m/s² was taken for g"),
    (1e3, "a prefix of 1000 was lost"),
    (1e-3, "a prefix of 1000 was lost"),
)


def mistake_text(coefficient: str, ratio: float, tolerance: float) -> str:
    """Text ``looks as if radians were taken for degrees``: the mistake that explains `ratio` (measured over stated value).

    Empty if |ln ratio| is at most `tolerance`, or if no known mistake has a factor near `ratio`. Near means that the
    logarithms differ by at most the smaller of `tolerance` and 0.1. Empty also if `ratio` is not positive. Some
    mistakes are only known for the `coefficient` N.
    """
    if ratio <= 0 or abs(math.log(ratio)) <= tolerance:
        return ""
    slips = (*SLIPS_OF_N, *SLIPS_OF_ALL) if coefficient == "N" else SLIPS_OF_ALL
    distance, words = min((abs(math.log(ratio / factor)), words) for factor, words in slips)
    # At most 0.1, because with a wide tolerance some factor would always agree.
    return f"looks as if {words}" if distance <= min(tolerance, 0.1) else ""
