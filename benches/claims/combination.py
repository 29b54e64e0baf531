"""Claim: weights and gain of a group of sensors match the true ones, and the deviating unit is named.

Groups of four, an hour at 20 Hz: equal; unequal (N of 1, 1.5, 2 and 3); correlated (two units share as much noise as each
has of its own). Groups of five whose N and K spread by 5 %: without a deviating unit, and with one of twice the N, or of
three, five or ten times the K. At least 95 % must be named for twice the N and five and ten times the K. ΔlogL is that of
the unit's own noise over the noise of the others, expected. The samples are made without the package.

    python benches/claims/combination.py [--seeds 40]
"""

from __future__ import annotations

import argparse

import numpy as np

import allanite as al

RATE, LENGTH = 20.0, 72_000
N, K = 0.01, 1e-4


def noise(rng, n=N, k=K):
    """Return samples of white noise and a random walk."""
    white = rng.normal(0.0, n * np.sqrt(RATE), LENGTH)
    return white + np.cumsum(rng.normal(0.0, k / np.sqrt(RATE), LENGTH))


def group(kind, rng):
    """Return samples of four units and the covariance of their white noise relative to one unit's variance."""
    if kind == "equal":
        return np.column_stack([noise(rng) for _ in range(4)]), np.eye(4)
    if kind == "unequal":
        sizes = np.array([1.0, 1.5, 2.0, 3.0])
        return np.column_stack([noise(rng, s * N, s * K) for s in sizes]), np.diag(sizes**2)
    x = np.column_stack([noise(rng) for _ in range(4)])
    x[:, :2] += noise(rng)[:, None]
    covariance = np.diag([2.0, 2.0, 1.0, 1.0])
    covariance[0, 1] = covariance[1, 0] = 1.0
    return x, covariance


def truth(covariance):
    """Return the true weights and gain. N and K have the same covariance, so both hold at every τ."""
    row = np.linalg.solve(covariance, np.ones(len(covariance)))
    return row / row.sum(), float(np.sqrt(np.diag(covariance).min() * row.sum()))


def combined(x, model="N+K"):
    """Combine the units of one board."""
    names = [f"gyro{k}_x" for k in range(x.shape[1])]
    return al.combine(al.Recording(x, rate=RATE, unit="deg/s", columns=names), model)


def spread_group(rng, odd=None, factor=(1.0, 1.0), units=5):
    """Return samples of units whose coefficients spread by 5 %; those of unit `odd` are also multiplied by `factor`."""
    out = []
    for k in range(units):
        n, walk = N * np.exp(rng.normal(0.0, 0.05)), K * np.exp(rng.normal(0.0, 0.05))
        if k == odd:
            n, walk = n * factor[0], walk * factor[1]
        out.append(noise(rng, n, walk))
    return np.column_stack(out)


def expected_gain(factor):
    """Return the expected ΔlogL of a unit whose N and K are multiplied by `factor`, over the noise of the others."""
    walk = 2.0 * np.sin(np.pi * np.arange(1, LENGTH) / (2 * LENGTH))

    def density(n, k):
        return n**2 + (k / (RATE * walk)) ** 2

    ratio = density(factor[0] * N, factor[1] * K) / density(N, K)
    return 0.5 * np.sum(ratio - 1.0 - np.log(ratio))


def main() -> None:
    """Print the found weights, gains and deviating units next to the true ones."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=40, help="groups of each case")
    given = parser.parse_args()
    for kind in ("equal", "unequal", "correlated"):
        weights, gains, measured = [], [], []
        for seed in range(max(given.seeds // 4, 4)):
            x, covariance = group(kind, np.random.default_rng([seed, len(kind)]))
            found = combined(x)
            weights.append(found.weights)
            # Compare with the unit that is truly best: the one with the best estimate is selected by chance too.
            gains.append(found.single[:, np.argmin(np.diag(covariance))] / found.combined)
            measured.append(found.measured / found.combined)
        right, gain = truth(covariance)
        scatter = np.std(weights, axis=0, ddof=1) / np.sqrt(len(weights))
        away = np.abs(np.mean(weights, axis=0) - right) / scatter
        mean = np.mean(weights, axis=0)
        print(f"{kind}: weights {mean.round(4)}, true {right.round(4)}, at most {away.max():.1f} σ")
        spread = np.std(gains, axis=0, ddof=1) / np.sqrt(len(gains))
        mean = np.mean(gains, axis=0)
        z = np.abs(mean - gain) / spread
        print(
            f"  gain {mean.min():.4f} to {mean.max():.4f}, true {gain:.4f}, at most {z.max():.1f} σ"
        )
        print(f"  samples/model: {np.mean(measured, axis=0).round(3)}", flush=True)
    healthy = 0
    for seed in range(given.seeds):
        found = combined(spread_group(np.random.default_rng([seed, 1])))
        healthy += len(found.deviating)
    print(f"healthy units named: {healthy} of {5 * given.seeds} (at most 1 %)", flush=True)
    for factor in ((2.0, 1.0), (1.0, 3.0), (1.0, 5.0), (1.0, 10.0)):
        right = wrong = 0
        for seed in range(given.seeds):
            odd = seed % 5
            found = combined(spread_group(np.random.default_rng([seed, 2]), odd, factor))
            names = [one.unit for one in found.deviating]
            right += f"gyro{odd}_x" in names
            wrong += len([n for n in names if n != f"gyro{odd}_x"])
        print(
            f"N×{factor[0]:g}, K×{factor[1]:g}, ΔlogL {expected_gain(factor):.0f}: named {right} of {given.seeds},"
            f" healthy ones {wrong}",
            flush=True,
        )


if __name__ == "__main__":
    main()
