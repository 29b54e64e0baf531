"""Logs are checked before a fit: markers, repeats, locked columns, units against gravity, motion."""

import json
from time import process_time

import numpy as np
import pytest

import allanite as al
from allanite.recording.at_rest import motion_error
from allanite.recording.coarse_column import coarse_step_of, without_steps
from allanite.recording.locked import locked_of
from allanite.recording.measured import markers_of
from allanite.recording.repeats import polling_of
from moving_records import ACCELS, GYROS, MOVING, at_rest, bus

FIELD = pytest.mark.data


def run(capsys, *arguments):
    """Exit code, standard output and standard error of a command."""
    from allanite.cli import main

    with pytest.raises(SystemExit) as stop:
        main([str(one) for one in arguments])
    out, err = capsys.readouterr()
    return stop.value.code, out, err


# -- no-data markers -------------------------------------------------------------------------------


@pytest.mark.slow
@FIELD
def test_markers_of_the_field_log_are_excluded(field):
    log = al.read(field("no_data_marker.csv"))
    (marker,) = [f for f in log.audit if f.kind == "marker"]
    assert (marker.values["count"], marker.values["value"]) == (40, -2000.0)
    assert not {"outliers", "clipping"} & {f.kind for f in log.audit}
    fit = al.fit_model(log.trim(0, 100), "N+K")
    assert fit.recording.missing == log.measured.trim(0, 100).missing > 0
    # Of the noise and of its rounding.
    n = np.hypot(0.05, 2000 / 32768 / 12**0.5) / 200**0.5
    assert float(fit["N"]) == pytest.approx(n, rel=0.03)


@pytest.mark.parametrize(
    ("value", "count"), [(-32768, 1), (32767, 2), (-32768, 40), (-999, 5), (-9999, 1)]
)
def test_markers(value, count):
    rng = np.random.default_rng(count)
    x = np.rint(rng.standard_normal(20_000) * 8).astype(np.int64)
    at = rng.choice(x.size, count, replace=False)
    x[at] = value
    (marker,) = markers_of(x)
    assert (marker.value, marker.count) == (value, count)
    # Factors of the range leave ends of a type recognizable; other values must repeat.
    found = markers_of(x * 0.061)
    assert [marker.count for marker in found] == ([] if value == -9999 else [count])


def test_zeros_of_lost_samples_beside_gravity():
    x = np.random.default_rng(1).normal(9.81, 0.02, 5000)
    x[[7, 100, 4000]] = 0.0
    recording = al.Recording(x, 100, unit="m/s^2").measured
    assert np.flatnonzero(np.isnan(recording.samples)).tolist() == [7, 100, 4000]


@pytest.mark.parametrize("seed", range(10))
def test_outliers_and_clipping_are_no_markers(seed):
    rng = np.random.default_rng(seed)
    heavy = rng.standard_t(2, 50_000)
    assert markers_of(heavy) == []
    assert markers_of(np.round(heavy, 1)) == []
    assert markers_of(np.clip(heavy, -20, 20)) == []
    spikes = rng.standard_normal(5000)
    spikes[rng.choice(5000, 5)] += rng.uniform(50, 500, 5)
    assert markers_of(spikes) == []


# -- repeated samples ------------------------------------------------------------------------------


def held(seed, ratio, step, n=40_000, axes=1):
    """White noise of unit variance with a slow walk, rounded, held at `ratio` of the rate of the log."""
    rng = np.random.default_rng(seed)
    x = rng.standard_normal((n, axes)) + 0.003 * np.cumsum(rng.standard_normal((n, axes)), axis=0)
    if step:
        x = np.round(x / step) * step
    return x[np.floor(np.arange(n) * ratio + 0.3).astype(int)].squeeze()


@FIELD
def test_a_polled_sensor_has_its_own_noise(field, capsys):
    code, out, _ = run(capsys, "fit", field("polled.csv"))
    assert code == 0
    assert "62.52 Hz sensor read at 100 Hz" in out
    fit = al.fit_model(al.read(field("polled.csv")), "N+B+K")
    low, high = fit["N"].interval
    assert low < 0.02 < high
    assert fit.recording.rate == pytest.approx(62.5, rel=1e-3)


