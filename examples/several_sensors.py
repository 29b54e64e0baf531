"""Three ADIS16405 inertial sensors combined: gain of averaging, weights, and a unit that deviates.

    python examples/several_sensors.py FOLDER

FOLDER holds adis16405_imu1.npz to adis16405_imu3.npz: data, rate_hz, channels and unit of three units at rest. Each file
names the public repository that its samples come from (`source`).
"""

import sys
from pathlib import Path

import allanite as al

#: Samples that are averaged into one: the loop below then takes seconds.
AVERAGED = 50


def main(folder: str | Path) -> dict[str, al.Combination]:
    """The combination of each axis."""
    folder = Path(folder)
    paths = [folder / f"adis16405_imu{k}.npz" for k in (1, 2, 3)]
    missing = [str(path) for path in paths if not path.exists()]
    if missing:
        raise SystemExit(
            f"{', '.join(missing)}: not there; any three logs with a column gyro_x will do"
        )
    logs = [al.read(path)[["gyro_x", "gyro_y", "gyro_z"]].decimate(AVERAGED) for path in paths]
    found = {}
    for axis in logs[0].columns:
        found[axis] = al.combine([log[axis] for log in logs])
        print(axis, found[axis], sep="\n", end="\n\n")
    return found


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "../shared/data")
