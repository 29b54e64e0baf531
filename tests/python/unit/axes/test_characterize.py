"""Every axis at once: the studies, what the axes share, and what is shown of it."""

import re

import numpy as np
import pytest

import allanite as al
import generators as g
from allanite.axes.coherence import cross_spectra
from allanite.axes.forms import labels_of
from allanite.axes.lines import common_lines
from allanite.cli.words import WORDS
from allanite.common.threads import side_by_side
from allanite.recording.axis_names import columns_by_sensor
from documents import valid
from six_axes import NAMES, six_axes

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def found():
    return al.characterize(six_axes(10_000))


def test_a_dead_and_a_stuck_axis_are_remarks():
    x = np.random.default_rng(3).normal(0, 0.1, (3000, 4))
    x[:, 1], x[10:, 2], x[:, 3] = np.nan, np.nan, np.clip(x[:, 3], -0.02, 0.02)
    log = al.Recording(x, rate=10, unit="deg/s", columns=["gx", "gy", "gz", "gw"])
    found = al.characterize(log, "N+K")
    assert list(found.studies) == ["gx", "gw"]
    assert "0 of " in found.failed["gy"]
    assert "10 of " in found.failed["gz"]
    assert "gy: not characterized" in found.table()


def test_that_no_unit_is_given_is_a_remark_in_the_words_of_who_asks(tmp_path):
    """Columns called x, y, z may belong to a clock, and were taken for one without a remark."""
    path = tmp_path / "phone.csv"
    x = np.random.default_rng(3).normal(0, 0.1, 500)
    path.write_text("\n".join(["x", *map(str, x)]))
    found = al.characterize(al.read(path, rate=10), "N")
    assert "no unit given for x" in found.table()
    assert "--unit UNIT" in found.table(100, WORDS)


@pytest.mark.long
def test_every_axis_is_what_improve_says_of_it(found):
    assert list(found.studies) == list(NAMES)
    column = found.recording.column("gyro_z")
    alone = al.improve(column)
    assert found["gyro_z"].fit.model == alone.fit.model


def test_the_document_keeps_its_schema(found):
    document = valid(found.to_dict())
    assert [d["recording"]["column"] for d in document["columns"]] == list(NAMES)
    assert document["failed"] == {}


def test_the_table_is_read_at_100_columns(found):
    text = found.table()
    assert max(map(len, text.splitlines())) <= 100
    for word in ("gyroscope", "accelerometer", "°/√h", "°/h", "µg/√Hz", "m/s/√h", "rad/s/√Hz"):
        assert word in text
    narrow = found.table(width=60)
    assert max(map(len, narrow.splitlines())) <= 60
    assert all(name in narrow for name in NAMES)


def test_numbers_of_the_table_are_those_of_the_fits(found):
    text = next(
        line for line in found.table().splitlines() if line.startswith("N") and "°/√h" in line
    )
    want = [f"{float(found[c].fit['N'].to('deg/sqrt(h)')):.4g}" for c in NAMES[:3]]
    assert [word for word in text.split() if word in want] == want


def test_one_form_holds_and_what_differs_is_named(found):
    gyroscope, accelerometer = found.common.sensors
    assert gyroscope.columns == NAMES[:3]
    assert gyroscope.form is not None
    assert gyroscope.form.model == "N+K" or "K" in gyroscope.form.model
    pooled = {n.pooled.name: n.pooled for n in gyroscope.form.numbers}
    # 50 % apart, each known to 0.7 %.
    assert not pooled["N"].agree
    assert not gyroscope.form.agree
    assert accelerometer.form is not None
    alike = {n.pooled.name: n.pooled for n in accelerometer.form.numbers}
    assert alike["N"].agree
    low, high = alike["N"].interval
    assert low <= 0.001 <= high
    # Three records of one level know it √3 times better than one.
    own = found["acc_x"].fit["N"].interval
    assert (high - low) < 0.7 * (own[1] - own[0])


def test_a_line_of_two_axes_is_named_once(found):
    (line,) = found.common.lines
    assert line.columns == ("acc_z", "gyro_z") or line.columns == ("gyro_z", "acc_z")
    assert abs(line.frequency - 7.3) < 4 * line.std_error
    assert str(line) in found.table().replace("\n    ", " ")


@pytest.mark.long
def test_a_visit_that_two_axes_feel_is_named_once():
    """Someone leans on the bench: an excursion of both axes at one time, and a later step of one axis alone."""
    rng, n, rate = np.random.default_rng(8), 20_000, 20.0
    time = np.arange(n) / rate
    visit = (time >= 300.0) & (time < 330.0)
    x = rng.normal(0.0, 0.1, (n, 2)) + visit[:, None] * [0.12, -0.1]
    x[:, 1] += 0.1 * (time >= 700.0)
    log = al.Recording(x, rate, unit="m/s^2", columns=("acc_x", "acc_y"))
    found = al.characterize(log, "N+K")
    (event,) = found.common.events
    assert event.columns == ("acc_x", "acc_y")
    assert abs(event.time - 300.0) < 3.0 * event.std_error
    assert event.kinds == ("excursion", "excursion")
    assert f"{event.time:.6g} s (excursion): acc_x, acc_y" in found.table()
    assert found.to_dict()["common"]["events"][0]["columns"] == ["acc_x", "acc_y"]