@pytest.mark.parametrize("ratio", [0.25, 1 / 3, 0.3719, 0.5, 0.625, 0.87])
@pytest.mark.parametrize("step", [0.0, 0.1, 0.5])
def test_the_rate_of_a_polled_sensor(ratio, step):
    found = polling_of(held(1, ratio, step))
    assert found.ratio == pytest.approx(ratio, rel=0.01)


@pytest.mark.parametrize("seed", range(5))
def test_a_polled_sensor_is_fitted_at_its_rate(seed):
    x = held(seed, 0.87, 0.0, 20_000)
    recording = al.Recording(x, 10.0, unit="deg/s")
    assert [f.kind for f in recording.audit] == ["repeats"]
    fit = al.fit_model(recording, "N+K")
    assert float(fit["N"]) == pytest.approx(1 / 8.7**0.5, rel=0.03)


@pytest.mark.parametrize("step", [0.0, 0.3, 1.0, 2.0, 3.0])
def test_coarse_samples_do_not_repeat(step):
    for seed in range(5):
        assert polling_of(held(seed, 1.0, step)) is None
        assert polling_of(held(seed, 1.0, step, axes=3)) is None


def test_a_lost_link_is_no_polled_sensor():
    x = held(1, 1.0, 0.0)
    x[1000:3000] = x[1000]
    assert polling_of(x) is None


# -- a quantizer that hardly leaves one code -----------------------------------------------------------


@FIELD
def test_a_locked_column_has_a_bound_alone(field, capsys):
    code, out, err = run(capsys, "fit", field("locked.csv"))
    assert (code, out) == (3, "")
    assert "99.4 % of the samples have one code" in err
    # 0.0016 rad/s at 160 Hz are 0.435 °/√h.
    limit = float(err.split("N < ")[1].split()[0])
    assert 0.435 < limit < 0.5


def test_the_limit_of_locked_columns_covers_the_noise():
    covered = []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        sigma, mean = rng.uniform(0.08, 0.25), rng.uniform(-0.3, 0.3)
        found = locked_of(np.round(rng.standard_normal(20_000) * sigma + mean))
        if found is not None:
            covered.append(found.most >= sigma)
    assert len(covered) > 50
    # Two limits of 97.5 %; one record in 40 may miss one of them.
    assert np.mean(covered) > 0.95


def test_a_locked_axis_is_left_out_of_several(tmp_path, capsys):
    rng = np.random.default_rng(1)
    x = rng.standard_normal((4000, 2)) * [1.0, 0.2]
    np.savetxt(
        tmp_path / "log.csv", np.round(x), "%g", ",", header="gx [deg/s],gy [deg/s]", comments=""
    )
    log = tmp_path / "log.csv"
    code, out, err = run(
        capsys, "fit", log, "--rate", 10, "--json", "--column", "gx", "--column", "gy"
    )
    assert err.startswith("! gy: ")
    assert (code, json.loads(out)["recording"]["column"]) == (0, "gx")
    assert "gy: " in err


# -- a thermometer of whole degrees ------------------------------------------------------------------


@pytest.mark.parametrize("digits", [0.5, 1.0])
@pytest.mark.parametrize("shape", ["warm-up", "cycle"])
def test_the_curve_behind_the_steps_of_a_thermometer(shape, digits):
    t = np.arange(27_000) / 10
    curve = 15 + 30 * (1 - np.exp(-t / 700)) if shape == "warm-up" else 25 + 8 * np.sin(t / 320)
    logged = np.round(curve / digits) * digits
    assert coarse_step_of(logged) == digits
    # Rounding alone has an error of 0.29 steps rms.
    assert np.std(without_steps(logged) - curve) < 0.15 * digits
    assert without_steps(curve) is curve


