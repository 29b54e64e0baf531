"""Time of the other deviations against allantools, and samples per second of streams."""

import time

import allantools
import numpy as np
from side_by_side import save, side_by_side

from allanite import deviation
from allanite.deviation.accumulator import Accumulator
from allanite.deviation.theo import theo1


def once(call):
    """Return the seconds that a call takes."""
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def main():
    """Print and save the times."""
    rng = np.random.default_rng(1)
    rows = []
    small, large = rng.normal(size=1000), rng.normal(size=100_000)
    factors = 2 ** np.arange(1, 9)
    for name in ("mtotdev", "htotdev", "theo1"):
        ours = theo1 if name == "theo1" else getattr(deviation, name)
        theirs = getattr(allantools, name)
        programs = {
            "allantools": lambda f=theirs: f(small, data_type="freq", taus=factors[:7]),
            "allanite": lambda f=ours: f(small, factors=factors[:7]),
        }
        rows += side_by_side(f"{name}, 1000 samples, 7 τ", programs, 3)
        seconds = once(lambda f=ours: f(large))
        print(f"  allanite {name}, 1e5 samples, octave τ: {seconds:.2f} s")
        rows.append((f"{name}, 1e5 samples, octave τ", "allanite", seconds, "", ""))
    x = rng.normal(size=1_000_000)
    tau = 2.0 ** np.arange(18)
    for name in ("mdev", "ohdev", "totdev"):
        theirs, ours = getattr(allantools, name), getattr(deviation, name)
        programs = {
            "allantools": lambda f=theirs: f(x, data_type="freq", taus=tau),
            "allanite": lambda f=ours: f(x, factors=tau.astype(int)),
        }
        rows += side_by_side(f"{name}, 1e6 samples, 18 τ", programs, 3)
    x = rng.normal(size=1 << 23)
    for taus in ("octave", 8):
        stream = Accumulator(taus=taus)

        def feed(stream=stream):
            for start in range(0, x.size, 1 << 16):
                stream.update(x[start : start + (1 << 16)])

        rows += side_by_side(
            f"stream of {x.size} samples, {taus} per octave", {"allanite": feed}, 5
        )
        print(f"  {x.size / rows[-1][2] / 1e6:.0f} M samples/s")
    save(rows, "family")


if __name__ == "__main__":
    main()
