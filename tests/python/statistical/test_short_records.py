"""A thousand samples: few bins, few degrees of freedom in each. Nothing is invented there either."""

import numpy as np
import pytest

import allanite as al
import generators as g

pytestmark = pytest.mark.statistical


def test_nothing_is_missing_from_a_thousand_white_samples():
    records, false = 150, []
    for seed in range(records):
        rng = np.random.default_rng([seed, 34])
        recording = al.Recording(g.white(rng, 1000, 1.0, 1.0), rate=1.0, unit="rad/s")
        check = al.fit_model(recording, "N+B").check()
        false += [(seed, [s.kind for s in check.significant])] if check.significant else []
    # One check in a hundred may raise a false alarm: more than five of 150 have a chance of 0.4 %. (1 here.)
    assert len(false) <= 5, false
