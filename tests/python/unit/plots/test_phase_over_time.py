"""Figures over time of the phase of a clock: they show its differences."""

import numpy as np

import allanite as al


def test_a_step_of_frequency_is_drawn_over_the_frequency_of_a_phase():
    frequency = 1e-9 * np.random.default_rng(1).standard_normal(4000)
    frequency[1500:] += 1e-9
    phase = np.concatenate([[0.0], np.cumsum(frequency)])
    log = al.Recording(phase, rate=1.0, unit="s", quantity="angle", columns=["clock"])
    check = al.fit_model(log, "N+B").check()
    (panel,) = [p for p in check.plot().panels if p.title == "Samples"]
    means, step = panel.marks
    assert "frequency step" in step.label
    late = np.asarray(step.x) > 0.5 * np.max(step.x)
    assert step.y[-1] - step.y[0] == np.ptp(step.y)
    np.testing.assert_allclose(
        np.mean(np.asarray(step.y)[late]), np.mean(frequency[2000:]), atol=1e-10
    )
    np.testing.assert_allclose(np.mean(means.y), np.mean(frequency), atol=1e-10)
