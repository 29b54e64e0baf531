"""A fit of a summary of ten million samples is that of the record."""

from __future__ import annotations

import pytest

import allanite as al

pytestmark = pytest.mark.statistical

RATE, N = 100.0, 10_000_000


@pytest.mark.parametrize(
    "text",
    [
        "N(N=1)+B(B=0.05)+K(K=0.003)",
        "N(N=1)+GM(q_c=0.5,correlation_time=20)",
        "N(N=1)+BW(cutoff=20)",
        "N(N=1)+RES(frequency=15,damping=0.05,rms=2)",
        "N(N=1)+SIN(frequency=0.2,amplitude=0.1)",
    ],
)
def test_within_a_tenth_of_a_standard_error(text):
    model = al.parse_model(text)
    r = model.simulate(rate=RATE, duration=N / RATE, seed=19)
    ours, theirs = model.fit(al.summarize(r)), model.fit(r)
    for found, expected in zip(ours.estimates, theirs.estimates, strict=True):
        for name, value in expected.items():
            if getattr(value, "std_error", None):
                assert abs(float(found[name]) - float(value)) < 0.1 * value.std_error, name
    assert ours.adequate == theirs.adequate
