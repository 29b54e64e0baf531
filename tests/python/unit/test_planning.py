"""Planning: what must hold of powers and plans whatever the numbers, and what is known in closed form."""

import itertools
import json
import subprocess
import sys

import numpy as np
import pytest
from click.testing import CliRunner

import allanite as al
import generators as g
from allanite.cli import cli
from allanite.fit.rivals.line_trials import trials_at

BASE = "N(N=0.0126)+B(B=0.002)+K(K=9.07e-5)"
LAG = "GM(q_c=1.9e-3,T=30)"


def test_white_noise_is_known_to_one_over_root_two_n():
    found = al.detection_power("N(N=0.01)", duration=1000.0, rate=100.0)
    # n − 1 ordinates, each one degree of freedom of N²: relative error 1/√(2(n−1)).
    assert found.relative("N") == pytest.approx(1 / np.sqrt(2 * 99_999), rel=1e-6)
    assert found.effect is found.probability is found.delta_log_likelihood is None


def test_a_line_in_white_noise_is_the_textbook_case():
    n, rate, level, size = 100_000, 100.0, 0.01, 6e-4
    found = al.detection_power(
        f"N(N={level})", f"SIN(f=7.3,A={size},phase=0.4)", duration=n / rate, rate=rate
    )
    energy = size**2 * n / (level**2 * rate)  # A² n/σ²
    # Rife & Boorstyn 1974: var A = 2σ²/n, var f = 6·4/((2π)² …): √(24 σ²/(A² n (n²−1)))/(2π) per sample.
    assert found.standard_errors["SIN.amplitude"] == pytest.approx(
        size * np.sqrt(2 / energy), rel=0.02
    )
    assert found.standard_errors["SIN.frequency"] == pytest.approx(
        np.sqrt(24 / energy) / n * rate / (2 * np.pi), rel=0.03
    )
    # ½ Σ s²/S = A² n/(4σ²), and half of each of three numbers. N takes up a hundred-thousandth of it.
    assert found.delta_log_likelihood == pytest.approx(energy / 4 + 1.5, rel=0.02)
    x = found.needed
    trials = float(trials_at(np.array([7.3 * n / rate]), n, rate)[0])
    chance = trials * np.sqrt(x) * np.exp(-x)
    # A share of 1 % for each of nine to eleven families.
    assert 0.01 / 12 < chance < 0.01 / 8


def test_a_ramp_in_white_noise():
    n, rate, level, slope = 20_000, 10.0, 0.1, 2e-4
    found = al.detection_power(f"N(N={level})", f"R(R={slope})", duration=n / rate, rate=rate)
    # var R = 12 σ²/(n³ τ0²), σ² = N² rate.
    expected = np.sqrt(12 * level**2 * rate / n**3) * rate
    assert found.standard_errors["R"] == pytest.approx(expected, rel=1e-3)


def test_more_record_tells_more():
    powers = [
        al.detection_power(BASE, LAG, duration=t, rate=20.0) for t in (1800, 3600, 7200, 14400)
    ]
    for short, long in itertools.pairwise(powers):
        assert short.probability < long.probability
        assert short.delta_log_likelihood < long.delta_log_likelihood
        for name, error in long.standard_errors.items():
            assert error < short.standard_errors[name]


def test_an_effect_that_is_not_there_is_found_at_the_rate_of_false_alarms():
    found = al.detection_power("N(N=0.0126)", "K(K=1e-9)", duration=3600.0, rate=10.0)
    assert found.probability < 0.01
    assert found.standard_errors["K"] > found.value("K")


@pytest.mark.slow
def test_a_plan_is_the_shortest_record_that_suffices():
    found = al.plan(BASE, find=LAG, power=0.9, rate=10.0)
    assert found.power.probability >= 0.9
    assert (
        al.detection_power(BASE, LAG, duration=found.duration / 1.03, rate=10.0).probability < 0.9
    )
    found = al.plan(BASE, know="K", to=0.1, rate=1.0)
    assert found.power.relative("K") <= 0.1
    assert al.detection_power(BASE, duration=found.duration / 1.03, rate=1.0).relative("K") > 0.1


