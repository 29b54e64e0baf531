"""Claim: a notch or high-pass hidden in N+B+K is the first effect added, and N is right.

The records are those of tests/python/statistical/test_whole_filters_simulated.py, made with scipy.signal; cutoffs,
qualities and orders are listed there. Checks of a true model with a notch give the share of false alarms.

    python benches/claims/whole_filters.py [--seeds 3] [--quiet 100]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "python"))
sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "python" / "statistical"))

from test_whole_filters_simulated import HIGH_PASSES, NOTCHES, N, record

import allanite as al


def main() -> None:
    """Print how often the filter is found, the error of N and the false alarms."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=3, help="records of each filter")
    parser.add_argument("--quiet", type=int, default=100, help="checks of the true model")
    asked = parser.parse_args()
    for kind, names in (("notch", NOTCHES), ("high_pass", HIGH_PASSES)):
        first, right, ended, worst = 0, 0, 0, 0.0
        for name in names:
            for seed in range(asked.seeds):
                study = al.improve(record(name, seed), "N+B+K")
                added = [step.added.kind for step in study.ladder[1:]]
                first += added[:1] == [kind]
                ended += added == [kind] and study.adequate
                off = abs(study.fit["N"].value / N - 1.0)
                right += off < 0.03
                worst = max(worst, off)
                if added != [kind] or not study.adequate:
                    print(f"   {name} seed {seed}: {study!r}", flush=True)
        print(
            f"{kind}: first step in {first} of {len(names) * asked.seeds}, the only one and adequate in {ended}, "
            f"N within 3 % in {right}, at most {100.0 * worst:.1f} % off",
            flush=True,
        )
    raised = 0
    for seed in range(asked.quiet):
        check = al.fit_model(record("notch:25:5", seed), "N+B+K+NOTCH").check()
        raised += bool(check.significant)
    print(f"true model with a notch: {raised} of {asked.quiet} checks suggest an effect")


if __name__ == "__main__":
    main()