@pytest.mark.long
def test_of_several_excursions_those_that_axes_share_are_events():
    rng = np.random.default_rng(8)
    n, rate = 20_000, 10.0
    time = np.arange(n) / rate
    x = 0.05 * rng.standard_normal((n, 2))
    for start, end, axes in (
        (300.0, 340.0, (0, 1)),
        (1200.0, 1230.0, (0,)),
        (1500.0, 1560.0, (0, 1)),
    ):
        x[np.ix_((time >= start) & (time < end), axes)] += 0.06
    log = al.Recording(x, rate, unit="m/s^2", columns=("acc_x", "acc_y"))
    events = al.characterize(log, "N+K").common.events
    assert [round(event.time / 10.0) for event in events] == [30, 150]
    assert all(event.kinds == ("excursion", "excursion") for event in events)


def test_what_is_shared_between_axes_is_found_with_its_sign():
    rng = np.random.default_rng(5)
    n, shared = 16_384, 0.3
    common = rng.standard_normal(n)
    axes = [
        sign * shared * common + np.sqrt(1 - shared**2) * rng.standard_normal(n)
        for sign in (1, -1, 0)
    ]
    axes[2] = rng.standard_normal(n)
    recording = al.Recording(np.column_stack(axes), 100, unit="deg/s", columns=("x", "y", "z"))
    fits = {c.columns[0]: al.fit_model(c, "N") for c in recording}
    xy, xz, yz = cross_spectra(fits)
    top = xy.bands[-1]
    assert top.significant
    assert top.interval[0] <= -(shared**2) <= top.interval[1]
    # A squared coherence of 0.09² = 0.0081 over 4096 ordinates, whose chance level is 3/4096.
    assert 0.002 < top.coherence < 0.02
    assert not xz.significant
    assert not yz.significant


def test_a_column_that_fails_says_so_and_the_rest_go_on():
    log = six_axes(4000)
    samples = log.samples[:, :2].copy()
    samples[:, 1] = 0.25
    found = al.characterize(al.Recording(samples, 100, unit="deg/s", columns=("good", "stuck")))
    assert list(found.studies) == ["good"]
    assert "constant" in found.failed["stuck"]
    assert "stuck: not characterized" in found.table()
    assert not found.adequate
    valid(found.to_dict())
    with pytest.raises(al.TooShortError, match="constant"):
        al.characterize(al.Recording(samples[:, 1:], 100, unit="deg/s", columns=("stuck",)))


@pytest.mark.long
def test_export_and_report_hold_every_axis(found):
    assert found.export("kalibr").count("# gyro_") == 3
    assert all(name in found.export("json") for name in NAMES)
    with pytest.raises(al.InputError, match="unknown export format"):
        found.export("nothing")
    report = found.report()
    text = report.to_markdown()
    assert text.index("All axes") < text.index("## gyro\\_x")
    assert report.to_dict()["common"] == found.common.to_dict()


def test_one_figure_has_all_curves(found, tmp_path):
    figure = found.plot(tmp_path / "all.svg")
    assert [panel.title for panel in figure.panels] == ["angular rate", "acceleration"]
    assert re.fullmatch(r"All axes of recording · \d+ s at 100 Hz", figure.title)
    assert (tmp_path / "all.svg").stat().st_size > 1000


@pytest.mark.long
def test_html_and_repr(found):
    html = found._repr_html_()
    assert all(name in html for name in NAMES)
    assert repr(found).startswith("Characterization(gyro_x: ")


@pytest.mark.long
def test_progress_tells_the_axis():
    said = []
    al.characterize(six_axes(2000), on_progress=lambda *what: said.append(what))
    ended = {name for name, done, total in said if done == total}
    assert ended == set(NAMES)


@pytest.mark.parametrize(
    ("names", "units", "groups"),
    [
        (("gx", "gy", "az", "ax"), ("deg/s",) * 2 + ("g",) * 2, [("gx", "gy"), ("az", "ax")]),
        (("a", "b"), ("1", "1"), [("a", "b")]),
        (
            ("imu1.gyro.x", "imu1.gyro.y", "imu2.gyro.x", "imu2.gyro.y"),
            ("deg/s",) * 4,
            [("imu1.gyro.x", "imu1.gyro.y"), ("imu2.gyro.x", "imu2.gyro.y")],
        ),
        (("first", "second"), ("deg/s", "g"), [("first",), ("second",)]),
    ],
)
def test_columns_of_one_sensor_belong_together(names, units, groups):
    log = al.Recording(np.zeros((20, len(names))), 1, unit=units, columns=names)
    assert columns_by_sensor(log) == groups


