"""Records that move are called so, those at rest are not, and the quiet stretch is the one put in."""

import numpy as np
import pytest

import allanite as al
from allanite.cli.words import WORDS
from allanite.recording.at_rest import motion_error, motion_findings, quiet_span
from allanite.recording.motion import motion_of

RATE = 100
NAMES = ("gyro_x", "gyro_y", "gyro_z", "acc_x", "acc_y", "acc_z")
UNITS = ("rad/s",) * 3 + ("m/s^2",) * 3


def lag(rng, n, seconds, rms, axes=3):
    """Gauss-Markov processes of a correlation time and a level."""
    from scipy.signal import lfilter

    keep = np.exp(-1 / (RATE * seconds))
    white = rng.standard_normal((n, axes)) * rms * np.sqrt(1 - keep**2)
    return lfilter([1], [1, -keep], white, axis=0)


def still(seed=0, seconds=300):
    """Noise of a poor sensor at rest: 0.1 deg/s/√Hz, 1 mg/√Hz, drifting."""
    rng = np.random.default_rng(seed)
    n = seconds * RATE
    white = rng.standard_normal((n, 6)) * np.sqrt(RATE) * ([np.radians(0.1)] * 3 + [0.01] * 3)
    slow = lag(rng, n, 100.0, 1.0, 6) * ([np.radians(0.1)] * 3 + [0.02] * 3)
    return white + slow + [0, 0, 0, 0, 0, 9.81]


def recorded(x):
    return al.Recording(x, RATE, unit=UNITS, columns=NAMES)


def carried(seed=0, seconds=300):
    """Carried in the hand or pocket: gait at 2 Hz, turning of the body, 0.046 rad/s rms and more."""
    rng = np.random.default_rng(seed)
    n = seconds * RATE
    t = np.arange(n) / RATE
    x = still(seed, seconds)
    gait = np.sin(2 * np.pi * (1.9 * t + np.cumsum(0.02 * rng.standard_normal(n)) / RATE))
    x[:, :3] += 0.03 * gait[:, None] + lag(rng, n, 0.5, 0.035)
    x[:, 3:] += 0.8 * gait[:, None] * [0.2, 0.3, 1.0] + lag(rng, n, 0.3, 0.2)
    return x


def driven(seed=0, seconds=300):
    """Turns and accelerations of seconds, road vibration, and two stops."""
    rng = np.random.default_rng(seed)
    n = seconds * RATE
    x = still(seed, seconds)
    moving = np.ones(n)
    moving[60 * RATE : 80 * RATE] = moving[200 * RATE : 215 * RATE] = 0.0
    x[:, 2] += moving * lag(rng, n, 3.0, 0.12, 1)[:, 0]
    x[:, 0:2] += moving[:, None] * lag(rng, n, 0.3, 0.03, 2)
    x[:, 3:5] += moving[:, None] * lag(rng, n, 3.0, 1.0, 2)
    x[:, 3:] += moving[:, None] * lag(rng, n, 0.05, 0.6)
    return x


def flown(seed=0, seconds=300):
    """A small drone: vibration of the rotors, attitude changes of a second."""
    rng = np.random.default_rng(seed)
    n = seconds * RATE
    x = still(seed, seconds)
    on = np.arange(n) > 40 * RATE
    x[:, :3] += on[:, None] * (lag(rng, n, 0.4, 0.3) + 0.1 * rng.standard_normal((n, 3)))
    x[:, 3:] += on[:, None] * (lag(rng, n, 1.0, 0.8) + 2.0 * rng.standard_normal((n, 3)))
    return x


@pytest.mark.slow
@pytest.mark.parametrize("make", [carried, driven, flown])
@pytest.mark.parametrize("seed", range(5))
def test_records_that_move(make, seed):
    r = recorded(make(seed))
    assert motion_of(r).moves
    assert r.audit[0].kind == "motion"
    assert r.audit[0].severity == "warning"
    # A single gyroscope or accelerometer tells it too.
    assert motion_of(r.column("gyro_z")).moves
    assert motion_of(r.column("acc_z")).moves
    # Units are converted.
    assert motion_of(r.to("deg/s")).moves
    assert motion_of(r.to("mg")).moves


@pytest.mark.parametrize("seed", range(20))
def test_records_at_rest(seed):
    r = recorded(still(seed))
    rest = motion_of(r)
    assert (rest.moves, rest.share) == (False, 0.0)
    assert rest.quiet == (0.0, r.duration)
    assert motion_findings(r) == []


