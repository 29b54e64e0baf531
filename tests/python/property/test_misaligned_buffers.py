"""Results that crossed to another process work the same when their buffers begin at an odd address."""

import itertools
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import allanite as al
from allanite.summary import level, reading, summary

N = 500_000


@pytest.fixture(autouse=True, scope="module")
def small():
    """Levels keep fewer samples, so that a short record has several."""
    with pytest.MonkeyPatch.context() as patch:
        for module in (level, reading, summary):
            patch.setattr(module, "MAX_KEPT_SAMPLES", 1 << 17)
        yield


@pytest.fixture(scope="module")
def record():
    return np.random.default_rng(5).standard_normal(N)


def received(sent, shift=1, *, read_only=False):
    """`sent` after out-of-band pickling, every buffer `shift` bytes after an address that 64 divides."""
    buffers = []
    pickled = pickle.dumps(sent, protocol=5, buffer_callback=buffers.append)
    arrived = []
    for buffer in buffers:
        raw = buffer.raw()
        memory = np.empty(raw.nbytes + 128, np.uint8)
        first = -memory.ctypes.data % 64 + shift
        place = memoryview(memory)[first : first + raw.nbytes]
        place[:] = raw
        arrived.append(place.toreadonly() if read_only or raw.readonly else place)
    return pickle.loads(pickled, buffers=arrived)


def bits(value):
    """The same object with every array as its bytes."""
    if isinstance(value, np.ndarray):
        return value.tobytes()
    if isinstance(value, dict):
        return {key: bits(inside) for key, inside in value.items()}
    return [bits(inside) for inside in value] if isinstance(value, (list, tuple)) else value


def state(one):
    return bits([stretch.state() for stretch in one.stretches])


@pytest.mark.slow
@settings(max_examples=6)
@given(
    cuts=st.lists(st.integers(1, N - 1), min_size=3, max_size=5, unique=True),
    shift=st.integers(1, 7),
    read_only=st.booleans(),
    seed=st.integers(0, 2**32 - 1),
)
def test_summaries_from_other_processes_merge_to_the_same_bits(
    record, cuts, shift, read_only, seed
):
    edges = [0, *sorted(cuts), N]
    pieces = [al.summarize(record[a:b], rate=10.0, start=a) for a, b in itertools.pairwise(edges)]
    found, expected = list(pieces), list(pieces)
    rng = np.random.default_rng(seed)
    while len(found) > 1:
        i, j = rng.permutation(len(found))[:2]
        for several, receive in ((found, received), (expected, lambda one, *_, **__: one)):
            one, other = (receive(several[k], shift, read_only=read_only) for k in (int(i), int(j)))
            several[:] = [s for k, s in enumerate(several) if k not in (i, j)] + [one.merge(other)]
    assert state(found[0]) == state(expected[0])


@pytest.mark.parametrize("read_only", [False, True])
def test_an_accumulator_goes_on_where_it_was(record, read_only):
    whole = al.Accumulator(rate=10.0)
    whole.update(record[:5000])
    part = received(whole, read_only=read_only)
    for one in (whole, part):
        one.update(record[5000:9000])
    assert np.array_equal(part.oadev().deviation, whole.oadev().deviation)


@pytest.mark.slow
def test_recordings_and_fits_compute_the_same(record):
    temperature = np.linspace(20.0, 30.0, 200)
    sent = al.Recording(
        record[:200].reshape(-1, 1), 10.0, columns=["gx"], covariates={"temp": temperature}
    )
    found = received(sent, read_only=True)
    assert not found.samples.flags.writeable
    assert np.array_equal(found.oadev().deviation, sent.oadev().deviation)
    model = al.parse_model("N")
    fit = model.fit(sent)
    assert model.fit(found).to_dict() == fit.to_dict()
    # A fit keeps intermediate results that a pickle leaves out: rounding may differ from the fit that was sent.
    plain = pickle.loads(pickle.dumps(fit))
    assert received(fit, read_only=True).check().to_dict() == plain.check().to_dict()
    assert np.array_equal(received(sent.psd()).density, sent.psd().density)
