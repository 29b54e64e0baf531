"""Clocks and time servers: `al.timing`, masks, holdover, `allanite timing`, the three-cornered hat."""

import json
import re
import warnings

import numpy as np
import pytest

import allanite as al
from allanite.clocks import MASKS, mask_named
from allanite.clocks.noise import thinned_indices
from allanite.clocks.verdicts import low_pass_filtered, verdicts, window_means
from documents import valid

pytestmark = pytest.mark.slow


def phase_of(model, n, seed, rate=1.0):
    clock = al.parse_model(model).simulate(n=n - 1, rate=rate, seed=seed, unit="1")
    return np.concatenate([[0.0], np.cumsum(clock.samples)]) / rate


def clock(phase, rate=1.0, **more):
    return al.Recording(phase, rate=rate, quantity="angle", **more)


# -- masks -------------------------------------------------------------------------------------

#: Mask, deviation → (τ, limit in ns) at each corner from below and right behind it, from the tables.
CORNERS = {
    ("G.811", "mtie"): [(0.2, 25.055), (1000, 300.0), (1001, 300.01), (1e6, 10290.0)],
    ("G.811", "tdev"): [(100, 3.0), (101, 3.03), (1000, 30.0), (10000, 30.0)],
    ("G.8262-1", "mtie"): [(1, 40.0), (100, 63.3957), (101, 63.5515), (1000, 100.5222)],
    ("G.8262-1", "tdev"): [(25, 3.2), (36, 3.84), (100, 6.4), (1000, 6.4)],
    ("G.8262-2", "mtie"): [(1, 20.0), (10, 60.3990), (11, 60.0), (1000, 60.0)],
    ("G.8262-2", "tdev"): [(1, 3.2), (40, 2.0), (100, 3.2), (10000, 10.0)],
    ("G.8272-A", "mtie"): [(1, 25.275), (273, 100.075), (274, 100.0), (1e5, 100.0)],
    ("G.8272-A", "tdev"): [(100, 3.0), (200, 6.0), (1000, 30.0), (10000, 30.0)],
    ("G.8272-B", "mtie"): [(1, 25.275), (54.5, 39.9875), (55, 40.0), (1e5, 40.0)],
    ("G.8272-B", "tdev"): [(100, 1.0), (200, 2.0), (500, 5.0), (1e5, 5.0)],
    ("G.8273.2-A", "mtie"): [(0.05, 40.0), (1000, 40.0)],
    ("G.8273.2-A", "tdev"): [(0.05, 4.0), (1000, 4.0)],
    ("G.8273.2-B", "mtie"): [(0.05, 40.0), (1000, 40.0)],
    ("G.8273.2-B", "tdev"): [(0.05, 4.0), (1000, 4.0)],
    ("G.8273.2-C", "mtie"): [(0.05, 10.0), (1000, 10.0)],
    ("G.8273.2-C", "tdev"): [(0.05, 2.0), (1000, 2.0)],
}


@pytest.mark.parametrize(("mask", "kind"), CORNERS, ids=str)
def test_limits_at_every_corner(mask, kind):
    limit = MASKS[mask].limits[kind]
    tau, values = np.array(CORNERS[mask, kind]).T
    assert 1e9 * limit.at(tau) == pytest.approx(values, rel=1e-5)
    first, last = limit.span
    assert np.isnan(limit.at(first))
    assert np.isnan(limit.at(last * 1.0001)) or last == np.inf
    assert limit.source.startswith(mask.split("-")[0])


def test_every_limit_is_tested_and_has_no_gap():
    assert set(CORNERS) == {(m.name, kind) for m in MASKS.values() for kind in m.limits}
    for mask in MASKS.values():
        for limit in mask.limits.values():
            for piece, following in zip(limit.pieces[:-1], limit.pieces[1:], strict=True):
                assert piece.high == following.low
                # The tables round: neighbours meet within 1.3 %.
                assert piece.at(piece.high) == pytest.approx(following.at(piece.high), rel=0.013)


def test_masks_agree_with_another_program():
    mask = pytest.importorskip("allantools.mask")
    tau = np.array([0.5, 20.0, 99.0, 101.0, 400.0, 999.0, 1001.0, 9000.0])
    for own, other in (("G.811", "prc"), ("G.8272-A", "prtcA"), ("G.8272-B", "prtcB")):
        for kind in ("mtie", "tdev"):
            theirs = [getattr(mask, f"{other}_{kind}")(t) for t in tau]
            assert MASKS[own].limits[kind].at(tau) == pytest.approx(theirs, rel=1e-12)


