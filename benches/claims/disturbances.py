"""Claim: a segment in which the sensor was moved is found with its start and end, and false segments are rare.

Records of an hour at 50 Hz, checked with N+B+K. Records without a disturbance contain one effect that is missing in this
model and may be mistaken for a disturbance: levels that change, lines that wander, steps, heavy tails. In the others the
sensor was carried, knocked or driven for a while. All samples are made without the package.

    python benches/claims/disturbances.py [--records 100] [--only wanders]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "python"))

import allanite as al
import generators as g

RATE, LENGTH = 50.0, 180_000
DURATION = LENGTH / RATE
N, B, K = 0.0126, 0.002, 9.07e-5
TIME = np.arange(LENGTH) / RATE


def noise(rng):
    """Return samples of N+B+K, the model that is checked."""
    return (
        g.white(rng, LENGTH, RATE, N)
        + g.flicker(rng, LENGTH, RATE, B)
        + g.walk(rng, LENGTH, RATE, K)
    )


def wanders(rng):
    """Return noise and a line whose frequency is a random walk of 0.05 Hz per √min."""
    phase = 2 * np.pi * np.cumsum(12.0 + g.walk(rng, LENGTH, RATE, 0.05 / np.sqrt(60.0))) / RATE
    return noise(rng) + 0.05 * np.sin(phase)


def heavy(rng):
    """Return noise with added samples of Student's t with three degrees of freedom."""
    return noise(rng) + N * np.sqrt(RATE / 3.0) * rng.standard_t(3, LENGTH)


def ringing(damping):
    """Return a source of noise with a resonance of nine times the power of the white noise in its band."""

    def made(rng):
        at = float(np.exp(rng.uniform(np.log(2.0), np.log(20.0))))
        rms = 3.0 * N * np.sqrt(4.0 * damping * at)
        return noise(rng) + g.resonance(rng, LENGTH, RATE, at, damping, rms)

    return made


def filtered(rng):
    """Return white noise after a low-pass of 8 Hz."""
    pole = np.exp(-2 * np.pi * 8.0 / RATE)
    return lfilter([1.0 - pole], [1.0, -pole], g.white(rng, LENGTH, RATE, N))


QUIET = {
    "nothing": noise,
    "lag": lambda rng: noise(rng) + g.gauss_markov(rng, LENGTH, RATE, 5e-3, 20.0),
    "burst noise": lambda rng: noise(rng) + g.telegraph(rng, LENGTH, RATE, 0.05, 60.0),
    "resonance, damping 0.05": ringing(0.05),
    "resonance, damping 0.002": ringing(0.002),
    "resonance, damping 0.0002": ringing(0.0002),
    "line that wanders": wanders,
    "line": lambda rng: noise(rng) + g.sinusoid(LENGTH, RATE, 7.3, 0.05),
    "two lines that beat": lambda rng: (
        noise(rng)
        + g.sinusoid(LENGTH, RATE, 7.3, 0.05)
        + g.sinusoid(LENGTH, RATE, 7.3 + 2.0 / DURATION, 0.05)
    ),
    "heavy tails, t (3)": heavy,
    "rounded to 3σ": lambda rng: np.round(noise(rng) / 0.27) * 0.27,
    "step": lambda rng: noise(rng) + g.step(LENGTH, RATE, rng.uniform(600, 3000), 0.2),
    "louder for 5 min": lambda rng: g.louder(noise(rng), RATE, 1500.0, 1800.0, 1.5),
    "outliers": lambda rng: noise(rng) + g.spikes(rng, LENGTH, 40, 1.0),
    "low-pass": filtered,
}


def carried(rng, duration):
    """Return the motion of a walk: 1.9 steps per second with a random frequency, and slower swings."""
    phase = np.cumsum(2 * np.pi * (1.9 + 0.3 * rng.standard_normal(duration.size)) / RATE)
    return np.sin(phase) + 0.5 * np.sin(0.37 * phase)


def knocked(rng, duration):
    """Return knocks a few seconds apart, each a 9 Hz oscillation that decays within a second."""
    blows = np.where(rng.random(duration.size) < 0.3 / RATE, rng.standard_normal(duration.size), 0)
    blows[:: int(6 * RATE)] = 1.0
    r, w = np.exp(-3.0 / RATE), 2 * np.pi * 9.0 / RATE
    return lfilter([1.0], [1.0, -2 * r * np.cos(w), r * r], blows)


def driven(rng, duration):
    """Return broad-band vibration around 3 Hz that begins and ends gradually."""
    r, w = 0.9, 2 * np.pi * 3.0 / RATE
    rumble = lfilter([1.0], [1.0, -2 * r * np.cos(w), r * r], rng.standard_normal(duration.size))
    return rumble / rumble.std() * np.sin(np.pi * duration / (duration[-1] + 1.0 / RATE)) ** 0.5


MOVED = {"carried": carried, "knocked": knocked, "driven": driven}


def disturbances(record):
    """Return the disturbances that a check of N+B+K finds."""
    fit = al.fit_model(al.Recording(record, rate=RATE, unit="rad/s"), "N+B+K")
    return [s.effect for s in fit.check().significant if s.kind == "disturbance"]


def main() -> None:
    """Print the false alarms, the share of disturbances found and the errors of their ends."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--records", type=int, default=100, help="records of each kind")
    parser.add_argument("--only", default="", help="run only kinds whose name contains this text")
    asked = parser.parse_args()
    for name, made in QUIET.items():
        if asked.only in name:
            seen = [disturbances(made(np.random.default_rng([1, k]))) for k in range(asked.records)]
            false = [(k, found) for k, found in enumerate(seen) if found]
            print(f"{name:26} {len(false)} of {asked.records} have a disturbance", flush=True)
            for k, found in false:
                print(f"   record {k}: {found}", flush=True)
    for name, made in MOVED.items():
        for times in (1.0, 2.0, 5.0) if asked.only in name else ():
            found, early, late = 0, [], []
            for k in range(asked.records):
                rng = np.random.default_rng([2, k])
                length = float(np.exp(rng.uniform(np.log(15.0), np.log(300.0))))
                start = rng.uniform(200.0, DURATION - 200.0 - length)
                inside = (start <= TIME) & (start + length > TIME)
                motion = made(rng, TIME[inside] - start)
                record = noise(rng)
                record[inside] += motion / motion.std() * times * N * np.sqrt(RATE)
                own = [
                    e for e in disturbances(record) if e.start < start + length and e.end > start
                ]
                found += bool(own)
                early += [start - e.start for e in own[:1]]
                late += [e.end - start - length for e in own[:1]]
            edges = [np.percentile(e, [5, 50, 95]).round(1) for e in (early, late) if e]
            print(
                f"{name}, {times:g} × the noise: named in {found} of {asked.records}; begins earlier and ends later by "
                f"{' and '.join('/'.join(f'{x:g}' for x in e) for e in edges)} s (5, 50, 95 %)",
                flush=True,
            )


if __name__ == "__main__":
    main()
