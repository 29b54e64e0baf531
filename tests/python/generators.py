"""Generators of noise with known spectra, independent of the package: recursions, sums and exact fractional differences.

The first arguments are a `numpy.random.Generator`, the number of samples n and the rate in Hz; the result has n samples.
"""

from functools import lru_cache

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.signal import butter, lfilter


def white(rng, n, rate, N):
    """White noise with the two-sided density N²."""
    return N * np.sqrt(rate) * rng.standard_normal(n)


def walk(rng, n, rate, K):
    """Random walk: running sum of steps of variance K²/rate."""
    return np.cumsum(K / np.sqrt(rate) * rng.standard_normal(n))


def quantization(rng, n, rate, Q):
    """Quantization noise: derivative of an angle with independent errors of standard deviation Q."""
    return np.diff(Q * rng.standard_normal(n + 1)) * rate


def gauss_markov(rng, n, rate, q_c, T):
    """Gauss-Markov process: AR(1), started in its stationary state."""
    phi, sigma = np.exp(-1.0 / (rate * T)), q_c * np.sqrt(T / 2.0)
    start = sigma * rng.standard_normal()
    drive = [sigma * np.sqrt(1.0 - phi**2)]
    return lfilter(drive, [1.0, -phi], rng.standard_normal(n), zi=[phi * start])[0]


@lru_cache(maxsize=8)
def _fractional(order, n, warm_up):
    """Length, FFT length and transform of the taps of (1 − z⁻¹)^(−order), for which the last n outputs are exact."""
    total = n * (1 + warm_up)
    k = np.arange(1, total)
    taps = np.concatenate([[1.0], np.cumprod((k - 1 + order) / k)])
    length = next_fast_len(total + n, real=True)
    return total, length, rfft(taps, length)


def power_law(rng, n, rate, exponent, level, warm_up=3):
    """Noise with the density level²·(2πf)^exponent for −1 ≤ exponent < 1: fractional difference of white noise.

    The record is the end of a record that is 1 + `warm_up` times as long and starts from zero.
    """
    total, length, response = _fractional(-exponent / 2.0, n, warm_up)
    drive = np.zeros(total)
    drive[:] = rng.standard_normal(total)
    out = irfft(response * rfft(drive, length), length)[total - n : total]
    return level * rate ** ((exponent + 1.0) / 2.0) * out


def flicker(rng, n, rate, B):
    """Flicker noise with the density B²/(2πf): half-order difference of white noise."""
    return power_law(rng, n, rate, -1.0, B)


def quantized_filter(rng, n, rate, N, cutoff, order, Q, B):
    """White noise behind a Butterworth low-pass, flicker, and quantization of the integral after the filter."""
    driven = N * np.sqrt(rate) * rng.standard_normal(n + 500)
    filtered = lfilter(*butter(order, cutoff / (rate / 2)), driven)[500:]
    return filtered + flicker(rng, n, rate, B) + Q * rate * np.diff(rng.standard_normal(n + 1))


def sinusoid(n, rate, frequency, amplitude, phase=0.0):
    return amplitude * np.sin(2.0 * np.pi * frequency * np.arange(n) / rate + phase)


def ramp(n, rate, R):
    """Linear drift R·t."""
    return R * np.arange(n) / rate


def low_passed(rng, n, rate, N, cutoff):
    """White noise through a continuous first-order low-pass, sampled: a fast Gauss-Markov process."""
    w = 2.0 * np.pi * cutoff
    return gauss_markov(rng, n, rate, N * w, 1.0 / w)


