"""What is merged, flags as samples, and a bias that cannot be known."""

import numpy as np
import pytest

import allanite as al


def test_merging_tells_what_is_wrong():
    a = al.Accumulator(rate=10.0, unit="deg/s")
    a.update(np.arange(10.0))
    b = al.Accumulator(rate=10.0, unit="rad/s", start=10)
    with pytest.raises(al.InputError, match=r"rad/s into samples in deg/s"):
        a.merge(b)
    with pytest.raises(al.InputError, match="with itself"):
        a.merge(a)
    for other in (3, None, [a]):
        with pytest.raises(al.InputError, match="another Accumulator is needed"):
            a.merge(other)
    assert a.n == 10


def test_flags_are_samples_as_array_and_as_list():
    flags = [True, False, False, True, True, False, True, False, False, True]
    by_list, by_array = al.oadev(flags), al.oadev(np.array(flags))
    np.testing.assert_array_equal(by_list.deviation, by_array.deviation)
    np.testing.assert_array_equal(by_array.deviation, al.oadev(np.array(flags, float)).deviation)


def test_theoh_says_when_no_bias_could_be_estimated():
    x = np.random.default_rng(1).standard_normal(600)
    x[::7] = np.nan
    said = " ".join(al.theoh(x).diagnostics)
    assert "nan" not in said
    assert "no bias of Theo1 could be estimated" in said
    x[np.isnan(x)] = 0.0
    assert "removed" in al.theoh(x).diagnostics[-1]


@pytest.mark.parametrize(
    ("quantity", "fewest"), [("rate", 119), ("increment", 119), ("angle", 120)]
)
def test_theoh_names_the_fewest_samples_that_suffice(quantity, fewest):
    x = np.random.default_rng(2).standard_normal(fewest)
    assert al.theoh(x, quantity=quantity).tau.size
    with pytest.raises(al.TooShortError, match=f"at least {fewest} samples .* found {fewest - 1}"):
        al.theoh(x[1:], quantity=quantity)
