"""A summary in the place of a recording: what works, and what is refused with a remedy."""

import numpy as np
import pytest

import allanite as al


def long_summary():
    """Summary of 300 000 samples of white noise and flicker, of which single samples are not kept."""
    truth = al.parse_model("N(N=0.1)+B(B=0.05)")
    x = truth.simulate(duration=30_000, rate=10, seed=1, unit="deg/h").samples
    return x, al.summarize([x], rate=10, unit="deg/h")


def test_a_data_sheet_with_a_minimum_is_compared_with_a_summary():
    x, summary = long_summary()
    assert not summary.keeps_all_samples
    sheet = al.DataSheet("sheet", (al.Quoted("in_run_bias_stability", 0.03, "deg/h"),))
    logs = (summary, al.Recording(x, rate=10, unit="deg/h"))
    minima = [
        al.compare_datasheet(al.fit_model(log, "N+B"), sheet).rows[0].measured for log in logs
    ]
    assert np.isclose(minima[0].value, minima[1].value, rtol=0.05)


def test_other_deviations_of_a_summary_are_refused_with_a_remedy():
    _, summary = long_summary()
    with pytest.raises(al.InputError, match=r"call summary\.column\(0\)\.oadev\(\)"):
        al.hdev(summary)
