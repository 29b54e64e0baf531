"""Simulated sensors whose bias depends on the temperature, with realistic thermometers and temperature schedules.

The module is independent of the package. The bench and the tests compare it with the results of the package.
"""

from dataclasses import dataclass

import numpy as np

RATE, LENGTH = 5.0, 18_000
N, K = 0.004, 2e-5  # deg/s/sqrt(Hz), deg/s/sqrt(s)
LAWS = ("linear", "quadratic", "cubic", "lag", "hysteresis")
THERMOMETERS = ("fine", "whole")
SCHEDULES = ("warm-up", "warm-up and cooling", "three chamber runs")
#: Standard deviation of the bias between switch-ons, in deg/s.
TURN_ON = 0.05


@dataclass
class Sensor:
    """A simulated sensor: runs as (samples, logged temperature), and the true law."""

    law: str
    thermometer: str
    schedule: str
    runs: list
    numbers: tuple

    def bias(self, temperature):
        """Bias in equilibrium, up to a constant; for hysteresis, the mean of both branches."""
        u = np.asarray(temperature) - 35.0
        c, d, e = self.numbers
        return c * u + d * u**2 + e * u**3


def temperatures(schedule, rng):
    """True temperature of each run of a schedule, sample by sample."""
    t = np.arange(LENGTH) / RATE
    wander = [np.cumsum(rng.normal(0.0, 0.003, LENGTH)) for _ in range(3)]
    if schedule == "warm-up":
        return [22.0 + 33.0 * (1.0 - np.exp(-t / 900.0)) + wander[0]]
    if schedule == "warm-up and cooling":
        half = t[LENGTH // 2]
        up = 22.0 + 36.0 * (1.0 - np.exp(-t / 600.0))
        down = 20.0 + (up[LENGTH // 2] - 20.0) * np.exp(-(t - half) / 700.0)
        return [np.where(t < half, up, down) + wander[0]]
    waves = [
        10.0 + 45.0 * t / t[-1],
        35.0 + 22.0 * np.sin(2 * np.pi * t / 1700.0),
        55.0 - 35.0 * t / t[-1],
    ]
    return [w + own for w, own in zip(waves, wander, strict=True)]


def lagged(u, time):
    """First-order lag of a series, started in equilibrium."""
    phi = np.exp(-1.0 / (RATE * time))
    out, last = np.empty_like(u), u[0]
    for k, value in enumerate(u):
        last = phi * last + (1.0 - phi) * value
        out[k] = last
    return out


def played(u, width):
    """Hysteresis of a series: Prandtl's play, started in its middle."""
    out, last = np.empty_like(u), u[0]
    for k, value in enumerate(u):
        last = min(max(last, value - width), value + width)
        out[k] = last
    return out


def sensor(law, thermometer, schedule, seed, scale=1.0):
    """A sensor with a law of random sign and size, multiplied by `scale`."""
    rng = np.random.default_rng(
        [seed, LAWS.index(law), THERMOMETERS.index(thermometer), SCHEDULES.index(schedule)]
    )
    sign = rng.choice([-1.0, 1.0])
    size = sign * scale * rng.uniform(0.7, 1.4)
    c, d, e = 0.004 * size, 0.0, 0.0
    if law in ("quadratic", "cubic"):
        d = 1.2e-4 * size * rng.choice([-1.0, 1.0])
    if law == "cubic":
        e = 8e-6 * size * rng.choice([-1.0, 1.0])
    numbers, play, lag = (c, d, e), 0.0, 0.0
    if law == "hysteresis":
        play = rng.uniform(3.0, 5.0)
    if law == "lag":
        lag = rng.uniform(60.0, 200.0)
    runs = []
    for true in temperatures(schedule, rng):
        u = true - 35.0
        if law == "lag":
            u = lagged(u, lag)
        x = c * u + d * u**2 + e * u**3
        if law == "hysteresis":
            x = 0.3 * c * u + 0.7 * c * played(u, play)
        x = x + rng.normal(0.0, N * np.sqrt(RATE), LENGTH)
        x += np.cumsum(rng.normal(0.0, K / np.sqrt(RATE), LENGTH)) + rng.normal(0.0, TURN_ON)
        shown = (
            np.round(true)
            if thermometer == "whole"
            else np.round(true + rng.normal(0.0, 0.02, LENGTH), 2)
        )
        runs.append((x, shown))
    return Sensor(law, thermometer, schedule, runs, numbers)
