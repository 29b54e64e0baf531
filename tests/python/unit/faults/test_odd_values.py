"""Numbers at the ends of what a double holds and values of other types: an answer or one line, never a traceback."""

import json
import os
import pickle
import signal
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

import allanite as al
from allanite.cli import main
from allanite.deviation import ESTIMATORS
from allanite.fit import refitted

X = np.random.default_rng(1).standard_normal(400)


@pytest.mark.parametrize("scale", [1e-320, 1e-310, 1e-160, 1e150, 1e155, 1e300, 3e307])
def test_a_fit_refuses_samples_whose_fourth_power_is_no_double(scale):
    recording = al.Recording(X * scale, rate=10.0, unit="deg/s")
    with pytest.raises(al.InputError, match="convert the samples to another unit"):
        al.fit_model(recording, "N")


@pytest.mark.slow
@pytest.mark.parametrize("scale", [1e-70, 1e70])
def test_a_fit_of_very_small_or_large_samples_is_scaled(scale):
    one, other = (
        al.fit_model(al.Recording(X * s, rate=10.0, unit="deg/s"), "N") for s in (1.0, scale)
    )
    assert other["N"].value / scale == pytest.approx(one["N"].value, rel=1e-6)
    assert other.check().adequate == one.check().adequate


@pytest.mark.parametrize("name", sorted(set(ESTIMATORS) & set(dir(al))))
def test_deviations_can_be_pickled(name):
    found = getattr(al, name)(X, rate=10.0)
    again = pickle.loads(pickle.dumps(found))
    np.testing.assert_array_equal(again.deviation, found.deviation)
    assert str(again) == str(found)


def test_the_deviation_of_a_recording_can_be_pickled():
    found = al.Recording(X, rate=10.0, unit="deg/s").oadev()
    assert str(pickle.loads(pickle.dumps(found))) == str(found)