@FIELD
@pytest.mark.long
def test_the_coefficient_of_a_thermometer_of_whole_degrees(field):
    log = al.read(field("temperature_whole_degrees.csv"))
    assert "coarse_column" in [f.kind for f in log.audit]
    fit = al.fit_model(log, "N+B+K+COV(column=temp)")
    low, high = fit["COV.coefficient"].interval
    assert low < 0.02 < high
    # 3.05 °/h/√h.
    assert fit["K"].interval[1] < 6 * 2e-6 * 50**0.5


# -- units ---------------------------------------------------------------------------------------------


@pytest.mark.slow
@FIELD
def test_a_wrong_unit_is_asked_for(field, capsys):
    path = field("wrong_unit.csv")
    for command in ("fit", "adev", "characterize"):
        code, out, err = run(capsys, command, path)
        assert (code, out, err.count("\n")) == (2, "", 1)
        assert "--unit g" in err
    code, _, err = run(capsys, "fit", path, "--unit", "g", "--json", "--model", "N")
    assert (code, err) == (0, "")
    code, out, _ = run(capsys, "fit", path, "--anyway", "--json", "--model", "N")
    assert code == 0
    assert "unit_doubt" in out
    assert "unit_doubt" in [f.kind for f in al.inspect(path).findings]


def six(rng, scale, header, tmp_path):
    x = rng.standard_normal((3000, 6)) * [0.1, 0.1, 0.1, 0.01, 0.01, 0.01] + [
        0,
        0,
        0,
        1.0,
        6.0,
        7.6,
    ]
    x[:, 3:] *= scale
    np.savetxt(tmp_path / "log.csv", x, "%.6f", ",", header=header, comments="")
    return tmp_path / "log.csv"


@pytest.mark.parametrize(
    ("scale", "unit", "likely"),
    [
        (1 / 9.81, "", "g"), (1.0, "", "m/s^2"), (1.0, "g", "m/s^2"), (1000 / 9.81, "m/s^2", "mg"),
        (1 / 9.81, "mg", "g"),
    ],
)  # fmt: skip
def test_gravity_tells_the_unit(scale, unit, likely, tmp_path, capsys):
    label = f" [{unit}]" if unit else ""
    header = "gx,gy,gz," + ",".join(f"acc_{axis}{label}" for axis in "xyz")
    path = six(np.random.default_rng(1), scale, header, tmp_path)
    code, out, err = run(capsys, "fit", path, "--rate", 100, "--model", "N")
    assert (code, out) == (2, "")
    assert likely in err.split("--unit ")[1]
    given = err.split("--unit ")[1].split(",  or")[0].split(";")[0].split(", or")[0]
    code, _, _ = run(capsys, "fit", path, "--rate", 100, "--model", "N", "--unit", given)
    assert code == 0


@pytest.mark.parametrize("scale", [1.0, 0.95, 1.06, 0.0])
def test_right_units_are_not_doubted(scale, tmp_path):
    header = "gx [deg/s],gy [deg/s],gz [deg/s]," + ",".join(f"acc_{axis} [m/s^2]" for axis in "xyz")
    path = six(np.random.default_rng(1), scale or 1e-9, header, tmp_path)
    assert "unit_doubt" not in [f.kind for f in al.inspect(path, rate=100).findings]


def test_raw_counts_are_scaled(tmp_path, capsys):
    counts = np.rint(np.random.default_rng(1).normal(0, 13.1, (4000, 2)))
    np.savetxt(tmp_path / "raw.csv", counts, "%d", ",", header="gx,gy", comments="")
    log = tmp_path / "raw.csv"
    assert "--scale" in run(capsys, "inspect", log, "--rate", 100)[1]
    both = ("--scale", "gx=1/131", "--scale", f"gy={1 / 131}")
    code, out, _ = run(
        capsys, "fit", log, "--rate", 100, "--unit", "deg/s", *both, "--json", "--model", "N"
    )
    assert code == 0
    for document in json.loads(out)["columns"]:
        assert document["effects"][0]["parameters"]["N"]["value"] == pytest.approx(0.01, rel=0.05)
    for wrong in ("gx", "gx=a", "gx=1/0", "=2", "gz=1/131"):
        code, out, err = run(capsys, "fit", log, "--rate", 100, "--unit", "deg/s", "--scale", wrong)
        assert (code, out, err.count("\n")) == (2, "", 1)
    twice = ("--scale", "gx=1/131", "--scale", "gx=1/65")
    code, out, err = run(capsys, "fit", log, "--rate", 100, "--unit", "deg/s", *twice)
    assert (code, out, err.count("\n")) == (2, "", 1)


