"""Claim: logs of moving sensors are refused, faults of a log are noted, and clean logs have no false alarms.

Moving records of six axes come from `tests/python/moving_records.py`: hand, bus, car, hovering drone, boat at a pier.
Clean records are at rest, with randomly selected noise. Each fault is inserted into each clean record, except where it does
not apply (a record of one column has no gravity). With `--data`, every recording of that folder must be accepted.

    python benches/claims/logs.py [--moving 10] [--clean 200] [--data FOLDER]
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections import Counter
from pathlib import Path
from time import process_time

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "python"))

import allanite as al
from allanite.readers.plausibility import checked
from moving_records import ACCELS, MOVING, at_rest

#: Kinds of findings that are false alarms on a clean record.
ALARMS = {"motion", "marker", "repeats", "locked", "unit_doubt"}
#: Values that drivers write instead of a missing sample, as 16-bit integers.
MARKERS = (-32768, 32767)


def read_again(recording: al.Recording, folder: Path) -> al.Recording:
    """Write the recording to a file and read it."""
    path = folder / "log.npz"
    np.savez(
        path, data=recording.samples, rate_hz=recording.rate, unit=list(recording.units),
        channels=list(recording.columns),
    )  # fmt: skip
    return al.read(path)


def replaced(recording: al.Recording, samples: np.ndarray, units=None) -> al.Recording:
    """Return the recording with other samples and units."""
    return al.Recording(
        samples, recording.rate, unit=units or list(recording.units), columns=recording.columns
    )


def columns_of(recording: al.Recording) -> np.ndarray:
    """Return a copy of the samples, shape (samples, columns)."""
    return np.array(recording.samples).reshape(recording.n, -1)


def polled(rng: np.random.Generator, recording: al.Recording) -> al.Recording:
    """Repeat samples as if a slower sensor were polled at the rate of the log."""
    x, ratio = columns_of(recording), rng.uniform(0.3, 0.9)
    return replaced(recording, x[np.floor(np.arange(len(x)) * ratio + rng.random()).astype(int)])


def locked(rng: np.random.Generator, recording: al.Recording) -> al.Recording:
    """Replace the first column by rounded white noise in which more than 95 % of the samples have the same code."""
    x = columns_of(recording)
    sigma = rng.uniform(0.16, 0.2)
    middle = rng.uniform(-1.0, 1.0) * (0.5 - 2.2 * sigma)
    step = x[:, 0].std()
    x[:, 0] = np.round(sigma * rng.standard_normal(len(x)) + middle) * step
    return replaced(recording, x)


def marked(rng: np.random.Generator, recording: al.Recording) -> al.Recording:
    """Put markers of missing samples into the first column, which is rounded to integer codes."""
    x = columns_of(recording)
    step = x[:, 0].std() / rng.uniform(2.0, 20.0)
    codes = np.round(x[:, 0] / step)
    codes[rng.choice(len(x), rng.integers(1, 40), replace=False)] = MARKERS[rng.integers(2)]
    x[:, 0] = codes * step
    return replaced(recording, x)


def wrong_unit(rng: np.random.Generator, recording: al.Recording) -> al.Recording | None:
    """Scale accelerations to g without changing the unit m/s², or change the unit to g; None without accelerometer."""
    if not set(ACCELS) <= set(recording.columns):
        return None
    x, at = columns_of(recording), [recording.columns.index(name) for name in ACCELS]
    units = list(recording.units)
    if rng.random() < 0.5:
        x[:, at] /= 9.80665
    else:
        units = ["g" if k in at else unit for k, unit in enumerate(units)]
    return replaced(recording, x, units)


FAULTS = {"repeats": polled, "locked": locked, "marker": marked, "unit_doubt": wrong_unit}


def kinds_of(recording: al.Recording) -> set[str]:
    """Return the kinds of alarms of a recording, including those for which it is refused."""
    taken = checked(recording, anyway=True)
    found = {finding.kind for finding in (*recording.audit, *taken.audit)} & ALARMS
    try:
        checked(recording)
    except al.AllaniteError as error:
        if "not at rest" in str(error):
            found.add("motion")
    return found


def moving_records(count: int) -> None:
    """Print how many moving records are refused."""
    for name, make in MOVING.items():
        refused = 0
        for seed in range(count):
            try:
                checked(make(seed))
            except al.AllaniteError as error:
                refused += "not at rest" in str(error)
        print(f"moving, {name}: {refused} of {count} refused", flush=True)


def recordings(folder: Path) -> None:
    """Print which recordings of a folder are refused."""
    refused = []
    paths = [p for p in sorted(folder.glob("*.npz")) if p.stem != "avar_curves"]
    for path in paths:
        try:
            checked(al.read(path))
        except al.AllaniteError as error:
            refused.append(f"{path.name}: {error}")
    print(f"real recordings: {len(refused)} of {len(paths)} refused", *refused, sep="\n  ")


def faults(count: int) -> None:
    """Print the false alarms on clean records, and how many faults are found."""
    alarms: list[str] = []
    tried: Counter[str] = Counter()
    found: Counter[str] = Counter()
    missed: list[str] = []
    with tempfile.TemporaryDirectory() as name:
        for seed in range(count):
            clean = read_again(at_rest(seed), Path(name))
            alarms += [f"{seed}: {kind}" for kind in sorted(kinds_of(clean))]
            for kind, fault in FAULTS.items():
                faulty = fault(np.random.default_rng([seed, 46]), clean)
                if faulty is None:
                    continue
                tried[kind] += 1
                seen = kind in kinds_of(read_again(faulty, Path(name)))
                found[kind] += seen
                if not seen:
                    missed.append(f"{kind} {seed}")
    print(f"clean records: {len(alarms)} alarms in {count}", *alarms, sep="\n  ")
    for kind, fault in FAULTS.items():
        print(f"{fault.__name__}: {found[kind]} of {tried[kind]} recognized")
    print("not recognized:", ", ".join(missed) or "none")


def main() -> None:
    """Print the counts of all three parts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--moving", type=int, default=10, help="moving records of each kind")
    parser.add_argument("--clean", type=int, default=200, help="clean records")
    parser.add_argument("--data", type=Path, help="folder of recordings at rest")
    asked = parser.parse_args()
    begun = process_time()
    moving_records(asked.moving)
    if asked.data:
        recordings(asked.data)
    faults(asked.clean)
    print(f"{process_time() - begun:.0f} s of processor time")


if __name__ == "__main__":
    main()