@pytest.mark.parametrize(
    "value", ["text", b"x", {"a": 1}, 3 + 4j, [[1], "x"], 10**400, None], ids=str
)
def test_frequencies_and_times_are_numbers(value):
    model = al.effects.AngleRandomWalk(N=1.0)
    if value is not None:
        with pytest.raises(al.InputError, match="must be numbers"):
            model.psd(value)
        with pytest.raises(al.InputError, match="must be numbers"):
            model.allan_variance(value)
    if not isinstance(value, (str, dict)):
        with pytest.raises(al.InputError, match="give a name such as"):
            al.Recording(X, rate=10.0, unit=value)


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_an_interrupt_while_the_command_is_imported_is_one_line():
    code = """
import sys
from types import SimpleNamespace
class Finder:
    def find_spec(self, name, path=None, target=None):
        if name == "allanite.cli":
            raise KeyboardInterrupt
sys.meta_path.insert(0, Finder())
from allanite._command import main
main()
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, b"", b"allanite: interrupted\n")
    assert signal.getsignal(signal.SIGINT) is not None


def test_a_stretch_that_ends_long_after_the_record_is_left_out():
    from allanite.page.source import part_of

    recording = al.Recording(X, rate=10.0, unit="deg/s")
    with pytest.raises(al.InputError, match="0 samples are too few"):
        part_of(recording, None, ((0.0, 1e308),))
    assert part_of(recording, None, ((20.0, 1e308),)).missing == 200


def test_samples_near_the_largest_double_have_no_marker():
    x = np.where(np.arange(400) % 2 == 0, 1e308, -1e308)
    for recording in (al.Recording(x, rate=10.0), al.Recording(np.r_[X, 1e308, 1e308], rate=10.0)):
        json.dumps(recording.describe(), allow_nan=False)


def test_a_signaling_nan_is_a_missing_sample(tmp_path):
    codes = X.astype("<f4").view("<u4").copy()
    codes[-1] = 0x7FA20649
    np.save(tmp_path / "x.npy", codes.view("<f4"))
    recording = al.read(tmp_path / "x.npy", rate=10.0)
    assert recording.missing == 1
    json.dumps(recording.describe(), allow_nan=False)


def test_every_second_sample_missing_is_described():
    x = np.tile([0.0, np.nan, 1.0, np.nan, 2.0, np.nan, 4.0, np.nan], 50)
    assert al.Recording(x, rate=10.0).describe()["gaps"] == 200


def test_the_highest_rate_shows_no_motion():
    recording = al.Recording(X, rate=1e30, unit="deg/s")
    assert not [finding for finding in recording.audit if finding.kind == "motion"]


def test_columns_of_half_precision_that_look_like_years(tmp_path):
    years = np.full(400, 2000.0, dtype="<f2")
    days = np.full(400, 60_000.0, dtype="<f2")
    years[1::2] = 2048.0
    np.save(tmp_path / "x.npy", np.stack([years, days, X.astype("<f2")], axis=1))
    assert al.read(tmp_path / "x.npy", rate=10.0).n == 400


@pytest.mark.parametrize("events", [[2000], [1234, 1235, 3211, 3212]], ids=["a step", "two events"])
@pytest.mark.parametrize("model", ["N", "N+B+K"])
def test_a_record_that_stands_still_but_for_a_few_changes_has_no_noise(events, model):
    x = np.cumsum(np.isin(np.arange(5000), events)) % 2.0
    recording = al.Recording(x, rate=10.0, unit="deg/s")
    with pytest.raises(al.TooShortError, match=f"changes its value only {len(events)} time"):
        al.improve(recording, model)


@pytest.mark.slow
def test_a_deviation_of_zero_is_no_error_in_per_cent(tmp_path):
    """Every seventh sample of the Allan variance of a sawtooth is exactly 0."""
    recording = al.Recording(np.arange(4000) % 7 * 1.0, rate=10.0, unit="deg/s")
    fit = al.fit_model(recording, "N")
    fit.save(tmp_path / "fit.json")
    json.dumps(fit.to_dict(), allow_nan=False)
    assert not fit.check().adequate


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf, 1e-320, 1e308])
def test_frequencies_and_times_beyond_all_rates_are_refused(value):
    model = al.parse_model("N(N=1)+B(B=1)+K(K=1)+Q(Q=1)+R(R=1)+GM(correlation_time=1,q_c=1)")
    for rate in (None, 10.0):
        with pytest.raises(al.InputError, match=r"f must be from 1e-60 to 1e\+60 Hz, found"):
            model.psd([1.0, value], rate)
        with pytest.raises(al.InputError, match=r"tau must be from 1e-60 to 1e\+60 s, found"):
            model.allan_variance(value, rate)


@pytest.mark.parametrize("value", [1e-60, 1e60])
def test_the_largest_and_smallest_frequencies_and_times_are_answered(value):
    model = al.parse_model("N(N=1)+B(B=1)+K(K=1)+Q(Q=1)+R(R=1)+GM(correlation_time=1,q_c=1)")
    for rate in (None, 10.0):
        assert np.isfinite(model.psd(value, rate))
        assert np.isfinite(model.allan_variance(value, rate))


@pytest.mark.parametrize("scale", [1e-320, 1e-160, 1e155, 1e300])
def test_a_spectrum_refuses_samples_whose_powers_are_no_doubles(scale):
    with pytest.raises(al.InputError, match=r"a spectrum needs .*convert the samples"):
        al.psd(X * scale, rate=10.0)
    assert al.psd(np.zeros(100), rate=10.0).density.max() == 0.0


@pytest.mark.parametrize("value", ["text", "1e5", b"1", [1.0], {}, {"value": 1}, 10**400, np.nan])
def test_values_of_other_types_are_no_parameters(value):
    with pytest.raises(al.InputError, match=r"N = .* is (not a number|out of its range)"):
        al.effects.AngleRandomWalk(N=value)
    with pytest.raises(al.InputError, match=r"column = 3.0 is not a text"):
        al.effects.Covariate(column=3.0)
    if not isinstance(value, (list, int, float)):
        with pytest.raises(al.InputError, match=r"overtones = .* is not a list of numbers"):
            al.effects.Sinusoid(overtones=value)
    with pytest.raises(al.InputError, match=r"overtones = .* is (not a number|out of its range)"):
        al.effects.Sinusoid(overtones=(2.0, value, 0.0))


@pytest.mark.parametrize("value", ["text", "1e5", [1.0], {}, {"value": 1}])
def test_a_study_file_with_values_of_other_types_is_one_line(value):
    from allanite.page.studies import SCHEMA, open_study

    effect = {"kind": "angle_random_walk", "parameters": {"N": {"value": value}}}
    axis = {"column": "x", "at": 0, "ladder": [{"label": "", "effects": [effect]}]}
    tab = SimpleNamespace(work=SimpleNamespace(recording=al.Recording(X, 10.0, columns=("x",))))
    with pytest.raises(
        al.InputError, match=r"is not a number|do not have the format of a model, fit or check file"
    ):
        open_study(tab, {"schema": SCHEMA, "axes": [axis]})


def test_a_panic_of_the_core_is_an_error_with_a_report(monkeypatch, capfd, tmp_path):
    from allanite import _core, _kernels
    from allanite.cli import main
    from allanite.common.errors import InternalError

    def panic(*_arguments, **_options):
        return _core.chirp_heights(np.ones(10), 0.1, 0.1, 2**62)

    with pytest.raises(InternalError, match="capacity overflow") as raised:
        panic()
    assert isinstance(raised.value, RuntimeError)
    monkeypatch.setattr(_kernels, "cosine_transform", panic)
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    np.savetxt(tmp_path / "x.csv", X)
    with pytest.raises(SystemExit) as ended:
        main(["fit", str(tmp_path / "x.csv"), "--rate", "10", "--unit", "deg/s"])
    assert ended.value.code == 70
    said = capfd.readouterr().err
    [report] = tmp_path.glob("allanite-error-*.txt")
    assert said.count("\n") == 1
    assert "an internal error of allanite" in said
    assert report.name in said
    assert "capacity overflow" in report.read_text(encoding="utf-8")


MANY = "+".join(["N(N=0.1)", *(f"SIN(frequency={0.01 * k:.2f},amplitude=1,phase=0)" for k in range(1, 300))])  # fmt: skip


@pytest.mark.parametrize(
    "arguments",
    [
        ("fit", "{log}", "--rate", "10", "--model", MANY),
        ("check", "{log}", "--rate", "10", "--model", MANY),
        ("improve", "{log}", "--rate", "10", "--model", MANY),
        ("predict", "--rate", "10", "--unit", "deg/s", "--aided", "10", "--model", MANY),
    ],
    ids=lambda a: a[0],
)
def test_a_model_of_300_effects_is_refused_at_once(tmp_path, capsys, arguments):
    """A fit of 300 lines took minutes."""
    np.save(tmp_path / "x.npy", X)
    with pytest.raises(SystemExit) as ended:
        main([word.format(log=tmp_path / "x.npy") for word in arguments])
    out, err = capsys.readouterr()
    assert (ended.value.code, out, err.count("\n")) == (2, "", 1)
    assert "300 effects" in err
    assert "at most 64" in err


def test_a_model_string_longer_than_a_path_is_compared(tmp_path, capsys):
    np.save(tmp_path / "x.npy", X)
    with pytest.raises(SystemExit) as ended:
        main(["compare", str(tmp_path / "x.npy"), MANY, "--rate", "10", "--unit", "deg/s"])
    assert (ended.value.code, capsys.readouterr().err) == (0, "")


def test_a_model_that_grew_beyond_the_limit_of_a_start_is_still_refitted():
    """Stepwise building continues, and its models can be refitted after samples were excluded."""
    start = al.parse_model("+".join(MANY.split("+")[:64]))
    with pytest.raises(al.InputError, match="65 effects"):
        al.fit_model(al.Recording(X, rate=10.0, unit="deg/s"), start + al.effects.Quantization())
    fit = al.fit_model(al.Recording(X, rate=10.0, unit="deg/s"), "N")
    held = al.parse_model("+".join(f"GM(T={k + 1}!,q_c=0.001!)" for k in range(65)))
    assert len(refitted(fit, fit.model + held).model) == 66
