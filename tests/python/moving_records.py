"""Simulated records of moving sensors, and of sensors at rest with every kind of noise.

The physics is simple and consistent: the attitude is prescribed, the rates are its derivatives, and the accelerometers
measure the rotated gravity. The noise models of the package are not used.
"""

import numpy as np
from scipy.signal import lfilter

import allanite as al

GRAVITY = 9.81
GYROS, ACCELS = ("gyro_x", "gyro_y", "gyro_z"), ("acc_x", "acc_y", "acc_z")


def lagged(rng, n, rate, seconds, rms, axes=1):
    """Gauss-Markov processes, shape (n, axes)."""
    keep = np.exp(-1 / (rate * seconds))
    white = rng.standard_normal((n, axes)) * rms * np.sqrt(1 - keep**2)
    return lfilter([1], [1, -keep], white, axis=0)


def swell(rng, n, rate, period, rms, axes=1, bandwidth=0.15):
    """Narrow-band processes with a period in s, shape (n, axes), like waves."""
    angle = 2 * np.pi / (period * rate)
    radius = np.exp(-np.pi * bandwidth / (period * rate))
    white = rng.standard_normal((n + int(40 * period * rate), axes))
    x = lfilter([1], [1, -2 * radius * np.cos(angle), radius**2], white, axis=0)[-n:]
    return x / x.std(axis=0) * rms


