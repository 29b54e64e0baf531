"""Claim: at most 1 % of the runs of a watched sensor have a false alarm, and changes are found soon.

False alarms: samples of several distributions through `al.Watch`, whose model is fitted to 10⁵ earlier samples of the
same run (N from their standard deviation, as in a fit of white noise). Filtered noise is simulated from its model.

Delays: samples through `al.Watch` with a change after `--after` segments, compared with two tests that use the likelihood
ratio of the exact change and the same limit 1/α: one knows the time of the change, the other averages over all times as
the watch does. A line has twice the amplitude that is detectable in the given number of segments.

    python benches/claims/watch.py [--runs 50] [--first 0] [--segments 100] [--changes 20] [--after 100]

The full study has 1000 runs of 100 segments for each distribution, and 300 changes.
"""

from __future__ import annotations

import argparse
from time import process_time

import numpy as np

import allanite as al
from allanite import _kernels
from allanite.fit.likelihood.expected import density
from allanite.scale.bets import capital_share
from allanite.scale.watch import FALSE_ALARM_PROBABILITY, SEGMENT, SEGMENTS_IN_LONG, Watch

RATE = 100.0
MODEL = "N(N=0.01)+K(K=0.001)"
#: Maximum number of segments after a change.
MOST = 400
#: Gain in logL of one line for an alarm with α = 1 %, corrected for the number of ordinates of a segment.
LIMIT = float(np.log(SEGMENT / FALSE_ALARM_PROBABILITY))


#: Independent samples of constant variance.
DISTRIBUTIONS = {
    "normal": lambda rng, n: rng.standard_normal(n),
    "Laplace": lambda rng, n: rng.laplace(size=n),
    "Student t, 6 degrees of freedom": lambda rng, n: rng.standard_t(6, n),
    "Student t, 4 degrees of freedom": lambda rng, n: rng.standard_t(4, n),
    "normal, 1 % of the samples x 5": lambda rng, n: (
        rng.standard_normal(n) * np.where(rng.random(n) < 0.01, 5, 1)
    ),
    "normal, rounded to half a deviation": lambda rng, n: np.round(2.0 * rng.standard_normal(n)),
    "normal, rounded to two deviations": lambda rng, n: np.round(0.5 * rng.standard_normal(n)),
}
FILTERED = {
    "normal, filtered at 30 Hz": "N(N=0.1)+BW(cutoff=30,order=1)",
    "normal, filtered at 10 Hz (order 2)": "N(N=0.1)+BW(cutoff=10,order=2)",
}
#: Number of samples to which the model of a run is fitted.
FITTED = 100_000


def one_run(name, run, segments):
    """Return the largest e-value of a run under its model."""
    n = segments * SEGMENT
    if name in FILTERED:
        model = al.parse_model(FILTERED[name])
        x = model.simulate(n=n, rate=RATE, seed=7, axis=run).samples
    else:
        x = DISTRIBUTIONS[name](np.random.default_rng([run, 9]), FITTED + n)
        white = al.AngleRandomWalk(N=x[:FITTED].std() / np.sqrt(RATE))
        model, x = al.Model([white]), x[FITTED:]
    watch, top = Watch(model, RATE), 0.0
    # The watch tests for an alarm at every segment; the e-value is read here only at every long one, which is faster.
    for part in np.split(x, range(SEGMENTS_IN_LONG * SEGMENT, n, SEGMENTS_IN_LONG * SEGMENT)):
        watch.update(part)
        top = max(top, watch.e_value)
    return top if watch.alarm is None else max(top, watch.alarm.e_value)


def false_alarms(runs, segments, first=0):
    """Print how many runs have an alarm, for each distribution."""
    for name in (*DISTRIBUTIONS, *FILTERED):
        began = process_time()
        top = np.array([one_run(name, first + run, segments) for run in range(runs)])
        alarms = int((top >= 1.0 / FALSE_ALARM_PROBABILITY).sum())
        print(
            f"{name}: {runs} runs of {segments} segments: {alarms} alarms ({100 * alarms / runs:.2f} %);"
            f" {(top >= 10.0).sum()} runs reach 10; largest e-value {top.max():.3g};"
            f" {process_time() - began:.0f} s of processor time",
            flush=True,
        )


def line_of(segments):
    """Return the amplitude A of a line whose gain A² T/4N² in so many segments is four times the limit."""
    return float(np.sqrt(4.0 * 4.0 * LIMIT * 0.01**2 * RATE / (SEGMENT * segments)))


CHANGES = {
    "10 % quieter": MODEL.replace("N=0.01", "N=0.009").replace("K=0.001", "K=0.0009"),
    "10 % louder": MODEL.replace("N=0.01", "N=0.011").replace("K=0.001", "K=0.0011"),
    "a lag of 30 Hz": f"{MODEL}+BW(cutoff=30)",
    "a correlation of 0.5 s": f"{MODEL}+GM(correlation_time=0.5,q_c=0.04)",
    **{
        f"a line, {many} segments": f"{MODEL}+SIN(frequency=7.3,amplitude={line_of(many)},phase=0.3)"
        for many in (1, 4, 16, 64)
    },
}


def known_test(changed, usual):
    """Return a function of segment number and samples: the log-likelihood ratio of changed and usual model."""
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
    """Return the segments from change to alarm, shape (3, runs): watch, test with known effect, with known time too."""
    usual, changed = al.parse_model(MODEL), al.parse_model(text)
    gain, out = known_test(changed, usual), np.full((3, runs), MOST)
    for run in range(runs):
        watch, enough = Watch(usual, RATE), np.log(1.0 / FALSE_ALARM_PROBABILITY)
        quiet = usual.simulate(n=after * SEGMENT, rate=RATE, seed=seed, axis=run).samples
        mixed, known = -np.inf, 0.0
        for k, segment in enumerate(np.reshape(quiet, (after, SEGMENT))):
            mixed = np.logaddexp(mixed, np.log(capital_share(k + 1))) + gain(
                k - after, segment.copy()
            )
        if watch.update(quiet) is not None:
            out[0, run] = 0
        x = changed.simulate(n=MOST * SEGMENT, rate=RATE, seed=seed + 1, axis=run).samples
        for piece, segment in enumerate(np.reshape(x, (MOST, SEGMENT))):
            gained = gain(piece, segment.copy())
            known += gained
            mixed = np.logaddexp(mixed, np.log(capital_share(after + piece + 1))) + gained
            alarmed = (watch.update(segment) is not None, mixed >= enough, known >= enough)
            out[:, run] = np.where((out[:, run] == MOST) & alarmed, piece + 1, out[:, run])
            if out[:, run].max() < MOST:
                break
    return out


def main():
    """Print delays and false alarms."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=50, help="runs of each distribution")
    parser.add_argument(
        "--first", type=int, default=0, help="number of the first run, which is its seed"
    )
    parser.add_argument("--segments", type=int, default=100, help="segments of a run")
    parser.add_argument("--changes", type=int, default=20, help="runs of each change")
    parser.add_argument("--after", type=int, default=100, help="segments before the change")
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
        false_alarms(asked.runs, asked.segments, asked.first)


if __name__ == "__main__":
    main()