def test_the_rate_is_the_lowest_that_is_as_good():
    found = al.plan(BASE, know="K")
    durations = dict(found.alternatives)
    assert durations[found.rate] == found.duration
    assert found.duration <= 1.1 * min(d for d in durations.values() if d is not None)
    assert all(durations[r] > 1.1 * min(durations.values()) for r in durations if r < found.rate)


def test_a_column_has_to_be_described():
    effect = al.effects.Covariate(column="temperature", coefficient=1e-3, lag=0.0)
    with pytest.raises(al.InputError, match="covariates="):
        al.detection_power("N(N=0.01)", effect, duration=1000.0, rate=10.0)
    day = {"temperature": lambda t: 5.0 * np.sin(2 * np.pi * t / 500.0)}
    found = al.detection_power("N(N=0.01)", effect, duration=1000.0, rate=10.0, covariates=day)
    # Two whole periods: var c = N²/(T·mean square of the column).
    assert found.standard_errors["COV.coefficient"] == pytest.approx(
        0.01 / np.sqrt(1000.0 * 12.5), rel=1e-2
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: al.detection_power("N", duration=100.0, rate=10.0), "N has no value"),
        (lambda: al.detection_power("N(N=1)", "K", duration=100.0, rate=10.0), "K has no value"),
        (lambda: al.detection_power("N(N=1)", "OUT", duration=100.0, rate=10.0), "not planned"),
        (
            lambda: al.detection_power("N(N=1)", "K(K=1)+B(B=1)", duration=100.0, rate=1.0),
            "one at a time",
        ),
        (lambda: al.detection_power("N(N=1)", duration=-1.0, rate=10.0), "positive"),
        (lambda: al.plan("N(N=1)"), "find= .*know= .*tell="),
        (lambda: al.plan("N(N=1)", know="K"), "no such parameter"),
        (lambda: al.plan("N(N=1)", know="N", to=0.0), "share"),
        (lambda: al.plan("N(N=1)", find="K(K=1)", power=1.0), "probability"),
        (lambda: al.plan("N(N=1)", find="Q(Q=1e-12)", rate=1.0), "ten years"),
    ],
)
def test_what_cannot_be_planned_is_said(call, message):
    with pytest.raises(al.InputError, match=message) as caught:
        call()
    assert "\n" not in str(caught.value)


def test_a_record_of_a_few_samples():
    with pytest.raises(al.TooShortError, match="at least 32"):
        al.detection_power("N(N=1)", duration=1.0, rate=10.0)


def test_command_prints_a_document():
    arguments = ["plan", "--model", BASE, "--know", "K", "--to", "20%", "--rate", "1", "--json"]
    result = CliRunner().invoke(cli, arguments)
    assert result.exit_code == 0, result.output
    document = json.loads(result.stdout)
    assert document["schema"] == "allanite/plan/1"
    assert document["power"]["standard_errors"]["K"]["relative"] <= 0.2
    found = al.plan(BASE, know="K", to=0.2, rate=1.0)
    assert document["duration_s"] == found.duration


def test_command_prints_a_table():
    arguments = ["plan", "--model", BASE, "--find", LAG, "--rate", "10", "--duration", "7200"]
    result = CliRunner().invoke(cli, arguments)
    assert result.exit_code == 0, result.output
    assert "check finds gauss_markov with probability" in result.stdout
    assert "GM.correlation_time" in result.stdout


