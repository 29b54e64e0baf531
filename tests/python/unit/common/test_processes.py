"""Work in other processes: forked, spawned, sent there by pickle."""

import copy
import multiprocessing
import pickle
import sys

import numpy as np
import pytest

import allanite as al

X = np.random.default_rng(1).standard_normal(6000)


def names(seed):
    x = np.random.default_rng(seed).standard_normal(6000)
    check = al.fit_model(al.Recording(x, rate=100), "N+K").check()
    return [s.kind for s in check.suggestions], check.fit["N"].value


@pytest.mark.slow
@pytest.mark.timeout(120)
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
@pytest.mark.parametrize("method", ["fork", "spawn"])
def test_check_in_a_worker_after_the_parent_has_checked(method):
    if method not in multiprocessing.get_all_start_methods():
        pytest.skip(f"no {method} on {sys.platform}")
    here = names(2)
    with multiprocessing.get_context(method).Pool(1) as pool:
        assert pool.apply_async(names, (2,)).get(100) == here


@pytest.mark.parametrize("taus", ["octave", 3])
@pytest.mark.parametrize("n", [0, 1, 700, 5000])
def test_an_accumulator_goes_on_after_pickle(taus, n):
    whole = al.Accumulator(100.0, taus, start=64)
    whole.update(X[:n])
    other = pickle.loads(pickle.dumps(whole))
    assert repr(other) == repr(whole)
    for stretch in (whole, other):
        stretch.update(X[n:])
    assert np.array_equal(whole.oadev().deviation, other.oadev().deviation)
    later = al.Accumulator(100.0, taus, start=64 + X.size)
    later.update(X)
    merged = copy.copy(whole)
    merged.merge(pickle.loads(pickle.dumps(later)))
    whole.merge(later)
    assert np.array_equal(whole.oadev().deviation, merged.oadev().deviation)


def test_a_damaged_state_is_refused():
    core = al.Accumulator(1.0)._core
    start, samples, gaps, origin, levels = core.__getstate__()
    with pytest.raises(ValueError, match="damaged"):
        core.__setstate__((start, samples, gaps, origin, [(*levels[0][:4], [], [])]))
    with pytest.raises(ValueError, match="no level"):
        core.__setstate__((start, samples, gaps, origin, []))
