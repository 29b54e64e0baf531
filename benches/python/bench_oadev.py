"""Time of the overlapping Allan deviation against allantools, NumPy and numba, over N and number of τ."""

import argparse
import os
from pathlib import Path

os.environ["OMP_WAIT_POLICY"] = "passive"  # otherwise idle numba threads slow down the next program

import allantools
import numpy as np
from side_by_side import save, side_by_side

from allanite import _kernels
from allanite.deviation import oadev

RATE = 100.0
FIGURE = Path(__file__).parents[2] / "docs" / "figures" / "speed.svg"


def log_spaced(n, k=100):
    """Return at most k log-spaced factors for n samples."""
    top = np.log10(2.0 ** np.floor(np.log2(n / 2)))
    return np.unique(np.ceil(np.logspace(0, top, k))).astype(np.int64)


def octave(n):
    """Return factors in powers of two for n samples."""
    return 2 ** np.arange(int(np.log2(n / 2)) + 1)


def numpy_recipe(x, factors):
    """Return the Allan deviation as in the MathWorks example, in NumPy."""
    theta = np.cumsum(x) / RATE
    out = np.empty(factors.size)
    for i, m in enumerate(factors):
        d = theta[2 * m :] - 2 * theta[m:-m] + theta[: -2 * m]
        out[i] = np.sqrt(np.sum(d**2) / (2 * (m / RATE) ** 2 * d.size))
    return out


def numba_recipe():
    """Return a fast loop as a user could write it, parallel over τ; None without numba."""
    try:
        import numba
    except ImportError:
        return None

    @numba.njit(parallel=True, fastmath=True)
    def sums(theta, factors):
        out = np.empty(factors.size)
        for i in numba.prange(factors.size):
            m = factors[i]
            a, b, c = theta[: -2 * m], theta[m:-m], theta[2 * m :]
            total = 0.0
            for k in range(a.size):
                d = c[k] - 2.0 * b[k] + a[k]
                total += d * d
            out[i] = total / a.size
        return out

    def run(x, factors):
        theta = np.empty(x.size + 1)
        theta[0] = 0.0
        np.cumsum(x - x.mean(), out=theta[1:])
        return np.sqrt(sums(theta, factors) / 2) / factors

    return run


def programs(x, factors, *, peers=True):
    """Return name → call of each program; without `peers` only the fast ones."""
    found = {}
    tau = factors / RATE
    if peers:
        found["allantools"] = lambda: allantools.oadev(x, rate=RATE, data_type="freq", taus=tau)
        found["NumPy recipe"] = lambda: numpy_recipe(x, factors)
    numba = numba_recipe()
    if numba is not None:
        found["numba, parallel"] = lambda: numba(x, factors)
    found["allanite, 1 thread"] = lambda: _kernels.overlapping_allan(x, factors, False, 1)
    found["allanite"] = lambda: oadev(x, rate=RATE, factors=factors)
    found["np.cumsum(x) alone"] = lambda: np.cumsum(x)
    return found


def draw(by_length, by_count):
    """Draw the figure of docs/."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    for axes, table, label in (
        (left, by_length, "samples (100 log-spaced τ)"),
        (right, by_count, "averaging times (10⁶ samples)"),
    ):
        for name, points in table.items():
            axes.loglog(*zip(*sorted(points), strict=True), ".-", label=name)
        axes.set_xlabel(label)
        axes.set_ylabel("time (s)")
        axes.grid(visible=True, which="both", alpha=0.25)
    left.legend()
    FIGURE.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(FIGURE)


def main(largest):
    """Measure up to 10**largest samples, save the times and draw the figure."""
    rng = np.random.default_rng(1)
    rows, by_length, by_count = [], {}, {}
    for power in range(3, largest + 1):
        n = 10**power
        x = rng.normal(size=n)
        repeats = {3: 51, 4: 31, 5: 21, 6: 11, 7: 5}.get(power, 3)
        for name, grid in (("100 log-spaced", log_spaced(n)), ("octave", octave(n))):
            title = f"oadev, {n:.0e} samples, {grid.size} τ ({name})"
            found = side_by_side(title, programs(x, grid), repeats)
            rows += found
            if name != "octave":
                for row in found:
                    by_length.setdefault(row[1], []).append((n, row[2]))
    x = rng.normal(size=10**6)
    for count in (3, 10, 30, 100, 300):
        grid = log_spaced(10**6, count)
        for row in side_by_side(f"oadev, 1e+06 samples, {grid.size} τ", programs(x, grid), 7):
            rows.append(row)
            by_count.setdefault(row[1], []).append((grid.size, row[2]))
    save(rows, "oadev")
    draw(by_length, by_count)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--largest", type=int, default=7, help="largest N as a power of ten (8: minutes)"
    )
    main(parser.parse_args().largest)
