"""Logs with random holes, jumps, joins, wraps, jitter and units: the rate and the gaps are those put in."""

import contextlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import allanite as al
from allanite.recording.stamp_units import TIME_UNITS
from allanite.recording.timebase import read_stamps


@pytest.mark.slow
@settings(max_examples=300)
@given(
    seed=st.integers(0, 2**32 - 1),
    rate=st.sampled_from([1.0, 5.0, 9.862, 50.0, 100.0, 128.0, 200.0, 1000.0]),
    unit=st.sampled_from(["s", "ms", "us", "ns"]),
    jitter=st.sampled_from([0.0, 0.02, 0.1]),
    holes=st.integers(0, 30),
    missing_share=st.sampled_from([0.0, 0.05, 0.3]),
    join=st.booleans(),
    jump=st.booleans(),
    epoch=st.booleans(),
)
def test_rate_and_gaps(seed, rate, unit, jitter, holes, missing_share, join, jump, epoch):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2000, 6000))
    keep = rng.random(n) >= missing_share
    for _ in range(holes):
        at = int(rng.integers(1, n - 1))
        keep[at : at + int(rng.integers(1, 60))] = False
    keep[[0, 1, -2, -1]] = True
    place = np.flatnonzero(keep).astype(float)
    rows = np.arange(place.size)
    moved = place + jitter * rng.uniform(-1, 1, place.size)
    at_jump = at_join = -1
    if jump:  # too long to be filled, and within what 64 bits of nanoseconds hold
        at_jump = int(rng.integers(100, place.size - 100))
        moved[at_jump:] += 10.0 ** rng.uniform(7, 9.8)
    if join:
        at_join = int(rng.integers(100, place.size - 100))
        moved[at_join:] -= moved[at_join] - moved[0]
    second = TIME_UNITS[unit]
    start = 1.7e9 if epoch else 0.0
    t = (start / second + moved / (rate * second)) if epoch else moved / (rate * second)
    if second < 1e-4:
        t = np.rint(t).astype(np.int64)
    found = read_stamps(t, unit)
    # Each stretch between gaps that are left out begins and ends with the jitter of a stamp, at most 2 jitter steps
    # together; doubles of the present resolve 2.4e-7 s.
    stretches = 1 + sum(count > 32 for _, count in found.gaps) + len(found.seams)
    assert found.rate == pytest.approx(
        rate, rel=2.5 * (jitter + 1e-3) * stretches / place.size + 1e-6
    )
    true = {
        int(i): int(place[i + 1] - place[i] - 1) for i in rows[:-1] if place[i + 1] - place[i] > 1
    }
    apart = {at_jump - 1, at_join - 1} - {-2}
    for row in apart:
        true.pop(row, None)
    got = {row: count for row, count in found.gaps if row not in apart}
    assert got == true
    if join and not (jump and at_jump == at_join):
        assert (at_join - 1) in {row for row, _ in found.seams}
    if jump and not join:
        assert len(found.pieces) == 2
        assert found.pieces[0][1] == at_jump
    filled = sum(count for _, count in found.gaps_in_segment)
    first, end = found.rows
    assert filled <= 64 * (end - first)


@settings(max_examples=100)
@given(
    seed=st.integers(0, 2**32 - 1),
    bits=st.sampled_from([16, 32]),
    unit=st.sampled_from(["ms", "us"]),
    rate=st.sampled_from([50, 100, 125, 200, 500]),
    holes=st.integers(0, 10),
)
def test_wraps(seed, bits, unit, rate, holes):
    rng = np.random.default_rng(seed)
    n = 5000
    keep = np.ones(n, dtype=bool)
    for _ in range(holes):
        at = int(rng.integers(1, n - 1))
        keep[at : at + int(rng.integers(1, 3))] = False
    keep[[0, -1]] = True
    place = np.flatnonzero(keep)
    step = round(1 / (rate * TIME_UNITS[unit]))
    if 4 * step > 2**bits:
        return  # several wraps to a sample cannot be undone
    start = 2**bits - int(rng.integers(1, n // 2)) * step
    true = start + place * step
    t = true % 2**bits
    wraps = np.flatnonzero(np.diff(true // 2**bits))
    if 20 * step > 2**bits:
        # A step back by less than twenty samples may be disorder: read as that, or refused in a line.
        with contextlib.suppress(al.InputError):
            read_stamps(t, unit)
        return
    found = read_stamps(t, unit)
    assert found.rate == pytest.approx(rate, rel=1e-6)
    assert found.wraps == tuple(wraps)
    assert found.missing == n - place.size
