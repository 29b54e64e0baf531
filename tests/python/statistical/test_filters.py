"""Filters hidden in N+B+K, made by scipy.signal alone: the first step is the filter, and N is right.

One record of each design; `benches/claims/filters.py` has all designs.
"""

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy import signal

import allanite as al

sys.path.insert(0, str(Path(__file__).parents[3] / "benches" / "claims"))
import filters

pytestmark = pytest.mark.statistical

CASES = [
    "butterworth 1, 0.2",
    "butterworth 2, 0.2",
    "butterworth 4, 0.3",
    "analogue 2, 0.3",
    "smoothers 2, 0.1",
    "bilinear 2, 0.2",
    "mean of 3",
    "cic 3, 4 at 4x",
    "fir 32 at 4x, 0.2",
    "fir 64, 0.3",
]


@pytest.mark.parametrize("name", CASES)
def test_the_first_rung_is_the_filter(name):
    added, level, _, _, study = filters.climb(name, 0)
    kinds = [e.kind for e in added]
    assert kinds[:1] == ["bandwidth"], study
    assert len(kinds) <= 2, study
    # N of 180 000 samples has a standard error of 0.5 % at a cutoff of a tenth of the rate.
    assert abs(level - 1.0) < 0.03


def test_what_is_rounded_after_the_filter_is_part_of_it():
    """White noise of 1/20 of N after a Butterworth low-pass of 5 Hz: no lag, no resonance, both coefficients right."""
    n, rate, N = 180_000, 100.0, 0.0126
    b, a = signal.butter(2, 0.1)
    rng = np.random.default_rng(4)
    filtered = signal.lfilter(b, a, rng.standard_normal(n + 4096))[4096:]
    samples = N * np.sqrt(rate) * (filtered + 0.05 * rng.standard_normal(n))
    study = al.improve(al.Recording(samples, rate=rate, unit="rad/s"), "N+B+K")
    assert [rung.added.kind for rung in study.ladder[1:]] == ["bandwidth"], study
    assert study.adequate, study
    for name, true in {"cutoff": 5.0, "floor": 0.05}.items():
        low, high = study.fit[f"BW.{name}"].interval
        assert low <= true <= high
