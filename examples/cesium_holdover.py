"""A cesium clock against a maser: the mask of a primary reference clock, and holdover over one hour.

The phase of a 5071A at 1 Hz is a file of allantools (aewallin/allantools, tests/Cs5071A/5071A_phase.txt.gz). The example
looks for it as clock_cs5071a_phase.npz (arrays data and rate_hz) in the folder named by ALLANITE_DATA.

1. Time error, MTIE and TDEV of a day against G.811, and the noise.
2. The holdover band of an hour, beside what the clock did in the hour that the fit has not seen, for eight hours.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

import allanite as al

NAME = "clock_cs5071a_phase.npz"


def main(seconds: int = 86_400) -> dict[str, object] | None:
    """Run the example on part of the recording; returns the result, or None without the recording."""
    path = Path(os.environ.get("ALLANITE_DATA", ".")) / NAME
    if not path.exists():
        print(
            f"no {NAME}: put it into a folder and name that folder in ALLANITE_DATA (see the head of this file)"
        )
        return None
    with np.load(path) as file:
        phase, rate = file["data"][:, 0], float(file["rate_hz"])

    day = al.Recording(phase[:seconds], rate=rate, quantity="angle", columns=["cesium"])
    found = al.timing(day, masks=["G.811"])
    print(found)

    held = []
    print("\nan hour of holdover, ns: predicted, and what the clock did")
    for hour in range(8):
        end = seconds + 3600 * hour
        known = al.Recording(phase[end - 20_000 : end], rate=rate, quantity="angle")
        after = al.timing(known, after=[3600.0]).holdover[0]
        truth = float(phase[end - 1 + 3600])
        held.append(after.low <= truth <= after.high)
        half = 0.5e9 * (after.high - after.low)
        print(
            f"{1e9 * after.expected:9.1f} ± {half:.1f}   {1e9 * truth:9.1f}{'' if held[-1] else '  outside'}"
        )
    return {"timing": found, "held": held}


if __name__ == "__main__":
    main()
