"""Claim: in a fleet of simulated six-axis sensors those with a hidden effect are named, and healthy ones rarely.

Records of 5 min at 100 Hz. Units differ from each other as those of a lot do (N by 5 %, B by 10 %, K by 20 %); some have
one more effect, or more noise, on one axis, about twice as strong as is detectable in one record. A result is right if the
kind of effect is named, or N for more noise. An interrupted run continues from the journal in `--folder`.

    python benches/claims/fleet.py [--sensors 1000] [--odd 30] [--folder /tmp/fleet]
"""

from __future__ import annotations

import argparse
import os
import sys
from collections import Counter
from pathlib import Path
from time import perf_counter

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "python"))

import allanite as al
from allanite.scale import run_fleet
from six_axes import NAMES, UNITS, write_csv

RATE, SECONDS = 100.0, 300.0
#: N, B and K of each axis of the sensor type.
GYRO, ACCELEROMETER = (0.01, 0.002, 2e-4), (0.001, 2e-4, 2e-5)
TYPE = (GYRO,) * 3 + (ACCELEROMETER,) * 3
SPREAD = np.array([0.05, 0.10, 0.20])


def sinusoid(rng, noise):
    """Return a line that is worth ΔlogL = A² T/4N² = 64 if its frequency and phase are known."""
    return f"SIN(frequency={np.exp(rng.uniform(0.0, np.log(45.0)))},amplitude={0.92 * noise})"


def resonance(rng, noise):
    """Return a resonance with a damping of 0.02 and an rms of 2 N."""
    return f"RES(frequency={rng.uniform(5.0, 40.0)},damping=0.02,rms={2.0 * noise})"


def bias_step(rng, noise):
    """Return a step of 5 N at a random time."""
    return f"STEP(time={rng.uniform(60.0, 240.0)},height={5.0 * noise})"


def noise_level_change(rng, _):
    """Return a noise level 1.2 times as high in a third of the record."""
    start = rng.uniform(30.0, 170.0)
    return f"LEVEL(start={start},end={start + 100.0},factor=1.2)"


def excursion(rng, noise):
    """Return an excursion of 5 N for half a minute."""
    start = rng.uniform(60.0, 200.0)
    return f"EXC(start={start},end={start + 30.0},height={5.0 * noise})"


def bandwidth(rng, _):
    """Return a low-pass with a cutoff of 15 to 35 Hz."""
    return f"BW(cutoff={rng.uniform(15.0, 35.0)})"


HIDDEN = (sinusoid, resonance, bias_step, noise_level_change, excursion, bandwidth)


def sensor(seed, odd):
    """Return the recording of a sensor, and the axis and the hidden effect if it is an odd one."""
    rng = np.random.default_rng([19, seed])
    at, what = int(rng.integers(6)), int(rng.integers(len(HIDDEN) + 1))
    hidden, columns = "", []
    for axis, usual in enumerate(TYPE):
        n, b, k = np.array(usual) * np.exp(SPREAD * rng.standard_normal(3))
        more = ""
        if odd and axis == at:
            hidden = "N" if what == len(HIDDEN) else HIDDEN[what].__name__
            if hidden == "N":
                n *= 1.5
            else:
                more = "+" + HIDDEN[what](rng, n)
        model = al.parse_model(f"N(N={n})+B(B={b})+K(K={k}){more}")
        simulated = model.simulate(rate=RATE, duration=SECONDS, seed=seed, axis=axis)
        columns.append(np.asarray(simulated.samples) + usual[0] * rng.standard_normal())
    recording = al.Recording(np.column_stack(columns), RATE, unit=UNITS, columns=NAMES)
    return recording, (NAMES[at], hidden)


def main():
    """Print how many odd and healthy sensors are named."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sensors", type=int, default=1000, help="sensors in all")
    parser.add_argument("--odd", type=int, default=30, help="sensors with a hidden effect")
    parser.add_argument(
        "--folder", type=Path, default=Path("/tmp/fleet"), help="folder of logs and journal"
    )
    asked = parser.parse_args()
    logs = asked.folder / "logs"
    logs.mkdir(parents=True, exist_ok=True)
    truth = {}
    for seed in range(asked.sensors):
        path = logs / f"unit{seed:04d}.csv"
        recording, hidden = sensor(seed, seed < asked.odd)
        if not path.is_file():
            write_csv(recording, path)
        if seed < asked.odd:
            truth[path.name] = hidden
    began, before = perf_counter(), os.times()
    rows = run_fleet(logs, asked.folder / "fleet.csv")
    wall, after = perf_counter() - began, os.times()
    busy = after.user + after.system + after.children_user + after.children_system
    busy -= before.user + before.system + before.children_user + before.children_system
    named = {}
    for d in al.fleet(rows).deviating:
        named.setdefault(Path(d.file).name, []).append((d.column, d.by))
    found = [name for name in truth if truth[name][0] in {c for c, _ in named.get(name, [])}]
    right = [name for name in found if truth[name] in named[name]]
    false = {name: d for name, d in named.items() if name not in truth}
    beside = [d for name in found for d in named[name] if d[0] != truth[name][0]]
    for name, hidden in truth.items():
        if name not in right:
            print(f"   {name} {hidden}: {named.get(name, 'not found')}")
    for name, d in false.items():
        print(f"   {name} healthy: {d}")
    healthy = asked.sensors - asked.odd
    kinds = Counter(kind for _, kind in truth.values())
    print(
        f"{asked.odd} odd of {asked.sensors} sensors ({dict(kinds)}): {len(found)} found, {len(right)} named;"
        f" {len(false)} of {healthy} healthy ones named ({100 * len(false) / max(healthy, 1):.2f} %), and {len(beside)}"
        f" more axes of odd ones"
    )
    print(f"{len(rows)} axes in {wall:.0f} s, {busy / len(rows):.2f} s of processor time each")


if __name__ == "__main__":
    main()