def test_a_tap_a_step_and_a_line_are_no_motion():
    x = still(1)
    n = len(x)
    x[n // 2 : n // 2 + 50] += 3.0
    x[n // 3 :, 0] += 0.02
    x[:, 1] += 0.005 * np.sin(2 * np.pi * 7.3 * np.arange(n) / RATE)
    x[n // 4 : n // 2] += x[n // 4 : n // 2] - np.mean(x[n // 4 : n // 2], axis=0)
    x[np.random.default_rng(0).integers(0, n, n // 60)] += 0.3
    assert not motion_of(recorded(x)).moves


@pytest.mark.parametrize(
    ("make", "start", "end"), [(driven, 60, 80), (flown, 0, 40)], ids=["stop", "before take-off"]
)
def test_the_longest_quiet_stretch(make, start, end):
    r = recorded(make(3))
    found = motion_of(r).quiet
    # Windows are 5 s long.
    assert found == (pytest.approx(start, abs=5), pytest.approx(end, abs=5))
    assert not motion_of(r.quiet()).moves
    assert f"{found[0]:g}–{found[1]:g} s" in motion_findings(r)[0].message


def test_a_record_turned_over():
    x = still(2)
    x[len(x) // 2 :, 3:] = x[len(x) // 2 :, [5, 4, 3]]
    finding = motion_findings(recorded(x))[0]
    assert "gravity turns by" in finding.message


def test_quiet_of_what_has_none_or_no_unit():
    with pytest.raises(al.TooShortError, match="no segment"):
        recorded(carried()).quiet()
    with pytest.raises(al.InputError, match="unit="):
        al.Recording(np.random.default_rng(0).standard_normal(5000), RATE).quiet()
    assert motion_of(al.Recording(np.zeros(5000), 1, unit="1")) is None


def test_in_the_shell(tmp_path, capsys):
    from allanite.cli import main

    path = tmp_path / "log.npz"
    np.savez(path, data=driven(3)[:, 2], rate_hz=RATE, unit="rad/s", channels="gyro_z")
    with pytest.raises(SystemExit):
        main(["adev", str(path)])
    said = capsys.readouterr()
    assert [(said.err + said.out).count(one) for one in ("not at rest", "its motion")] == [1, 1]
    with pytest.raises(SystemExit) as stop:
        main(["adev", str(path), "--trim", "quiet", "--json"])
    out, err = capsys.readouterr()
    assert (stop.value.code, err) == (0, "")
    assert '"duration_s": 20' in out or '"duration_s": 15' in out


IMUS = (
    "adis16405_imu1", "adis16405_imu2", "adis16405_imu3", "mtig_gyrox_contaminated", "hfi_10hz", "cats_thermal_a",
    "cats_thermal_b", "phone_gyro_b", "mpu6050_raw_7min", "ch104", "galaxy_s5", "phone_acc",
)  # fmt: skip


@pytest.mark.slow
@pytest.mark.data
@pytest.mark.parametrize("name", IMUS)
def test_real_recordings_are_at_rest(data, name):
    r = al.read(data(f"{name}.npz"))
    rest = motion_of(r)
    assert (rest.moves, rest.share) == (False, 0.0)
    assert rest.quiet[1] - rest.quiet[0] > 0.5 * r.duration


@pytest.mark.data
@pytest.mark.parametrize(("name", "unit"), [("data_v", None), ("Gyroscope", "rad/s")])
def test_real_flight_and_hand(data, name, unit):
    assert motion_of(al.read(data(f"logs/{name}.csv"), unit=unit)).moves


def in_the_hand(seconds):
    """Gyroscope and accelerometer at 50 Hz, carried in the hand, then at rest for 600 s."""
    rng = np.random.default_rng(2)
    n = 50 * 600
    x = rng.standard_normal((n, 2)) * (0.05, 0.02) + (0.0, 9.8)
    t = np.arange(n) / 50.0
    x[:, 0] += np.where(t < seconds, 40.0 * np.sin(2 * np.pi * 0.7 * t), 0.0)
    return x


def test_inspect_tells_of_a_start_in_the_hand_with_what_to_give(tmp_path):
    path = tmp_path / "hand.csv"
    for header in ("gyro_x,acc_x", "gyro_x [deg/s],acc_x [m/s^2]"):
        np.savetxt(path, in_the_hand(60.0), "%.6f", ",", header=header, comments="")
        (told,) = [f for f in al.inspect(path, rate=50).findings if f.kind == "motion"]
        assert told.message.startswith("if the unit is deg/s,m/s^2: ") == ("[" not in header)
        words = told.worded(WORDS)
        start = float(words.split("--trim ")[1].split(":")[0])
        assert 60.0 <= start < 75.0
        assert words.endswith(":600, or --trim quiet)")


def test_the_quiet_stretch_that_was_kept_is_told():
    units = ["deg/s", "m/s^2"]
    kept = al.Recording(in_the_hand(60.0), rate=50, unit=units, columns=["gx", "ax"]).quiet()
    (told,) = [f for f in kept.audit if f.kind == "quiet_stretch"]
    assert told.message.startswith("kept the longest quiet segment, ")
    assert told.message.endswith("–600 s of 600 s")


def test_a_quiet_stretch_has_no_turn_in_it_and_begins_with_no_motion():
    rng = np.random.default_rng(8)
    rate, n = 200.0, 60 * 200
    x = 0.02 * rng.standard_normal((n, 3)) + [0.0, 0.0, 9.81]
    t = np.arange(n) / rate
    x[:, 2] = 9.81 * np.cos(np.pi * np.clip((t - 23.0) / 0.9, 0.0, 1.0)) + x[:, 2] - 9.81
    x[:, 0] += 3.0 * np.exp(-t / 0.3)  # what is left of putting it down
    record = al.Recording(x, rate=rate, unit="m/s^2", columns=("ax", "ay", "az"))
    start, end = quiet_span(record)
    assert 23.8 < start < 25.5
    assert end == pytest.approx(60.0)
    # A tap is no motion: the stretch goes on.
    x[40 * 200 : 40 * 200 + 40, 1] += 2.0
    record = al.Recording(x, rate=rate, unit="m/s^2", columns=("ax", "ay", "az"))
    assert quiet_span(record)[1] == pytest.approx(60.0)


def test_an_axis_without_samples_for_a_while_leaves_its_direction_unknown():
    """The direction of gravity is judged only while all three axes have samples."""
    x = still()
    x[: len(x) // 5, 5] = np.nan
    assert motion_of(recorded(x)).tilt < 1.0
    turned = x.copy()
    turned[len(x) // 2 :, 3:] = turned[len(x) // 2 :, [4, 5, 3]]
    assert motion_of(recorded(turned)).tilt > 30.0
    x[:, 5] = np.nan
    assert motion_of(recorded(x)).tilt == 0.0


def noisy(rate, seconds, seed, columns=1):
    """White noise of 0.1 rad/s/√Hz: means over 1 s of it change by ten times what a good sensor at rest shows."""
    rng = np.random.default_rng([seed, round(rate)])
    return 0.1 * np.sqrt(rate) * rng.standard_normal((round(seconds * rate), columns))


@pytest.mark.slow
@pytest.mark.parametrize("rate", [10.0, 50.0, 200.0])
def test_white_noise_above_the_limits_is_no_motion(rate):
    """One window of a column in 10 000 counts as motion: of 4800 windows 0.5, over four in 1 of 5000 such tests."""
    said = 0.0
    for seed in range(20):
        x = noisy(rate, 200, seed, 6)
        rest = motion_of(al.Recording(x, rate, unit="rad/s", columns=NAMES))
        assert not rest.moves
        said += rest.share * 40
    assert said < 4.5


@pytest.mark.parametrize("change", ["none", "clipped", "held", "lag"])
def test_a_noisy_sensor_at_rest_is_not_said_to_move(change):
    """An absolute limit, below the noise of a mean over 1 s, once found motion in 93 % of an example."""
    rng = np.random.default_rng(5)
    n = 600 * RATE
    x = 0.0126 * np.sqrt(RATE) * rng.standard_normal(n) + 2e-5 * np.cumsum(rng.standard_normal(n))
    if change == "clipped":
        x = np.clip(x, -0.3, 0.3)
    if change == "held":
        x = np.repeat(x[::2], 2)
    if change == "lag":
        x += lag(rng, n, 30.0, 2.5e-3 * np.sqrt(15.0), 1)[:, 0]
    assert motion_findings(al.Recording(x, RATE, unit="rad/s")) == []


@pytest.mark.parametrize("rate", [10.0, 50.0, 100.0])
def test_motion_in_a_part_of_a_noisy_record_is_still_said(rate):
    """Steps of three times the noise of 0.2 s, turns of 3 s of twelve times that of 1 s; each in two minutes of five."""
    from scipy.signal import lfilter

    for seed in range(5):
        rng = np.random.default_rng(seed)
        time = np.arange(round(300 * rate)) / rate
        there = (time > 100.0) & (time < 220.0)
        steps = 3.0 * 0.1 / np.sqrt(0.2) * np.sqrt(2.0) * np.sin(2 * np.pi * 1.9 * time)
        keep = np.exp(-1.0 / (3.0 * rate))
        white = np.sqrt(1.0 - keep**2) * rng.standard_normal(time.size)
        turns = 12.0 * 0.1 * 1.5 * lfilter([1.0], [1.0, -keep], white)
        for motion in (steps, turns):
            x = noisy(rate, 300, seed)[:, 0] + there * motion
            assert motion_of(al.Recording(x, rate, unit="rad/s")).moves


def test_white_noise_of_any_size_is_no_motion():
    """This includes a short record, in which the usual change is known to a fifth."""
    refused = [
        motion_error(
            al.Recording(np.random.default_rng(seed).standard_normal((400, 3)), 10.0, unit="rad/s")
        )
        for seed in range(40)
    ]
    assert refused == [None] * 40
