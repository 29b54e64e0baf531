"""What is no recording or no model is said in one line, with what to give; a string stands for its model."""

import numpy as np
import pytest

import allanite as al

X = np.random.default_rng(1).standard_normal(200)
LOG = al.Recording(X, rate=10.0, unit="deg/s")
GROWTH = al.error_growth("N(N=1)", aided=1.0, unit="deg/s", rate=10.0)[0]

TAKING = {
    "fit_model": lambda x: al.fit_model(x, "N+K"),
    "fit_many": lambda x: al.fit_many([x], "N"),
    "fit": lambda x: al.AngleRandomWalk().fit(x),
    "improve": al.improve,
    "characterize": al.characterize,
    "make_report": al.make_report,
    "measured_growth": lambda x: al.measured_growth(x, GROWTH),
    "innovations": lambda x: al.innovations(x, "N(N=1)"),
    "explore": lambda x: al.explore(x, open_browser=False),
}


@pytest.mark.parametrize("call", TAKING.values(), ids=TAKING)
def test_what_is_no_recording(call):
    for array in (X, X.tolist()):
        with pytest.raises(
            al.InputError, match=r"^an array is not a recording: use al.Recording\(x,"
        ):
            call(array)
    with pytest.raises(
        al.InputError, match=r"^'imu.csv' is a path, not .*: use al.read\('imu.csv'\)"
    ):
        call("imu.csv")
    with pytest.raises(al.InputError, match=r"^int is not a recording"):
        call(3)


@pytest.mark.parametrize("items", [LOG, "log", [LOG], 3, [("log", LOG)]])
def test_what_is_no_list_to_compare(items):
    with pytest.raises(al.InputError, match="compare takes a list of"):
        al.compare(items, "N(N=1)")


def test_a_string_or_a_fit_stands_for_a_model():
    fit = al.fit_model(LOG, "N")
    text = "N(N=1)"
    given = {"unit": "deg/s", "rate": 10.0, "aided": 60.0, "tau": [1.0]}
    assert (
        al.error_growth(text, **given)[0].total
        == al.error_growth(al.parse_model(text), **given)[0].total
    )
    found = al.compare([("a", LOG, None), ("b", text, None), ("c", fit, None)])
    assert [c.kind for c in found.curves] == ["recording", "model", "model"]
    assert al.plan(fit, know="N", rate=10.0).duration > 0.0
    assert al.Watch(text, rate=10.0).model == al.parse_model(text)
    with pytest.raises(al.InputError, match=r"needs the unit and the rate"):
        al.error_growth(text, aided=60)
    with pytest.raises(al.InputError, match=r"^expected a model, found int; give a string"):
        al.fit_model(LOG, 3)


@pytest.mark.parametrize("tolerance", ["5%", 0.0, np.nan])
def test_a_tolerance_is_a_number(tolerance):
    for call in (al.improve, al.characterize):
        with pytest.raises(al.InputError, match=r"^tolerance = .*per cent of the deviation"):
            call(LOG, tolerance=tolerance)
