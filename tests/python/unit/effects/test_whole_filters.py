"""Filters of the whole signal: every term behind them against scipy's, simulated, as a state space, and found."""

import numpy as np
import pytest
from scipy import signal

import allanite as al
import generators as g

RATE = 100.0
N, B, K = 0.0126, 0.002, 9.07e-5
FILTERS = ["NOTCH(f=25,Q=5)", "NOTCH(f=3,Q=1,left=0.3)", "HP(f=0.1,order=1)", "HP(f=1,order=2)"]
LOW_PASSES = [
    f"BW(f={cutoff},order={order},design={design},acts_on=all)"
    for cutoff, order, design in [
        (5, 1, "sampled"),
        (20, 2, "sampled"),
        (20, 2, "digital"),
        (30, 4, "digital"),
        (10, 2, "cascaded"),
        (10, 3, "smoothed"),
    ]
]
SOURCES = [
    "N(N=1)",
    "Q(Q=1)",
    "B(B=1)",
    "K(K=1)",
    "GM(q_c=1,T=0.3)",
    "RES(f=20,damping=0.05,rms=1)",
    "PL(a=-0.5,level=1)",
    "PL(a=-2.6,level=1)",
    "PL(a=0.6,level=1)",
    "N(N=1)+BW(cutoff=20,order=2,design=sampled)",
    "N(N=1)+BW(cutoff=20,order=32,design=fir)",
    "N(N=1)+BW(cutoff=2,order=1,design=moving_average)",
]


def test_a_high_pass_near_half_of_the_nyquist_frequency_forgets_at_once():
    """Its pole is next to 0, and a power of it exceeds doubles; once half the difference behind a long filter remained."""
    model = al.parse_model("N(N=1)+BW(cutoff=20,order=64,design=fir)")
    whole = model + al.effects.HighPass(cutoff=RATE / 4.0 * (1.0 - 1e-5), order=1)
    f = np.linspace(1.0, 49.0, 97)
    difference = np.sin(np.pi * f / RATE) ** 2
    np.testing.assert_allclose(
        whole.psd(f, RATE), model.psd(f, RATE) * difference, rtol=1e-3, atol=1e-9
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "source"),
    [
        (name, source)
        for name in [*FILTERS, *LOW_PASSES]
        for source in SOURCES
        if not ("BW" in name and "BW" in source)  # a model has one
    ],
)
def test_the_spectrum_behind_a_filter(name, source):
    """|H|² of the declared difference equation times the spectrum before it: poles exact, cuts to 0.2 % of it."""
    before, behind = al.parse_model(source), al.parse_model(f"{source}+{name}")
    response = behind.filters[0].response(RATE)
    # What has no low frequencies has no digits there.
    f = np.geomspace(0.05 if source[0] == "Q" else 1e-3, 49.0, 1500)
    gain = np.abs(signal.freqz(response.b, response.a, worN=f, fs=RATE)[1]) ** 2
    found = behind.psd(f, RATE) / before.psd(f, RATE)
    cut = source[0] in "BP"
    np.testing.assert_allclose(found, gain, rtol=2e-3 if cut else 1e-4, atol=1e-3 if cut else 1e-8)


def test_the_filters_are_those_of_the_textbook():
    f = np.linspace(0.1, 49.0, 300)
    for frequency, quality in [(25.0, 5.0), (10.0, 1.3), (45.0, 8.0), (2.0, 30.0)]:
        b, a = signal.iirnotch(frequency, quality, fs=RATE)
        found = al.effects.Notch(frequency=frequency, quality=quality).response(RATE)
        expected = signal.freqz(b, a, worN=f, fs=RATE)[1]
        np.testing.assert_allclose(
            signal.freqz(found.b, found.a, worN=f, fs=RATE)[1], expected, atol=1e-9
        )
    for cutoff, order in [(0.05, 1), (3.0, 1), (0.2, 2), (24.0, 2)]:
        b, a = signal.butter(order, cutoff, "high", fs=RATE)
        found = al.effects.HighPass(cutoff=cutoff, order=order).response(RATE)
        expected = signal.freqz(b, a, worN=f, fs=RATE)[1]
        np.testing.assert_allclose(
            signal.freqz(found.b, found.a, worN=f, fs=RATE)[1], expected, atol=1e-9
        )


@pytest.mark.parametrize("name", LOW_PASSES)
def test_white_noise_behind_a_low_pass_of_all_is_that_behind_one_of_the_white_part(name):
    f = np.geomspace(0.01, 49.0, 60)
    one = al.parse_model(f"N(N=1)+{name.replace('all', 'white')}").psd(f, RATE)
    np.testing.assert_allclose(
        al.parse_model(f"N(N=1)+{name}").psd(f, RATE), one, rtol=2e-3, atol=1e-6
    )


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("BW(f=20,design=fir,order=16,acts_on=all)", "can filter only the white noise"),
        ("BW(f=20,floor=0.1,acts_on=all)", "a floor needs acts_on=white"),
        ("BW(f=20,acts_on=some)", "known: white, all"),
    ],
)
def test_a_low_pass_of_all_that_is_none_is_refused(name, said):
    with pytest.raises(al.InputError, match=said):
        al.parse_model(f"N(N=1)+{name}")


