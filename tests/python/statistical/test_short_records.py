"""A thousand samples: few bins, few degrees of freedom in each. Nothing is invented there either."""

import numpy as np
import pytest

import allanite as al
import generators as g
from counts import records

pytestmark = pytest.mark.statistical


@pytest.mark.long
def test_nothing_is_missing_from_a_thousand_white_samples():
    count, false = records(60, 150), []
    for seed in range(count):
        rng = np.random.default_rng([seed, 34])
        recording = al.Recording(g.white(rng, 1000, 1.0, 1.0), rate=1.0, unit="rad/s")
        check = al.fit_model(recording, "N+B").check()
        false += [(seed, [s.kind for s in check.significant])] if check.significant else []
    # One check in a hundred may raise a false alarm: more than two of 60 have a chance of 2.2 %, at 5 % one of 58 %, at
    # 10 % of 95 %; more than four of 150 of 1.8, 87 and 99.9 %. (benches/claims/nulls.py takes thousands.)
    assert len(false) <= records(2, 4), false
