"""Velocity of a GNSS station in east, north and up, with the uncertainty under correlated noise.

Daily positions of a station are files of the Nevada Geodetic Laboratory (geodesy.unr.edu, .tenv and .tenv3). The example
takes the file given on the command line, or field/station_tenv.txt in the folder named by ALLANITE_DATA.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

import allanite as al


def main(path: str | None = None) -> al.Trends | None:
    """Print the rates under white noise and under the fitted noise; returns the latter, or None without a file."""
    file = Path(path or Path(os.environ.get("ALLANITE_DATA", ".")) / "field" / "station_tenv.txt")
    if not file.exists():
        print(f"no {file}: give a .tenv or .tenv3 file of geodesy.unr.edu")
        return None
    metres = al.read(file, unit="1", quantity="rate")
    station = metres.with_samples(1000.0 * metres.samples)
    naive = al.trend_columns(station, unit="mm", model="N")
    found = al.trend_columns(station, unit="mm")
    for name, one in found.items():
        print(
            f"{name:6} {one.rate} with {one.noise.name}; {naive[name].rate} with white noise alone"
        )
    print(f"\n{found}")
    return found


if __name__ == "__main__":
    main(*sys.argv[1:2])