@pytest.mark.slow
@pytest.mark.parametrize(("order", "cutoff"), [(1, 20.0), (2, 20.0), (4, 30.0)])
def test_a_low_pass_behind_the_sensor_leaves_b_what_it_is(order, cutoff):
    """Flicker with a corner at 0.1 Hz passes it like white noise; B was once "not detected (< 0.00027)", or a lag."""
    rng, n, flicker = np.random.default_rng(11), 120_000, 0.01
    x = g.white(rng, n, RATE, N) + g.flicker(rng, n, RATE, flicker)
    b, a = signal.butter(order, cutoff, fs=RATE)
    record = al.Recording(signal.lfilter(b, a, x)[2000:], rate=RATE, unit="rad/s")
    study = al.improve(record, "N+B+K")
    assert [rung.added.kind for rung in study.ladder[1:]] == ["bandwidth"], study
    assert study.fit.estimates[-1]["acts_on"] == "all"
    assert study.fit["BW.cutoff"].value == pytest.approx(cutoff, rel=0.01)
    assert study.fit["N"].value == pytest.approx(N, rel=0.02)
    low, high = study.fit["B"].interval
    assert low < flicker < high
    assert study.adequate, study


@pytest.mark.long
def test_a_lag_takes_no_place_because_chance_bends_the_allan_curve():
    """Its logL is hardly better, and its curve is closer only by chance; once it replaced B."""
    rng, n = np.random.default_rng(3), 64_000
    flicker = N * np.sqrt(2.0 * np.pi * 0.05)
    x = g.white(rng, n, RATE, N) + g.flicker(rng, n, RATE, flicker) + g.walk(rng, n, RATE, K)
    filtered = signal.lfilter(*signal.butter(2, 20.0, fs=RATE), x)[4000:]
    study = al.improve(al.Recording(filtered, rate=RATE, unit="rad/s"), "N+B+K")
    assert study.fit.model.name == "N+B+K+BW", study
    assert study.adequate, study


def test_a_filter_of_which_nothing_tells_what_it_acts_on_is_one_of_the_white_part():
    rng = np.random.default_rng(12)
    b, a = signal.butter(2, 20.0, fs=RATE)
    x = signal.lfilter(b, a, g.white(rng, 62_000, RATE, N))[2000:]
    fit = al.fit_model(al.Recording(x, rate=RATE, unit="rad/s"), "N+BW")
    assert fit.estimates[-1]["acts_on"] is None


def test_a_random_walk_behind_a_high_pass_is_a_lag():
    tau = np.geomspace(0.01, 100.0, 20)
    walk = al.parse_model("K(K=0.3)+HP(f=0.1,order=1)").allan_variance(tau, RATE)
    time = 1.0 / (2.0 * np.pi * 0.1)
    lag = al.GaussMarkov(q_c=0.3, correlation_time=time).allan_variance(tau, RATE)
    np.testing.assert_allclose(walk, lag, rtol=5e-3)


def test_pieces_of_a_filtered_record_are_the_record():
    model = al.parse_model("N(N=0.1)+B(B=0.02)+HP(f=0.5,order=2)+NOTCH(f=20,Q=3)+SIN(f=7,A=0.1)")
    whole = model.simulate(n=5000, rate=RATE, seed=3)
    parts = model.simulate_chunks(n=5000, rate=RATE, seed=3, size=777)
    np.testing.assert_array_equal(np.concatenate([p.samples for p in parts]), whole.samples)
    # Begun before the record, and so steady from its first sample on.
    starts = [model.simulate(n=40, rate=RATE, seed=s).samples for s in range(300)]
    assert np.std(np.array(starts)[:, :5]) == pytest.approx(np.std(whole.samples), rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["HP(f=0.5,order=1)", "HP(f=0.5,order=2)", "NOTCH(f=20,Q=3)", LOW_PASSES[2]]
)
def test_the_state_space_of_what_is_filtered(name):
    """It has the density of the model, and white innovations of the stated variance."""
    model = al.parse_model(f"N(N=0.1)+B(B=0.02)+K(K=0.02)+{name}+SIN(f=7,A=0.1)")
    space = model.state_space(RATE, duration=200.0)
    F, H, Q, R = space.F, space.H[0], space.Q, float(space.R[0, 0])
    f = np.array([0.05, 0.4, 3.0, 19.0, 21.0, 40.0])
    lines = np.isclose(np.abs(np.linalg.eigvals(F)), 1.0).sum()
    assert lines >= 2
    expected = al.parse_model(f"N(N=0.1)+B(B=0.02)+K(K=0.02)+{name}").psd(f, RATE)
    found = []
    for z in np.exp(2j * np.pi * f / RATE):
        through = np.linalg.solve((z * np.eye(H.size) - F).T, H)
        found.append((through @ Q @ through.conj()).real + R)
    np.testing.assert_allclose(np.array(found) / RATE, expected, rtol=3e-3)
    told = al.innovations(model.simulate(n=20_000, rate=RATE, seed=5), model)
    assert abs(told.mean_nis - 1.0) < 5.0 * np.sqrt(2.0 / told.n)
    assert told.whiteness > 1e-3
    assert model.state_space(RATE, states=12).states <= 12


