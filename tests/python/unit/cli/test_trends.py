"""Rates with steps and periodic terms: `al.trend` and `allanite trend`."""

import json

import numpy as np
import pytest

import allanite as al
from allanite.trends.design import YEAR, seconds_of
from documents import valid

DAY = 86400.0


def series(n=1500, seed=1, missing=0.1, rate=2.0):
    """Heights in mm: white and flicker noise, a rate in mm/year, an annual term, missing days."""
    rng = np.random.default_rng(seed)
    x = al.parse_model("N(N=1)+B(B=1)").simulate(n=n, rate=1.0, seed=seed).samples.copy()
    years = np.arange(n) / 365.25
    x += rate * years + 3.0 * np.sin(2.0 * np.pi * years)
    x[rng.random(n) < missing] = np.nan
    return x


@pytest.fixture(scope="module")
def found():
    return al.trend(al.Recording(series(), rate=1 / DAY, columns=["up"]), unit="mm")


def test_the_interval_holds_the_rate(found):
    low, high = found.rate.interval
    assert low < 2.0 < high
    assert found.rate.unit == "mm/year"
    assert found.noise.name in ("N+B", "N+PL")
    assert [w.period for w in found.waves] == [YEAR, YEAR / 2]
    assert abs(found.waves[0].amplitude - 3.0) < 4.0 * found.waves[0].amplitude.std_error
    assert found.missing == np.count_nonzero(np.isnan(series()))


def test_sizes_are_those_of_geodesy(found):
    sizes = {name: size for name, size, _ in found.parts}
    units = {name: unit for name, _, unit in found.parts}
    # 1500 samples tell the sizes to about 5 and 10 %.
    assert sizes["white"] == pytest.approx(1.0, rel=0.2)
    assert sizes["flicker"] == pytest.approx(365.25**0.25, rel=0.4)
    assert units["flicker"] == "mm/yr^0.25"


def test_a_longer_record_is_predicted(found):
    assert found.predicted(1.0) == pytest.approx(found.longer[0][1])
    # Flicker noise: nearly the inverse of the length.
    assert 0.4 < found.predicted(2.0) / found.predicted(1.0) < 0.6


def test_white_noise_alone_is_least_squares():
    x = series(300, missing=0.2)
    got = al.trend(al.Recording(x, rate=1 / DAY), unit="mm", model="N")
    there = np.isfinite(x)
    t = np.flatnonzero(there) / 365.25
    design = np.column_stack([np.ones(t.size), t])
    amplitudes, squares, *_ = np.linalg.lstsq(design, x[there], rcond=None)
    sigma = np.sqrt(squares[0] / (t.size - 2) * np.linalg.inv(design.T @ design)[1, 1])
    assert got.rate.value == pytest.approx(amplitudes[1], rel=1e-8)
    assert got.rate.std_error == pytest.approx(sigma, rel=1e-6)


def test_steps_are_fitted_at_dates():
    n = 900
    days = np.datetime64("2010-01-01") + np.arange(n)
    x = series(n, missing=0.0) + 20.0 * (np.arange(n) >= 500)
    recording = al.Recording(x, time=days)
    got = al.trend(recording, unit="mm", steps=[str(days[500])])
    assert got.steps[0].date == str(days[500])
    assert abs(got.steps[0].height - 20.0) < 4.0 * got.steps[0].height.std_error
    later = al.trend(recording.trim(100 * DAY), unit="mm", steps=[str(days[500])])
    assert later.steps[0].time == pytest.approx(400 * DAY)


def test_steps_are_found_and_noise_has_none():
    n = 800
    x = series(n, missing=0.05)
    with_step = x + 15.0 * (np.arange(n) >= 300)
    got = al.trend(al.Recording(with_step, rate=1 / DAY), unit="mm", find_steps=True, model="N+B")
    assert [round(s.time / DAY) for s in got.steps] == [300]
    assert got.steps[0].found
    none = al.trend(al.Recording(x, rate=1 / DAY), unit="mm", find_steps=True, model="N+B")
    assert none.steps == ()


def test_uneven_times_are_used():
    rng = np.random.default_rng(3)
    t = np.cumsum(rng.uniform(0.5, 1.5, 600)) * DAY
    walk = np.cumsum(rng.standard_normal(600) * np.sqrt(np.diff(t, prepend=0.0) / DAY))
    got = al.trend(al.Recording(walk, time=t, time_unit="s"), unit="mm", periods=[], model="K")
    assert got.uneven
    # A random walk of unit steps a day: (last − first) over the time between.
    expected = (walk[-1] - walk[0]) / (t[-1] - t[0]) * YEAR
    assert got.rate.value == pytest.approx(expected, rel=1e-6)


def test_columns_have_a_trend_each():
    x = np.column_stack([series(400), series(400, seed=2)])
    got = al.trend_columns(
        al.Recording(x, rate=1 / DAY, columns=["north", "up"]), unit="mm", model="N+B"
    )
    assert list(got) == ["north", "up"]
    assert len(valid(got.to_dict())["columns"]) == 2


