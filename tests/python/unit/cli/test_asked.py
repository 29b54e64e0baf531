"""Numbers that cannot be used: one line from the command, one class of error from Python."""

import numpy as np
import pytest

import allanite as al
from allanite.common.errors import about
from allanite.common.validation import positive, positive_rate, sample_index, whole
from command_line import refused

INF, NAN = float("inf"), float("nan")
WHITE = "N(N=0.1)"


def test_whole_numbers():
    for value in (5, 5.0, np.int16(5), np.float64(5), np.uint64(5)):
        assert whole(value, "n", 1, 9) == 5
    assert whole(2**64 - 1, "seed", 0, 2**64 - 1) == 2**64 - 1
    for value in (1.5, NAN, INF, "5", None, [1], -1, 10, 10**400):
        with pytest.raises(al.InputError, match="n = "):
            whole(value, "n", 1, 9)


def test_positive_numbers_rates_and_moments():
    assert positive(2, "duration", "s", "") == 2.0
    assert positive_rate(np.float32(2)) == 2.0
    assert sample_index(1.5, 10.0) == 15
    for value in (0, -1, NAN, INF, 10**400, "x", None):
        with pytest.raises(al.InputError, match=r"duration = .* s: longer"):
            positive(value, "duration", "s", "longer")
    for value in (0, -1, NAN, INF, 1e300, 1e-320, "x", None):
        with pytest.raises(al.InputError, match="log: the rate must be"), about("log"):
            positive_rate(value)
    for value in (NAN, INF):
        with pytest.raises(al.InputError, match="finite"):
            sample_index(value, 1.0)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"duration": NAN}, "duration = nan s"),
        ({"duration": INF}, "duration = inf s"),
        ({"duration": 1e30}, "1e\\+30 samples"),
        ({"duration": 0.1}, "longer duration"),
        ({"n": 1.5}, "n = 1.5: a whole number"),
        ({"n": 0}, "a record of 0 samples"),
        ({"n": 10**30}, "n = 1000000"),
        ({"n": "5"}, "n = '5'"),
        ({"n": 5, "seed": -1}, "seed = -1"),
        ({"n": 5, "seed": 2**64}, "seed = 18446744073709551616"),
        ({"n": 5, "seed": 1.5}, "seed = 1.5"),
        ({"n": 5, "seed": None}, "seed = None"),
        ({"n": 5, "axis": -1}, "axis = -1"),
        ({"n": 5, "rate": INF}, "rate"),
        ({"n": 5, "rate": "fast"}, "rate"),
        ({"n": 5, "covariates": {"t": [1.0, 2.0]}}, "'t' has shape"),
    ],
)
def test_simulate_refuses_with_the_package_s_error(given, words):
    with pytest.raises(al.InputError, match=words):
        al.AngleRandomWalk(N=0.1).simulate(**({"rate": 1.0} | given))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", ["N", "K", "Q"])
def test_values_whose_squares_overflow(name):
    with pytest.raises(al.InputError, match=f"{name} = 1e\\+308 is out of its range"):
        al.parse_model(f"{name}({name}=1e308)")
    with pytest.raises(al.InputError, match=r"too large for a double|not finite"):
        al.parse_model(f"{name}({name}=1e150)").simulate(n=5, rate=1e30 if name in "NQ" else 1e-30)


def test_a_value_that_is_no_number():
    with pytest.raises(al.InputError, match="is not a number"):
        al.AngleRandomWalk(N=[1.0])


def test_trim_refuses_what_is_no_time():
    record = al.Recording(np.arange(20.0), rate=1.0)
    for bounds in ((NAN, None), (None, INF)):
        with pytest.raises(al.InputError, match="finite"):
            record.trim(*bounds)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("simulate", WHITE, "--rate", 1, "--duration", "nan"), ("--duration", "nan")),
        (("simulate", WHITE, "--rate", 1, "--duration", "inf"), ("--duration", "inf")),
        (("simulate", WHITE, "--rate", 1, "--duration", "1e30"), ("1e+30", "shorter")),
        (("simulate", WHITE, "--rate", 1, "-n", 10**30), ("--samples", "up to")),
        (("simulate", WHITE, "--rate", "inf", "-n", 5), ("--rate", "inf")),
        (("simulate", WHITE, "--rate", 1, "-n", 5, "--seed", -1), ("--seed", "-1")),
        (("simulate", WHITE, "--rate", 1, "-n", 5, "--seed", "9" * 23), ("--seed", "999")),
        (
            ("simulate", "N(N=1e308)", "--rate", 1, "-n", 5),
            ("angle_random_walk", "1e+308", "range"),
        ),
        (("demo", "--seed", -1), ("--seed", "-1")),
        (("plan", "--model", "N(N=1)", "--know", "N", "--rate", "inf"), ("rate", "inf")),
        (
            ("plan", "--model", "N(N=1)+K(K=1e-3)", "--know", "K", "--rate", "1e30"),
            ("1e+30", "lower"),
        ),
        (("plan", "--model", "N(N=1)", "--know", "N", "--to", "inf"), ("to = inf", "10 %")),
        (("plan", "--model", "N(N=1)", "--rate", 1, "--duration", "inf"), ("duration = inf",)),
        (("plan", "--model", "N(N=1)", "--rate", 1, "--duration", "1e30"), ("1e+30", "lower")),
        (("compare", "N(N=1)", "K(K=1)", "--rate", "inf"), ("rate", "inf")),
        (("compare", "N(N=1)", "K(K=1)", "--rate", 0), ("rate", "0")),
    ],
)
def test_commands_refuse_in_one_line(run, arguments, words):
    refused(run(*arguments), 2, *words)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--trim", "nan:"), ("--trim", "START:END")),
        (("--trim", ":inf"), ("--trim", "START:END")),
        (("--rate", "nan"), ("rate", "nan")),
        (("--rate", "1e-320"), ("rate", "1e-30")),
        (("--seed", -1), ("--seed", "-1")),
        (("--taus", 0), ("0 averaging times",)),
        (("--taus", -1), ("-1",)),
    ],
)
def test_options_of_logs(run, log, options, words):
    refused(run("adev", log, *options), 2, *words)


@pytest.mark.parametrize("frequency", ["60", "1e100"])
def test_a_line_that_no_record_at_this_rate_shows(run, log, frequency):
    model = f"N+SIN(f={frequency})"
    refused(run("fit", log, "--model", model), 2, "frequency", "half the sampling rate", "50 Hz")
