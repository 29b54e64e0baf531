"""Bands and levels of a summary: what is narrow, what moves and what happens in time, told as of the record."""

from __future__ import annotations

import numpy as np
import pytest

import allanite as al
import generators as g
from allanite.summary import level, reading, summary

RATE, LENGTH = 100.0, 300_000
TIME = np.arange(LENGTH) / RATE
WARMS_UP = 18.0 + 2.5 * np.exp(-TIME / 600.0)


@pytest.fixture(autouse=True)
def short(monkeypatch):
    """Levels keep fewer samples, so that records of 3e5 samples have octaves of segments."""
    for module in (level, reading, summary):
        monkeypatch.setattr(module, "MAX_KEPT_SAMPLES", 1 << 16)


def _both(x):
    recording = al.Recording(x, rate=RATE, unit="rad/s")
    made = al.summarize(recording)
    assert not made.keeps_all_samples
    return made, recording


def _white(seed):
    rng = np.random.default_rng(seed)
    return rng, g.white(rng, LENGTH, RATE, 0.0126)


def _kinds(study):
    return [effect.kind for effect in study.fit.model]


@pytest.mark.slow
def test_a_band_within_a_bin_is_that_of_the_record():
    rng, x = _white(1)
    x += g.resonance(rng, LENGTH, RATE, 1.3, 0.002, 0.02)
    ours, theirs = (al.improve(one, "N") for one in _both(x))
    assert _kinds(ours) == _kinds(theirs) == ["angle_random_walk", "resonance"]
    assert ours.adequate
    for name in ("RES.frequency", "RES.damping", "RES.rms"):
        value = theirs.fit[name]
        # The same ordinates: the halvings turn them by 1e-3 of their scatter.
        assert abs(ours.fit[name].value - value.value) < 0.1 * value.std_error, name
        assert ours.fit[name].std_error == pytest.approx(value.std_error, rel=0.05)


@pytest.mark.long
def test_a_band_that_moves_is_one_effect():
    rng, x = _white(2)
    x += g.moving_band(rng, LENGTH, RATE, WARMS_UP, 0.2, 0.05)
    ours, theirs = (al.improve(one, "N") for one in _both(x))
    assert _kinds(ours) == _kinds(theirs) == ["angle_random_walk", "drifting_resonance"], ours
    # What the map over time keeps of a band that moves is what is expected of it.
    assert ours.adequate, ours
    course = np.array(ours.fit.model.effects[1].course)
    parts = [part.mean() for part in np.array_split(WARMS_UP, course.size)]
    # A quarter of a half-width, and what it moves by within a part.
    assert np.abs(course - parts).max() < 0.4
    assert ours.fit["DRES.rms"].value == pytest.approx(0.05, rel=0.05)


@pytest.mark.long
def test_a_band_that_stays_does_not_move():
    for seed in range(20):
        rng, x = _white(100 + seed)
        x += g.resonance(rng, LENGTH, RATE, 18.0, 0.02, 0.1)
        fit = al.fit_model(_both(x)[0], "N+RES(f=18,damping=0.02)")
        assert "drifting_resonance" not in {s.kind for s in fit.check().significant}, seed


def test_the_cells_of_sections_are_those_of_the_record():
    """The mean ratio of power to expected power is 1 within its scatter in every section."""
    made, recording = _both(_white(3)[1])
    fits = [al.fit_model(one, "N") for one in (made, recording)]
    for fit in fits:
        number = fit.data.resolved_sections((17.0, 18.0), 16, 8.0)
        assert number == 16
        cells = fit.data.sections(al.Model(()), number).cells((16.0, 20.0), 0.05)
        ratio = cells.power / cells.expected(fit.data.terms(fit.model))
        free = cells.count.sum(axis=1)
        # 5 standard deviations of χ²/f.
        assert (
            np.abs((ratio * cells.count).sum(axis=1) / free - 1.0) < 5.0 * np.sqrt(2.0 / free)
        ).all()
        # Of 187 s, 4 Hz: 1500 ordinates; what lies outside whole cells, or in half a segment at the end, is not counted.
        assert free[:-1] == pytest.approx(1500.0, rel=0.05)


def test_neither_where_nothing_is_kept_nor_where_much_is_missing():
    x = _white(4)[1]
    data = al.fit_model(_both(x)[0], "N").data
    # 36 tiles of the top level; below 1.9 Hz samples are kept, above 30 Hz no map.
    assert [
        data.resolved_sections(band, 64, 8.0) for band in ((17.0, 18.0), (1.0, 1.1), (40.0, 41.0))
    ] == [16, 0, 0]
    x[: LENGTH // 4] = np.nan
    data = al.fit_model(_both(x)[0], "N").data
    assert data.resolved_sections((17.0, 18.0), 64, 8.0) == 0


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_a_level_that_changes_is_put_into_the_model(seed):
    x = g.louder(_white(seed)[1], RATE, 1000.0, 2000.0, 1.2)
    study = al.improve(_both(x)[0], "N")
    assert _kinds(study) == ["angle_random_walk", "noise_level_change"], study
    assert study.adequate, study
    found = study.fit.model.effects[1]
    # 24 of 160 cells about a border, each known to 4 %, say where between two levels 36 % apart it is: to 10 s; five
    # of these, a third of a tile.
    assert (found.start, found.end) == pytest.approx((1000.0, 2000.0), abs=50.0)
    # Powers of 3 tiles well inside are known to 1.5 %, so is half of that their root; three of these.
    assert found.factor == pytest.approx(1.2, abs=0.03)
    # As well as the factor of a third of the record.
    assert study.fit["N"].value == pytest.approx(0.0126, rel=0.02)


@pytest.mark.slow
def test_several_levels_are_put_into_the_model():
    x = g.louder(_white(7)[1], RATE, 800.0, 1300.0, 1.4)
    x = g.louder(x, RATE, 2100.0, 3000.0, 0.7)
    study = al.improve(_both(x)[0], "N")
    assert _kinds(study) == ["angle_random_walk", "noise_levels"], study
    assert study.adequate, study
    found = study.fit.model.effects[1]
    # Changes larger than that of the test above are placed at least as well, to 10 s: three of these. Levels likewise.
    assert found.times == pytest.approx((800.0, 1300.0, 2100.0), abs=30.0)
    assert found.factors == pytest.approx((1.4, 1.0, 0.7), abs=0.05)