def test_a_mask_is_named_in_any_case_and_an_unknown_one_is_refused():
    assert mask_named("g.8272-a") is MASKS["G.8272-A"]
    with pytest.raises(al.InputError, match=r"known masks: G.811"):
        mask_named("G.42")


@pytest.mark.parametrize("where", ["below", "above"])
@pytest.mark.parametrize("tau", [1.0, 100.0, 1000.0])
def test_mtie_decides_at_a_corner(tau, where):
    # A ramp: MTIE is its slope times τ. It touches the limit of option 1 at this τ and stays below it at others.
    limit = MASKS["G.8262-1"].limits["mtie"]
    slope = limit.at(np.array([tau]))[0] / tau * (0.999 if where == "below" else 1.001)
    width = int(tau)
    ramp = slope * np.clip(np.arange(12000) - 5000, 0, width)
    [found] = [v for v in verdicts(mask_named("G.8262-1"), ramp, 1.0) if v.kind == "mtie"]
    assert found.result == ("passes" if where == "below" else "fails")


def test_tdev_passes_fails_and_is_undecided():
    rng = np.random.default_rng(1)
    white = rng.standard_normal(13000) * 1e-9

    def result(size, n=13000):
        got = verdicts(mask_named("G.8262-1"), size * white[:n], 1.0)
        return next(v for v in got if v.kind == "tdev")

    # Of white PM the time deviation at 1 s is the standard deviation of a sample.
    assert result(2.0).result == "passes"
    assert result(4.0).result == "fails"
    assert result(4.0).tau == 1.0
    assert result(3.2).result == "undecided"  # the interval holds the limit
    short = result(2.0, 2000)
    assert (short.result, short.needs) == ("undecided", 12000.0)


def test_a_time_error_is_judged_unfiltered_and_wander_behind_its_filter():
    tone = 60e-9 * np.sin(2 * np.pi * 2.0 * np.arange(20000) / 10.0)  # 2 Hz at 10 Hz
    found = {v.kind: v.result for v in verdicts(mask_named("G.8273.2-B"), tone, 10.0)}
    assert found["mtie"] == "passes"
    assert found["time error"] == "passes"
    assert found["constant time error"] == "passes"
    more = {v.kind: v.result for v in verdicts(mask_named("G.8273.2-B"), tone + 30e-9, 10.0)}
    assert more["time error"] == "fails"
    assert more["constant time error"] == "fails"


def test_the_filter_is_of_first_order_at_a_tenth_of_a_hertz():
    t = np.arange(40000) / 16.0
    tone = np.sin(2 * np.pi * 0.1 * t)
    passed = low_pass_filtered(tone, 16.0, 0.1)[8000:]
    assert np.std(passed) / np.std(tone) == pytest.approx(np.sqrt(0.5), rel=0.03)


def test_averages_skip_windows_with_few_samples():
    x = np.ones(3000)
    x[500:1800] = np.nan
    assert window_means(x, 1.0) == pytest.approx(1.0)
    assert window_means(x, 1.0).size < 2001
    assert window_means(x[:900], 1.0).size == 0


# -- the whole -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def found():
    log = clock(phase_of("Q(Q=1e-9)+N(N=2e-11)", 6000, 1), columns=["offset"])
    return al.timing(log, masks=["G.8272-A"])


def test_noise_and_deviations(found):
    assert found.noise.name == "Q+N"
    sizes = {e.kind: getattr(e, e.coefficient) for e in found.noise.stochastic}
    assert sizes["quantization"] == pytest.approx(1e-9, rel=0.1)
    assert sizes["angle_random_walk"] == pytest.approx(2e-11, rel=0.4)
    valid(found.to_dict())
    assert "holdover after 24 h" in str(found)


def test_deviations_equal_another_program(found):
    allantools = pytest.importorskip("allantools")
    phase = phase_of("Q(Q=1e-9)+N(N=2e-11)", 6000, 1)
    for kind in ("tdev", "mdev", "mtie"):
        curve = found.deviations[kind]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            tau, theirs, *_ = getattr(allantools, kind)(phase, rate=1.0, taus=curve.tau)
        same = np.isin(curve.tau, tau)
        assert same.sum() > 8
        assert [f"{v:.4e}" for v in curve.deviation[same]] == [f"{v:.4e}" for v in theirs]