# -- motion ----------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("kind", MOVING)
@pytest.mark.parametrize("seed", range(2))
def test_moving_records_are_refused(kind, seed):
    make = MOVING[kind]
    for only in (None, ("acc_x", "acc_y", "acc_z"), ("gyro_x", "gyro_y", "gyro_z")):
        assert motion_error(make(seed, only=only)) is not None
        assert (
            motion_error(
                make(seed + 50, only=only).to("rad/s,g") if only is None else make(seed, only=only)
            )
            is not None
        )


def test_turns_of_a_bus_are_named():
    assert "17 turns of up to 89°" in str(motion_error(bus(3, only=("gyro_z",))))


@pytest.mark.long
def test_clean_records_raise_no_alarm():
    alarms = []
    for seed in range(200):
        recording = at_rest(seed)
        kinds = {"motion", "marker", "repeats", "locked", "unit_doubt"}
        alarms += [(seed, f.kind) for f in recording.audit if f.kind in kinds]
    assert alarms == []


@pytest.mark.slow
@FIELD
def test_motion_is_refused_with_the_quiet_segment(field, capsys, tmp_path):
    path = field("moved.csv")
    for more in ((), ("--unit", "deg/s,m/s^2"), ("--unit", "rad/s,m/s^2")):
        code, out, err = run(capsys, "characterize", path, *more)
        assert (code, out, err.count("not at rest")) == (2, "", 1)
        assert "--trim quiet" in err
        assert "--anyway" in err
    span = err.split("--trim ")[1].split(",")[0]
    for trim in (span, "quiet"):
        code, _, _ = run(
            capsys, "fit", path, "--unit", "rad/s,m/s^2", "--trim", trim, "--model", "N"
        )
        assert code == 0
    code, _, _ = run(capsys, "fit", path, "--unit", "rad/s,m/s^2", "--anyway", "--model", "N")
    assert code == 0
    # A curve is drawn of any log, with a remark.
    code, _, err = run(capsys, "adev", path, "--unit", "rad/s,m/s^2")
    assert code == 0
    assert "not at rest" in err


def in_deg_s(kind, seed):
    """Samples of three gyroscopes in deg/s."""
    return MOVING[kind](seed, only=GYROS).samples


@pytest.mark.parametrize("command", ["fit", "check", "improve", "characterize", "report", "accept"])
def test_motion_of_gyroscopes_without_a_unit_is_refused(capsys, tmp_path, command):
    log = tmp_path / "log.csv"
    np.savetxt(log, in_deg_s("hand", 1), "%.5f", ",", header=",".join(GYROS), comments="")
    (tmp_path / "sheet.toml").write_text('[figures]\nangle_random_walk = "1 deg/√h"\n', "utf-8")
    more = {"report": ("-o", tmp_path / "r.html"), "accept": ("--sheet", tmp_path / "sheet.toml")}
    code, out, err = run(capsys, command, log, "--rate", 100, *more.get(command, ()))
    assert (code, out, err.count("\n")) == (2, "", 1)
    for words in ("if the unit is deg/s: not at rest", "--anyway", "--unit"):
        assert words in err
    code, _, err = run(capsys, "inspect", log, "--rate", 100)
    assert code == 0


