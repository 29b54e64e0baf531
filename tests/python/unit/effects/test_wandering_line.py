"""A line whose frequency wanders is one effect, with its harmonics, and states how far it wanders."""

import numpy as np
import pytest

import allanite as al
import generators as g

RATE, LENGTH = 100.0, 60_000


def _study(rng, line):
    x = g.white(rng, LENGTH, RATE, 0.005) + g.walk(rng, LENGTH, RATE, 4e-5) + line
    return al.improve(al.Recording(x, rate=RATE, unit="deg/s"), "N+K")


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_mains_that_wander_are_one_line(seed):
    """2π·0.03 Hz·10 s = 1.9: the spectrum is the frequency's distribution, whose width is known to 9 % (60 values)."""
    rng = np.random.default_rng(seed)
    study = _study(rng, g.wandering_line(rng, LENGTH, RATE, 23.4, 0.03, 10.0, 0.02))
    assert study.adequate, study
    assert [e.kind for e in study.fit.model][2:] == ["wandering_line"], study
    assert study.fit["WLINE.wander"].value == pytest.approx(0.03, rel=0.3)
    assert study.fit["WLINE.rms"].value == pytest.approx(0.02 / np.sqrt(2.0), rel=0.2)
    assert study.fit["N"].value == pytest.approx(0.005, rel=0.02)


@pytest.mark.slow
def test_an_engine_is_found_with_its_harmonics_in_one_step():
    rng = np.random.default_rng(1)
    orders = ((1.0, 1.0), (2.0, 0.6), (3.0, 0.3))
    study = _study(rng, g.wandering_line(rng, LENGTH, RATE, 11.3, 0.34, 4.0, 0.06, orders))
    lines = sorted(e.frequency for e in study.fit.model if e.kind == "wandering_line")
    assert lines == pytest.approx([11.3, 22.6, 33.9], rel=0.02), study
    assert len(study.ladder[1].new) == 3, study


@pytest.mark.slow
def test_a_resonance_remains_a_resonance():
    rng = np.random.default_rng(2)
    study = _study(rng, g.resonance(rng, LENGTH, RATE, 11.3, 0.02, 0.05))
    assert [e.kind for e in study.fit.model][2:] == ["resonance"], study


@pytest.mark.parametrize("wander", [0.3, 1e-2, 1e-4])
def test_state_space_and_simulation_have_the_spectrum_of_the_terms(wander):
    from allanite.statespace.sections import sections_of

    line = al.effects.WanderingLine(frequency=11.3, wander=wander, rms=0.1)
    terms = line.terms(RATE)
    (section,) = sections_of(terms, LENGTH)
    lags = [0, 1, 7, 100]
    found = [
        section.H @ np.linalg.matrix_power(section.F, k) @ section.P0 @ section.H for k in lags
    ]
    assert found == pytest.approx([sum((t.a * t.phi**k).real for t in terms) for k in lags])
    assert np.linalg.eigvalsh(section.Q).min() > -1e-12 * np.linalg.eigvalsh(section.Q).max()
    _, (sd, *numbers) = line.generator(RATE)
    w = 2.0 * np.pi * (11.3 + wander * np.array([-1.0, 0.0, 1.0])) / RATE
    z = np.exp(-1j * w)
    gain = np.array([1.0 + 0j] * 3)
    for b0, b1, b2, a1, a2 in np.reshape(numbers, (-1, 5)):
        gain *= (b0 + b1 * z + b2 * z**2) / (1.0 + a1 * z + a2 * z**2)
    # `MAX_GENERATOR_ERROR`.
    assert sd**2 * np.abs(gain) ** 2 == pytest.approx(sum(t.spectrum(w) for t in terms), rel=1e-3)


@pytest.mark.parametrize(("f", "wander"), [(49.5, 0.2), (49.9, 0.2), (0.5, 0.2), (1.0, 0.01)])
def test_a_line_near_the_ends_of_the_spectrum_is_simulated_with_its_variance(f, wander):
    """The variance of n samples has about n·wander/rate·2√π degrees of freedom; four standard errors."""
    n = 200_000
    line = al.parse_model(f"WLINE(frequency={f},wander={wander},rms=0.3)")
    x = line.simulate(n=n, rate=RATE, seed=1).samples
    freedom = 2.0 * np.sqrt(np.pi) * n * wander / RATE
    assert np.var(x) == pytest.approx(0.09, rel=4.0 * np.sqrt(2.0 / freedom))


@pytest.mark.parametrize("on", [False, True])
def test_a_fan_that_runs_for_a_while_has_a_level(on):
    """A line of 9 Hz that wanders by 0.2 Hz, for 130 of 400 s or always; neither is a tone burst."""
    rng, n, rate = np.random.default_rng([4, 55]), 20_000, 50.0
    t = np.arange(n) / rate
    line = g.wandering_line(rng, n, rate, 9.0, 0.2, 10.0, 0.05)
    samples = g.white(rng, n, rate, 0.01) + line * ((t > 120.0) & (t < 250.0) if on else 1.0)
    log = al.Recording(samples, rate=rate, unit="deg/s")
    found = al.fit_model(log, "N+WLINE(frequency=9,wander=0.2)").check().significant
    assert [s.kind for s in found] == ["band_level_change"] * on
    for s in found:
        assert (s.effect.start, s.effect.end) == pytest.approx((120.0, 250.0), abs=2.0)
        assert s.effect.factor > 5.0
