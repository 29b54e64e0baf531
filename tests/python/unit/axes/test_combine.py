"""Several sensors as one: weights, gains, shared noise, the unit that deviates, and bad input."""

import numpy as np
import pytest

import allanite as al
from allanite.combination.combine import units_of
from documents import valid

RATE, N, K = 20.0, 0.01, 1e-4


def noise(rng, n=N, k=K, length=20_000):
    white = rng.normal(0.0, n * np.sqrt(RATE), length)
    return white + np.cumsum(rng.normal(0.0, k / np.sqrt(RATE), length))


def board(*units, names=None):
    names = names or [f"gyro{k}_x" for k in range(len(units))]
    return al.Recording(np.column_stack(units), rate=RATE, unit="deg/s", columns=names)


def test_equal_units_gain_the_root_of_their_number():
    rng = np.random.default_rng(1)
    found = al.combine(board(*(noise(rng) for _ in range(4))), "N+K")
    # N of each is known to 1/√(2·20000) = 0.5 %, a weight to 1.1 % of itself; 4 σ.
    assert found.weights == pytest.approx(np.full(4, 0.25), rel=0.05)
    assert found.gain[:4] == pytest.approx(2.0, rel=0.02)
    assert found.measured[:4] == pytest.approx(found.combined[:4], rel=0.03)
    assert not found.shared
    assert not found.deviating
    # White noise of a mean of four in R, a random walk in Q.
    space = found.state_space()
    assert space.R.item() == pytest.approx(N**2 * RATE / 4.0, rel=0.05)
    document = valid(found.to_dict())
    assert document["state_space"]["R"] == space.R.tolist()


def test_shared_noise_lowers_the_weights_of_those_that_share_it():
    rng = np.random.default_rng(2)
    common = noise(rng)
    units = [noise(rng) + common, noise(rng) + common, noise(rng), noise(rng)]
    found = al.combine(board(*units), "N+K")
    # Two of variance 2 and correlation ½ are one of variance 3/2: weights 1/8, 1/8, 3/8, 3/8 and a gain of √(8/3).
    assert found.weights == pytest.approx([0.125, 0.125, 0.375, 0.375], abs=0.012)
    assert found.gain[:4] == pytest.approx(np.sqrt(8.0 / 3.0), rel=0.03)
    assert [one.pair for one in found.shared] == [(0, 1)]
    assert found.measured[:4] == pytest.approx(found.combined[:4], rel=0.03)


def test_boards_are_independent_and_may_have_other_rates():
    rng = np.random.default_rng(3)
    slow = al.Recording(
        rng.normal(0.0, 2 * N * np.sqrt(5.0), 5000), rate=5, unit="deg/s", columns=["gyro_x"]
    )
    fast = al.Recording(
        rng.normal(0.0, N * np.sqrt(RATE), 20_000), rate=RATE, unit="deg/s", columns=["gyro_x"]
    )
    found = al.combine([slow, fast], "N")
    assert found.weights == pytest.approx([0.2, 0.8], abs=0.02)
    assert found.rate == 5.0
    assert found.measured is None
    assert found.gain == pytest.approx(np.sqrt(1.25), rel=0.03)
    assert "needs three or more units" in str(found)


def test_weights_for_one_averaging_time():
    """One unit is white, the other wanders: short and long times have other weights."""
    rng = np.random.default_rng(4)
    units = noise(rng, N, 1e-3), noise(rng, 3 * N, 1e-5)
    short = al.combine(board(*units), "N+K", tau=0.1).weights
    long = al.combine(board(*units), "N+K", tau=300.0).weights
    assert short == pytest.approx([0.9, 0.1], abs=0.02)
    assert long[1] > 0.8


def test_the_unit_that_deviates_is_named():
    rng = np.random.default_rng(5)
    units = [noise(rng) for _ in range(3)]
    assert not al.combine(board(*units), "N+K").deviating
    found = al.combine(board(units[0], 2.0 * units[1], units[2]), "N+K")
    assert [one.unit for one in found.deviating] == ["gyro1_x"]
    assert found.deviating[0].factor == pytest.approx(2.0, rel=0.1)
    assert "gyro1_x deviates from the others" in str(found)


@pytest.mark.slow
def test_a_unit_with_more_slow_noise_is_named():
    """Five times the K in an hour: expected ΔlogL 139 over the noise of the others (benches/claims/combination.py)."""
    for seed in range(3):
        rng = np.random.default_rng([seed, 12])
        units = [noise(rng, N, 5.0 * K if k == 1 else K, 72_000) for k in range(5)]
        names = [one.unit for one in al.combine(board(*units), "N+K").deviating]
        assert names == ["gyro1_x"]


def test_units_are_grouped_by_names_that_differ_in_a_number():
    rng = np.random.default_rng(6)
    x = rng.normal(size=(200, 4))
    log = al.Recording(
        x, rate=1, unit="deg/s", columns=["imu0_gx", "imu1_gx", "imu0_gy", "imu1_gy"]
    )
    groups = units_of([log])
    assert [[c for one in g for c in one.columns] for g in groups.values()] == [
        ["imu0_gx", "imu1_gx"],
        ["imu0_gy", "imu1_gy"],
    ]
    one_board = al.Recording(x[:, :2], rate=1, unit="deg/s", columns=["left", "right"])
    with pytest.raises(al.InputError, match="no axis has two units"):
        units_of([one_board])
    assert list(units_of([one_board], named=True)) == ["left"]


@pytest.mark.parametrize(
    ("recordings", "model", "said"),
    [
        (lambda x: [al.Recording(x[:, 0], rate=1)], "N", "two or more units"),
        (
            lambda x: [al.Recording(x, rate=1, unit=["deg/s", "m/s^2"])],
            "N",
            "choose columns of one axis",
        ),
        (lambda x: [al.Recording(x, rate=1)], "N+SIN", "remove the others"),
    ],
)
def test_bad_input_is_one_line(recordings, model, said):
    x = np.random.default_rng(7).normal(size=(200, 2))
    with pytest.raises(al.InputError, match=said):
        al.combine(recordings(x), model)


@pytest.mark.statistical
def test_healthy_units_are_not_named_and_a_deviating_one_is():
    """Spread of 5 %. With a rate of 1 %, two of 24 healthy units are named with 2.4 %. All four deviating ones are."""
    healthy, named = 0, 0
    for seed in range(6):
        rng = np.random.default_rng([seed, 11])
        sizes = np.exp(rng.normal(0.0, 0.05, (4, 2)))
        units = [noise(rng, N * a, K * b) for a, b in sizes]
        healthy += len(al.combine(board(*units), "N+K").deviating)
        if seed < 4:
            units[seed] = 2.0 * units[seed]
            names = [one.unit for one in al.combine(board(*units), "N+K").deviating]
            named += names == [f"gyro{seed}_x"]
    assert healthy <= 1
    assert named >= 3
