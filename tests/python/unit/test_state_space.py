"""State space of a model: the same spectrum, the same Allan variance, the exact likelihood; reduced within a per cent."""

import numpy as np
import pytest
from scipy.linalg import cho_factor, cho_solve, toeplitz

import allanite as al
from allanite.statespace import smooth_samples, state_space

RATE = 100.0
EVERY = [
    "N(N=0.1)",
    "Q(Q=1e-3)+N(N=1e-2)",
    "B(B=0.02)+N(N=0.01)",
    "K(K=0.01)+N(N=0.01)",
    "GM(q_c=0.2,T=0.3)+N(N=0.01)",
    "RES(f=7.3,zeta=0.05,rms=0.4)+N(N=0.01)",
    "RES(f=0.002,zeta=0.01,rms=0.4)+N(N=0.01)",
    "N(N=0.1)+BW(cutoff=20,order=2,design=digital)",
    "N(N=0.1)+BW(cutoff=7,order=1,design=digital)",
    "N(N=0.1)+BW(cutoff=12,order=2,design=sampled)",
    "N(N=0.1)+BW(cutoff=12,order=1,design=sampled)",
    "N(N=0.1)+BW(cutoff=9,design=moving_average)",
    "PL(a=-1.5,level=0.02)+N(N=0.01)",
    "PL(a=-2.5,level=0.02)+N(N=0.01)",
    "PL(a=0.5,level=0.02)+N(N=0.01)",
    "RTS(A=0.2,D=3)+N(N=0.01)",
]


def density(space, f):
    """H (zI − F)⁻¹ Q (…)ᴴ Hᵀ + R from the matrices alone."""
    out = []
    for w in 2 * np.pi * f / space.rate:
        gain = np.linalg.solve(
            np.exp(1j * w) * np.eye(space.states) - space.F, np.eye(space.states)
        )
        row = space.H @ gain
        out.append((row @ space.Q @ row.conj().T + space.R)[0, 0].real / space.rate)
    return np.array(out)


@pytest.mark.parametrize("text", EVERY)
def test_matrices_have_the_spectrum_and_the_allan_variance(text):
    model = al.parse_model(text)
    space = model.state_space(RATE, duration=1000.0)
    f = np.geomspace(1e-3, 49.9, 40)
    expected = model.psd(f, RATE)
    # The bank of lags of flicker and power laws has a ripple of 0.1 %; everything else is exact except for rounding. Where
    # a filter lowers the density by eleven decades, rounding of the largest density remains: 500 ε = 1e-13.
    np.testing.assert_allclose(density(space, f), expected, rtol=2e-3, atol=1e-13 * expected.max())
    tau = np.array([0.01, 0.02, 0.07, 1.0, 10.0, 100.0])
    np.testing.assert_allclose(
        space.allan_variance(tau), model.allan_variance(tau, RATE), rtol=2e-3
    )
    assert space.cost.allan_error < 1e-3
    if not space.states:
        return
    P = space.P0
    assert np.linalg.eigvalsh(P).min() > -1e-9 * np.abs(P).max()
    assert np.linalg.eigvalsh(space.Q).min() > -1e-12 * np.abs(space.Q).max()
    stationary = ~space.diffuse
    if not space.diffuse.any():
        np.testing.assert_allclose(
            (space.F @ P @ space.F.T + space.Q)[np.ix_(stationary, stationary)],
            P[np.ix_(stationary, stationary)],
            atol=1e-6 * np.abs(P).max(),
        )


def test_a_line_is_an_undamped_pair():
    model = al.parse_model("N(N=0.1)+SIN(f=7.3,A=0.5,phase=1)")
    space = model.state_space(RATE)
    assert space.labels == ("SIN", "SIN")
    np.testing.assert_allclose(np.abs(np.linalg.eigvals(space.F)), 1.0)
    np.testing.assert_allclose(np.diag(space.P0), 0.125)
    tau = np.array([0.01, 0.05, 1.0])
    np.testing.assert_allclose(
        space.allan_variance(tau), model.allan_variance(tau, RATE), rtol=1e-9
    )


def exact_log_likelihood(x, model):
    """Of the differences of the samples, whose covariance is Toeplitz."""
    g = sum(t.variogram(x.size + 1) for t in model.terms(RATE))
    r = np.concatenate([[2 * g[1]], g[2:-1] + g[:-3] - 2 * g[1:-2]])
    d = np.diff(x)
    factor = cho_factor(toeplitz(r[: d.size]))
    quadratic = d @ cho_solve(factor, d)
    return -0.5 * (quadratic + d.size * np.log(2 * np.pi)) - np.log(np.diag(factor[0])).sum()


@pytest.mark.parametrize(
    "text",
    [
        "N(N=0.1)+B(B=0.02)+K(K=0.05)",
        "Q(Q=1e-3)+N(N=0.01)+GM(q_c=0.2,T=0.3)",
        "N(N=0.1)+BW(cutoff=20,order=2,design=digital)+B(B=0.1)",
        "B(B=0.2)+PL(a=-1.5,level=0.02)",
        "N(N=0.1)+RES(f=7.3,zeta=0.05,rms=0.4)",
    ],
)
def test_log_likelihood_is_the_exact_one(text):
    model = al.parse_model(text)
    recording = model.simulate(n=1200, rate=RATE, seed=3, unit="rad/s")
    exact = exact_log_likelihood(recording.samples, model)
    found = al.innovations(recording, model)
    assert found.n == 1199
    assert abs(found.log_likelihood - exact) / 1199 < 1e-3
    assert np.isnan(found.nis[0])
    # A mean of 1199 χ²/1: within four standard errors of 1.
    assert abs(found.mean_nis - 1.0) < 4 * np.sqrt(2 / 1199)


