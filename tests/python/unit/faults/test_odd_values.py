"""Numbers at the ends of what a double holds and values of other types: an answer or one line, never a traceback."""

import os
import pickle
import signal
import subprocess
import sys

import numpy as np
import pytest

import allanite as al
from allanite.deviation import ESTIMATORS

X = np.random.default_rng(1).standard_normal(400)


@pytest.mark.parametrize("scale", [1e-320, 1e-310, 1e-160, 1e150, 1e155, 1e300, 3e307])
def test_a_fit_refuses_samples_whose_fourth_power_is_no_double(scale):
    recording = al.Recording(X * scale, rate=10.0, unit="deg/s")
    with pytest.raises(al.InputError, match="convert the samples to another unit"):
        al.fit_model(recording, "N")


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
    model = al.AngleRandomWalk(N=1.0)
    if value is not None:
        with pytest.raises(al.InputError, match="numbers are needed"):
            model.psd(value)
        with pytest.raises(al.InputError, match="numbers are needed"):
            model.allan_variance(value)
    if not isinstance(value, (str, dict)):
        with pytest.raises(al.InputError, match="give a name such as"):
            al.Recording(X, rate=10.0, unit=value)


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_an_interrupt_while_the_command_is_imported_is_one_line():
    code = """
import sys
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
    with pytest.raises(al.TooShortError, match="every sample is NaN"):
        part_of(recording, None, ((0.0, 1e308),))
    assert part_of(recording, None, ((20.0, 1e308),)).missing == 200
