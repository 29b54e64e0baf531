"""Rows that a watch reads."""

import numpy as np
import pytest

from allanite.cli.live_source import sample_of


@pytest.mark.parametrize(
    ("line", "place", "value"),
    [
        # What a topic of ROS 2 is printed as: seconds, nanoseconds, a frame that may have no name, numbers.
        ("1700000000,5000000,imu_link,0.0,0.0,0.25", 5, 0.25),
        ("1700000000,5000000,,0.0,0.0,0.25", 5, 0.25),
        ("1,,3", 1, np.nan),
        ("1,5;2,5", 1, 2.5),
        ("0.5  0.25", 1, 0.25),
        ("time,gx", 1, None),
        ("# no row", 0, None),
        ("", 0, None),
    ],
)
def test_a_cell_is_where_it_is(line, place, value):
    found = sample_of(f"{line}\n", place)
    assert found is None if value is None else found == pytest.approx(value, nan_ok=True)