def six_axes(
    rng, rate, attitude, force=0.0, gyro_noise=0.01, accel_noise=0.002, extra_rate=0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Gyroscope and accelerometer samples for an attitude (n, 3) in rad (small roll and pitch) and a force in m/s²."""
    n = len(attitude)
    rates = np.gradient(attitude, 1 / rate, axis=0) + extra_rate
    gyro = np.degrees(rates) + rng.standard_normal((n, 3)) * gyro_noise * np.sqrt(rate)
    roll, pitch = attitude[:, 0], attitude[:, 1]
    gravity = np.stack(
        [-np.sin(pitch), np.sin(roll) * np.cos(pitch), np.cos(roll) * np.cos(pitch)], axis=1
    )
    accel = GRAVITY * gravity + force + rng.standard_normal((n, 3)) * accel_noise * np.sqrt(rate)
    return gyro, accel


def recorded(gyro, accel, rate, only=None):
    """Recording of six axes, or of those named in `only`."""
    columns = [*GYROS, *ACCELS]
    units = ["deg/s"] * 3 + ["m/s^2"] * 3
    x = np.column_stack([gyro, accel])
    at = range(6) if only is None else [columns.index(name) for name in only]
    return al.Recording(
        x[:, list(at)], rate, unit=[units[i] for i in at], columns=[columns[i] for i in at]
    )


def smooth(x, samples):
    """Columns smoothed by a Hann window of this many samples."""
    kernel = np.hanning(samples + 2)[1:-1]
    kernel /= kernel.sum()
    return np.stack([np.convolve(c, kernel, "same") for c in np.asarray(x).T], axis=1)


def hand(seed, rate=100, seconds=240, only=None, rms=6.0):
    """A sensor held in a hand: slow wander of some degrees, and tremor."""
    rng = np.random.default_rng(seed)
    n = int(rate * seconds)
    attitude = smooth(lagged(rng, n, rate, 0.8, np.radians(rms), 3), int(rate * 0.3))
    force = smooth(lagged(rng, n, rate, 0.1, 0.3, 3), max(int(rate * 0.05), 1))
    return recorded(*six_axes(rng, rate, attitude, force), rate, only)


def turns(rng, n, rate, number, angles, seconds=(8, 20)):
    """Yaw angle with `number` turns at random times, shape (n,)."""
    t = np.arange(n) / rate
    yaw = np.zeros(n)
    for start in rng.uniform(0.02, 0.97, number) * n / rate:
        length = rng.uniform(*seconds)
        inside = np.clip((t - start) / length, 0, 1)
        yaw += (
            rng.choice([-1, 1])
            * rng.choice(angles)
            * (inside - np.sin(2 * np.pi * inside) / (2 * np.pi))
        )
    return yaw


def bus(seed, rate=20, seconds=1800, only=None, number=18):
    """A sensor in a bus: turns of 90°, vibration during rides, rest at stops."""
    rng = np.random.default_rng(seed)
    n = int(rate * seconds)
    rides = smooth(
        (np.sin(2 * np.pi * np.arange(n)[:, None] / (rate * rng.uniform(80, 200))) > -0.3).astype(
            float
        ),
        rate * 4,
    )
    attitude = np.zeros((n, 3))
    attitude[:, :2] = rides * smooth(
        lagged(rng, n, rate, 0.3, np.radians(0.6), 2), max(rate // 5, 1)
    )
    attitude[:, 2] = turns(rng, n, rate, number, [np.pi / 2, np.pi / 4])
    force = rides * np.column_stack(
        [lagged(rng, n, rate, 3.0, 0.5, 2), lagged(rng, n, rate, 0.1, 0.5)]
    )
    return recorded(*six_axes(rng, rate, attitude, force), rate, only)


def car(seed, rate=50, seconds=600, only=None):
    """A sensor in a car: bends, braking and road vibration."""
    rng = np.random.default_rng(seed)
    n = int(rate * seconds)
    attitude = np.column_stack(
        [
            smooth(lagged(rng, n, rate, 0.4, np.radians(0.8), 2), rate // 5),
            np.cumsum(smooth(lagged(rng, n, rate, 5.0, np.radians(4.0)), rate)) / rate,
        ]
    )
    force = np.column_stack(
        [smooth(lagged(rng, n, rate, 4.0, 0.8, 2), rate), lagged(rng, n, rate, 0.05, 0.8)]
    )
    return recorded(*six_axes(rng, rate, attitude, force), rate, only)


def drone(seed, rate=200, seconds=120, only=None):
    """A sensor in a hovering drone: attitude controlled within some degrees, and rotor vibration."""
    rng = np.random.default_rng(seed)
    n = int(rate * seconds)
    attitude = smooth(lagged(rng, n, rate, 0.5, np.radians(1.5), 3), int(rate * 0.15))
    rotors = np.sin(
        2
        * np.pi
        * (
            rng.uniform(55, 90) * np.arange(n)[:, None] / rate
            + np.cumsum(rng.standard_normal((n, 3)), axis=0) * 0.01
        )
    )
    force = rotors * rng.uniform(0.5, 2.0, 3) + lagged(rng, n, rate, 0.5, 0.3, 3)
    return recorded(
        *six_axes(rng, rate, attitude, force, extra_rate=np.radians(3) * rotors),
        rate=rate,
        only=only,
    )


def boat(seed, rate=25, seconds=900, only=None, degrees=1.0):
    """A sensor in a boat at a pier: slow rolling with the swell."""
    rng = np.random.default_rng(seed)
    n = int(rate * seconds)
    period = rng.uniform(3.5, 8.0)
    attitude = swell(rng, n, rate, period, np.radians([degrees, 0.5 * degrees, 0.3 * degrees]), 3)
    force = swell(rng, n, rate, period, [0.02, 0.02, 0.1], 3)
    return recorded(*six_axes(rng, rate, attitude, force), rate, only)


MOVING = {"hand": hand, "bus": bus, "car": car, "drone": drone, "boat": boat}


def at_rest(seed):
    """A record of a sensor at rest: one to six columns, each with a randomly chosen kind of noise."""
    rng = np.random.default_rng(10_000 + seed)
    rate = float(rng.choice([5, 10, 25, 50, 100, 200]))
    n = int(rng.choice([4_000, 12_000, 40_000]))
    names = [GYROS[2:], GYROS, ACCELS, (*GYROS, *ACCELS)][rng.integers(4)]
    t = np.arange(n) / rate
    columns = []
    for name in names:
        # Noise densities: deg/s/√Hz for gyroscopes from tactical to poor, m/s²/√Hz for accelerometers.
        density = 10 ** (rng.uniform(-3, -1) if name in GYROS else rng.uniform(-3.3, -1.7))
        white = density * np.sqrt(rate) * rng.standard_normal(n)
        kind = rng.integers(12)
        x = white
        if kind == 1:  # strong random walk
            x = x + density * rng.uniform(0.02, 0.3) * np.cumsum(rng.standard_normal(n)) / np.sqrt(
                rate
            )
        elif kind == 2:  # flicker, as a sum of lags
            x = x + sum(lagged(rng, n, rate, T, density * 0.7)[:, 0] for T in (1, 4, 16, 64, 256))
        elif kind == 3:  # bias steps
            for at in rng.integers(0, n, rng.integers(1, 5)):
                x[at:] += rng.choice([-1, 1]) * density * rng.uniform(0.5, 5)
        elif kind == 4:  # warm-up
            x = x + density * rng.uniform(1, 20) * np.exp(-t / (rng.uniform(0.05, 0.5) * t[-1]))
        elif kind == 5:  # lines
            for _ in range(rng.integers(1, 4)):
                x = x + density * rng.uniform(0.2, 3) * np.sin(
                    2 * np.pi * rng.uniform(0.02, 0.45) * rate * t
                )
        elif kind == 6:  # temperature
            x = x + density * rng.uniform(1, 20) * np.sin(
                2 * np.pi * t / t[-1] * rng.uniform(0.3, 3)
            )
        elif kind == 7:  # burst noise
            flips = rng.random(n) < 1 / (rate * rng.uniform(2, 60))
            x = x + density * rng.uniform(0.5, 3) * (np.cumsum(flips) % 2)
        elif kind == 8:  # heavy tails
            x = density * np.sqrt(rate) * rng.standard_t(3, n)
        elif kind == 9:  # changes of the noise level
            a, b = np.sort(rng.integers(0, n, 2))
            x[a:b] *= rng.uniform(1.5, 4)
        elif kind == 10:  # low-pass
            x = lfilter([0.3], [1, -0.7], x)
        elif kind == 11:  # a resonance
            x = x + lfilter([0.5], [1, -1.2, 0.9], white)
        if rng.random() < 0.5:
            step = density * np.sqrt(rate) * 10 ** rng.uniform(-1.5, 0.2)
            x = np.round(x / step) * step
        columns.append(x + (GRAVITY if name == "acc_z" else 0.0))
    units = ["deg/s" if name in GYROS else "m/s^2" for name in names]
    return al.Recording(np.column_stack(columns), rate, unit=units, columns=names)
