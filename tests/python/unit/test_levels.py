"""A change of level by chance: the law that `screen_levels` judges by."""

import numpy as np
import pytest

from allanite.suggestion.transients import _best_interval


@pytest.mark.parametrize("cells", [32, 256])
def test_chance_of_an_interval_is_no_smaller_than_simulated(cells):
    records, rng = 3000, np.random.default_rng(7)
    chances = np.array(
        [
            _best_interval(rng.standard_normal(16 * cells) ** 2, 1.0, cells)[3]
            for _ in range(records)
        ]
    )
    for p in (0.1, 0.01):
        found = np.mean(chances < np.log(p))
        # Three standard errors of a share of 3000 records.
        assert found <= p + 3.0 * np.sqrt(p * (1.0 - p) / records)
        assert found >= 0.1 * p, "more careful than it need be"
