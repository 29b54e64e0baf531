"""What a summary keeps of a record, and what a fit of it tells."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite import _kernels
from allanite.summary import lapped, level, reading, summary

RATE, SECONDS = 100.0, 3000.0


@pytest.fixture
def short(monkeypatch):
    """Levels keep fewer samples, so that records of 3e5 samples have octaves of segments."""
    for module in (level, reading, summary):
        monkeypatch.setattr(module, "MAX_KEPT_SAMPLES", 1 << 16)


def simulated(text, seed=1, **options):
    return al.parse_model(text).simulate(rate=RATE, duration=SECONDS, seed=seed, **options)


def test_segments_are_an_orthonormal_basis():
    x = np.zeros(9 * lapped.SEGMENT)
    x[lapped.SEGMENT : -lapped.SEGMENT] = np.random.default_rng(0).standard_normal(
        7 * lapped.SEGMENT
    )
    assert (lapped.segments(x) ** 2).sum() == pytest.approx((x**2).sum(), rel=1e-12)


def test_a_line_stays_within_its_neighbours():
    x = np.cos(2 * np.pi * 0.2003 * np.arange(9 * lapped.SEGMENT))
    power = (lapped.segments(x) ** 2).mean(axis=0)
    top = int(power.argmax())
    power[top - 8 : top + 9] = 0.0
    # The window's side lobes: −70 dB.
    assert power.max() < 1e-7 * lapped.SEGMENT


def test_halving_keeps_low_frequencies_and_refuses_high_ones():
    f = np.array([0.01, 0.1, 0.149])
    assert lapped.low_pass_gain(f, 1) == pytest.approx(1.0, abs=1e-3)
    assert (np.abs(lapped.low_pass_gain(np.array([0.36, 0.4, 0.49]), 1)) < 2e-5).all()
    t = np.arange(4096)
    for frequency in (0.03, 0.13):
        y = lapped.halved(np.cos(2 * np.pi * frequency * (t + 0.5)))
        at = 2 * (np.arange(y.size) + lapped.REACH // 2) + 1.0
        expected = lapped.low_pass_gain(np.array([frequency]), 1) * np.cos(
            2 * np.pi * frequency * at
        )
        assert y == pytest.approx(expected, abs=1e-12)


def test_lowest_ordinates_are_those_of_the_record(short):
    r = simulated("N(N=1)+K(K=0.03)")
    found = al.fit_model(al.summarize(r), "N+K").data
    whole = _kernels.cosine_transform(np.ascontiguousarray(r.samples[: found.n]))
    known = found.ordinates.size
    assert known > 0.5 * found.samples.size
    # What is folded back from above is 100 dB below; the record's ends are mirrored alike.
    error = np.abs(found.ordinates[1:] - whole[1:known])
    assert error.max() < 1e-3 * whole[known // 2 : known].std()


MODELS = {
    "N+B+K": "N(N=1)+B(B=0.1)+K(K=0.02)",
    "N+GM": "N(N=1)+GM(q_c=0.5,correlation_time=5)",
    "N+K+BW": "N(N=1)+K(K=0.05)+BW(cutoff=20)",
    "N+RES": "N(N=1)+RES(frequency=15,damping=0.05,rms=4)",
    "N+SIN(frequency=0.2)": "N(N=1)+SIN(frequency=0.2,amplitude=1)",
    "Q+N+R": "Q(Q=0.05)+N(N=1)+R(R=0.001)",
    "N+STEP": "N(N=1)+STEP(time=1234,height=1)",
}


@pytest.mark.slow
@pytest.mark.parametrize("asked", MODELS)
def test_a_fit_of_the_summary_is_that_of_the_record(short, asked):
    r = simulated(MODELS[asked], seed=3)
    s = al.summarize(r)
    assert not s.keeps_all_samples
    ours, theirs = al.parse_model(asked).fit(s), al.parse_model(asked).fit(r)
    for found, expected in zip(ours.estimates, theirs.estimates, strict=True):
        for name, value in expected.items():
            if getattr(value, "std_error", None):
                # Single ordinates are the same. Segments see nearly the same power; of a record this short, with some ten
                # of them an octave, its ends count for more: test_summary_long.py asks 0.1 of all numbers of a long one.
                allowed = (
                    0.1 if name in ("K", "R", "frequency", "height") and "RES" not in asked else 0.3
                )
                assert abs(float(found[name]) - float(value)) < allowed * value.std_error, name
                assert found[name].std_error == pytest.approx(value.std_error, rel=0.05)
    assert ours.adequate == theirs.adequate


@pytest.mark.long
def test_checks_and_ladders_are_those_of_the_record(short):
    r = simulated("N(N=1)+RES(frequency=15,damping=0.05,rms=4)", seed=5)
    s = al.summarize(r)
    ours, theirs = al.improve(s, "N"), al.improve(r, "N")
    assert [rung.changes for rung in ours.ladder] == [rung.changes for rung in theirs.ladder]
    assert ours.verdict == theirs.verdict == "adequate"
    assert ours.recording is s
    assert al.parse_model("N").fit(s).check().suggestions[0].kind == "resonance"
    assert str(ours)
    assert ours.to_dict()["recording"]["n"] == r.n


@pytest.mark.slow
def test_a_change_of_level_is_seen_over_time(short):
    r = simulated("N(N=1)+LEVEL(start=1000,end=2000,factor=1.1)", seed=6)
    check = al.parse_model("N").fit(al.summarize(r)).check()
    assert check.suggestions[0].kind == "noise_level_change"
    assert check.suggestions[0].significant
    found = check.suggestions[0].effect
    # The time axis has 160 cells of 19 s, and the interval is within a few of them.
    assert found.start == pytest.approx(1000.0, abs=80.0)
    assert float(found.factor) == pytest.approx(1.1, rel=0.02)


@pytest.mark.slow
def test_a_temperature_explains_its_part(short):
    t = np.arange(int(RATE * SECONDS)) / RATE
    warm = {"temperature": 20.0 + 5.0 * np.sin(2 * np.pi * t / 1000.0) + t / 1000.0}
    r = simulated("N(N=1)+COV(column=temperature,coefficient=0.2)", covariates=warm)
    ours, theirs = (
        al.parse_model("N+COV(column=temperature)").fit(x) for x in (al.summarize(r), r)
    )
    value = theirs["COV.coefficient"]
    assert abs(float(ours["COV.coefficient"]) - float(value)) < 0.1 * value.std_error


@pytest.mark.slow
def test_a_short_record_is_kept_whole():
    r = simulated("N(N=1)+K(K=0.01)").trim(0.0, 2000.0)
    s = al.summarize([r.trim(0.0, 1000.0), r.trim(1000.0)])
    assert s.keeps_all_samples
    assert np.array_equal(s.recording().samples, r.samples)
    assert (
        al.parse_model("N+K").fit(s).to_dict()["effects"]
        == (al.parse_model("N+K").fit(r).to_dict()["effects"])
    )


def test_saved_pickled_and_columns(short, tmp_path):
    x = np.random.default_rng(2).standard_normal((100_000, 2)) + 5.0
    s = al.summarize(x, rate=50.0, unit="deg/s", columns=["gx", "gy"])
    s.save(tmp_path / "s.summary")
    for other in (al.Summary.load(tmp_path / "s.summary"), pickle.loads(pickle.dumps(s))):
        assert other.describe() == s.describe()
        for ours, theirs in zip(other, s, strict=True):
            assert np.array_equal(ours.reading().samples, theirs.reading().samples)
            assert np.array_equal(ours.oadev().deviation, theirs.oadev().deviation)
        more = al.summarize(x[:1000], rate=50.0, unit="deg/s", columns=["gx", "gy"], start=100_000)
        assert other.merge(more).n == 101_000
    assert (tmp_path / "s.summary").stat().st_size < 4e6
    assert s.n == 100_000


@pytest.mark.slow
def test_a_mapped_file_is_let_go_as_it_is_read(tmp_path):
    status = Path("/proc/self/status")
    if not status.is_file() or "RssFile" not in status.read_text():
        pytest.skip("the system does not tell")

    def mapped():
        line = next(x for x in status.read_text().splitlines() if x.startswith("RssFile"))
        return int(line.split()[1]) / 1024

    np.save(tmp_path / "x.npy", np.random.default_rng(4).standard_normal(1 << 23))
    x = np.load(tmp_path / "x.npy", mmap_mode="r")
    al.summarize(x[: 1 << 20], rate=RATE)
    before = mapped()
    s = al.summarize(x, rate=RATE)
    assert s.n == x.size
    # Of 64 MB.
    assert mapped() - before < 16


def test_what_a_summary_does_not_know_is_said(short):
    s = al.summarize(simulated("N(N=1)+SIN(frequency=30,amplitude=2)"))
    assert [line.frequency for line in s.lines()] == pytest.approx([30.0], abs=0.02)
    # Of 36 segments: a line ten times its noise is known to a few per cent.
    assert s.lines()[0].amplitude == pytest.approx(2.0, rel=0.1)
    assert any("keeps no phase" in finding.message for finding in s.audit)
    fit = al.parse_model("N").fit(s)
    # 3e5 samples know N to 0.13 %: the line does not disturb it, but the Allan curve shows that something is missing.
    assert float(fit["N"]) == pytest.approx(1.0, abs=0.006)
    assert not fit.adequate
    with pytest.raises(al.InputError, match="keeps phases only up to"):
        al.parse_model("N+SIN(frequency=30)").fit(s)
    with pytest.raises(al.InputError, match="needs samples"):
        al.fit_model(s, "N", method="gls")
    with pytest.raises(al.InputError, match="does not keep the samples"):
        s.recording()


def test_refusals():
    x = np.random.default_rng(3).standard_normal(100)
    s = al.summarize(x, rate=10.0)
    with pytest.raises(al.InputError, match="hold sample 50"):
        s.merge(al.summarize(x, rate=10.0, start=50))
    with pytest.raises(al.InputError, match="cannot merge x at 20 Hz"):
        s.merge(al.summarize(x, rate=20.0, start=100))
    with pytest.raises(al.InputError, match="no sampling rate"):
        al.summarize(x)
    with pytest.raises(al.TooShortError):
        al.summarize(iter([]), rate=1.0)
    with pytest.raises(al.InputError, match="sample 150 is inf"):
        al.summarize([x, np.append(x[:50], np.inf)], rate=1.0)
    with pytest.raises(al.InputError, match="no such file"):
        al.Summary.load("/nowhere/s")
