"""A sensor under watch: false alarms of whole runs, and how soon changes are found.

False alarms: runs of 10⁵ segments under the model N+K, of which the ordinates of segments are independent χ² but for
rounding (the cosine transform makes white noise and a random walk so), so that powers of ordinates are drawn instead of
samples. What each bet gains by them is as `al.Watch` computes it. Short and long segments are drawn on their own: the
chance that either alarms is at most the sum of both.

Delays: samples through `al.Watch`, with a change after so many segments, beside two tests with the likelihood ratio of the
exact change, which end at the same 1/α: one knows when it begins, the other bets on all starts as the watch does. A line is
twice as strong as what a record of so many segments can tell.

    python benches/claims/watch.py [--runs 1000] [--segments 100000] [--changes 300] [--after 100]
"""

from __future__ import annotations

import argparse
from time import process_time

import numpy as np

import allanite as al
from allanite import _kernels
from allanite.fit.likelihood.expected import density
from allanite.scale.bets import share
from allanite.scale.watch import FALSE, PARTS, SEGMENT, Watch

RATE = 100.0
MODEL = "N(N=0.01)+K(K=0.001)"
#: Segments drawn at a time, over all runs together, divided by short segments in one.
TOGETHER = 64
#: Segments after a change at which a run is given up.
MOST = 400
#: What an alarm in 100 needs of the gain of one line among the ordinates of a segment: its limit.
LIMIT = float(np.log(SEGMENT / FALSE))


def null_runs(bets, runs, segments, rng):
    """Largest capital of each run."""
    weights = np.exp(bets.weights, dtype=np.float32)
    stake, kept, top = np.zeros((runs, weights.size), dtype=np.float32), 1.0, np.zeros(runs)
    z = np.zeros((runs, bets.segment), dtype=np.float32)
    pairs = z[:, 4::2]
    for k in range(1, segments + 1):
        # Two ordinates at a time, but for the first three: no bet parts the others.
        z[:, 1:4] = rng.standard_normal((runs, 3), dtype=np.float32) ** 2
        pairs[:] = rng.standard_exponential(pairs.shape, dtype=np.float32)
        pairs *= 2.0
        gain = bets.gains(np.cumsum(z, axis=1))
        stake += np.float32(share(k)) * weights
        stake *= np.exp(gain, out=gain)
        kept -= share(k)
        np.maximum(top, kept + stake.sum(axis=1), out=top)
    return top


def false_alarms(runs, segments, seed=0):
    """Prints how many runs end with an alarm."""
    watch = Watch(al.parse_model(MODEL), RATE)
    for part, bets in zip(PARTS, watch._bets, strict=True):
        bets.__dict__.update(
            {k: v.astype(np.float32) for k, v in bets.__dict__.items() if k in TABLES}
        )
        rng, many = np.random.default_rng([seed, bets.segment]), bets.segment // SEGMENT
        began, top, each = process_time(), [], max(1, TOGETHER // many)
        while len(top) < runs:
            top += list(null_runs(bets, min(each, runs - len(top)), segments // many, rng))
        alarms = sum(part * t >= 1.0 / FALSE for t in top)
        print(
            f"{runs} runs of {segments // many} segments of {bets.segment}: {alarms} alarms ({100 * alarms / runs:.2f} %),"
            f" largest capital {part * max(top):.3g}, {process_time() - began:.0f} s of processor time",
            flush=True,
        )


#: Numbers of the gains, which need not be of double precision here.
TABLES = ("_wide_fixed", "_wide_slope", "_narrow_fixed", "_narrow_slope")


def line_of(segments):
    """Amplitude of a line whose gain in so many segments is four times the limit: A² T/4N²."""
    return float(np.sqrt(4.0 * 4.0 * LIMIT * 0.01**2 * RATE / (SEGMENT * segments)))


CHANGES = {
    "10 % louder": MODEL.replace("N=0.01", "N=0.011").replace("K=0.001", "K=0.0011"),
    "a lag of 30 Hz": f"{MODEL}+BW(cutoff=30)",
    "a correlation of 0.5 s": f"{MODEL}+GM(correlation_time=0.5,q_c=0.04)",
    **{
        f"a line, {many} segments": f"{MODEL}+SIN(frequency=7.3,amplitude={line_of(many)},phase=0.3)"
        for many in (1, 4, 16, 64)
    },
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
    """Segments from the change to the alarm: of the watch, and of the tests that know effect, and time; shape (3, runs)."""
    usual, changed = al.parse_model(MODEL), al.parse_model(text)
    gain, out = known_test(changed, usual), np.full((3, runs), MOST)
    for run in range(runs):
        watch, enough = Watch(usual, RATE), np.log(1.0 / FALSE)
        quiet = usual.simulate(n=after * SEGMENT, rate=RATE, seed=seed, axis=run).samples
        mixed, known = -np.inf, 0.0
        for k, segment in enumerate(np.reshape(quiet, (after, SEGMENT))):
            mixed = np.logaddexp(mixed, np.log(share(k + 1))) + gain(k - after, segment.copy())
        if watch.update(quiet) is not None:
            out[0, run] = 0
        x = changed.simulate(n=MOST * SEGMENT, rate=RATE, seed=seed + 1, axis=run).samples
        for piece, segment in enumerate(np.reshape(x, (MOST, SEGMENT))):
            gained = gain(piece, segment.copy())
            known += gained
            mixed = np.logaddexp(mixed, np.log(share(after + piece + 1))) + gained
            told = (watch.update(segment) is not None, mixed >= enough, known >= enough)
            out[:, run] = np.where((out[:, run] == MOST) & told, piece + 1, out[:, run])
            if out[:, run].max() < MOST:
                break
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
        found = delays(text, asked.changes, asked.after)
        early = int((found[0] == 0).sum())
        found = found[:, found[0] > 0]
        ours, effect, both = found.mean(axis=1)
        lost = int((found[0] == MOST).sum())
        print(
            f"{name}: {ours:.2f} segments (median {np.median(found[0]):g}, 95 % {np.quantile(found[0], 0.95):g}); the test"
            f" that knows the effect {effect:.2f} (× {effect / both:.2f} of the next), and the time {both:.2f}:"
            f" × {ours / both:.2f}; {early} before, {lost} not in {MOST}",
            flush=True,
        )
    if asked.runs:
        false_alarms(asked.runs, asked.segments)


if __name__ == "__main__":
    main()
