"""One sample a second that is off (the pulse of a clock next to the sensor) is one effect, not a line for each harmonic."""

import numpy as np
import pytest

import allanite as al
import generators as g


@pytest.mark.long
def test_a_train_of_pulses_is_one_line_with_its_harmonics():
    rate, n = 50.0, 20_000
    rng = np.random.default_rng(5)
    samples = g.white(rng, n, rate, 0.0126) + g.walk(rng, n, rate, 9e-5)
    size = 3.0 * 0.0126 * np.sqrt(rate)
    samples[7 :: int(rate)] += size
    study = al.improve(al.Recording(samples, rate=rate, unit="rad/s"), "N+B+K")
    added = [r.added for r in study.ladder[1:]]
    assert [e.kind for e in added] == ["sinusoid"], study
    assert added[0].frequency == pytest.approx(1.0, abs=1e-5)
    assert len(added[0].lines) > 0.4 * rate
    assert study.adequate, study
    # A line of a train of one sample in k has the amplitude 2/k of the pulse.
    sizes = [a for _, a, _ in added[0].lines]
    assert np.median(sizes) == pytest.approx(2.0 / rate * size, rel=0.15)


@pytest.mark.parametrize("n", [255, 256, 257, 1023])
def test_lines_are_looked_for_in_a_record_of_any_length(n):
    """The highest octave is complete for 2^k − 1 samples, and partial for other numbers."""
    x = np.random.default_rng(n).standard_normal(n)
    assert al.AngleRandomWalk().fit(al.Recording(x, rate=10.0)).check().adequate
