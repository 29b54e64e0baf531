"""Records with holes: completed under the model, so that nothing is invented and nothing is lost."""

import itertools

import numpy as np
import pytest

import allanite as al
import generators as g
from allanite.effects import Deterministic
from allanite.fit import fit_again
from allanite.fit.likelihood.data import prepare
from allanite.fit.likelihood.expected import column
from allanite.fit.likelihood.whittle import normal_scores
from allanite.fit.missing import completion
from allanite.fit.missing.completion import _ConditionalMean, complete, information_ratio
from allanite.fit.missing.shares import known_ordinates, mixing_of, squared_correlations
from allanite.spectrum import bins_of

RATE = 100.0
NOISE = "N(N=0.0126)+B(B=0.006)+K(K=4e-4)"


def holes(kind, n, seed=0):
    """Mask by name: single samples, every second one, blocks of seconds, or a tenth in one segment."""
    rng = np.random.default_rng(seed)
    mask = np.zeros(n, dtype=bool)
    if kind == "random":
        return rng.random(n) < 0.3
    if kind == "alternate":
        mask[1::2] = True
    elif kind == "tenth":
        mask[n // 3 : n // 3 + n // 10] = True
    else:
        for start in rng.integers(0, n - kind, max(1, round(0.3 * n / kind))):
            mask[start : start + kind] = True
    return mask


def record(model, n, mask, seed, signal=None):
    samples = al.parse_model(model).simulate(duration=n / RATE, rate=RATE, seed=seed).samples.copy()
    if signal is not None:
        samples += signal
    samples[mask] = np.nan
    return al.Recording(samples, rate=RATE)


@pytest.mark.parametrize("few", [0, 512])
@pytest.mark.parametrize("kind", ["random", "alternate", 40, "tenth"])
def test_the_mean_given_the_rest_is_the_dense_one(kind, few, monkeypatch):
    """By conjugate gradients, or directly if few samples are missing."""
    monkeypatch.setattr("allanite.fit.missing.completion.MAX_DIRECT_MISSING", few)
    n = 300
    mask = holes(kind, n)
    transform = np.cos(np.pi * np.outer(np.arange(n), np.arange(n) + 0.5) / n) * np.sqrt(2.0 / n)
    transform[0] /= np.sqrt(2.0)
    spectrum = 1.0 + 300.0 / np.maximum(np.arange(n), 1.0) ** 2
    precision = transform.T @ np.diag(np.r_[0.0, 1.0 / spectrum[1:]]) @ transform
    values = np.random.default_rng(1).standard_normal(n).cumsum()
    there = ~mask
    dense = -np.linalg.solve(
        precision[np.ix_(mask, mask)], precision[np.ix_(mask, there)] @ values[there]
    )
    start = np.where(mask, 0.0, values)
    found = _ConditionalMean(mask, spectrum).mean(start)
    # Conjugate gradients stop at 1e-5 of the first residual.
    np.testing.assert_allclose(found[mask], dense, atol=2e-4 * np.abs(dense).max())
    np.testing.assert_array_equal(found[there], values[there])


@pytest.mark.parametrize("kind", ["random", "alternate", "tenth"])
def test_correlations_by_holes_are_those_of_every_other_ordinate(kind):
    n = 200
    mask = holes(kind, n)
    edges = np.array([1, 2, 3, 5, 9, 20, 70, n])
    j = np.arange(2 * n)
    w = (np.cos(np.pi * np.outer(j, np.arange(n) + 0.5) / n) * mask).sum(axis=1) / n
    a = np.arange(n)
    w[0] = 0.0  # of an ordinate with itself
    both = w[np.abs(a[:, None] - a)] ** 2 + w[a[:, None] + a] ** 2
    cells = [slice(*pair) for pair in itertools.pairwise(edges)]
    slow = [[both[rows, columns].sum() for columns in cells] for rows in cells]
    np.testing.assert_allclose(squared_correlations(mask, edges), slow, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("kind", ["random", "alternate", 300, "tenth"])
def test_completed_ordinates_have_the_spectrum_of_the_model(kind):
    """Under the truth, the mean square over S of k ordinates is 1 ± √(2/k), with the k that the bins count."""
    n = 20_000
    model = al.parse_model(NOISE)
    data = complete(prepare(record(NOISE, n, holes(kind, n), seed=7)), model)
    expected = column(data.terms(model), data)
    ratio = data.bins.power(data.ordinates) / expected
    count = data.bins.count
    wide = count > 30
    # Holes make ordinates far apart depend on each other: the whole has no fewer than half as many.
    assert abs(np.average(ratio, weights=count) - 1.0) < 4.0 * np.sqrt(4.0 / count.sum())
    scores = normal_scores(ratio[wide], count[wide], np.ones(np.count_nonzero(wide)))
    assert np.abs(scores).max() < 4.5
    # The variance of k normal scores is 1 ± √(2/k); the share that is seen is known to some per cent, which adds 0.04.
    assert abs(scores.var() - 1.0) < 4.0 * np.sqrt(2.0 / scores.size) + 0.04
    assert np.all(data.bins.count <= np.diff(data.bins.edges))


@pytest.mark.long
def test_the_lowest_ordinates_beside_long_holes_have_the_power_of_the_whole_record():
    """When their shares were up to a third too high, the lowest 32 had 0.83 of the power."""
    n, records = 20_000, 24
    mask, model = holes(6000, n, seed=2), al.parse_model(NOISE)
    expected = sum(t.cosine_variance(np.arange(1, 33), n) for t in model.terms(RATE))
    apart = np.empty(records)
    for seed in range(records):
        whole = prepare(record(NOISE, n, np.zeros(n, dtype=bool), seed)).ordinates
        seen = complete(prepare(record(NOISE, n, mask, seed)), model).ordinates
        apart[seed] = np.mean((seen[1:33] ** 2 - whole[1:33] ** 2) / expected)
    # Of the same records, so that their own scatter is in both: four standard errors are 0.1.
    assert abs(apart.mean()) < 4.0 * apart.std() / np.sqrt(records)


@pytest.mark.slow
def test_every_second_sample_of_white_noise_is_white_noise():
    n = 20_000
    fit = al.parse_model("N+B+K").fit(record("N(N=0.0126)", n, holes("alternate", n), seed=1))
    low, high = fit["N"].interval
    assert low < 0.0126 < high
    # 10 000 samples know it to 0.7 %.
    assert fit["N"].std_error / 0.0126 == pytest.approx(np.sqrt(0.5 / (n / 2)), rel=0.1)
    assert not fit["B"].detected
    assert not fit["K"].detected
    assert fit.adequate


@pytest.mark.long
@pytest.mark.parametrize("kind", ["random", "alternate", 300, 3000, "tenth"])
def test_holes_invent_no_effect(kind):
    n = 30_000
    check = al.parse_model("N+B+K").fit(record(NOISE, n, holes(kind, n), seed=5)).check()
    assert check.adequate
    assert not check.significant


@pytest.mark.long
@pytest.mark.parametrize("kind", ["random", "alternate", 300])
def test_a_line_is_found_with_its_amplitude(kind):
    n = 30_000
    mask = holes(kind, n)
    time = np.arange(n) / RATE
    # 10 standard errors of the amplitude on what is left.
    size = 10 * 0.126 * np.sqrt(2.0 / np.count_nonzero(~mask))
    seen = record("N(N=0.0126)", n, mask, seed=2, signal=size * np.sin(2 * np.pi * 7.3 * time))
    check = al.parse_model("N").fit(seen).check()
    best = check.significant[0]
    assert best.kind == "sinusoid"
    # ½·10² and the ½χ²₂ of the noise.
    assert best.delta_log_likelihood == pytest.approx(50.0, abs=4 * 10.0)
    fit = al.parse_model("N").fit(seen).add(best)
    assert fit["SIN.amplitude"].value == pytest.approx(size, rel=4 * 0.1)
    found = fit["SIN.frequency"].value
    if kind == "alternate":
        found = min(found, RATE / 2.0 - found)  # the same samples
    assert found == pytest.approx(7.3, abs=1e-3)


def test_a_step_has_its_height():
    n = 20_000
    mask = holes("random", n)
    step = np.where(np.arange(n) / RATE > 90.0, 0.02, 0.0)
    # The error for white noise alone. Without a slow process in the model, it would include flicker noise that was not
    # detected, as test_solution.py checks.
    fit = al.parse_model("N+B(B=1e-9!)+STEP(time=90!)").fit(
        record("N(N=0.0126)", n, mask, seed=4, signal=step)
    )
    height = fit["STEP.height"]
    error = 0.126 * np.sqrt(4.0 / np.count_nonzero(~mask))
    assert height.std_error == pytest.approx(error, rel=0.15)
    assert abs(height.value - 0.02) < 4 * error


def test_of_one_sample_in_three_hundred_no_record_is_made():
    samples = np.full(18_000, np.nan)
    samples[::300] = np.random.default_rng(1).standard_normal(60)
    with pytest.raises(al.TooShortError, match=r"60 of 18000 samples; .* one in 200"):
        al.parse_model("N").fit(al.Recording(samples, rate=RATE))


def test_hardly_anything_left_says_how_much_is_needed():
    samples = np.full(5000, np.nan)
    samples[[10, 4000]] = 1.0, 2.0
    with pytest.raises(al.TooShortError, match="2 of 5000 samples; a fit needs at least 32"):
        al.parse_model("N").fit(al.Recording(samples, rate=RATE))


@pytest.mark.parametrize("kind", ["random", "alternate", 40])
def test_power_that_is_seen_changes_as_the_dense_covariance_says(kind):
    """The ordinates of m answer to S as (δ − c)²; rows of it are 1 − r, whatever the spectrum."""
    n = 600
    mask = holes(kind, n)
    transform = np.cos(np.pi * np.outer(np.arange(n), np.arange(n) + 0.5) / n) * np.sqrt(2.0 / n)
    transform[0] /= np.sqrt(2.0)
    spectrum = 1.0 + 900.0 / np.maximum(np.arange(n), 1.0) ** 2
    white = transform[:, mask] / np.sqrt(spectrum)[:, None]
    c = white @ np.linalg.solve(white.T @ white, white.T)
    share = c.diagonal()
    bins = bins_of(n)
    first = bins.edges[:-1]
    left = (np.eye(n) - c) ** 2
    np.testing.assert_allclose(left.sum(axis=1), 1.0 - share, rtol=1e-9)
    dense = np.add.reduceat(np.add.reduceat(left, first, axis=0), first, axis=1)
    dense /= known_ordinates(share, bins)[:, None]
    found = mixing_of(mask, share, bins)
    np.testing.assert_allclose(found.sum(axis=1), 1.0, rtol=1e-9)
    # What an effect of low frequencies and one of all would change, in each bin.
    for tried in (1.0 - 1.0 / spectrum, 1.0 / spectrum):
        power = bins.power(np.sqrt(tried))
        np.testing.assert_allclose(found @ power, dense[:, :] @ power, atol=0.05)


def test_a_shape_that_bridges_suggest_is_not_confirmed():
    """Every second sample is missing: the bridged record is low-passed, and once stayed so (q_c 60 times too high)."""
    truth = al.parse_model("N(N=0.0126)+GM(q_c=3e-3,T=20)")
    samples = truth.simulate(duration=200.0, rate=RATE, seed=5).samples.copy()
    half = al.parse_model("N+GM").fit(al.Recording(samples[::2].copy(), rate=RATE / 2.0))
    samples[1::2] = np.nan
    fit = al.parse_model("N+GM").fit(al.Recording(samples, rate=RATE))
    # The same samples: they differ by how well the share of each ordinate is known, 5 % of the lowest.
    assert fit["GM.q_c"].value == pytest.approx(half["GM.q_c"].value, rel=0.2)
    assert fit["N.N"].value == pytest.approx(half["N.N"].value / np.sqrt(2.0), rel=0.01)


@pytest.mark.long
def test_a_limit_is_that_of_the_samples_that_are_there():
    """Ordinates and their mirror images are the same samples; counted twice, they made the limit 17 % too low."""
    ratios = []
    for seed in (0, 1, 2, 3, 4, 8):
        truth = al.parse_model(NOISE).simulate(duration=200.0, rate=RATE, seed=seed)
        samples = truth.samples.copy()
        half = al.parse_model("N+B+K").fit(al.Recording(samples[::2].copy(), rate=RATE / 2.0))
        samples[1::2] = np.nan
        fit = al.parse_model("N+B+K").fit(al.Recording(samples, rate=RATE))
        ratios.append(np.log(fit["B"].interval[1] / half["B"].interval[1]))
    # Where B and K say the same a limit depends on which of them is 0: 0.08 each, 0.03 their mean.
    assert abs(np.mean(ratios)) < 0.08, ratios


@pytest.mark.long
@pytest.mark.parametrize("seed", [60, 90])
def test_an_ordinate_and_its_mirror_image_have_one_vote(seed):
    """Counted twice, they made a narrow resonance significant at 16 and 12.5, half of it due to the mirror image."""
    truth = al.parse_model(NOISE).simulate(duration=200.0, rate=RATE, seed=seed)
    samples = truth.samples.copy()
    samples[1::2] = np.nan
    check = al.parse_model("N+B+K").fit(al.Recording(samples, rate=RATE)).check()
    assert not check.significant


def test_many_single_gaps_are_solved_for_at_once_though_the_spectrum_is_steep():
    n = 2693
    missing = np.zeros(n, dtype=bool)
    missing[1::4] = True
    j = np.maximum(np.arange(n), 1.0)
    for spectrum in (1.0 / j**2, np.exp(-60.0 * j / n) + 1e-26):
        bridge = _ConditionalMean(missing, spectrum)
        assert bridge.exact is not None
        x = np.cos(np.pi * 3.0 * (np.arange(n) + 0.5) / n)
        start = np.where(missing, 0.0, x)
        assert np.abs(bridge.mean(start) - x).max() < 1e-3


def test_holes_that_no_bin_notices_leave_a_fit_as_it_is(monkeypatch):
    """With one of 20 000 samples missing, the mixing of bins changes nothing, whether or not it is computed."""
    samples = al.parse_model("N(N=0.1)+K(K=0.01)").simulate(n=20_000, rate=10.0, seed=4).samples
    samples = np.where(np.arange(20_000) == 7_000, np.nan, samples)
    record = al.Recording(samples, rate=10.0)
    plain = al.fit_model(record, "N+K")
    assert plain.data.mixing is None
    monkeypatch.setattr("allanite.fit.missing.completion.MAX_NEGLECTED_MIXING", 0.0)
    mixed = al.fit_model(record, "N+K")
    assert mixed.data.mixing is not None
    for name in ("N", "K"):
        # A hundredth of its standard error.
        error = mixed[name].std_error
        assert plain[name].value == pytest.approx(mixed[name].value, abs=0.01 * error)


def test_a_model_with_one_more_effect_completes_the_record_as_one_fitted_from_the_start():
    """Two thirds are missing in segments; the samples completed by the smaller model must only be start values."""
    rng, n = np.random.default_rng(3), 12_000
    x = 0.01 * rng.standard_normal(n) + np.cumsum(2e-4 * rng.standard_normal(n))
    away = np.repeat(np.arange(400) % 2, rng.geometric(1.0 / np.tile([30, 60], 200)))[:n] == 1
    x[: away.size][away] = np.nan
    log = al.Recording(x, rate=1.0)
    first = al.fit_model(log, "N+B")
    again, whole = fit_again(first, al.parse_model("N+B+K")), al.fit_model(log, "N+B+K")
    assert again.data is not first.data
    # The starts differ; rounds end at changes of 0.02 nats, that is 0.2 standard errors.
    for name in ("N", "K"):
        assert abs(again[name].value - whole[name].value) < 0.2 * whole[name].std_error


def long_holes(rng, n):
    """Two thirds missing: runs of about 40 present samples between gaps of 20 to 2000 samples."""
    on, off = rng.geometric(1 / 40, 600), rng.pareto(1.0, 600) * 20 + 1
    off = np.minimum(off, 2000).astype(int)
    runs = [np.r_[np.zeros(a, bool), np.ones(b, bool)] for a, b in zip(on, off, strict=True)]
    return np.concatenate(runs)[:n]


@pytest.mark.statistical
def test_long_gaps_invent_no_function_of_time():
    """P-values use the information of the present samples: with 1 % false alarms, 1.7 % of runs have 2 of 20."""
    alarms = 0
    for seed in range(20):
        rng, n = np.random.default_rng(seed), 12_000
        x = 0.01 * rng.standard_normal(n) + np.cumsum(1e-4 * rng.standard_normal(n))
        x[long_holes(rng, n)] = np.nan
        found = al.fit_model(al.Recording(x, rate=1.0), "N+K").check().significant
        alarms += any(isinstance(s.effect, Deterministic) for s in found)
    assert alarms < 2


def test_a_function_beside_long_gaps_has_the_height_of_least_squares():
    """A decay of which no sample is missing, in white noise: least squares of the present samples give its height."""
    rng, n = np.random.default_rng(2), 12_000
    there = ~long_holes(rng, n)
    there[:60] = True
    shape = np.exp(-np.arange(n) / 10.0)
    x = np.where(there, 0.01 * rng.standard_normal(n) + 0.05 * shape, np.nan)
    height = shape[there] @ x[there] / (shape[there] @ shape[there])
    warm = al.effects.WarmUp(time_constant=10.0, hold=("time_constant",))
    first = al.fit_model(al.Recording(x, rate=1.0), "N")
    found = fit_again(first, first.model + warm).estimates_of("WARM")["amplitude"].value
    assert abs(found - height) < 0.1 * height


@pytest.mark.parametrize("seed", range(3))
def test_power_hidden_by_gaps_does_not_drift_if_the_model_is_wrong(seed):
    """Gaps hide 70 % of a phase, and the model lacks its white noise: no bin is wrong by a factor of 1e5."""
    rng = np.random.default_rng([seed, 5])
    n = 4000
    rate = 2e-9 * rng.standard_normal(n) + np.cumsum(4e-11 * rng.standard_normal(n))
    phase = 1e-8 * rng.standard_normal(n) + np.cumsum(rate)
    there = np.zeros(n, dtype=bool)
    at = 0
    while at < n:
        length = int(rng.geometric(1 / 15))
        there[at : at + length] = True
        at += length + int(8.0 * rng.pareto(1.2)) + 1
    there[[0, -1]] = True
    stamps = np.flatnonzero(there).astype(float)
    unit = {"rate": 1.0, "unit": "s", "quantity": "angle"}
    found = al.fit_model(al.Recording(phase[there], time=stamps, **unit), "N+B+K")
    whole = al.fit_model(al.Recording(phase, **unit), "N+B+K")
    assert found.discrepancy.percent > 10.0
    # Few ordinates of a bin are known, and the model is wrong, but its power does not run away (it did, by e^36 and more).
    assert np.abs(np.log(found.data.power / whole.data.power)).max() < np.log(1e5)


def test_a_length_with_large_prime_factors_is_completed_like_any_other(monkeypatch):
    """5003 is a prime: conjugate gradients solve a slightly longer record, and agree with the direct solution."""
    n = 5003
    log = record(NOISE, n, holes("random", n), 1, np.where(np.arange(n) > 2000, 0.5, 0.0))
    found = []
    for few in (2048, 0):
        monkeypatch.setattr("allanite.fit.missing.completion.MAX_DIRECT_MISSING", few)
        fit = al.fit_model(log, f"{NOISE}+STEP(time=20,height=0.5)")
        found.append(
            (fit["N"].value, fit["STEP.height"].value, information_ratio(fit.data, fit.solution))
        )
        assert fit.data.samples.size == fit.data.ordinates.size == n
    np.testing.assert_allclose(found[0], found[1], rtol=0.02)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_wrong_model_is_completed_as_well_as_its_discrepancy_allows(seed, monkeypatch):
    """Further rounds change no coefficient, although the model lacks a band."""
    rng = np.random.default_rng(seed)
    x = g.white(rng, 20_000, 1.0, 0.1) + g.resonance(rng, 20_000, 1.0, 0.03, 0.1, 0.1)
    x += 1e-4 * np.cumsum(rng.standard_normal(x.size))
    for first in rng.integers(0, x.size, 200):
        x[first : first + int(rng.exponential(80.0))] = np.nan
    record = al.Recording(x, rate=1, unit="deg/s")
    fit = al.fit_model(record, "N+B+K")
    assert fit.discrepancy.percent > 1.0
    monkeypatch.setattr(completion, "MAX_SETTLED_DELTA_LOGL", 1e-4)
    further = al.fit_model(record, "N+B+K")
    for name in "NBK":
        error = fit[name].std_error or fit[name].limit
        assert abs(further[name] - fit[name]) < 0.1 * error