def test_raw_counts_are_not_judged_in_a_unit(capsys, tmp_path):
    """In deg/s, a drift by some counts of a sensor at rest would be motion."""
    rng = np.random.default_rng(3)
    counts = np.round(np.cumsum(rng.standard_normal((6000, 3)), axis=0) + 3 * rng.standard_normal((6000, 3)))  # fmt: skip
    log = tmp_path / "log.csv"
    np.savetxt(log, counts, "%d", ",", header=",".join(GYROS), comments="")
    code, _, err = run(capsys, "fit", log, "--rate", 50, "--model", "N+K")
    assert code == 0
    assert "at rest" not in err
    assert "no unit given" in err


def large(tmp_path, x, unit):
    path = tmp_path / "log.npz"
    np.savez(path, data=x, rate_hz=100.0, unit=unit, channels=[*GYROS, *ACCELS])
    return path


@pytest.mark.slow
@pytest.mark.parametrize("why", ["motion", "unit", "rate", "locked"])
def test_a_refusal_takes_seconds(capsys, tmp_path, why):
    """An hour of six axes at 100 Hz; the fit of one such axis alone would take longer."""
    rng = np.random.default_rng(1)
    x = rng.standard_normal((360_000, 6)) * 0.01 + [0, 0, 0, 0, 0, 9.81]
    unit, more = ["deg/s"] * 3 + ["m/s^2"] * 3, ()
    if why == "motion":
        x = np.tile(np.column_stack([in_deg_s("hand", 1)] * 2), (15, 1))[: len(x)] + x
    elif why == "unit":
        unit = ["deg/s"] * 3 + ["g"] * 3
    elif why == "rate":
        more = ("--rate", 20)
    else:
        x = np.round(x / 50.0)
        x[17] = 1.0
    log = large(tmp_path, x, unit)
    begun = process_time()
    code, out, err = run(capsys, "characterize", log, *more)
    assert process_time() - begun < 5.0
    assert (code, out, err.count("\n")) == (3 if why == "locked" else 2, "", 1), err


def _write_counts(path, head: str = "t [s],gx,gy") -> None:
    counts = np.random.default_rng(1).normal(0, 12, (400, 2)).astype(int)
    rows = "".join(f"{k / 100},{a},{b}\n" for k, (a, b) in enumerate(counts))
    path.write_text(head + "\n" + rows)


@pytest.mark.parametrize(
    ("head", "options", "found"),
    [
        ("t [s],gx,gy", {"unit": "deg/s"}, ["gx, gy: whole numbers of deg/s"]),
        ("t [s],gx [deg/s],gy [deg/s]", {}, ["gx, gy: whole numbers of deg/s"]),
        ("t [s],gx,gy", {"unit": "deg/s", "scale": {"gx": 1 / 131}}, ["gy: whole numbers"]),
        ("t [s],gx,gy", {"unit": "deg/s", "scale": {"gx": 1, "gy": 1}}, []),
        ("t [s],ax [mg],ay [mg]", {}, []),
        ("t [s],x,y", {"unit": "1"}, []),
    ],
)
def test_whole_numbers_with_a_unit_are_probably_raw_counts(tmp_path, head, options, found):
    _write_counts(tmp_path / "raw.csv", head)
    told = [f for f in al.read(tmp_path / "raw.csv", **options).audit if f.kind == "raw_counts"]
    assert [f.severity for f in told] == ["warning"] * len(found)
    assert all(f.message.startswith(text) for f, text in zip(told, found, strict=True))


def test_a_column_named_as_covariate_is_neither_sensor_nor_time(tmp_path):
    rows = "".join(f"{k / 100},{k % 7},{25 + 1e-4 * k},{k % 11}\n" for k in range(400))
    (tmp_path / "log.csv").write_text("t [s],x,T_imu,y\n" + rows)
    read = al.read(tmp_path / "log.csv", covariate=["T_imu", "y"])
    assert (read.columns, list(read.covariates)) == (("x",), ["T_imu", "y"])
    assert not [f for f in read.audit if f.kind == "two_clocks"]
    seen = al.inspect(tmp_path / "log.csv", covariate=["T_imu", "y"])
    assert [(c.role, c.used) for c in seen.columns] == [
        ("time", True),
        ("sensor", True),
        ("other", True),
        ("other", True),
    ]
