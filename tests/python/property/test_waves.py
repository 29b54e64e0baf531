"""Sines of a whole record, made block by block, are those of its times."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from allanite.effects._waves import MIN_BLOCKED_TIMES, sines, sines_pointwise, waves

line = st.tuples(st.floats(-300.0, 300.0), st.floats(-5.0, 5.0), st.floats(-7.0, 7.0))


@settings(max_examples=30, deadline=None)
@given(
    st.lists(line, min_size=1, max_size=4),
    st.integers(MIN_BLOCKED_TIMES, 3 * MIN_BLOCKED_TIMES),
    st.floats(0.0, 1e4),
)
def test_blocks_are_the_function(lines, n, start):
    time = start + np.arange(n) / 100.0
    # An angle ωt + φ has a rounding of 1.1e-16 of itself, in the blocks of some of its parts.
    rounding = 4e-16 * sum(abs(a) * (1.0 + abs(w) * time[-1] + abs(phi)) for w, a, phi in lines)
    assert np.abs(sines(lines, time) - sines_pointwise(lines, time)).max() < rounding + 1e-15


def test_times_that_are_not_even_are_taken_one_by_one():
    time = np.arange(2 * MIN_BLOCKED_TIMES) / 100.0
    time[MIN_BLOCKED_TIMES + 5] += 0.003
    found = waves(3.0, time)
    assert np.array_equal(found[0], np.sin(2.0 * np.pi * 3.0 * time))
