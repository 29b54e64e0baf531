"""Claim: NIS, overbound and predicted error growth of a fitted model hold on data that was not fitted.

Each record of N+B+K (2 · 40 000 samples at 20 Hz) is fitted on its first half; the second half is filtered and integrated.

    python benches/claims/filter_promises.py [--nis 200] [--overbound 1000] [--growth 500]
"""

from __future__ import annotations

import argparse

import numpy as np

import allanite as al
from allanite.effects.files import model_to_dict
from allanite.exports import axes_of
from allanite.exports._choice import choose

TRUTH = al.parse_model("N(N=0.01)+B(B=0.004)+K(K=2e-4)")
RATE, HALF = 20.0, 40_000
TAU = (1.0, 5.0, 20.0)


def halves(seed):
    """Return a fit of the first half of a record, and the second half."""
    record = TRUTH.simulate(n=2 * HALF, rate=RATE, seed=seed, unit="deg/s")
    middle = 0.5 * record.duration
    return al.parse_model("N+B+K").fit(record.trim(None, middle)), record.trim(middle, None)


def bound_of(fit):
    """Return whether the overbound is above the truth at every τ used, and its mean ratio to the tightest possible one."""
    (axis,) = axes_of([fit.to_dict()])
    (known,) = axes_of([{**model_to_dict(TRUTH), "recording": fit.recording.describe()}])
    bound, tightest = (choose(a, overbound=True).model for a in (axis, known))
    variance = bound.allan_variance(axis.taus, RATE)
    above = variance >= axis.scale**2 * TRUTH.allan_variance(axis.taus, RATE)
    ratio = variance / tightest.allan_variance(axis.taus, RATE)
    return bool(above.all()), float(np.sqrt(ratio).mean())


def main() -> None:
    """Print the share of records in which each prediction holds."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--nis", type=int, default=200, help="records of the NIS")
    parser.add_argument("--overbound", type=int, default=1000, help="records of the overbound")
    parser.add_argument("--growth", type=int, default=500, help="records of the error growth")
    asked = parser.parse_args()
    nis, bounds, inside, ratios = [], [], [], []
    for seed in range(max(asked.nis, asked.overbound, asked.growth)):
        fit, second = halves(seed)
        if seed < asked.nis:
            nis.append(al.innovations(second, fit.model, states=8))
        if seed < asked.overbound:
            bounds.append(bound_of(fit))
        if seed < asked.growth:
            growth = al.error_growth(fit, aided=5.0, tau=list(TAU))[0]
            measured = al.measured_growth(second, growth)
            inside.append(measured.inside)
            ratios.append(measured.rms / growth.total)
    if nis:
        coverage = 100 * np.array([i.coverage for i in nis])
        print(
            f"NIS, {len(nis)} held-out halves: {coverage.mean():.2f} % in the 95 % band on average,"
            f" {coverage.min():.2f} to {coverage.max():.2f} %; mean {np.mean([i.mean_nis for i in nis]):.4f}"
        )
    if bounds:
        holds, ratio = np.array([b[0] for b in bounds]), np.array([b[1] for b in bounds])
        print(
            f"overbound, {len(bounds)} records: above the truth at every tau in {100 * holds.mean():.1f} %,"
            f" {np.median(ratio):.2f} times the tightest (95 % of records below {np.quantile(ratio, 0.95):.2f})"
        )
    for tau, share, ratio in zip(
        TAU, np.mean(inside, axis=0), np.mean(ratios, axis=0), strict=True
    ):
        print(
            f"growth over {tau:g} s, {len(inside)} records: {100 * share:.1f} % of held-out segments"
            f" inside, measured over predicted {ratio:.3f}"
        )


if __name__ == "__main__":
    main()
