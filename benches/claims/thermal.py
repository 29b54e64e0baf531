"""Claim: the dependence of a bias on temperature is found, and its band contains it, on sixty simulated sensors.

Laws: linear, quadratic, cubic, with a lag, with hysteresis. Thermometers: fine, and with steps of 1 °C. Schedules: one
warm-up, a warm-up and cooling, three chamber runs. The samples come from tests/python/thermal_sensors.py, which does not
use the package.

    python benches/claims/thermal.py [--seeds 2] [--scale 1] [--results FILE]

The file of results gets one JSON line per sensor; a repeated run continues it.
"""

from __future__ import annotations

import argparse
import sys
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "python"))

from results_file import Results

import allanite as al
import thermal_sensors as ts

#: A wrong form counts as an error if the true form leads every other form by this ΔlogL.
CLEAR = 10.0


def recordings(sensor):
    """Return the recordings of a sensor."""
    return [
        al.Recording(
            x, rate=ts.RATE, unit="deg/s", columns=["gyro_x"], covariates={"temperature": shown}
        )
        for x, shown in sensor.runs
    ]


def is_right(form, law):
    """Return whether the selected form is that of the simulated law."""
    if law in ("lag", "hysteresis"):
        return form.memory == law
    return form.name == law


def judged(sensor):
    """Return for one sensor: band contains the law, K inside its interval, form right, form clear, and its name.

    The band must contain the law at 95 % of the temperatures.
    """
    axis = al.thermal(recordings(sensor)).axes[0]
    curve = axis.curve
    true = sensor.bias(curve.temperature) - sensor.bias(curve.reference)
    inside = float(np.mean((true >= curve.low - 1e-12) & (true <= curve.high + 1e-12)))
    interval = axis.random["K"].interval
    assert interval is not None
    low, high = interval
    right = [t.log_likelihood for t in axis.tried if is_right(t.form, sensor.law)]
    simpler = [
        t.log_likelihood
        for t in axis.tried
        if not is_right(t.form, sensor.law)
        and t.form.numbers
        <= min((o.form.numbers for o in axis.tried if is_right(o.form, sensor.law)), default=0)
    ]
    clear = bool(right) and max(right) - max(simpler, default=0.0) >= CLEAR
    return {
        "band": inside >= 0.95,
        "K": bool(low <= ts.K <= high),
        "right": is_right(axis.form, sensor.law),
        "clear": clear,
        "form": axis.form.name,
    }


def main() -> None:
    """Print the result of each sensor and the shares."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=2, help="sensors of each case")
    parser.add_argument(
        "--scale", type=float, default=1.0, help="factor of the temperature dependence"
    )
    parser.add_argument("--results", type=Path, help="file with one JSON line per sensor")
    given = parser.parse_args()
    results = Results(given.results, f"scale {given.scale:g}")
    rows = []
    for law, meter, schedule, seed in product(
        ts.LAWS, ts.THERMOMETERS, ts.SCHEDULES, range(given.seeds)
    ):
        made = partial(ts.sensor, law, meter, schedule, seed, given.scale)
        row = results.of(f"{law} {meter} {schedule} {seed}", lambda made=made: judged(made()))
        rows.append(row)
        print(
            f"{law:11}{meter:6}{schedule:20}{seed}  band {'ok' if row['band'] else 'MISS':5}"
            f"K {'ok' if row['K'] else 'MISS':5}{'clear' if row['clear'] else '':6}"
            f"{'' if row['right'] else 'not '}{'found':6}: {row['form']}",
            flush=True,
        )
    band, walk = ([row[key] for row in rows] for key in ("band", "K"))
    forms = [row["right"] for row in rows if row["clear"]]
    print(f"band holds the law: {np.mean(band):.1%} of {len(band)} (at least 93 %)")
    print(f"interval holds K: {np.mean(walk):.1%} (at least 93 %)")
    print(f"wrong form where ΔlogL ≥ 10: {1 - np.mean(forms):.1%} of {len(forms)} (at most 5 %)")


if __name__ == "__main__":
    main()
