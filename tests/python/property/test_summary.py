"""A record cut anywhere and put together in any order is the same summary."""

from __future__ import annotations

import itertools
import pickle

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import allanite as al
from allanite.summary import level, reading, summary
from allanite.summary.making import summary_of_chunks

N = 150_000


@pytest.fixture(autouse=True, scope="module")
def small():
    """Levels keep fewer samples, so that a short record has several."""
    modules = (level, reading, summary)
    with pytest.MonkeyPatch.context() as patch:
        for module in modules:
            patch.setattr(module, "MAX_KEPT_SAMPLES", 1 << 15)
        yield


@pytest.fixture(scope="module")
def record():
    x = np.random.default_rng(19).standard_normal(N).cumsum() * 0.01
    x += np.random.default_rng(20).standard_normal(N)
    x[70_000:70_050] = np.nan
    x[100_001] = np.nan
    return x


@pytest.fixture(scope="module")
def whole(record, small):
    return al.summarize(record, rate=100.0)


@settings(max_examples=12)
@given(
    cuts=st.lists(st.integers(1, N - 1), max_size=6, unique=True),
    seed=st.integers(0, 2**32 - 1),
)
def test_cut_anywhere_and_merged_in_any_order(record, whole, cuts, seed):
    edges = [0, *sorted(cuts), N]
    pieces = [al.summarize(record[a:b], rate=100.0, start=a) for a, b in itertools.pairwise(edges)]
    rng = np.random.default_rng(seed)
    while len(pieces) > 1:
        one, other = (pieces.pop(int(rng.integers(len(pieces)))) for _ in range(2))
        pieces.append(one.merge(other))
    found, expected = pieces[0].reading(), whole.reading()
    assert len(expected.octaves) >= 2
    # Every tile is computed from the same samples, and its power added with 106 bits: nothing differs.
    assert np.array_equal(found.samples, expected.samples)
    for ours, theirs in zip(found.octaves, expected.octaves, strict=True):
        assert np.array_equal(ours.power.value, theirs.power.value)
        assert ours.frames == theirs.frames
        for map_of in (lambda octave: octave.blocks, lambda octave: octave.sections):
            assert np.array_equal(map_of(ours).sums.value, map_of(theirs).sums.value)
            assert np.array_equal(map_of(ours).frames, map_of(theirs).frames)
    assert pieces[0].extremes.count == whole.extremes.count == N - 51
    assert pieces[0].gaps == whole.gaps == 2
    # Sums of up to 1e5 squares in double-double, of samples counted from another origin.
    curve = pieces[0].oadev().deviation / whole.oadev().deviation
    assert np.nanmax(np.abs(curve - 1.0)) < 1e-10


@settings(max_examples=5)
@given(sizes=st.lists(st.integers(1, 40_000), min_size=1, max_size=20))
@example(sizes=[32_769])  # the first sample beyond those that a level keeps, and no complete tile
def test_chunks_of_any_size(record, whole, sizes):
    edges = np.minimum(np.cumsum([0, *sizes, N]), N)
    chunks = [record[a:b] for a, b in itertools.pairwise(edges) if b > a]
    found = al.summarize(chunks, rate=100.0)
    ours, theirs = found.reading(), whole.reading()
    assert np.array_equal(ours.samples, theirs.samples)
    assert np.array_equal(ours.octaves[0].power.value, theirs.octaves[0].power.value)


def test_a_piece_that_never_came_is_a_gap(record):
    pieces = [al.summarize(record[a : a + 50_000], rate=100.0, start=a) for a in (0, 100_000)]
    both = pieces[1].merge(pieces[0])
    assert len(both.stretches) == 2
    assert both.n == N
    assert both.missing == 50_001
    fit = al.parse_model("N+K").fit(both)
    # White noise of 1 at 100 Hz is N = 0.1; 1e5 samples know it to 0.22 %, and 4 of these are allowed.
    assert float(fit["N"]) == pytest.approx(0.1, rel=0.009)


def test_threads_change_no_bit(record, whole):
    # Three: also where there are fewer processors.
    for threads in (1, 3):
        found = summary_of_chunks(record, 100.0, "1", 0, None, None, threads)
        ours, theirs = found.stretches[0].state(), whole.stretches[0].state()
        assert pickle.dumps(ours) == pickle.dumps(theirs)
