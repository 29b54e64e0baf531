"""Claim: a low-pass hidden in N+B+K is the first effect that is added, and N is right.

The records are made with scipy.signal: 1800 s at 100 Hz, N = 0.0126, B = 0.002, K = 9.07e-5 (rad/s). Each filter, with
cutoffs of 0.1 to 0.4 of the rate, acts on the white noise alone, or with --whole on all noise.

    python benches/claims/filters.py [--seeds 3] [--only butterworth] [--whole]
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from scipy import signal

import allanite as al

RATE, LENGTH = 100.0, 180_000
N, B, K = 0.0126, 0.002, 9.07e-5
CUTOFFS = (0.1, 0.2, 0.3, 0.4)
SETTLED = 4096


def _iir(b, a, times=1):
    """Return a source of samples that are filtered `times` times by a digital filter."""

    def run(given, count):
        x = given(count + SETTLED, RATE)
        for _ in range(times):
            x = signal.lfilter(b, a, x)
        return x[SETTLED:]

    return run


def _decimated(taps, factor):
    """Return a source of samples that are filtered at `factor` times the rate and then decimated."""

    def run(given, count):
        x = given(factor * count + len(taps) - 1, factor * RATE)
        return signal.fftconvolve(x, taps, "valid")[::factor]

    return run


def _smoother(cutoff, sections):
    """Return the pole of y += α(x − y) for which `sections` in series have half power at the cutoff."""
    share = 0.5 ** (1 / sections)
    middle = (1 - share * np.cos(2 * np.pi * cutoff)) / (1 - share)
    return middle - np.sqrt(middle**2 - 1)


def designs():
    """Return name → source of all filters."""
    out = {}
    for c in CUTOFFS:
        for order in (1, 2, 3, 4):
            out[f"butterworth {order}, {c}"] = _iir(*signal.butter(order, 2 * c))
        # Filtered at 8 times the rate: the output of an analog filter, including aliases.
        b, a = signal.butter(2, 2 * c / 8)
        out[f"analogue 2, {c}"] = _analogue(b, a, 8)
        p = _smoother(c, 2)
        out[f"smoothers 2, {c}"] = _iir([1 - p], [1, -p], 2)
        k = np.tan(np.pi * c) / np.sqrt(np.sqrt(2) - 1)
        out[f"bilinear 2, {c}"] = _iir([k / (1 + k)] * 2, [1, -(1 - k) / (1 + k)], 2)
        for taps in (32, 64):
            out[f"fir {taps} at 4x, {c}"] = _decimated(signal.firwin(taps, c, fs=4), 4)
            out[f"fir {taps}, {c}"] = _decimated(signal.firwin(taps, c, fs=1), 1)
    for length in (2, 3, 4, 5):
        out[f"mean of {length}"] = _decimated(np.full(length, 1 / length), 1)
    for factor in (4, 5, 6, 8):
        box = np.full(factor, 1 / factor)
        cic = np.convolve(np.convolve(box, box), box)
        out[f"cic 3, {factor} at {factor}x"] = _decimated(cic, factor)
        if factor == 8:
            out[f"cic 3, {factor} at 4x"] = _decimated(cic, 4)
    return out


def _analogue(b, a, factor):
    """Return a source of samples that are filtered at `factor` times the rate and then sampled at the rate."""

    def run(given, count):
        x = given(factor * (count + SETTLED), factor * RATE)
        return signal.lfilter(b, a, x)[factor * SETTLED :: factor]

    return run


def record(source, seed, name, whole=False):
    """Return samples in rad/s: filtered white noise, flicker noise of its discrete spectrum and a random walk."""
    rng = np.random.default_rng([seed, *name.encode()])

    def white(count, rate):
        return N * np.sqrt(rate) * rng.standard_normal(count)

    def slow(count, rate):
        size = signal.fftconvolve(rng.standard_normal(2 * count), _flicker(2 * count))
        return B * size[count : 2 * count] + np.cumsum(
            K / np.sqrt(rate) * rng.standard_normal(count)
        )

    if whole:
        return source(lambda count, rate: white(count, rate) + slow(count, rate), LENGTH)
    return source(white, LENGTH) + slow(LENGTH, RATE)


def _flicker(count):
    """Return the impulse response of (1 − z⁻¹)^{−1/2}, whose spectrum is 1/(2 sin(w/2)) (Hosking 1981)."""
    k = np.arange(1, count)
    return np.concatenate([[1.0], np.cumprod((k - 0.5) / k)])


def climb(name, seed, whole=False):
    """Return the added effects, N over its true value, whether the model is adequate, CPU seconds and the study."""
    samples = record(designs()[name], seed, name, whole)
    began = time.process_time()
    study = al.improve(al.Recording(samples, rate=RATE, unit="rad/s"), "N+B+K")
    spent = time.process_time() - began
    added = [r.added for r in study.ladder[1:] if r.added is not None]
    level = next((e.N for e in study.fit.model if e.kind == "angle_random_walk"), np.nan)
    return added, level / N, study.adequate, spent, study


def main():
    """Print the result of each filter and the counts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=3, help="records of each filter")
    parser.add_argument("--only", default="", help="run only filters whose name contains this text")
    parser.add_argument("--whole", action="store_true", help="filter B and K too")
    options = parser.parse_args()
    first, few, right, total = 0, 0, 0, 0
    for name in designs():
        if options.only not in name:
            continue
        for seed in range(options.seeds):
            added, level, adequate, spent, _ = climb(name, seed, options.whole)
            kinds = [e.kind for e in added]
            total += 1
            first += kinds[:1] == ["bandwidth"]
            few += len(kinds) <= 2
            right += abs(level - 1) < 0.03
            steps = " → ".join(str(e) for e in added) or "nothing"
            print(
                f"{name:22} {seed}  N {100 * (level - 1):+5.1f} %  {'adequate' if adequate else '-':8}"
                f" {spent:5.1f} s  {steps}",
                flush=True,
            )
    print(
        f"of {total}: filter first {first}, at most two effects added {few}, N within 3 % {right}"
    )


if __name__ == "__main__":
    main()
