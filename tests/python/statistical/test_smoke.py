"""The claims of this folder at a hundredth of their records, in seconds, for `make test`.

Only what is badly wrong is found here: chance alone exceeds the bounds in one run in ten thousand.
"""

import numpy as np
import pytest
from scipy.stats import kstest

import allanite as al
import generators as g

RECORDS, LENGTH = 40, 2048


def records(salt):
    for seed in range(RECORDS):
        rng = np.random.default_rng([salt, seed])
        samples = g.white(rng, LENGTH, 1.0, 1.0) + g.walk(rng, LENGTH, 1.0, 0.03)
        yield al.Recording(samples, rate=1.0, unit="1")


def test_intervals_cover_and_p_values_are_uniform():
    inside, p_values = {"N": 0, "K": 0}, []
    for recording in records(41):
        fit = al.fit_model(recording, "N+K")
        for key, truth in (("N", 1.0), ("K", 0.03)):
            low, high = fit[key].interval
            inside[key] += low <= truth <= high
        p_values.append(fit.misfit.p_value)
    # Binomial (40, 0.95): 31 or fewer have a chance of 7e-5.
    assert min(inside.values()) >= 32, inside
    assert kstest(p_values, "uniform").pvalue > 1e-4


@pytest.mark.slow
def test_nothing_is_invented_and_a_line_is_found():
    invented = found = 0
    for i, recording in enumerate(records(42)):
        if i == 5:
            break
        invented += bool(al.fit_model(recording, "N+K").check().significant)
        # 14 times the standard error of its amplitude, sqrt(2/n): missed by nobody.
        line = g.sinusoid(LENGTH, 1.0, 0.0713, 14 * np.sqrt(2 / LENGTH), i)
        louder = al.Recording(recording.samples + line, rate=1.0, unit="1")
        named = [s.kind for s in al.fit_model(louder, "N+K").check().significant]
        found += "sinusoid" in named
    # False alarms are at 1 %: three of five have a chance of 1e-5.
    assert invented <= 2
    assert found == 5
