"""Intervals of a stream cover the truth as those of a record that is kept."""

import numpy as np
import pytest

import allanite as al

pytestmark = pytest.mark.statistical

RECORDS, SAMPLES = 600, 20_000


@pytest.mark.parametrize("walk", [False, True])
def test_coverage_to_the_longest_averaging_times(walk):
    rng = np.random.default_rng(5)
    inside = []
    for _ in range(RECORDS):
        x = rng.standard_normal(SAMPLES)
        stream = al.Accumulator()
        stream.update(np.cumsum(x) if walk else x)
        curve = stream.oadev()
        m = curve.factors
        truth = np.sqrt((2.0 * m**2 + 1.0) / (6.0 * m)) if walk else 1.0 / np.sqrt(m)
        inside.append((curve.low <= truth) & (truth <= curve.high))
    share = np.mean(inside, axis=0)
    # 95 % of 600 records: a standard error of 0.9 %, 3.5 of which over 14 averaging times; wider intervals are allowed at
    # the end, where the noise cannot be told from a redder one.
    assert (share > 0.95 - 3.5 * 0.0089).all(), share
    assert (share[m <= SAMPLES / 90] < 0.95 + 3.5 * 0.0089).all(), share
