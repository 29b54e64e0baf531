"""Rates, holdover bands and the hat, on a few of the records of benches/claims/trends.py, holdover.py and hats.py."""

import runpy
import sys
from pathlib import Path

import numpy as np
import pytest

from counts import records

pytestmark = pytest.mark.statistical
CLAIMS = Path(__file__).parents[3] / "benches" / "claims"
# The programs import their neighbors.
sys.path.insert(0, str(CLAIMS))


def study_of(name):
    return runpy.run_path(str(CLAIMS / f"{name}.py"))["study"]


@pytest.mark.long
def test_rates_are_as_good_as_with_the_true_noise():
    count = records(30, 500)
    rows, names, _ = study_of("trends")(count, 1500)
    rate, error, covered, known, known_error = rows.T
    # The estimates differ by a tenth of an error in most series: of 30, the ratio of the errors scatters by 0.02.
    ratio = np.sqrt((rate**2).mean() / (known**2).mean())
    assert abs(ratio - 1.0) < 0.01 + 4 * 0.1 / np.sqrt(count)
    # A stated error scatters by 20 % from series to series.
    assert abs(error.mean() / known_error.mean() - 1.0) < 0.01 + 4 * 0.2 / np.sqrt(count)
    # 95 %: four of 30 or more fail in 6 %, six or more in 0.3 %.
    assert covered.sum() >= count * 0.95 - 3.5 * np.sqrt(count * 0.95 * 0.05)
    assert names.most_common(1)[0][0] == "N+B"


@pytest.mark.long
def test_holdover_bands_hold():
    count = records(24, 300)
    shares = [rows[..., 0].mean() for rows in study_of("holdover")(count, 600).values()]
    # The three times of a clock are nearly one: of 24 clocks, 95 ± 4.4 %; of 300, ± 1.3 %.
    assert abs(np.mean(shares) - 0.95) < 0.02 + 3 * np.sqrt(0.05 * 0.95 / count)


@pytest.mark.long
def test_holdover_bands_include_slow_noise_and_drift_that_the_record_hardly_shows():
    count = records(24, 300)
    kinds = ("white FM, hidden random-walk FM", "white FM, hidden drift")
    found = study_of("holdover")(count, 1200, kinds=kinds)
    held = np.concatenate([rows[:, -1, 0] for rows in found.values()])
    # At 3 h 90 % of these bands contain the phase: noise and drift of this size are those that are overlooked most.
    assert held.mean() > 0.9 - 2.5 * np.sqrt(0.1 * 0.9 / count)


def test_intervals_of_the_hat_hold():
    count = records(15, 300)
    found = study_of("hats")(count, 256)
    held = np.concatenate([rows[:, 2] for rows in found.values()])
    # Averaging times share samples: some three independent intervals for each clock of a record.
    independent = 9 * count
    assert abs(held.mean() - 0.95) < 0.02 + 3 * np.sqrt(0.05 * 0.95 / independent)
