"""The first and last samples of a record: an outlier there is found, and nothing else is suggested for it.

The noise of a clock's counter is here, too, because it once appeared in the same study.
"""

import numpy as np
import pytest

import allanite as al
import generators as g
from allanite.fit.likelihood.data import prepare
from allanite.suggestion.screens.exclusions import end_outlier_scores

RATE, LENGTH = 1.0, 100_000


def _clock(rng, late=0.0, rising=0.0):
    """Fractional frequency of a clock whose first reading is `late` (s), and whose counter has noise that rises with f."""
    read = 1.8e-10 * rng.standard_normal(LENGTH + 2)
    phase = read[1:] - rising * read[:-1]
    phase += np.cumsum(1e-11 * rng.standard_normal(LENGTH + 1))
    phase[0] -= late
    return al.Recording(np.diff(phase), rate=RATE, unit="1")


@pytest.mark.long
def test_a_late_first_reading_of_a_clock_is_an_outlier():
    """A real clock once ended with a step, a high-pass and burst noise instead."""
    study = al.improve(_clock(np.random.default_rng(5), late=2e-8))
    assert [e.short for e in study.fit.model] == ["N", "B", "K", "OUT", "Q"]
    assert len(study.ladder) == 2
    assert study.adequate
    assert study.fit["N"].interval[0] < 1e-11 < study.fit["N"].interval[1]


@pytest.mark.long
def test_noise_of_a_counter_is_no_high_pass():
    """A high-pass at a quarter of the rate, with 40 times the white FM, once described the rise better than white PM."""
    study = al.improve(_clock(np.random.default_rng(0), rising=0.1))
    assert [e.short for e in study.fit.model] == ["N", "B", "K", "Q"]
    # The model is not quite true: its N is known to some per cent.
    assert study.fit["N"].value == pytest.approx(1e-11, rel=0.1)


@pytest.mark.parametrize("place", [0, 1, 40_000, -1])
def test_the_audit_says_where_the_largest_outlier_is(place):
    """For the first sample, it once named the second, with a value below the limit of the same sentence."""
    x = np.random.default_rng(3).standard_normal(LENGTH)
    x[place] = 40.0
    [found] = [f for f in al.Recording(x, rate=RATE).audit if f.kind == "outliers"]
    assert found.values["time_s"] == place % LENGTH
    assert "(40" in found.found


@pytest.mark.long
@pytest.mark.parametrize("place", [0, 3, -1, -20])
def test_an_outlier_at_either_end_is_counted(place):
    rng = np.random.default_rng(2)
    x = g.white(rng, LENGTH, 100.0, 0.01) + g.walk(rng, LENGTH, 100.0, 1e-3)
    x[place] += 20.0 * 0.1
    study = al.improve(al.Recording(x, rate=100.0, unit="rad/s"), "N+K")
    assert [e.short for e in study.fit.model] == ["N", "K", "OUT"]
    assert study.fit.model.effects[-1].values["count"] == 1


def _switched_on(begins):
    """White noise of 0.1 and a walk, 20 minutes at 50 Hz, and a disturbance of the first samples."""
    rng = np.random.default_rng(1)
    x = g.white(rng, 60_000, 50.0, 0.1 / np.sqrt(50.0)) + g.walk(rng, 60_000, 50.0, 7e-4)
    x[: begins.size] += begins
    return al.improve(al.Recording(x, rate=50.0, unit="rad/s"), "N+K")


@pytest.mark.long
@pytest.mark.parametrize("decay", [5, 20, 100])
def test_a_settling_of_some_samples_is_a_warm_up_and_no_outliers(decay):
    """The first samples of a settling from 50 standard deviations are outliers; two seconds once gave nine effects."""
    study = _switched_on(5.0 * np.exp(-np.arange(60_000) / decay))
    assert [e.short for e in study.fit.model] == ["N", "K", "WARM"]
    assert study.adequate
    low, high = study.fit["WARM.time_constant"].interval
    assert low < decay / 50.0 < high


@pytest.mark.long
@pytest.mark.parametrize("count", [5, 20])
def test_a_sensor_that_says_nothing_at_first_has_outliers_there(count):
    """Each is compared with samples that are no outliers; once four of five were excluded, and a warm-up was added."""
    study = _switched_on(np.full(count, 5.0))
    assert [e.short for e in study.fit.model] == ["N", "K", "OUT"]
    assert study.fit.model.effects[-1].values["count"] == count


NOISES = {
    "white": lambda rng, n: g.white(rng, n, RATE, 1.0),
    "flicker": lambda rng, n: g.flicker(rng, n, RATE, 1.0),
    "walk": lambda rng, n: g.walk(rng, n, RATE, 1.0),
    "laplace": lambda rng, n: rng.laplace(size=n),
    "student": lambda rng, n: rng.standard_t(3.0, size=n),
    "coarse": lambda rng, n: np.round(0.4 * rng.standard_normal(n)),
}


@pytest.mark.long
@pytest.mark.parametrize("kind", NOISES)
def test_the_ends_of_a_record_without_outliers_say_nothing(kind):
    """One record in 1000 has one by design: three or more of 100 in 0.02 % of the runs."""
    rngs = (np.random.default_rng([seed, *kind.encode()]) for seed in range(100))
    records = (al.Recording(NOISES[kind](rng, 4096), rate=RATE) for rng in rngs)
    # No known function of time in the model: any solution serves all.
    solution = al.parse_model("N").fit(al.Recording(np.arange(100) % 3, rate=RATE)).solution
    assert sum(bool(end_outlier_scores(solution, prepare(record)).any()) for record in records) <= 2