FULL = "N(N=0.0126)+B(B=0.002)+K(K=9.07e-5)+GM(q_c=1.9e-3,T=30)+RES(f=7.3,zeta=0.05,rms=0.01)"


@pytest.mark.parametrize(
    "text",
    [
        FULL,
        "N(N=0.01)+B(B=0.01)+K(K=1e-4)+GM(q_c=5e-3,T=3)+RES(f=20,zeta=0.2,rms=0.05)",
        "N(N=1e-3)+B(B=0.02)+K(K=1e-5)+GM(q_c=0.05,T=100)+RES(f=2,zeta=0.01,rms=0.05)",
    ],
)
def test_eight_states_are_within_a_per_cent(text):
    space = al.parse_model(text).state_space(RATE, states=8)
    assert space.states <= 8
    assert space.cost.allan_error <= 0.01
    assert space.cost.log_likelihood <= 1e-3
    assert "a sample below it" in str(space)


def test_the_reduced_filter_has_nearly_the_likelihood():
    model = al.parse_model(FULL)
    recording = model.simulate(n=50_000, rate=RATE, seed=5, unit="rad/s")
    whole, small = al.innovations(recording, model), al.innovations(recording, model, states=8)
    assert small.space.states <= 8
    assert abs(whole.log_likelihood - small.log_likelihood) / whole.n < 1e-3


def test_fewer_states_cost_more_and_say_so():
    model = al.parse_model(FULL)
    costs = [model.state_space(RATE, states=k).cost for k in (2, 5, 10)]
    assert costs[0].allan_error > costs[1].allan_error > costs[2].allan_error
    assert costs[0].log_likelihood > costs[2].log_likelihood
    with pytest.raises(al.InputError, match="at least 1"):
        model.state_space(RATE, states=0)
    with pytest.raises(al.InputError, match="cannot be reduced"):
        al.parse_model("PL(a=-2.5,level=0.02)+N(N=1)").state_space(RATE, states=4)


def test_innovations_of_a_wrong_model_show_where():
    truth = al.parse_model("N(N=0.01)+GM(q_c=0.02,T=2)")
    recording = truth.simulate(n=40_000, rate=RATE, seed=2, unit="rad/s")
    right, wrong = al.innovations(recording, truth), al.innovations(recording, "N(N=0.0143)")
    assert right.whiteness > 1e-3
    assert wrong.whiteness < 1e-9
    assert right.log_likelihood > wrong.log_likelihood
    b = wrong.by_tau
    assert (b.nis > b.high).any()
    inside = (right.by_tau.nis > right.by_tau.low) & (right.by_tau.nis < right.by_tau.high)
    assert inside.mean() > 0.7
    assert "whiteness" in str(right)
    assert right.to_dict()["coverage_95"] == pytest.approx(0.95, abs=4 * np.sqrt(0.05 * 0.95 / 4e4))


def test_missing_samples_and_known_functions():
    model = al.parse_model("N(N=0.01)+K(K=0.3)+R(R=0.5)")
    recording = model.simulate(n=4000, rate=RATE, seed=2, unit="rad/s")
    x = np.array(recording.samples)
    x[1000:1500] = np.nan
    found = al.innovations(al.Recording(x + 9.81, rate=RATE, unit="rad/s"), model)
    assert np.isnan(found.nis[1000:1500]).all()
    assert found.n == 3499
    assert found.variances[1499] > 10 * found.variances[999]
    assert abs(found.mean_nis - 1.0) < 4 * np.sqrt(2 / 3499)
    with pytest.raises(al.TooShortError):
        al.innovations(
            al.Recording(np.array([1.0, np.nan, np.nan]), rate=1.0, unit="rad/s"), "N(N=1)"
        )


def test_smoothing_fills_a_gap_as_a_straight_line_of_a_random_walk():
    space = al.parse_model("K(K=1)+N(N=1e-6)").state_space(1.0, duration=100.0)
    x = np.arange(100.0) * 0.0
    x[60:] = 4.0
    x[20:60] = np.nan
    filled = smooth_samples(x, space)
    np.testing.assert_allclose(filled[19:61], np.linspace(0, 4, 42), atol=1e-4)


def test_refusals():
    with pytest.raises(al.InputError, match="has no value"):
        state_space(al.parse_model("N+B"), RATE)
    with pytest.raises(al.InputError, match="no random part"):
        state_space(al.parse_model("R(R=1)"), RATE)
    louder = al.parse_model("N(N=1)+LEVEL(start=1,end=2,factor=3)")
    recording = louder.simulate(n=1000, rate=RATE, seed=1, unit="rad/s")
    with pytest.raises(al.InputError, match="trim the recording"):
        al.innovations(recording, louder)
    assert state_space(al.parse_model("N(N=1)+R(R=1)"), RATE).known[0].kind == "rate_ramp"
    assert state_space(al.AngleRandomWalk(N=1.0), RATE).to_dict()["R"] == [[100.0]]
