"""One record in pieces, and its independent repetitions."""

import numpy as np
import pytest

import allanite as al
from allanite.simulate import simulate, simulate_chunks

N = 20_000
TEMPERATURE = np.sin(np.arange(N) / 3000.0) * 5.0 + 20.0
MODELS = (
    "N(N=0.1)",
    "Q(Q=0.01)+N(N=0.1)+B(B=0.01)+K(K=0.001)+R(R=1e-5)",
    "N(N=0.1)+GM(T=30,q_c=2e-3)+SIN(f=7.3,amplitude=0.2,phase=0.3)+RTS(amplitude=0.1,dwell_time=2)",
    "N(N=0.1)+K(K=0.01)+STEP(time=61.3,height=0.5)+WARM(time_constant=40,amplitude=1)",
    "N(N=0.1)+B(B=0.01)+LEVEL(start=50,end=120,factor=3)",
    "N(N=0.1)+COV(column=temperature,coefficient=0.1,lag=5)",
    "R(R=1e-3)",
)


@pytest.mark.parametrize("size", [1_000, 4_096, 7_777, N, 10 * N])
@pytest.mark.parametrize("model", MODELS)
def test_pieces_are_the_record_bit_for_bit(model, size):
    columns = {"temperature": TEMPERATURE} if "COV" in model else None
    options = {
        "n": N,
        "rate": 100.0,
        "seed": 7,
        "unit": "deg/s",
        "covariates": columns,
        "replicate": 2,
    }
    whole = simulate(model, **options)
    pieces = list(simulate_chunks(model, size=size, **options))
    assert [p.n for p in pieces] == [size] * (N // size) + ([N % size] if N % size else [])
    np.testing.assert_array_equal(np.concatenate([p.samples for p in pieces]), whole.samples)
    assert {(p.rate, p.unit) for p in pieces} == {(100.0, "deg/s")}
    if columns:
        joined = np.concatenate([p.covariates["temperature"] for p in pieces])
        np.testing.assert_array_equal(joined, TEMPERATURE)


def test_models_effects_and_fits_have_them():
    effect = al.AngleRandomWalk(N=0.1)
    whole = effect.simulate(duration=50.0, rate=10.0, seed=3)
    for source in (effect, al.Model((effect,))):
        pieces = source.simulate_chunks(size=64, duration=50.0, rate=10.0, seed=3)
        np.testing.assert_array_equal(np.concatenate([p.samples for p in pieces]), whole.samples)
    fit = effect.fit(whole)
    pieces = list(fit.simulate_chunks(size=300, n=500, seed=1))
    expected = fit.simulate(n=500, seed=1).samples
    np.testing.assert_array_equal(np.concatenate([p.samples for p in pieces]), expected)


@pytest.mark.parametrize(
    "model", ["N(N=1)", "N(N=1)+GM(T=5,q_c=1)+LEVEL(start=50,end=120,factor=3)"]
)
def test_replicates_are_independent(model):
    rows = [simulate(model, n=4096, rate=1.0, seed=1, replicate=r).samples for r in range(3)]
    rows.append(simulate(model, n=4096, rate=1.0, seed=1, axis=1).samples)
    np.testing.assert_array_equal(rows[0], simulate(model, n=4096, rate=1.0, seed=1).samples)
    # White noise of 4096 samples: a correlation has a standard deviation of 1/64; slow parts widen it.
    spread = 5 / 64 if "GM" not in model else 0.5
    assert np.abs(np.corrcoef(rows) - np.eye(4)).max() < spread


def test_what_cannot_be_is_said_before_the_first_piece():
    effect = al.AngleRandomWalk(N=0.1)
    for size in (0, 1.5, -1):
        with pytest.raises(al.InputError, match="size = "):
            effect.simulate_chunks(size=size, n=5, rate=1.0)
    for replicate in (-1, 2**32, 0.5):
        with pytest.raises(al.InputError, match="replicate = "):
            effect.simulate(n=5, rate=1.0, replicate=replicate)


def test_a_record_larger_than_any_memory_begins_at_once():
    pieces = al.AngleRandomWalk(N=0.1).simulate_chunks(size=1000, n=2**52, rate=1e3)
    first = next(pieces).samples
    np.testing.assert_array_equal(
        first, al.AngleRandomWalk(N=0.1).simulate(n=1000, rate=1e3).samples
    )