def test_a_pair_is_found_whose_parts_explain_little():
    # The best single noise is B, and every step from it leads away from N+K.
    got = al.timing(
        clock(phase_of("N(N=1e-11)+K(K=1e-13)", 5001, 1, rate=0.1), rate=0.1), after=[60.0]
    )
    assert got.noise.name == "N+K"


def test_a_frequency_makes_no_jumps_across_pauses():
    phase = phase_of("N(N=1e-10)", 3000, 4) - 2e-7 * np.arange(3000)
    for start in range(100, 2900, 100):
        phase[start : start + 1 + start // 100] = np.nan
    phase[1550:] += 50e-9
    got = al.timing(clock(phase), after=[60.0])
    assert [(j.time, j.stays) for j in got.jumps] == [(1550.0, True)]
    assert got.frequency.value == pytest.approx(-2e-7, abs=1e-11)


def test_jumps_between_the_same_kept_samples_are_one_step():
    # Only every 16th of the first samples is kept: these two jumps are between two of them.
    n = 20000
    rows = thinned_indices(n)
    first = int(rows[np.argmax(np.diff(rows) >= 8)])
    phase = phase_of("Q(Q=1e-9)", n, 5)
    phase[first + 3 :] += 40e-9
    phase[first + 6 :] += 60e-9
    got = al.timing(clock(phase), after=[60.0])
    assert [j.time for j in got.jumps] == [first + 3.0, first + 6.0]
    assert got.noise.name == "Q"


def test_jumps_are_named_and_do_not_become_noise():
    x = phase_of("Q(Q=1e-9)+N(N=2e-11)", 3000, 2)
    x[1200:] += 50e-9
    x[2000] += 40e-9
    got = al.timing(clock(x))
    assert [(j.time, j.stays) for j in got.jumps] == [(1200.0, True), (2000.0, False)]
    assert got.jumps[0].height == pytest.approx(50e-9, abs=6e-9)
    sizes = {e.kind: getattr(e, e.coefficient) for e in got.noise.stochastic}
    assert sizes["quantization"] == pytest.approx(1e-9, rel=0.15)


def test_a_drift_is_found_and_one_that_is_not_there_is_bounded(found):
    t = np.arange(6000.0)
    x = phase_of("Q(Q=1e-9)+N(N=2e-11)", 6000, 1) + 0.5 * 1e-13 * t**2
    got = al.timing(clock(x))
    low, high = got.drift.interval
    assert got.drift.detected
    assert low < 1e-13 * 86400 < high
    assert not found.drift.detected
    assert found.drift.interval[0] < 0.0 < found.drift.interval[1]


def test_the_frequency_of_a_random_walk_is_that_at_the_last_sample():
    rng = np.random.default_rng(7)
    frequency = 1e-10 + np.cumsum(rng.normal(0.0, 1e-13, 1500))
    phase = np.cumsum(frequency) + rng.normal(0.0, 1e-11, 1500)
    found = al.timing(clock(phase), after=()).frequency
    assert abs(found.value - frequency[-1]) < 4.0 * found.std_error
    # Error of the steady Kalman filter: (√2 q^(3/2) r^(1/2))^½ for steps q and phase errors r. Both are estimated, to 10 %.
    assert found.std_error == pytest.approx(
        np.sqrt(np.sqrt(2.0) * 1e-13**1.5 * 1e-11**0.5), rel=0.3
    )


def test_temperature_drives_the_frequency():
    n = 4000
    warmth = 25.0 + 3.0 * np.sin(np.arange(n) / 300.0)
    x = phase_of("Q(Q=1e-9)+N(N=2e-11)", n, 3) + np.cumsum(2e-10 * (warmth - 25.0))
    got = al.timing(clock(x, covariates={"temperature": warmth}))
    low, high = got.temperature.interval
    assert low < 2e-10 < high
    assert high - low < 1e-10


def test_a_servo_is_taken_out_and_keeps_its_last_frequency():
    n, later = 3000, 3600
    free = phase_of("Q(Q=1e-9)+N(N=1e-10)", n + later, 4) + 1e-8 * np.arange(n + later)
    steer = np.zeros(n)  # ppb
    steered = np.zeros(n)
    added, sum_of_errors = 0.0, 1e-8 / 0.005
    for k in range(n):
        steered[k] = free[k] + added
        sum_of_errors += steered[k]
        steer[k] = -(0.1 * steered[k] + 0.005 * sum_of_errors) * 1e9
        added += 1e-9 * steer[k]
    truth = free[-1] + added + 1e-9 * steer[-1] * (later - 1)
    free = free[:n]
    log = clock(steered, covariates={"frequency": steer})
    got = al.timing(log, steering=("frequency", 1e-9), after=[3600.0])
    alone = al.timing(clock(free), after=[3600.0])
    assert got.noise.name == alone.noise.name
    assert got.holdover[0].std == pytest.approx(alone.holdover[0].std, rel=1e-6)
    assert got.holdover[0].low < truth < got.holdover[0].high
    assert got.frequency.value == pytest.approx(1e-8, abs=1e-11)
    assert got.steered == "frequency"


def test_uneven_times_are_told_and_used():
    rng = np.random.default_rng(5)
    t = np.cumsum(rng.uniform(0.6, 1.4, 1500))
    x = np.cumsum(1e-10 * rng.standard_normal(1500) * np.sqrt(np.diff(t, prepend=0.0)))
    log = al.Recording(x, time=t, time_unit="s", quantity="angle")
    got = al.timing(log)
    assert got.uneven
    assert "uneven times" in str(got)
    assert got.noise.name == "N"
    # Steps of 1e-10 √Δt.
    assert pytest.approx(1e-10, rel=0.06) == got.noise.stochastic[0].N


def test_rows_are_thinned_towards_the_beginning():
    rows = thinned_indices(100_000)
    assert rows[-1] == 99_999
    assert rows[0] < 300
    assert rows.size < 6000
    assert (np.diff(rows)[-1000:] == 1).all()
    assert thinned_indices(500).tolist() == list(range(500))


def test_a_rate_is_refused():
    with pytest.raises(al.InputError, match="phase of a clock"):
        al.timing(al.Recording(np.zeros(100) + np.arange(100), rate=1.0))
    with pytest.raises(al.TooShortError, match="too few"):
        al.timing(clock(np.arange(10.0) ** 2))


# -- three clocks ---------------------------------------------------------------------------------


def test_the_hat_is_the_classical_one_for_three_clocks():
    rng = np.random.default_rng(6)
    x = np.cumsum(rng.standard_normal((4000, 3)) * [1e-9, 2e-9, 4e-9], axis=0)
    got = al.three_cornered_hat(clock(x, columns=["a", "b", "c"]))
    m = got["a"].tau.astype(int)
    ab, ac, bc = (
        al.oadev(x[:, i] - x[:, j], quantity="angle", factors=m).deviation ** 2
        for i, j in ((0, 1), (0, 2), (1, 2))
    )
    assert got["a"].variance == pytest.approx(0.5 * (ab + ac - bc), rel=1e-9, abs=1e-24)
    assert got["c"].variance == pytest.approx(0.5 * (ac + bc - ab), rel=1e-9, abs=1e-24)
    valid(got.to_dict())


def test_counters_cancel_with_a_column_for_each_pair():
    rng = np.random.default_rng(7)
    x = np.cumsum(rng.standard_normal((20000, 3)) * [1e-9, 2e-9, 4e-9], axis=0)
    noisy = 3e-9 * rng.standard_normal((20000, 3))
    columns = np.column_stack([x[:, 0] - x[:, 1], x[:, 0] - x[:, 2], x[:, 1] - x[:, 2]]) + noisy
    log = clock(columns, columns=["ab", "ac", "bc"])
    got = al.three_cornered_hat(log, pairs=[("a", "b"), ("a", "c"), ("b", "c")])
    # At 1 s the counters have 27 times the variance of the first clock; their mean product is 0 ± 1e-18.
    assert abs(got["a"].variance[0] - 1e-18) < 2e-18
    hat = 0.5 * sum(
        s * al.oadev(columns[:, i], quantity="angle", factors=[1]).deviation[0] ** 2
        for i, s in ((0, 1), (1, 1), (2, -1))
    )
    assert hat > 1e-17


def test_two_clocks_are_refused():
    with pytest.raises(al.InputError, match="three or more"):
        al.three_cornered_hat(clock(np.zeros((100, 2)) + np.arange(100.0)[:, None] ** 2))


# -- the command ------------------------------------------------------------------------------------


def test_the_command_reads_a_log_of_ptp4l(run, tmp_path):
    rng = np.random.default_rng(8)
    lines = []
    t, x = 1000.0, 0.0
    for _ in range(400):
        t += 1.001 + 0.0006 * rng.standard_normal()
        x += rng.standard_normal() * 20.0
        freq = -100 - 0.1 * x
        x -= 0.1 * x
        lines.append(
            f"ptp4l[{t:.3f}]: master offset {x:10.0f} s2 freq {freq:+7.0f} path delay       500\n"
        )
    path = tmp_path / "ptp4l.log"
    path.write_text("".join(lines))
    code, out, err = run("timing", path, "--mask", "G.8273.2-A", "--after", "1h", "--json")
    assert code == 0, err
    got = valid(json.loads(out))
    assert got["steered"] == "frequency"
    assert got["spacing_s"][0] == pytest.approx(1.001, abs=2e-4)
    assert {v["kind"] for v in got["masks"]} == {
        "mtie",
        "tdev",
        "time error",
        "constant time error",
    }
    code, out, err = run("timing", path, "--as-logged", "--quiet")
    assert code == 0, err
    assert "holdover after 1 h" in out


@pytest.mark.data
def test_irregular_steps_of_a_field_log_are_told(run, data):
    # Lines of ptp4l come when a packet arrives: 1.001 s apart, but for a millisecond.
    path = data("field/ptp4l.txt")
    code, out, err = run("timing", path, "--mask", "G.8273.2-A", "--json")
    assert code == 0, err
    got = valid(json.loads(out))
    usual, least, most = got["spacing_s"]
    assert least <= usual <= most
    assert got["n"] == 51
    code, out, err = run("inspect", path)
    assert code == 0, err
    assert "lines are 1.001 s apart, from" in out + err


def test_the_command_refuses_an_unknown_mask(run, tmp_path):
    path = tmp_path / "phase.csv"
    path.write_text("phase [s]\n" + "".join(f"{v:.12f}\n" for v in np.arange(50) ** 2 * 1e-9))
    code, _, err = run("timing", path, "--rate", 1, "--mask", "G.1")
    assert code == 2
    assert "known masks: G.811" in err


def test_the_command_parts_the_clocks_of_a_log(run, tmp_path):
    x = np.cumsum(np.random.default_rng(9).standard_normal((400, 3)) * 1e-9, axis=0)
    path = tmp_path / "three.csv"
    rows = "".join(",".join(f"{v:.6e}" for v in row) + "\n" for row in x)
    path.write_text("a [s],b [s],c [s]\n" + rows)
    code, out, err = run("timing", path, "--rate", 1, "--quantity", "angle", "--hat", "--json")
    assert code == 0, err
    assert [one["clock"] for one in valid(json.loads(out))["clocks"]] == ["a", "b", "c"]
    code, _, err = run("timing", path, path, "--rate", 1, "--hat")
    assert code == 2
    assert "one log" in err


def test_the_command_refuses_a_frequency_read_as_a_phase(run, tmp_path):
    y = np.random.default_rng(9).standard_normal(60) * 1e-9
    numbers = "".join(f"{v:.6e}\n" for v in y)
    stated, bare = tmp_path / "stated.csv", tmp_path / "bare.csv"
    stated.write_text("x [1]\n" + numbers)
    bare.write_text(numbers)
    integrate = (
        "timing needs a phase in s; this column is a fractional frequency (unit 1): integrate it"
    )
    for arguments in (
        [stated],
        [stated, "--quantity", "angle"],
        [bare, "--unit", "1"],
        [bare, "--unit", "1", "--quantity", "angle"],
    ):
        code, out, err = run("timing", *arguments, "--rate", 1)
        assert (code, out) == (2, ""), arguments
        assert integrate in " ".join(err.split())
        assert "--quantity" not in err
    billion = tmp_path / "billion.csv"
    billion.write_text("x [ppb]\n" + numbers)
    code, _, err = run("timing", billion, "--rate", 1, "--quantity", "angle")
    assert code == 2
    assert "a fractional frequency (unit ppb)" in " ".join(err.split())
    # Without a unit the samples may be either; a unit of another sensor is neither.
    code, _, err = run("timing", bare, "--rate", 1)
    assert code == 2
    assert "--unit s (or ms, us, ns)" in " ".join(err.split())
    assert run("timing", bare, "--rate", 1, "--quantity", "angle", "--after", "1h")[0] == 0
    code, _, err = run("timing", bare, "--rate", 1, "--quantity", "angle", "--unit", "deg")
    assert code == 2
    given = ("--quantity", "angle", "--unit", "s", "--after", "1h")
    assert run("timing", stated, "--rate", 1, *given)[0] == 0
    assert "this column is an angular rate" in " ".join(err.split())


def test_a_frequency_read_as_a_phase_is_reported(tmp_path):
    path = tmp_path / "clock.csv"
    path.write_text("x [1]\n" + "1e-9\n3e-9\n2e-9\n" * 20)
    found = [f for f in al.read(path, rate=1, quantity="angle").audit if f.kind == "phase_unit"]
    assert [f.severity for f in found] == ["warning"]
    assert "x has unit 1, the unit of a fractional frequency, but is read as a phase in s" in str(
        found[0]
    )
    bare = tmp_path / "bare.csv"
    bare.write_text("1e-9\n3e-9\n2e-9\n" * 20)
    audit = al.read(bare, rate=1, quantity="angle", unit="1").audit
    assert "phase_unit" in {f.kind for f in audit}
    audit = al.read(bare, rate=1, quantity="angle").audit
    assert "phase_unit" not in {f.kind for f in audit}
    for given in ({"unit": "s", "quantity": "angle"}, {}):
        audit = al.read(path, rate=1, **given).audit
        assert "phase_unit" not in {f.kind for f in audit}


def test_differences_of_clocks_are_no_clocks(run, tmp_path):
    x = np.cumsum(np.random.default_rng(9).standard_normal((400, 3)) * 1e-9, axis=0)
    differences = x - np.roll(x, -1, axis=1)
    path = tmp_path / "pairs.csv"
    rows = "".join(",".join(f"{v:.6e}" for v in row) + "\n" for row in differences)
    path.write_text("ab [s],bc [s],ca [s]\n" + rows)
    code, out, err = run("timing", path, "--rate", 1, "--hat")
    assert (code, out) == (2, "")
    assert "the columns sum to zero" in err
    assert "each clock against the same reference" in " ".join(err.split())
    # The column of the third pair may have the opposite sign.
    for samples in (differences * [1, 1, -1], np.cumsum(differences, axis=0)):
        with pytest.raises(al.InputError, match="against the same reference"):
            al.three_cornered_hat(clock(samples, columns=["ab", "bc", "ac"]))
    pairs = [("a", "b"), ("b", "c"), ("c", "a")]
    assert len(al.three_cornered_hat(clock(differences), pairs=pairs)) == 3


def test_the_table_of_the_hat_names_its_columns_and_unit():
    phase = np.cumsum(np.random.default_rng(1).standard_normal((500, 3)), axis=0) * 1e-9
    found = al.three_cornered_hat(
        al.Recording(phase, rate=1.0, quantity="angle", columns=["a", "b", "c"])
    )
    lines = str(found).splitlines()
    assert "fractional frequency" in lines[0]
    assert lines[1].split() == ["τ", "/", "s", "deviation", "low", "high"]
    assert found.to_dict()["clocks"][0]["unit"] == "1"


def test_numbers_have_few_digits_and_a_unit(tmp_path, run):
    clock = al.parse_model("Q(Q=2e-10)+N(N=1e-11)").simulate(n=4000, rate=1.0, seed=1, unit="1")
    phase = np.concatenate([[0.0], np.cumsum(clock.samples)])
    log = tmp_path / "clock.csv"
    log.write_text("x [s]\n" + "\n".join(map(repr, phase.tolist())), encoding="utf-8")
    code, out, _ = run("timing", log, "--rate", 1, "--after", "1h")
    assert code == 0
    assert not re.search(r"\d[eE][+-]?\d", out), out
    assert re.search(r"white PM Q [\d.]+·10⁻¹⁰ s", out)
    assert re.search(r"frequency: \(−?[\d.]+ ± [\d.]+\)·10⁻¹\d|not detected, \(", out)


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ((1.879e-12, 3.9e-14), "(1.879 ± 0.039)·10⁻¹²"),
        ((-3.4e-13, 0.0), "(−3.4 ± 0.0)·10⁻¹³"),
        ((0.0, 0.0), "0 ± 0"),
        ((1.0, float("nan")), "1.0 ± nan"),
    ],
)
def test_two_numbers_share_a_power_of_ten(values, text):
    from allanite.clocks.words import powered_text

    assert powered_text(values, " ± ") == text
