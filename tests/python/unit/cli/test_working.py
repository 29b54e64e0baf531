"""The noise of a sensor at work: a log at rest, and one with rotors running."""

import json
import re

import numpy as np
import pytest

import allanite as al
from allanite.exports import axes_of
from command_line import refused

RATE, FINE = 100, 8
N, K = 1e-3, 1e-5
ROTOR = 43.3


def white(rng, shape):
    return N * np.sqrt(RATE) * rng.standard_normal(shape)


def sensor(rng, count, segments=1):
    steps = K * np.sqrt(1 / RATE) * rng.standard_normal((segments, count))
    return white(rng, (segments, count)) + np.cumsum(steps, axis=1)


def vibration(rng, count, band, segments=1):
    """Noise of a band and four harmonics of a rotor, sampled without a filter."""
    size = count * FINE
    f = np.fft.rfftfreq(size, 1 / (RATE * FINE))
    shape = (f > band[0]) & (f < band[1])
    spectrum = np.fft.rfft(rng.standard_normal((segments, size))) * shape
    x = np.fft.irfft(spectrum, size)[:, ::FINE] * 0.02 * np.sqrt(f.size / shape.sum())
    t = np.arange(count) / RATE
    for k, rms in enumerate((0.02, 0.01, 0.01, 0.005), start=1):
        phase = 2 * np.pi * rng.random((segments, 1))
        x += np.sqrt(2) * rms * np.sin(2 * np.pi * k * ROTOR * t + phase)
    return x


def motion(rng, count):
    """A vehicle that moves below 1 Hz."""
    f = np.fft.rfftfreq(count, 1 / RATE)
    x = np.fft.irfft(np.fft.rfft(rng.standard_normal(count)) / (1 + (f / 0.5) ** 2) ** 1.5, count)
    return 0.3 * x / x.std()


def logs(seed, band, moves=True):
    rng = np.random.default_rng(seed)
    rest = al.Recording(sensor(rng, 300 * RATE)[0], RATE, unit="rad/s", columns=["gx"])
    count = 120 * RATE
    x = sensor(rng, count)[0]
    if band is not None:
        x = x + vibration(rng, count, band)[0]
    if moves:
        x = x + motion(rng, count)
    return rest, al.Recording(x, RATE, unit="rad/s", columns=["gx"])


def state(seed, band, moves=True):
    from allanite.axes.working import working_states

    class Study:
        fit = None

    rest, hover = logs(seed, band, moves)
    study = Study()
    study.fit = al.fit_model(rest, "N+K")
    return study.fit, working_states({"gx": study}, (hover,))["gx"]


#: Beside half of the rate, 50 Hz, and about the rate, where it folds to 0 … 40 Hz.
BANDS = {"20-80 Hz": (20.0, 80.0), "60-140 Hz": (60.0, 140.0)}


@pytest.mark.parametrize("band", BANDS)
def test_parts_are_named(band):
    fit, found = state(1, BANDS[band])
    low, high = fit["N"].interval
    assert low < N < high
    text = "\n".join(found.reasons)
    # 86.6 Hz folds to 13.4 Hz, 129.9 to 29.9, 173.2 to 26.8.
    lines = {round(line.frequency, 1): line for line in found.lines}
    assert set(lines) == {13.4, 26.8, 29.9, 43.3}
    assert lines[43.3].rms == pytest.approx(0.02, rel=0.1)
    assert "29.9 Hz (alias of 3 x 43.3 Hz)" in text
    # The end of motion lies above its corner, its rms is what moved.
    assert 1.0 < found.motion[0] <= 10.0
    assert found.motion[1] == pytest.approx(0.3, rel=0.2)
    assert "is ignored" in text
    if band == "60-140 Hz":
        # The band folds twice: 0.02² rad²/s² spread over 0 … 40 Hz, two-sided.
        level = np.sqrt(1 + 0.02**2 / 80 / N**2)
        assert found.level == pytest.approx(level, rel=0.15)
        assert "N x2.4: vibration at 0-" in text or "N x2.5" in text or "N x2.3" in text
        assert found.interval[0] < found.N < found.interval[1]
    else:
        assert found.level == pytest.approx(1.0, abs=0.15)
        assert "vibration at 2" in text


def test_nothing_is_made_of_a_second_log_at_rest():
    _, found = state(2, None, moves=False)
    assert found.reasons == ["nothing above the noise at rest"]
    assert found.model.name == "N+K"
    assert found.interval[0] < N < found.interval[1]


def nees(white, walk, samples):
    """Mean squared error over predicted variance after 10 and 30 s of coasting; aided each second for 60 s before."""
    integrals = samples.reshape(len(samples), -1, RATE).sum(axis=2) / RATE
    F = np.array([[1.0, -1.0], [0.0, 1.0]])
    Q = np.array([[white**2 + walk**2 / 3, -(walk**2) / 2], [-(walk**2) / 2, walk**2]])
    P, x, out = np.diag([0.0, 1.0]), np.zeros((2, len(samples))), []
    for k in range(integrals.shape[1]):
        P, x = F @ P @ F.T + Q, F @ x
        x[0] += integrals[:, k]
        if k < 60:
            gain = P[:, 0] / P[0, 0]
            x, P = x - np.outer(gain, x[0]), P - np.outer(gain, P[0])
        elif k + 1 - 60 in (10, 30):
            out.append(np.mean(x[0] ** 2) / P[0, 0])
    return np.array(out)


