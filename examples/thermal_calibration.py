"""The thermal law of a whale tag's gyroscope and accelerometer, from two logs of one sensor.

    python examples/thermal_calibration.py FOLDER

FOLDER holds cats_thermal_a.npz and cats_thermal_b.npz: data, rate_hz, channels and unit of the calibration recordings in
skdiveMove/tests/data/cats_temperature_calib.nc, which the Python package scikit-diveMove carries.
"""

import sys
from pathlib import Path

import allanite as al

SOURCE = "skdiveMove/tests/data/cats_temperature_calib.nc of the Python package scikit-diveMove"


def main(folder: str | Path) -> al.ThermalCalibration:
    """Law, residual and parameters of three axes."""
    folder = Path(folder)
    paths = [folder / f"cats_thermal_{log}.npz" for log in "ab"]
    missing = [str(path) for path in paths if not path.exists()]
    if missing:
        raise SystemExit(f"{', '.join(missing)}: not there; the recordings come from {SOURCE}")
    logs = [al.read(path)[["gyro_y", "acc_y", "acc_z"]] for path in paths]
    found = al.thermal(logs)
    print(found)
    print(found.export("csv"))
    return found


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "../shared/data")
