"""White noise behind a low-pass filter, quantized afterwards: both are named, and nothing takes their place."""

import numpy as np
import pytest
from scipy.signal import butter, lfilter

import allanite as al
import generators as g

pytestmark = pytest.mark.statistical


@pytest.mark.parametrize(("cutoff", "order", "q"), [(2.5, 2, 1e-3), (3.0, 4, 1e-3), (2.5, 2, 5e-4)])
def test_quantization_behind_a_filter_is_no_resonance(cutoff, order, q):
    """The truth is 6 to 40 nats above N+B with any one effect, so that it must be found, with N inside its interval.

    Each interval holds N = 0.01 with a probability of 95 %; all three miss it in one of 8000 studies.
    """
    n, rate, white = 20_000, 10.0, 0.01
    rng = np.random.default_rng([0, 7])
    driven = white * np.sqrt(rate) * rng.standard_normal(n + 500)
    filtered = lfilter(*butter(order, cutoff / (rate / 2)), driven)[500:]
    codes = q * rate * np.diff(rng.standard_normal(n + 1))
    samples = filtered + g.flicker(rng, n, rate, 3e-3) + codes
    study = al.improve(al.Recording(samples, rate=rate, unit="deg/s"), "N+B")
    kinds = {effect.kind for effect in study.fit.model}
    assert {"bandwidth", "quantization"} <= kinds
    assert "resonance" not in kinds
    low, high = study.fit["N"].interval
    assert low < white < high
