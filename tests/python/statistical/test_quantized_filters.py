"""White noise behind a low-pass filter, quantized afterwards: both are named, and nothing takes their place."""

import numpy as np
import pytest

import allanite as al
import generators as g

pytestmark = pytest.mark.statistical


@pytest.mark.parametrize(("cutoff", "order", "q"), [(2.5, 2, 1e-3), (3.0, 4, 1e-3), (2.5, 2, 5e-4)])
def test_quantization_behind_a_filter_is_no_resonance(cutoff, order, q):
    """The true model has 6 to 20 nats more than the best model without quantization, so the search must find it.

    A 95 % interval must contain N = 0.01. The seeds are fixed; with other seeds one interval in twenty may miss it.
    """
    rng = np.random.default_rng([0, 7])
    samples = g.quantized_filter(rng, 20_000, 10.0, 0.01, cutoff, order, q, 3e-3)
    study = al.improve(al.Recording(samples, rate=10.0, unit="deg/s"), "N+B")
    kinds = {effect.kind for effect in study.fit.model}
    assert {"bandwidth", "quantization"} <= kinds
    assert "resonance" not in kinds
    low, high = study.fit["N"].interval
    assert low < 0.01 < high
