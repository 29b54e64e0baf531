"""Error since the last fix: closed forms, simulation, and a recording's own segments."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import allanite as al
from allanite.statespace.coasting import Coasting, Sums, integration_weights

RATE = 50.0


def angle(text, **options):
    options = {"unit": "rad/s", "rate": RATE, "aided": 10.0, **options}
    return al.error_growth(al.parse_model(text), **options)[0]


def test_closed_forms():
    tau = np.array([1.0, 10.0, 60.0])
    # N²t + N²t²/a.
    np.testing.assert_allclose(
        angle("N(N=0.01)", tau=tau).total, 0.01 * np.sqrt(tau + tau**2 / 10), rtol=1e-9
    )
    # A ramp: the mean of the ramp over the aiding lies a/2 back (half a sample apart in discrete time).
    ramp = angle("N(N=1e-9)+R(R=0.1)", tau=tau).budget["R"]
    np.testing.assert_allclose(ramp, 0.1 * (tau**2 / 2 + tau * 10 / 2), rtol=1e-3)
    # K² (t³/3 + t² a/3) of a random walk.
    walk = angle("K(K=0.1)", tau=tau).total
    np.testing.assert_allclose(walk, 0.1 * np.sqrt(tau**3 / 3 + tau**2 * 10 / 3), rtol=3e-3)


@pytest.mark.parametrize(
    "text", ["B(B=0.01)", "GM(q_c=0.1,T=3)", "N(N=1)+B(B=0.1)+K(K=0.01)", "Q(Q=1)"]
)
def test_at_the_time_of_aiding_it_is_the_allan_deviation(text):
    found = angle(text, tau=[10.0]).total[0]
    assert found == pytest.approx(
        np.sqrt(2.0) * 10.0 * np.sqrt(al.parse_model(text).allan_variance(10.0, RATE)), rel=1e-6
    )


def test_hours_are_exact_at_once_and_at_the_end():
    # 1.8 million samples: a sample after hours of aiding as well as hours later.
    model = al.parse_model("N(N=0.1)+B(B=0.01)+K(K=1e-3)+GM(q_c=0.01,T=5)")
    tau = np.array([0.02, 0.1, 18_000.0])
    found = al.error_growth(model, aided=18_000.0, unit="rad/s", rate=RATE, tau=tau)[0]
    expected = np.sqrt(2.0) * 18_000.0 * np.sqrt(model.allan_variance(18_000.0, RATE))
    assert found.total[-1] == pytest.approx(expected, rel=1e-9)
    np.testing.assert_allclose(
        found.budget["N"], 0.1 * np.sqrt(tau * (1.0 + tau / 18_000.0)), rtol=1e-9
    )


@settings(max_examples=60, deadline=None)
@given(
    st.integers(1, 40), st.integers(1, 40), st.sampled_from([1, 2, 3]), st.integers(0, 2**31),
    st.floats(0.0, 6.3),
)  # fmt: skip
def test_sums_are_those_of_every_pair(back, m, order, seed, angle):
    g = np.concatenate([[0.0], np.random.default_rng(seed).random(back + m).cumsum()])
    coasting = Coasting(back, m, RATE, order)
    r = integration_weights(m, RATE, order)
    w = np.concatenate([np.full(back, -r.sum() / back), r])
    k = np.arange(w.size)
    variance = -(w[:, None] * w * g[np.abs(k[:, None] - k)]).sum()
    size = np.abs(w).sum() ** 2 * g[-1]
    assert coasting.deviation(Sums(g)) ** 2 == pytest.approx(variance, rel=1e-9, abs=1e-12 * size)
    turn = abs(w @ np.exp(1j * angle * k))
    assert coasting.line_error(angle) == pytest.approx(turn, abs=1e-12 * np.abs(w).sum() * w.size)


def test_fast_lines_are_not_taken_for_slow_ones():
    # n samples of a line add up to A/|sin(πf/rate)| at most; those of the aiding count t/aided times.
    tau = np.array([0.3, 100.0, 300.0])
    for frequency in (50.0, 142.86, 499.0):
        growth = al.error_growth(
            al.parse_model(f"N(N=1e-9)+SIN(f={frequency},A=0.01)"),
            aided=10.0, unit="rad/s", rate=1000.0, tau=tau,
        )[0]  # fmt: skip
        most = 0.01 / np.sqrt(2.0) / 1000.0 / np.sin(np.pi * frequency / 1000.0) * (1 + tau / 10)
        assert (growth.budget["SIN"] <= most).all()


def test_a_changing_level_is_averaged_over_the_record_or_left_out():
    model = al.parse_model("N(N=0.02)+CYCLE(period=10,start=1,share=0.3,factor=2)")
    tau = [1.0, 10.0]
    alone = al.error_growth(model, aided=7.0, unit="rad/s", rate=10.0, tau=tau)[0]
    assert alone.left_out == ("periodic_noise_level",)
    log = model.simulate(duration=20_000, rate=10.0, seed=3, unit="rad/s")
    growth = al.error_growth(model, aided=7.0, unit="rad/s", rate=10.0, tau=tau, duration=20_000)[0]
    assert growth.left_out == ()
    np.testing.assert_allclose(growth.total / alone.total, np.sqrt(1.9), rtol=1e-3)
    # 1000 segments, of which some have more loud samples than others: √(1/2000) = 2.2 %, and as much again.
    np.testing.assert_allclose(al.measured_growth(log, growth).rms, growth.total, rtol=4 * 0.032)


def test_budget_adds_in_squares_and_names_what_is_left_out():
    growth = al.error_growth(
        al.parse_model("N(N=0.1)+B(B=0.01)+SIN(f=0.1,A=0.01)+STEP(t=5,h=1)"),
        aided=10.0, unit="mg", rate=RATE,
    )  # fmt: skip
    assert [g.quantity for g in growth] == ["velocity", "position"]
    for g in growth:
        np.testing.assert_allclose(g.total**2, sum(v**2 for v in g.budget.values()))
        assert g.left_out == ("bias_step",)
    # A line of amplitude A, seen for long: its angle stays within A/(2πf), its mean over whole periods is 0.
    line = growth[0].budget["SIN"]
    assert line.max() < 0.01 * 9.80665e-3 / (2 * np.pi * 0.1) * np.sqrt(2.0) * 1.01


def test_what_follows_a_column_is_left_out_for_that_reason():
    text = "N(N=1)+STEP(t=5,h=1)+COV(column=temp,coefficient=1)+NCOL(column=temp,coefficient=0.1,reference=20)"
    growth = angle(text, tau=[1.0])
    steps, columns = growth.table().splitlines()[-2:]
    assert steps == "not predicted, it happens at times of its own: bias_step"
    assert columns == (
        "not predicted, they follow columns whose future is not known: covariate, noise_of_column"
    )
    seen = al.measured_growth(
        al.parse_model("N(N=1)").simulate(n=600, rate=RATE, unit="rad/s"), growth
    )
    lines = growth.table(seen).splitlines()
    assert lines[-3].split()[-1] == "1"
    assert lines[-2].endswith("bias_step (measured with it)")
    assert lines[-1].endswith("noise_of_column (measured with them)")


@pytest.mark.parametrize("quantity", [0, 1, 2])
def test_simulation_agrees(quantity):
    model = al.parse_model("Q(Q=1e-4)+N(N=0.01)+B(B=0.02)+K(K=2e-3)+GM(q_c=0.02,T=2)+R(R=1e-3)")
    growth = al.error_growth(model, aided=5.0, unit="deg/s", rate=RATE, tau=[0.1, 2.0, 20.0])[
        quantity
    ]
    recording = model.simulate(n=1250 * 400, rate=RATE, seed=4, unit="deg/s")
    found = al.measured_growth(recording, growth)
    # The shorter the coasting, the more segments: of 5.1, 7 and 25 s.
    assert found.segments.tolist() == [1960, 1428, 400]
    # Nearly independent: 400 tell the root mean square to 1/√800 = 3.5 %, and the share inside to 1.1 %.
    error = 1 / np.sqrt(2 * found.segments)
    assert (np.abs(found.rms / growth.total - 1) < 4 * error).all()
    assert (np.abs(found.inside - 0.95) < 4 * np.sqrt(0.0475 / found.segments)).all()


def test_a_clock_and_a_fit():
    assert angle("N(N=1e-9)", unit="1").quantity == "phase"
    recording = al.parse_model("N(N=0.1)+B(B=0.01)").simulate(
        n=20_000, rate=10.0, seed=1, unit="mg"
    )
    fit = al.parse_model("N+B").fit(recording)
    growth = al.error_growth(fit, aided=10.0)
    assert [g.unit for g in growth] == ["m/s", "m"]
    document = growth[0].to_dict()
    assert set(document["budget"]) == {"N", "B"}
    assert al.measured_growth(recording, growth[0]).to_dict()["segments"][-1] == 18


def test_refusals():
    with pytest.raises(al.InputError, match="unit and the rate"):
        al.error_growth(al.parse_model("N(N=1)"), aided=10.0)
    with pytest.raises(al.InputError, match="aided"):
        angle("N(N=1)", aided=0.0)
    with pytest.raises(al.InputError, match="tau"):
        angle("N(N=1)", tau=[-1.0])
    with pytest.raises(al.InputError, match="more than"):
        angle("N(N=1)", tau=[1e9])
    with pytest.raises(al.InputError, match="no value"):
        angle("N")
    short = al.parse_model("N(N=1)").simulate(n=100, rate=RATE, seed=1, unit="rad/s")
    with pytest.raises(al.TooShortError, match="no segment"):
        al.measured_growth(short, angle("N(N=1)"))


def test_a_record_that_is_short_for_the_longest_time_is_measured_at_the_others():
    recording = al.parse_model("N(N=0.01)").simulate(n=1200, rate=10.0, seed=1, unit="deg/s")
    growth = al.error_growth(
        al.parse_model("N(N=0.01)"), aided=10.0, tau=[1.0, 500.0], unit="deg/s", rate=10.0
    )[0]
    found = al.measured_growth(recording, growth)
    assert found.segments.tolist() == [10, 0]
    assert np.isnan(found.rms[1])
    assert found.to_dict()["rms"][1] is None
    assert "nan" in growth.table(found)
    growth = al.error_growth(
        al.parse_model("N(N=0.01)"), aided=200.0, tau=[1.0], unit="deg/s", rate=10.0
    )[0]
    with pytest.raises(al.TooShortError, match="no segment of 201 s"):
        al.measured_growth(recording, growth)


def test_sensors_without_such_an_error_are_refused():
    noise = al.parse_model("N(N=0.01)")
    with pytest.raises(al.InputError, match="samples in uT are a magnetic field"):
        al.error_growth(noise, aided=10.0, unit="uT", rate=10.0)
    velocity = al.error_growth(noise, aided=10.0, tau=[1.0], unit="m/s^2", rate=10.0)[0]
    gyroscope = noise.simulate(n=1200, rate=10.0, seed=1, unit="deg/s")
    with pytest.raises(al.InputError, match="samples in deg/s have no error of velocity"):
        al.measured_growth(gyroscope, velocity)
