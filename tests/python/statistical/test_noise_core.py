"""The generator against its declaration, at lengths where a wrong per cent shows."""

from __future__ import annotations

import numpy as np
import pytest

from allanite import _core

pytestmark = pytest.mark.statistical

SIGMA, PHI = 2.0, 0.99
SUM = [
    ("white", [1.0]),
    ("flicker", [0.2]),
    ("random_walk", [0.002]),
    ("gauss_markov", [SIGMA, PHI]),
]


def declared(w, processes):
    s = 2 * np.sin(w / 2)
    parts = {
        "white": lambda sd: sd**2,
        "flicker": lambda b: b**2 / s,
        "random_walk": lambda k: k**2 / s**2,
        "power_law": lambda a, level: level**2 * s**a,
        "gauss_markov": lambda sd, p: sd**2 * (1 - p**2) / (1 - 2 * p * np.cos(w) + p**2),
    }
    return sum(parts[name](*values) for name, values in processes) + 0 * w


@pytest.mark.parametrize(
    "processes",
    [SUM, [("flicker", [1.0])], [("power_law", [-0.5, 1.0])], [("power_law", [0.5, 1.0])]],
    ids=["sum", "flicker", "-0.5", "+0.5"],
)
def test_welch_spectrum_of_1e8_samples_is_within_one_per_cent(processes):
    length, batch, batches = 4096, 1024, 24
    stream = _core.Simulator(processes, 1, 0, 0, length * batch * batches)
    window = np.sin(np.pi * (np.arange(length) + 0.5) / length) ** 2
    power = np.zeros(length // 2 + 1)
    for _ in range(batches):
        x = stream.next(length * batch).reshape(batch, length)
        x -= x.mean(axis=1, keepdims=True)
        power += (np.abs(np.fft.rfft(x * window)) ** 2).sum(axis=0)
    power /= batch * batches * np.sum(window**2)
    w = 2 * np.pi * np.arange(length // 2 + 1) / length
    inside = np.arange(8, length // 2 - 2)
    model = declared(w[1:], processes)
    # What a Hann window makes of the declared spectrum, from its three nearest neighbours.
    smooth = (model[inside - 2] + 4 * model[inside - 1] + model[inside]) / 6
    ratio = power[inside] / smooth
    edges = [8]
    while edges[-1] < ratio.size:
        edges.append(edges[-1] + max(8, edges[-1] // 4))
    for band in np.split(ratio, edges[:-2]):
        # 24 576 segments of 8 or more bins, of which neighbours correlate by 4/9: one standard error is below 0.31 %.
        assert band.size >= 8
        assert abs(band.mean() - 1) < 0.01


@pytest.mark.parametrize("exponent", [-1.0, -0.5, -1.5])
def test_low_end_of_the_spectrum_at_one_over_the_record(exponent):
    # Mean square of the lowest Fourier ordinates of many records, against the integral of the
    # declared spectrum seen through the record's window (Hann, to keep leakage local).
    n, runs = 4096, 20_000
    process = [("power_law", [exponent, 1.0])]
    window = np.sin(np.pi * (np.arange(n) + 0.5) / n) ** 2
    phase = np.exp(-2j * np.pi * np.outer(np.arange(2, 6), np.arange(n)) / n) * window
    power = np.zeros(4)
    for r in range(runs):
        x = _core.simulate(process, n, 3, replicate=r, threads=1)
        power += np.abs(phase @ x) ** 2
    power /= runs
    padded = 16 * n
    w = 2 * np.pi * (np.arange(padded) + 0.5) / padded
    # The response is shifted by half a bin of the fine grid, which avoids the pole at zero.
    shift = np.exp(-1j * np.pi * np.arange(n) / padded)
    response = np.abs(np.fft.fft(phase * shift, padded, axis=1)) ** 2
    expected = (response * declared(w, process)).mean(axis=1)
    # Ordinates are exponential: relative error 1/sqrt(runs), five of them, and the 1 % declared.
    assert np.all(np.abs(power / expected - 1) < 5 / np.sqrt(runs) + 0.01)
