"""Evenly spaced lines that are no harmonics are one comb; others stay lines of their own."""

import numpy as np
import pytest

import allanite as al
import generators as g
from allanite.common.numbers import spacing_text
from allanite.suggestion.screens.lines import evenly_spaced

RATE, LENGTH = 100.0, 20_000


def _lines(frequencies, amplitude, seed):
    rng = np.random.default_rng([seed, 61])
    x = g.white(rng, LENGTH, RATE, 0.01)
    for f in frequencies:
        x = x + g.sinusoid(LENGTH, RATE, f, amplitude, rng.uniform(0.0, 6.28))
    return al.Recording(x, RATE, unit="deg/s")


def _periodogram(places, size=20_100):
    """Periodogram over its expectation, with lines of 50 nats at the indices `places`."""
    power = np.ones(size)
    power[np.asarray(places)] = 50.0
    return power


@pytest.mark.slow
def test_a_comb_is_one_effect():
    """Nine lines, 2.13 Hz apart from 3.37 Hz, one of them missing."""
    frequencies = [3.37 + 2.13 * k for k in range(10) if k != 4]
    study = al.improve(_lines(frequencies, 0.01, 3), "N")
    assert study.adequate
    (comb,) = (e for e in study.fit.model if e.kind == "sinusoid")
    found = [m * comb.frequency for m, _, _ in comb.lines]
    # √6/(πT) σ√2/(A√n) (Rife & Boorstyn 1974) is 4·10⁻⁴ Hz for each line; a comb's are better.
    assert found == pytest.approx(frequencies, abs=1e-3)
    assert [a for _, a, _ in comb.lines] == pytest.approx([0.01] * 9, rel=0.45)
    assert study.ladder[1].changes == ("+ comb of 9 lines",)
    assert "8 further lines 2.13 Hz apart, up to 22.54 Hz" in str(study)


@pytest.mark.slow
def test_unrelated_lines_are_no_comb():
    study = al.improve(_lines([3.3, 4.7, 8.9, 16.9, 23.2, 31.8], 0.012, 2), "N")
    assert [len(e.lines) for e in study.fit.model if e.kind == "sinusoid"] == [1] * 6


@pytest.mark.parametrize("seed", range(50))
def test_random_places_are_not_evenly_spaced(seed):
    places = np.random.default_rng([seed, 62]).choice(20_000, 20, replace=False)
    assert evenly_spaced(_periodogram(places), places.tolist()) is None


def test_harmonics_are_left_to_their_fundamental():
    places = [500 * k for k in range(1, 9)]
    assert evenly_spaced(_periodogram(places), places) is None


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 3])
def test_twelve_harmonics_are_one_effect_whichever_is_strongest(seed):
    """The strongest of equal harmonics is any of the twelve."""
    frequencies = [2.0 * m for m in range(1, 13)]
    study = al.improve(_lines(frequencies, 0.012, seed), "N")
    (comb,) = (e for e in study.fit.model if e.kind == "sinusoid")
    assert [m * comb.frequency for m, _, _ in comb.lines] == pytest.approx(frequencies, abs=1e-3)


@pytest.mark.slow
def test_many_lines_that_share_no_frequency_are_one_effect():
    """Of 20 lines with 60 of logL each, all are found in one step, since a search of one at a time takes 20."""
    rng, n, rate = np.random.default_rng(8), 60_000, 50.0
    lines = np.sort(rng.uniform(1.0, 24.0, 20))
    x = 0.01 * np.sqrt(rate) * rng.standard_normal(n)
    x += sum(g.sinusoid(n, rate, f, 4.5e-3, rng.uniform(0.0, 6.28)) for f in lines)
    study = al.improve(al.Recording(x, rate=rate, unit="deg/s"), "N")
    first = study.ladder[1]
    assert first.changes == ("+ 20 lines",), study
    found = np.array([m for m, _, _ in first.added.lines]) * first.added.frequency
    # A line is known to √(6/60)/π of 1/T.
    assert found == pytest.approx(lines, abs=5.0 * 0.1 * rate / n), study
    assert len(study.ladder) <= 3, study