def test_an_unexpected_error_is_not_kept_for_a_result():
    def wrong():
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        side_by_side([lambda: 1, wrong])


def test_how_numbers_compare_with_a_data_sheet_is_said_once(found):
    text = " ".join(found.table().split())
    assert text.count("N is two-sided, a data sheet's one-sided density is √2·N") == 1
    assert ("bias instability is usually the minimum" in text) == any(
        "B" in s.fit.model.name.split("+") for s in found.studies.values()
    )


def test_what_is_one_thing_has_one_label_on_all_axes():
    first = al.parse_model("N+RES(f=10,damping=.02)+RES(f=2.7,damping=.02)+SIN(f=3)")
    other = al.parse_model("N+RES(f=10.07,damping=.02)+SIN(f=5)+SIN(f=3.001)")
    assert labels_of([first, other, al.parse_model("N+B")]) == [
        ("N", "RES2", "RES", "SIN"),
        ("N", "RES2", "SIN2", "SIN"),
        ("N", "B"),
    ]
    many = [f"SIN(f={0.1 * k:.1f})" for k in range(1, 33)]
    labels = labels_of([al.parse_model("+".join(many)), al.parse_model("+".join(many[1::2]))])
    assert labels[1] == labels[0][1::2]


def test_what_comes_and_goes_with_one_rate_is_named_once():
    """A vibration whose load varies periodically on one axis, and a noise level with that period on another."""
    n, rate, apart = 120_000, 50.0, 0.31
    time = np.arange(n) / rate
    rng = np.random.default_rng(0)
    swings = 1.0 + 0.6 * np.cos(2.0 * np.pi * apart * time + 1.0)
    shaken = g.white(rng, n, rate, 0.0126) + swings * g.resonance(rng, n, rate, 9.0, 3e-4, 0.03)
    gated = g.white(rng, n, rate, 0.0126) * np.where((apart * time) % 1.0 < 0.4, 1.3, 1.0)
    models = {"a": "N+MOD(f=9,damping=3e-4,modulation=0.31,depth=0.6)", "b": "N"}
    fits = {}
    for (name, model), x in zip(models.items(), (shaken, gated), strict=True):
        fits[name] = al.fit_model(al.Recording(x, rate=rate, unit="rad/s"), model)
    fits["b"] = fits["b"].add(fits["b"].check().significant[0])
    assert fits["b"].model.name == "N+CYCLE"
    [line] = common_lines(fits)
    assert set(line.columns) == {"a", "b"}
    assert line.frequency == pytest.approx(apart, abs=4.0 * line.std_error)


def test_averaging_sensors_of_one_axis():
    """Three gyroscopes with own noise 1, 1.4 and 1.8, and a common vibration at short times."""
    rng = np.random.default_rng(16)
    n, rate = 20_000, 400.0
    shake = np.sin(2 * np.pi * 160.0 * np.arange(n) / rate) * 0.3
    own = np.array([1.0, 1.4, 1.8]) * 0.1
    x = shake[:, None] + rng.standard_normal((n, 3)) * own
    names = ["gyro0_x", "gyro1_x", "gyro2_x"]
    found = al.characterize(al.Recording(x, rate, unit="deg/s", columns=names), "N+SIN(f=160)")
    (one,) = found.averages
    assert one.columns == tuple(names)
    expected = own**-2 / np.sum(own**-2)
    # N of 20 000 samples is known to 0.5 %.
    np.testing.assert_allclose(one.weights, expected, rtol=0.03)
    # Alone the best has 0.1, the mean 0.1/√(1 + 1/1.96 + 1/3.24): 1.35 times less; the vibration hides it at one sample.
    at = dict(zip(np.round(one.tau, 6), one.gain, strict=True))
    assert at[0.0025] < 1.1
    assert at[0.25] == pytest.approx(1.349, rel=0.1)
    assert "gyro0_x, gyro1_x, gyro2_x: averaged with the weights 0.55, 0.28, 0.17" in " ".join(
        found.table(width=1000).split()
    )
    assert valid(found.to_dict())["averages"][0]["columns"] == names


@pytest.mark.long
def test_axes_of_one_sensor_are_not_averaged():
    x = np.random.default_rng(1).standard_normal((2000, 3))
    for names in (["gx", "gy", "gz"], ["gyro[0]", "gyro[1]", "gyro[2]"], ["x0", "x1", "x2"]):
        found = al.characterize(al.Recording(x, 100.0, unit="deg/s", columns=names), "N")
        assert found.averages == ()
