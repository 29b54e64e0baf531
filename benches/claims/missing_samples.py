"""Claim: checks of true models on records with missing samples have no more false alarms, and intervals cover.

Prints the table of docs/validation.md: false alarms, coverage and scatter of each coefficient.

    python benches/claims/missing_samples.py [RECORDS] [SAMPLES]
"""

from __future__ import annotations

import sys

import numpy as np

import allanite as al

RATE = 100.0
TRUTHS = {
    "N": ("N(N=0.0126)", "N+B+K"),
    "N+B+K": ("N(N=0.0126)+B(B=0.006)+K(K=4e-4)", "N+B+K"),
    "N+GM": ("N(N=0.0126)+GM(q_c=3e-3,T=20)", "N+GM"),
}
HOLES = (
    "none",
    "every second",
    *(f"{share} {kind}" for share in ("0.01", "0.05", "0.3") for kind in ("single", "3 s", "30 s")),
    "a tenth",
)


def mask(holes: str, n: int, rng: np.random.Generator) -> np.ndarray:
    """Return the mask of missing samples."""
    out = np.zeros(n, dtype=bool)
    if holes == "every second":
        out[1::2] = True
    elif holes == "a tenth":
        start = rng.integers(0, n - n // 10)
        out[start : start + n // 10] = True
    elif holes != "none":
        share, kind = holes.split(maxsplit=1)
        length = 1 if kind == "single" else int(float(kind.split()[0]) * RATE)
        while out.sum() < float(share) * n:
            start = rng.integers(0, n - length)
            out[start : start + length] = True
    return out


def row(truth: str, holes: str, records: int, n: int) -> str:
    """Return a line: false alarms, and coverage and scatter of each coefficient."""
    model, fitted = TRUTHS[truth]
    true = al.parse_model(model)
    alarms, covered, values = 0, {}, {}
    for seed in range(records):
        samples = true.simulate(duration=n / RATE, rate=RATE, seed=seed).samples.copy()
        samples[mask(holes, n, np.random.default_rng(seed))] = np.nan
        fit = al.parse_model(fitted).fit(al.Recording(samples, rate=RATE))
        check = fit.check()
        alarms += bool(check.significant) or not check.adequate
        for effect, found in zip(fit.model, fit.estimates, strict=True):
            name = getattr(effect, "coefficient", "")
            wanted = next((e.values[name] for e in true if e.kind == effect.kind), 0.0)
            low, high = found[name].interval
            covered.setdefault(name, []).append(low <= wanted <= high)
            values.setdefault(name, []).append(found[name].value / (wanted or 1.0))
    numbers = "; ".join(
        f"{name} {100 * np.mean(covered[name]):.0f} % covered, mean {np.mean(values[name]):.4f},"
        f" std. dev. {np.std(values[name]):.4f}"
        for name in covered
    )
    return f"{truth}, {holes}: alarms {alarms} of {records}; {numbers}"


if __name__ == "__main__":
    records = int(sys.argv[1]) if len(sys.argv) > 1 else 50
    n = int(sys.argv[2]) if len(sys.argv) > 2 else 20_000
    for truth in TRUTHS:
        for holes in HOLES:
            print(row(truth, holes, records, n), flush=True)
