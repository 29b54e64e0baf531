"""Sway of a platform: the direction of gravity in the accelerometers changes as the gyroscopes measure."""

from __future__ import annotations

import numpy as np

from allanite.common.arrays import Array

#: Averaging time, s, and averages in a window of 20 s: swell and hands are slower than an average, faster than a window.
AVERAGING_TIME, WINDOW_AVERAGES = 0.2, 100
#: Minimum correlation of both directions over the whole record. Independent noise of ten windows or more stays below 0.5
#: with probability 1 − 1e-6.
MIN_CORRELATION = 0.5
#: Minimum number of windows.
MIN_WINDOWS = 10
#: Range of the ratio of the angles from accelerometers and gyroscopes. It is 1 for pure rotation; outside of the range
#: accelerations dominate.
ANGLE_RATIOS = (0.3, 3.0)


def averages_for_sway(x: Array, rate: float) -> Array:
    """Averages over 0.2 s of samples x at `rate` (Hz), shape (averages,); the last incomplete average is omitted."""
    m = max(1, round(AVERAGING_TIME * rate))
    return np.asarray(x[: x.size // m * m].reshape(-1, m).mean(axis=1))


def sway_of(rates: Array, force: Array, rate: float) -> Array | None:
    """Standard deviation of the tilt in each window of 20 s, degrees, shape (windows,); None without sway.

    None also for fewer than 10 windows. If a platform turns, the integrated rates equal the change of the direction of
    gravity: df/dt = −ω × f. The covariance of the two is the variance of the tilt, and independent of sensor noise.

    Parameters
    ----------
    rates, force : ndarray of shape (averages, 3)
        `averages_for_sway` of gyroscopes, rad/s, and accelerometers, in any unit, in the order x, y, z.
    rate : float
        Sampling rate of the averaged samples, Hz.
    """
    m = max(1, round(AVERAGING_TIME * rate))
    windows = len(rates) // WINDOW_AVERAGES
    if windows < MIN_WINDOWS:
        return None
    kept = windows * WINDOW_AVERAGES
    omega, seen = np.nan_to_num(rates[:kept]), np.nan_to_num(force[:kept])
    middle = np.median(seen, axis=0)
    level = float(np.linalg.norm(middle))
    if level == 0.0:
        return None
    up = middle / level
    turned = np.cumsum(-np.cross(omega, up), axis=0) * (m / rate)
    # Averages refer to the middle of their interval, sums to its end.
    turned = 0.5 * (turned + np.vstack([np.zeros(3), turned[:-1]]))
    tilted = seen / level
    predicted, measured = _without_parabolas(turned, windows), _without_parabolas(tilted, windows)
    # Along gravity accelerometers show no tilt.
    predicted -= (predicted @ up)[..., np.newaxis] * up
    measured -= (measured @ up)[..., np.newaxis] * up
    both = np.einsum("wki,wki->w", predicted, measured)
    gyro, accel = np.sum(predicted**2), np.sum(measured**2)
    total = float(both.sum())
    if not total > MIN_CORRELATION * float(np.sqrt(gyro * accel)):
        return None
    if not ANGLE_RATIOS[0] < float(accel) / total < ANGLE_RATIOS[1]:
        return None
    return np.asarray(np.degrees(np.sqrt(np.maximum(both, 0.0) / WINDOW_AVERAGES)))


def _without_parabolas(x: Array, windows: int) -> Array:
    """Array of the averages of each window and axis minus their least-squares parabola, shape (windows, averages, 3 axes).

    This removes drifts and integrated noise.
    """
    basis = np.linalg.qr(np.vander(np.linspace(-1.0, 1.0, WINDOW_AVERAGES), 3))[0]
    parts = x.reshape(windows, WINDOW_AVERAGES, 3)
    return np.asarray(parts - basis @ (basis.T @ parts))