def resonance(rng, n, rate, frequency, damping, rms):
    """Position of an oscillator driven by white noise: exact two-state recursion, started in its stationary state.

    The transition matrix is that of the oscillator. The covariance of the steps keeps the stationary covariance
    diag(1, ω²) rms².
    """
    from scipy.linalg import expm

    w = 2.0 * np.pi * frequency
    step = expm(np.array([[0.0, 1.0], [-(w**2), -2.0 * damping * w]]) / rate)
    balance = rms**2 * np.diag([1.0, w**2])
    root = np.linalg.cholesky(balance - step @ balance @ step.T)
    kicks = root @ rng.standard_normal((2, n))
    first = np.sqrt(np.diag(balance)) * rng.standard_normal(2)
    # The position alone obeys x[k+2] = tr(step) x[k+1] − det(step) x[k] + forcing (Cayley-Hamilton).
    forcing = kicks[0, 1:] + step[0, 1] * kicks[1, :-1] - step[1, 1] * kicks[0, :-1]
    second = step[0] @ first + kicks[0, 0]
    poles = [1.0, -np.trace(step), np.linalg.det(step)]
    zi = [np.trace(step) * second - poles[2] * first[0], -poles[2] * second]
    return np.concatenate([[first[0], second], lfilter([1.0], poles, forcing, zi=zi)[0]])[:n]


def wandering_line(rng, n, rate, frequency, wander, time, amplitude, harmonics=((1.0, 1.0),)):
    """Line of constant amplitude whose frequency is a Gauss-Markov process: standard deviation, Hz, correlation time, s.

    `harmonics` are pairs: multiple of the frequency, amplitude relative to `amplitude`.
    """
    speed = frequency + gauss_markov(rng, n, rate, wander * np.sqrt(2.0 / time), time)
    angle = 2.0 * np.pi * np.cumsum(speed) / rate
    return amplitude * sum(a * np.sin(m * angle + rng.uniform(0.0, 6.28)) for m, a in harmonics)


def telegraph(rng, n, rate, amplitude, dwell):
    """Random telegraph: two levels with exponential dwell times."""
    count = int(n / rate / dwell * 1.5) + 100
    switches = np.cumsum(rng.exponential(dwell, count))
    side = np.searchsorted(switches, np.arange(n) / rate) % 2
    return amplitude * (1.0 - 2.0 * side) * rng.choice([-1.0, 1.0])


def step(n, rate, time, height):
    return height * (np.arange(n) / rate >= time)


def settling(n, rate, time_constant, amplitude):
    """Exponential decay from the first sample."""
    return amplitude * np.exp(-np.arange(n) / rate / time_constant)


def louder(samples, rate, start, end, factor):
    """The samples multiplied by `factor` between `start` and `end` (s)."""
    time = np.arange(samples.size) / rate
    return samples * np.where((time >= start) & (time < end), factor, 1.0)


def spikes(rng, n, count, size):
    """Zeros with `count` isolated samples of ±size at random positions."""
    out = np.zeros(n)
    out[rng.choice(n, count, replace=False)] = size * rng.choice([-1.0, 1.0], count)
    return out


def temperature(n, rate, period, swing=5.0):
    """Smooth, non-sinusoidal temperature in °C."""
    angle = 2.0 * np.pi * np.arange(n) / rate / period
    return 20.0 + swing * (np.sin(angle) + 0.4 * np.sin(2.3 * angle + 1.0))


def lagged(column, rate, lag):
    """First-order lag of a column, started in equilibrium."""
    phi = np.exp(-1.0 / (rate * lag))
    return lfilter([1.0 - phi], [1.0, -phi], column, zi=[phi * column[0]])[0]


def backlash(column, width):
    """Hysteresis: output of a column through a play of ±width, started in its middle, sample by sample."""
    out = np.empty(column.size)
    place = float(column[0])
    for k, value in enumerate(column.tolist()):
        place = min(max(place, value - width), value + width)
        out[k] = place
    return out


def moving_band(rng, n, rate, course, half_width, rms):
    """Narrow-band noise around a changing frequency: a complex first-order process, modulated by the phase."""
    keep = np.exp(-2.0 * np.pi * half_width / rate)
    steps = rng.standard_normal((n + 4096, 2)) @ [1.0, 1j]
    slow = lfilter([np.sqrt(1.0 - keep**2)], [1.0, -keep], steps)[4096:]
    return rms * np.real(slow * np.exp(2j * np.pi * np.cumsum(course) / rate))