@pytest.mark.parametrize(
    ("text", "epoch", "expected"),
    [
        ("120d", None, 120 * DAY),
        ("+3.5yr", None, 3.5 * YEAR),
        ("2000-01-02", 946684800.0, DAY),
        ("2000.0", 946728000.0, 0.0),
        ("2000-01-01T12:00:00", 946728000.0, 0.0),
    ],
)
def test_times_of_steps(text, epoch, expected):
    assert seconds_of(text, epoch) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"steps": ["tomorrow"]}, "give a date"),
        ({"steps": ["2012-01-01"]}, "no dates"),
        ({"steps": [1e9]}, "outside of the record"),
        ({"steps": ["10.1d", "10.2d"]}, "two steps lie between the same two samples"),
        ({"per": "month"}, "one of year"),
        ({"model": "Q"}, "one of N"),
    ],
)
def test_bad_input_is_refused(options, words):
    recording = al.Recording(series(100, missing=0.0), rate=1 / DAY)
    with pytest.raises(al.InputError, match=words):
        al.trend(recording, unit="mm", **options)


def test_too_short_a_series_is_refused():
    with pytest.raises(al.TooShortError, match="too few"):
        al.trend(al.Recording([1.0, 2.0, 1.5], rate=1 / DAY), unit="mm")


def test_the_command_reads_a_mom_file_with_its_offsets(run, tmp_path):
    x = series(600) + 20.0 * (np.arange(600) >= 250)
    rows = "".join(f"{50000 + k} {v:.4f}\n" for k, v in enumerate(x) if np.isfinite(v))
    path = tmp_path / "station.mom"
    path.write_text(f"# sampling period 1.0\n# offset 50250.0\n{rows}")
    code, out, err = run("trend", path, "--unit", "mm", "--noise", "N+B", "--json")
    assert code == 0, err
    [got] = valid(json.loads(out))["columns"]
    assert got["rate"]["unit"] == "mm/year"
    [step] = got["steps"]
    assert step["date"] == "1996-06-16"
    assert abs(step["height"]["value"] - 20.0) < 5.0
    code, out, err = run("trend", path, "--unit", "mm", "--noise", "N+B", "--output-unit", "m")
    assert code == 0, err
    assert "m/year" in out
    assert "step 1996-06-16" in out


@pytest.mark.parametrize("unit", ["mm", "nm/s^2", "s"])
def test_the_command_takes_the_unit_of_the_header(run, tmp_path, unit):
    path = tmp_path / "heights.csv"
    rows = "".join(f"{k},{v:.4f}\n" for k, v in enumerate(series(80, missing=0.0)))
    path.write_text(f"time [d],up [{unit}]\n{rows}")
    code, out, err = run("trend", path, "--noise", "N", "--column", "up")
    assert code == 0, err
    assert f"{unit}/year" in out


@pytest.mark.parametrize("slope", [0.0, 0.1])
@pytest.mark.parametrize("model", [None, "N+B+K"])
def test_samples_without_noise_are_refused(slope, model):
    x = 3.0 + slope * np.arange(100)
    with pytest.raises(al.InputError, match="no noise" if slope else "all samples are equal"):
        al.trend(al.Recording(x, rate=1 / DAY), unit="mm", model=model)


def test_a_large_offset_is_printed_with_all_digits():
    x = 3.7e9 + np.random.default_rng(2).standard_normal(400)
    offset = al.trend(al.Recording(x, rate=1 / DAY), unit="mm", model="N").offset
    assert str(offset).startswith(("3700000000.0", "3699999999.9"))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--unit", "mm", "--output-unit", "g"), "between m, cm, mm"),
        ((), "--unit"),
        (("--unit", "mm", "--step", "soon"), "give a date"),
        (("--unit", "mm", "--noise", "Q"), "one of N"),
    ],
)
def test_the_command_refuses_bad_options(run, tmp_path, options, words):
    path = tmp_path / "heights.csv"
    path.write_text(
        "time [d],up\n" + "".join(f"{k},{v:.4f}\n" for k, v in enumerate(series(80, missing=0.0)))
    )
    code, out, err = run("trend", path, *options)
    assert (code, out) == (2, "")
    assert words in err


def test_a_series_in_any_unit_needs_no_column(tmp_path, capsys):
    """A header h [mm] states the unit; --unit mm repeats it. Both were once refused."""
    from allanite.cli import main

    log = tmp_path / "height.csv"
    lines = [f"{day},{value!r}" for day, value in enumerate(series(400).tolist())]
    log.write_text("\n".join(["time [d],h [mm]", *lines]), encoding="utf-8")
    found = []
    for options in ([], ["--unit", "mm"]):
        with pytest.raises(SystemExit) as done:
            main(["trend", str(log), *options])
        out, err = capsys.readouterr()
        assert done.value.code in (0, None), err
        assert "mm/year" in out
        found.append(out)
    assert found[0] == found[1]


def test_a_series_whose_unit_is_that_of_a_sensor(run, tmp_path):
    x = np.random.default_rng(1).standard_normal(300)
    log = tmp_path / "drift.csv"
    log.write_text("gx [deg/s]\n" + "".join(f"{v:.6f}\n" for v in x))
    code, out, err = run("trend", log, "--rate", 1, "--quiet")
    assert (code, err) == (0, "")
    assert "deg/s/year" in out
    assert "e+" not in out
    assert run("trend", log, "--rate", 1, "--unit", "m/s^2")[0] == 2