def _behind(seed, b, a, *, count=60_000, settled=20_000):
    """N+B+K behind a filter, by generators independent of the package."""
    rng, n = np.random.default_rng(seed), count + settled
    x = g.white(rng, n, RATE, N) + g.flicker(rng, n, RATE, B) + g.walk(rng, n, RATE, K)
    return al.Recording(signal.lfilter(b, a, x - x[0])[settled:], rate=RATE, unit="rad/s")


@pytest.mark.long
def test_a_hidden_notch_is_named_first():
    study = al.improve(_behind(1, *signal.iirnotch(25.0, 5.0, fs=RATE)), "N+B+K")
    first = study.ladder[1].added
    assert first.kind == "notch", study
    assert first.frequency == pytest.approx(25.0, abs=0.05)
    assert first.quality == pytest.approx(5.0, rel=0.05)
    assert study.fit["N"].value == pytest.approx(N, rel=0.02)
    assert study.adequate, study


@pytest.mark.slow
def test_a_hidden_high_pass_is_named_first():
    study = al.improve(_behind(2, *signal.butter(1, 0.2, "high", fs=RATE)), "N+B+K")
    first = study.ladder[1].added
    assert (first.kind, first.order) == ("high_pass", 1.0), study
    assert first.cutoff == pytest.approx(0.2, rel=0.3)
    assert study.fit["N"].value == pytest.approx(N, rel=0.02)


def test_no_drift_is_looked_for_behind_a_high_pass():
    """In three of four, the ends of such a record were once an excursion or a step."""
    x = _behind(5, *signal.butter(2, 0.1, "high", fs=RATE))
    check = al.fit_model(x, "N+B+K+HP(f=0.1,order=2)").check()
    assert check.suggestions
    kinds = {s.kind for s in check.suggestions}
    assert not kinds & {"bias_step", "excursion", "transient", "rate_ramp", "warm_up"}
    assert not check.significant


def test_no_drift_takes_the_place_of_a_process_behind_a_high_pass():
    rng = np.random.default_rng(8)
    x = g.white(rng, 60_000, RATE, N) + g.walk(rng, 60_000, RATE, 5e-3)
    b, a = signal.butter(1, 0.1, "high", fs=RATE)
    recording = al.Recording(signal.lfilter(b, a, x)[10_000:], rate=RATE, unit="rad/s")
    fit = al.fit_model(recording, "N+K+HP(order=1)")
    drifts = {e.kind for e in al.CATALOG if e.screened == "slow"}
    assert not drifts & {a.effect.kind for a in fit.alternatives(1)}
    assert not drifts & {kind for pair in fit.alternative_pairs(1) for kind in pair.kinds}


@pytest.mark.slow
def test_a_lag_is_no_high_pass():
    """K behind a high-pass has the spectrum of a lag; if nothing falls below N, it is called a lag."""
    rng = np.random.default_rng(3)
    x = g.white(rng, 60_000, RATE, N) + g.gauss_markov(rng, 60_000, RATE, 6e-3, 5.0)
    check = al.fit_model(al.Recording(x, rate=RATE, unit="rad/s"), "N+K").check()
    kinds = [s.kind for s in check.suggestions]
    assert "gauss_markov" in kinds
    assert "high_pass" not in kinds


@pytest.mark.slow
def test_a_notch_that_leaves_nothing_is_where_it_is():
    """With one shape at the end of its range, a second search of the others was 1500 of logL lower, in 5 of 12 records."""
    rng = np.random.default_rng(3)
    n = 80_000
    x = g.white(rng, n, RATE, N) + g.flicker(rng, n, RATE, B) + g.walk(rng, n, RATE, K)
    b, a = signal.iirnotch(25.0, 5.0, fs=RATE)
    log = al.Recording(signal.lfilter(b, a, x - x[0])[20_000:], rate=RATE, unit="rad/s")
    fit = al.fit_model(log, "N+B+K+NOTCH")
    assert fit["NOTCH.frequency"].value == pytest.approx(25.0, rel=2e-3)
    assert fit["NOTCH.quality"].value == pytest.approx(5.0, rel=0.05)
    assert fit.model.effects[-1].at_limit == ("left",)