def test_a_planned_record_tells_two_effects_apart():
    """Expected odds of 1000 : 1 are 6.9 nats; the fits gain ½ nat more by chance, for three parameters instead of two.

    The log-likelihood ratio of one record scatters by √(2·6.9) = 3.7, the mean of 20 by 0.83. The mean lies within four
    standard errors of 7.4, well above that of a record of a quarter of the length (1.7 + ½).
    """
    planned = al.plan("N(N=0.01)+GM(q_c=0.003,correlation_time=20)", tell=("B", "GM"), rate=20.0)
    risen = []
    for seed in range(20):
        rng = np.random.default_rng([seed, 2026])
        n = round(planned.duration * planned.rate)
        x = g.white(rng, n, 20.0, 0.01) + g.gauss_markov(rng, n, 20.0, 0.003, 20.0)
        recording = al.Recording(x, rate=20.0, unit="rad/s")
        fits = [al.fit_model(recording, m).solution.log_likelihood for m in ("N+GM", "N+B")]
        risen.append(fits[0] - fits[1])
    assert abs(np.mean(risen) - 7.4) < 4 * 0.83


@pytest.mark.slow
def test_two_effects_are_told_apart_only_where_one_is_in_the_model():
    with pytest.raises(al.InputError, match="has none of the two"):
        al.plan("N(N=0.01)", tell=("K", "GM"))
    with pytest.raises(al.InputError, match="has both of the two"):
        al.plan("N(N=0.01)+B(B=0.01)+K(K=0.001)", tell=("K", "B"))
    with pytest.raises(al.InputError, match="the other one can look like it"):
        al.plan("N(N=0.01)+K(K=0.001)", tell=("K", "GM"), rate=1.0)


@pytest.mark.skipif(sys.platform != "linux", reason="limits the address space")
def test_a_plan_takes_no_memory_for_the_samples_of_ten_years():
    """Ten years at 10 Hz are 3·10⁹ samples; their squares alone would take 24 GB."""
    code = (
        "import resource; resource.setrlimit(resource.RLIMIT_AS, (6 * 10**9, 6 * 10**9));"
        "from allanite.cli import main; main()"
    )
    words = ["plan", "--model", "N(N=0.003)+K(K=1e-4)", "--tell", "K,GM", "--rate", "10"]
    answer = subprocess.run(
        [sys.executable, "-c", code, *words], capture_output=True, text=True, check=False
    )
    assert answer.returncode == 2
    assert "ten years of record do not suffice" in answer.stderr


@pytest.mark.parametrize(
    ("model", "rows", "remark"),
    [
        (
            "N(N=0.3 deg/sqrt(h))+GM(T=60 s,q_c=138 deg/h/sqrt(h))",
            {"N": ("0.3", "°/√h"), "GM.correlation_time": ("60", "s"), "GM.q_c": ("138", "°/h/√h")},
            False,
        ),
        ("N(N=0.003)+K(K=1e-5)", {"N": ("0.003", "U/√Hz"), "K": ("10⁻⁵", "U/√s")}, True),
    ],
)
def test_a_plan_prints_the_unit_of_each_value(model, rows, remark):
    arguments = ["plan", "--model", model, "--rate", "100", "--duration", "3600"]
    out = CliRunner().invoke(cli, arguments).output
    for name, (value, unit) in rows.items():
        row = next(line.split() for line in out.splitlines() if line.startswith(f"{name} "))
        assert (row[1], row[-1]) == (value, unit)
    assert ("U is the unit of the samples" in out) == remark


@pytest.mark.parametrize("name", ["N", "K"])
def test_a_plan_beside_a_line(name):
    """The line of 2.5 Hz is above the Nyquist frequency of the record that suffices for the parameter."""
    plain = al.parse_model("N(N=0.005)+K(K=1e-4)")
    line = al.parse_model("SIN(frequency=2.5,amplitude=0.003)").effects[0]
    expected = al.plan(plain, know=name, rate=100.0)
    found = al.plan(plain + line, know=name, rate=100.0)
    assert found.duration == pytest.approx(expected.duration, rel=0.1)


def test_a_parameter_without_a_value_is_one_line():
    model = al.parse_model("N(N=0.005)+B(B=0)+K(K=1e-4)")
    with pytest.raises(
        al.InputError, match=r"B has no value.*give one in the model, such as B\(B=…\)"
    ):
        al.plan(model, know="B", rate=100.0)