def test_lines_that_are_not_among_the_clearest_complete_a_comb():
    """Three combs have 20 lines each. The search is given 32 of the 60 lines, at most 11 from one comb."""
    combs = [
        np.round(start + step * np.arange(20))
        for start, step in ((311, 2491), (437, 2513), (2090, 2467))
    ]
    every = np.concatenate(combs).astype(int)
    power = _periodogram(every, 60_000)
    clearest = np.random.default_rng(4).permutation(every)[:32].tolist()
    lowest, multiples = evenly_spaced(power, clearest)
    assert any(
        lowest * np.array(multiples) == pytest.approx(comb, abs=0.5)
        for comb in combs
        if comb.size == len(multiples)
    )


def _both_sides(offset, step, count):
    return sorted(
        [offset + step * k for k in range(count)] + [step * k - offset for k in range(1, count)]
    )


@pytest.mark.parametrize(
    ("offset", "step"), [(377.3, 3011.8), (377.3, 3040.7), (1201.0, 2555.5), (901.4, 1999.2)]
)
def test_lines_on_both_sides_of_the_multiples_are_one_comb(offset, step):
    """A line modulates a pulse train: it appears on both sides of each harmonic. One line in six is missing."""
    lines = np.round(_both_sides(offset, step, 12)).astype(int)
    lines = np.delete(lines, slice(4, None, 6))
    lowest, multiples = evenly_spaced(_periodogram(lines, 40_000), lines.tolist())
    found = lowest * np.array(multiples)
    assert max(np.abs(found - line).min() for line in lines) < 1.5
    # The highest pair may lack one side.
    assert lines.size <= len(multiples) <= 25


@pytest.mark.parametrize("step", [1700.0, 1711.5])
def test_a_comb_between_the_multiples_is_its_own_image(step):
    lines = np.round(step * (0.5 + np.arange(14))).astype(int)
    lowest, multiples = evenly_spaced(_periodogram(lines, 40_000), lines.tolist())
    assert lowest * np.array(multiples) == pytest.approx(lines, abs=1.0)


@pytest.mark.slow
def test_combs_on_both_sides_of_the_multiples_are_one_effect_each():
    """Two families of images interleave, as those of two lines that are sampled and held."""
    families = [_both_sides(0.190, 1.5203, 12), _both_sides(0.47, 1.71, 10)]
    study = al.improve(_lines(np.concatenate(families), 0.012, 6), "N")
    assert study.adequate, study
    found = {len(e.lines): e for e in study.fit.model if e.kind == "sinusoid"}
    assert sorted(found) == [19, 23], study
    for count, family in ((23, families[0]), (19, families[1])):
        places = [m * found[count].frequency for m, _, _ in found[count].lines]
        assert places == pytest.approx(family, abs=2e-3)
    assert "further lines on both sides of multiples of 1.52 Hz" in str(study)


@pytest.mark.slow
def test_combs_on_several_carriers_are_combs():
    """Three combs whose lines interleave: each is one effect, found in one step with the others."""
    combs = [(0.187, 1.495, 14), (1.292, 1.477, 13), (1.33, 1.5202, 12)]
    frequencies = [start + step * k for start, step, count in combs for k in range(count)]
    study = al.improve(_lines(frequencies, 0.012, 5), "N")
    assert study.adequate, study
    found = sorted(e.frequency for e in study.fit.model if e.kind == "sinusoid")
    assert found == pytest.approx(sorted(start for start, _, _ in combs), abs=1e-3)
    assert sorted(len(e.lines) for e in study.fit.model if e.kind == "sinusoid") == [12, 13, 14]


@pytest.mark.parametrize("apart", [3.4, 4.3, 6.0, 8.0])
def test_leakage_of_strong_lines_is_no_second_comb(apart):
    """A mirror image of each line about a multiple of the spacing would lie `apart` ordinates from it."""
    n = 40_000
    x = np.random.default_rng(1).standard_normal(n)
    for k in range(10):
        half_cycles = 850 + apart / 2 + 1700 * k
        x += 0.3 * np.sin(np.pi * half_cycles * np.arange(n) / n + k)
    check = al.fit_model(al.Recording(x, 1.0, unit="deg/s"), "N").check()
    comb = check.significant[0].effect
    assert comb.kind == "sinusoid"
    assert len(comb.lines) == 10


def test_random_lines_are_seldom_on_both_sides_of_multiples():
    """2 in 1000 sets of five: at most 60 of 20 000 sets with 40 ± 6.3 expected (three standard deviations)."""
    rng = np.random.default_rng(0)
    texts = [spacing_text(1.0, [1.0, *np.sort(rng.uniform(1.0, 30.0, 4))]) for _ in range(20_000)]
    assert sum("both sides" in text for text in texts) <= 60
