"""A sensor under watch: false alarms of whole runs, and how soon three changes are found.

False alarms: runs of 10⁵ segments under the model N+K, of which the ordinates of segments are independent χ² but for
rounding (the cosine transform makes white noise and a random walk so), so that the powers of the bands are drawn instead of
samples. Everything else is as `al.Watch` computes it.

Delays: samples through `al.Watch`, with a change after so many segments, beside the likelihood ratio of the exact change
from its first sample on, which ends at the same 1/α. A line is twice as strong as what a record of so many segments can
tell.

    python benches/claims/watch.py [--runs 1000] [--segments 100000] [--changes 300] [--after 100]
"""

from __future__ import annotations

import argparse
from time import process_time

import numpy as np

import allanite as al
from allanite import _kernels
from allanite.fit.likelihood.data import density
from allanite.scale.watch import FALSE, SEGMENT, TOLERANCE, Watch, _share

RATE = 100.0
MODEL = "N(N=0.01)+K(K=0.001)"
#: Runs at a time, and segments drawn at a time.
TOGETHER, AHEAD = 50, 64
#: Segments after a change at which a run is given up.
MOST = 1000
#: What an alarm in 100 needs of the gain of one line among the ordinates of a segment: its limit.
LIMIT = float(np.log(SEGMENT / FALSE))


def null_runs(watch, runs, segments, rng):
    """Largest capital of each run."""
    edges = np.unique(watch._bands)
    bands, owner = np.unique(watch._bands, axis=0, return_inverse=True)
    low, high = (np.searchsorted(edges, bands[:, side]) for side in (0, 1))
    null = np.where(watch._ratios > 1.0, (1.0 + TOLERANCE) ** 2, (1.0 - TOLERANCE) ** 2)
    fixed = 0.5 * watch._freedom * np.log(null / watch._ratios)
    slope = 0.5 * (1.0 / null - 1.0 / watch._ratios)
    stake, kept, top = np.zeros((runs, fixed.size)), 1.0, np.zeros(runs)
    for first in range(0, segments, AHEAD):
        power = 2.0 * rng.standard_gamma(0.5 * np.diff(edges), size=(AHEAD, runs, edges.size - 1))
        total = np.concatenate([np.zeros((AHEAD, runs, 1)), np.cumsum(power, axis=2)], axis=2)
        power = total[:, :, high] - total[:, :, low]
        for k in range(min(AHEAD, segments - first)):
            share = _share(first + k + 1)
            kept -= share
            gain = np.take(power[k], owner, axis=1)
            gain *= slope
            gain += fixed
            stake += share
            stake *= np.exp(gain, out=gain)
            np.maximum(top, kept + stake.mean(axis=1), out=top)
    return top


def false_alarms(runs, segments, seed=0):
    """Prints how many runs end with an alarm."""
    watch, rng = Watch(al.parse_model(MODEL), RATE), np.random.default_rng([seed, segments])
    began, top = process_time(), []
    while len(top) < runs:
        top += list(null_runs(watch, min(TOGETHER, runs - len(top)), segments, rng))
    alarms = sum(t >= 1.0 / FALSE for t in top)
    print(
        f"{runs} runs of {segments} segments: {alarms} alarms ({100 * alarms / runs:.2f} %), largest capital"
        f" {max(top):.3g}, {process_time() - began:.0f} s of processor time",
        flush=True,
    )


def line_of(segments):
    """Amplitude of a line whose gain in so many segments is four times the limit: A² T/4N²."""
    return float(np.sqrt(4.0 * 4.0 * LIMIT * 0.01**2 * RATE / (SEGMENT * segments)))


CHANGES = {
    "10 % louder": MODEL.replace("N=0.01", "N=0.011").replace("K=0.001", "K=0.0011"),
    "a lag of 30 Hz": f"{MODEL}+BW(cutoff=30)",
    "a correlation of 0.5 s": f"{MODEL}+GM(correlation_time=0.5,q_c=0.04)",
    "a line, 1 segment": f"{MODEL}+SIN(frequency=7.3,amplitude={line_of(1)},phase=0.3)",
    "a line, 4 segments": f"{MODEL}+SIN(frequency=7.3,amplitude={line_of(4)},phase=0.3)",
    "a line, 16 segments": f"{MODEL}+SIN(frequency=7.3,amplitude={line_of(16)},phase=0.3)",
}


def known_test(changed, usual):
    """Logarithm of the likelihood ratio of a segment from the change on, by number and samples."""
    j = np.arange(1, SEGMENT, dtype=np.int64)
    span = (0.0, SEGMENT / RATE)
    lines = [e for e in changed if e.kind == "sinusoid"]
    before, after = (density(m.terms(RATE, span), j, SEGMENT) for m in (usual, changed))

    def gain(number, x):
        c = _kernels.cosine_transform(x)[1:]
        if not lines:
            return float(0.5 * (np.log(before / after) + c**2 * (1.0 / before - 1.0 / after)).sum())
        time = (np.arange(SEGMENT) + number * SEGMENT) / RATE
        s = _kernels.cosine_transform(np.ascontiguousarray(lines[0].signal(time, {})))[1:]
        return float(((c - 0.5 * s) * s / before).sum())

    return gain


def delays(text, runs, after, seed=1):
    """Segments from the change to the alarm, of the watch and of the test that knows, shape (2, runs)."""
    usual, changed = al.parse_model(MODEL), al.parse_model(text)
    gain, out = known_test(changed, usual), np.full((2, runs), MOST)
    for run in range(runs):
        watch = Watch(usual, RATE)
        watch.update(usual.simulate(n=after * SEGMENT, rate=RATE, seed=seed, axis=run).samples)
        if watch.alarm is not None:
            out[0, run] = 0
            continue
        known, piece = 0.0, 0
        x = changed.simulate(n=MOST * SEGMENT, rate=RATE, seed=seed + 1, axis=run).samples
        while out.max(axis=0)[run] == MOST and piece < MOST:
            segment = np.ascontiguousarray(x[piece * SEGMENT : (piece + 1) * SEGMENT])
            if out[1, run] == MOST:
                known += gain(piece, segment)
                out[1, run] = piece + 1 if known >= np.log(1.0 / FALSE) else MOST
            if out[0, run] == MOST and watch.update(segment) is not None:
                out[0, run] = piece + 1
            piece += 1
    return out


def main():
    """Print both."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--segments", type=int, default=100_000)
    parser.add_argument("--changes", type=int, default=300)
    parser.add_argument("--after", type=int, default=100)
    asked = parser.parse_args()
    for name, text in CHANGES.items() if asked.changes else ():
        ours, known = delays(text, asked.changes, asked.after)
        early = int((ours == 0).sum())
        ours, known = ours[ours > 0], known[ours > 0]
        lost = int((ours == MOST).sum())
        print(
            f"{name}: {ours.mean():.2f} segments (median {np.median(ours):g}, 95 % {np.quantile(ours, 0.95):g}), the"
            f" test that knows {known.mean():.2f}: × {ours.mean() / known.mean():.2f}; {early} before, {lost} not in"
            f" {MOST}",
            flush=True,
        )
    if asked.runs:
        false_alarms(asked.runs, asked.segments)


if __name__ == "__main__":
    main()