@pytest.mark.statistical
@pytest.mark.parametrize("band", BANDS)
def test_a_filter_with_the_file_is_consistent_at_work(band):
    """NEES is 0.8 to 1.2 over eight sensors; 400 segments have a standard error of 7 %."""
    rng = np.random.default_rng(9)
    new = sensor(rng, 90 * RATE, 400) + vibration(rng, 90 * RATE, BANDS[band], 400)
    found, inside = [], 0
    for seed in range(8):
        fit, at_work = state(seed, BANDS[band])
        low, high = fit["N"].interval
        inside += low < N < high
        document = {**fit.to_dict(), "working": at_work.to_dict()}
        text = al.export(axes_of([document]), "kalibr", horizon=30.0)
        numbers = [
            float(re.search(rf"^gyroscope_{key}: (\S+)", text, re.MULTILINE)[1])
            for key in ("noise_density", "random_walk")
        ]
        found.append(nees(*numbers, new))
    mean = np.mean(found, axis=0)
    assert (mean > 0.8 - 0.14).all()
    assert (mean < 1.2 + 0.14).all()
    # Of 8 intervals of 95 % fewer than 6 are right once in 200.
    assert inside >= 6


@pytest.mark.long
def test_the_command_writes_the_working_state(run, tmp_path):
    paths = []
    for name, log in zip(("rest", "hover"), logs(3, BANDS["60-140 Hz"]), strict=True):
        paths.append(tmp_path / f"{name}.npz")
        np.savez(
            paths[-1], data=log.samples, rate_hz=RATE, channels=["gx"], unit="rad/s"
        )  # fmt: skip
    rest, hover = paths
    words = ("characterize", rest, "--model", "N+K", "--working", hover)
    output, models = tmp_path / "imu.yaml", tmp_path / "models.json"
    code, out, err = run(*words, "--export", "kalibr", "--output", output, "--save", models)
    assert (code, err) == (0, "")
    assert "at work" in out
    text = output.read_text()
    assert "working state, from hover.npz:" in text
    assert re.search(r"N x2\.[345]: vibration at 0-\d+ Hz, or folded there from above 50 Hz", text)
    density = float(re.search(r"noise_density: (\S+)", text)[1])
    assert density > 2 * N
    # Saved models write the same file; a simulated twin stays at rest.
    code, again, _ = run("export", models, "--format", "kalibr")
    assert code == 0
    assert f"gyroscope_noise_density: {density:.6e}" in again
    code, twice, _ = run("export", models, "--format", "kalibr", "--inflate", "5")
    assert code == 0
    assert "all deviations x5: the user's choice" in twice
    assert float(re.search(r"noise_density: (\S+)", twice)[1]) == pytest.approx(
        5 * density, rel=1e-5
    )
    document = json.loads(models.read_text())
    assert document["columns"][0]["ladder"][-1]["model"] == "N+K"
    assert document["working"]["gx"]["notes"][0] == "working state, from hover.npz:"


def test_a_working_log_that_does_not_fit_is_refused(run, tmp_path):
    def saved(name, **changes):
        rng = np.random.default_rng(4)
        path = tmp_path / f"{name}.npz"
        given = {"data": rng.standard_normal(4000), "rate_hz": 100.0, "channels": ["gx"], "unit": "rad/s"}  # fmt: skip
        np.savez(path, **{**given, **changes})
        return path

    rest = saved("rest")
    for name, changes, told in (
        ("fast", {"rate_hz": 200.0}, "at rest at 100 Hz, and vibration folds elsewhere"),
        ("other", {"channels": ["hx"]}, "no column of the log at rest (gx): it has hx"),
        ("acc", {"unit": "m/s^2"}, "is in m/s^2, at rest in rad/s"),
        ("short", {"data": np.random.default_rng(1).standard_normal(900)}, "900 samples at work are too few"),
    ):  # fmt: skip
        code = 3 if name == "short" else 2
        refused(
            run("characterize", rest, "--working", saved(name, **changes)),
            code,
            f"{name}.npz",
            told,
        )
    refused(run("characterize", rest, "--inflate", "0"), 2, "--inflate")


@pytest.mark.slow
@pytest.mark.parametrize("target", ["kalibr", "gtsam", "kfgins", "gazebo", "json", "statespace"])
def test_inflation_multiplies_every_number_and_is_recorded(target):
    fit = al.fit_model(logs(5, None)[0], "N+K").to_dict()
    accel = json.loads(json.dumps(fit).replace("rad/s", "m/s^2").replace("gx", "ax"))
    axes = axes_of([fit, accel])
    plain, five = al.export(axes, target), al.export(axes, target, inflate=5.0)
    assert "all deviations x5: the user's choice" in five.replace("’", "'")
    if target == "json":
        found = [json.loads(t)["axes"][0]["coefficients"]["N"]["value"] for t in (plain, five)]
        assert found[1] == pytest.approx(5 * found[0])
    elif target == "statespace":
        found = [json.loads(t)["axes"][0]["R"][0][0] for t in (plain, five)]
        assert found[1] == pytest.approx(25 * found[0])
    elif target == "kalibr":
        found = [float(re.search(r"gyroscope_noise_density: (\S+)", t)[1]) for t in (plain, five)]
        assert found[1] == pytest.approx(5 * found[0], rel=1e-5)
