"""What every command answers when all is well."""

import pickle

import numpy as np
import pytest

from allanite.deviation import ESTIMATORS
from command_line import needs, refused, strict

RNG = np.random.default_rng(7)


def test_simulate_writes_what_read_reads(run, tmp_path):
    needs("simulate")
    from allanite.readers import read

    found = []
    for suffix in ("npz", "npy", "csv"):
        path = tmp_path / f"x.{suffix}"
        code, out, err = run(
            "simulate", "N(N=0.1)+K(K=0.01)", "--rate", 50, "--duration", 20, "--unit", "deg/s",
            "--seed", 3, "-o", path,
        )  # fmt: skip
        assert (code, err) == (0, "")
        assert "1000 samples at 50 Hz in deg/s" in out
        options = {"rate": 50, "unit": "deg/s"} if suffix == "npy" else {}
        found.append(read(path, **options))
    for r in found:
        assert (r.n, r.unit) == (1000, "deg/s")
        assert r.rate == pytest.approx(50)
        np.testing.assert_array_equal(r.samples, found[0].samples)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["x.csv", "x.npy", "x.npz"]
    code, out, _ = run("simulate", "N(N=1)", "--rate", 1, "-n", 5)
    assert out.splitlines()[0] == "time [s],x [1]"
    assert len(out.splitlines()) == 6


def test_simulate_names_no_unit_1(run, tmp_path):
    code, out, err = run("simulate", "N(N=1)", "--rate", 1, "-n", 40, "-o", tmp_path / "x.csv")
    assert code == 0, err
    assert out.rstrip().endswith("x.csv: 40 samples at 1 Hz without a unit")


def test_simulate_json(run, tmp_path):
    needs("simulate")
    code, out, _ = run(
        "simulate", "N(N=1)", "--rate", 1, "-n", 50, "-o", tmp_path / "x.npz", "--json"
    )
    assert code == 0
    assert strict(out)["recording"]["n"] == 50


def test_adev(run, log, tmp_path):
    needs("deviation")
    figure = tmp_path / "figure.svg"
    code, out, err = run("adev", log, "--json", "--plot", figure)
    assert (code, err) == (0, "")
    document = strict(out)
    assert document["schema"] == "allanite/adev/1"
    assert document["recording"]["rate_hz"] == pytest.approx(100)
    assert document["recording"]["column"] == "gyro_x"
    assert set(document["points"][0]) == {"tau_s", "m", "n", "deviation", "low", "high", "edf"}
    assert figure.read_text().startswith("<?xml")
    code, out, err = run("adev", log)
    assert code == 0
    assert "deg/s" in out
    rad = strict(run("adev", log, "--output-unit", "rad/s", "--json")[1])
    ratio = rad["points"][0]["deviation"] / document["points"][0]["deviation"]
    assert ratio == pytest.approx(np.pi / 180)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("command", "schema"), [("fit", "fit/1"), ("check", "check/2"), ("improve", "improve/2")]
)
def test_fit_check_improve(run, log, command, schema):
    needs("deviation")
    code, out, err = run(command, log, "--model", "N", "--json")
    assert (code, err) == (0, "")
    document = strict(out)
    assert document["schema"] == f"allanite/{schema}"
    assert document["recording"]["path"] == str(log)
    code, out, _ = run(command, log, "--model", "N")
    assert code == 0
    assert "χ²/dof" in out


def test_several_columns_are_one_document(run, tmp_path):
    needs("deviation")
    path = tmp_path / "log.npz"
    np.savez(
        path,
        data=RNG.standard_normal((500, 2)) * [1.0, 1e-3],  # 1 g of noise is motion, and said
        rate_hz=10.0,
        channels=["gyro", "acc"],
        unit=["deg/s", "g"],
    )
    document = strict(run("fit", path, "--model", "N", "--json")[1])
    assert document["schema"] == "allanite/fit/1"
    assert [d["recording"]["unit"] for d in document["columns"]] == ["deg/s", "g"]
    code, out, _ = run("fit", path, "--model", "N", "--column", "acc", "--json")
    assert code == 0
    assert strict(out)["recording"]["column"] == "acc"
    saved = tmp_path / "m.json"
    assert run("fit", path, "--model", "N", "--save", saved)[0] == 0
    assert len(strict(saved.read_text())["columns"]) == 2


def test_a_saved_fit_goes_everywhere(run, log, tmp_path):
    needs("deviation")
    needs("simulate")
    model = tmp_path / "model.json"
    assert run("fit", log, "--model", "N", "--save", model)[0] == 0
    code, out, _ = run("simulate", model, "--duration", 10)
    assert code == 0
    assert out.startswith("time [s],")
    assert len(out.splitlines()) == 1001
    code, out, _ = run("export", model, "--format", "ros")
    assert code == 0
    assert "angular_velocity_covariance" in out
    code, out, _ = run("compare", log, model, "--json")
    assert code == 0
    items = strict(out)["items"]
    assert [i["kind"] for i in items] == ["recording", "model"]
    first = [i["points"][0]["deviation"] for i in items]
    # 4000 white samples: 2-σ of the deviation at m = 1 is 2·√(3/16000)… about 2.4 %.
    assert first[0] == pytest.approx(first[1], rel=0.03)
    assert run("fit", log, "--model", model)[0] == 0


@pytest.mark.slow
def test_a_model_that_is_not_adequate_is_said_by_fit_and_export(run, tmp_path):
    white = RNG.standard_normal(20_000)
    log, model = tmp_path / "filtered.npz", tmp_path / "model.json"
    np.savez(log, data=np.convolve(white, np.ones(8) / 8), rate_hz=100.0, unit="deg/s")
    code, out, _ = run("fit", log, "--save", model)
    assert code == 0
    assert "do not use these limits and intervals" in " ".join(out.split())
    assert "run `allanite improve`" in " ".join(out.split())
    assert "run `allanite improve`" not in run("check", log)[1]
    saved = strict(model.read_text())
    assert saved["adequate"] is False
    worst = saved["error"]["adev_worst"]
    code, out, err = run("export", model, "--format", "kalibr")
    assert code == 0
    assert "the fit is not adequate" in err
    assert err.count("\n") == 1
    assert f"at {worst['tau_s']:.3g} s" in err
    first = out.partition("# Details:")[0]
    assert "\n# Use: no." in first
    assert "the fit is not adequate" in first.replace("\n#    ", "")


@pytest.mark.slow
def test_check_strict(run, tmp_path):
    needs("deviation")
    t = np.arange(20_000) / 100
    white = RNG.standard_normal(t.size)
    np.savez(tmp_path / "white.npz", data=white, rate_hz=100.0)
    np.savez(tmp_path / "line.npz", data=white + np.sin(2 * np.pi * 7.3 * t), rate_hz=100.0)
    assert run("check", tmp_path / "white.npz", "--model", "N", "--strict")[0] == 0
    assert run("check", tmp_path / "line.npz", "--model", "N", "--strict")[0] == 1
    # Two codes: "limited by quantization" is not adequate either, as in JSON.
    codes = 0.01 * np.round(0.35 * white + 0.1)
    np.savez(tmp_path / "codes.npz", data=codes, rate_hz=100.0)
    given = ("check", tmp_path / "codes.npz", "--unit", "deg/s", "--model", "N", "--strict")
    assert run(*given)[0] == 1
    assert '"verdict": "limited by quantization"' in run(*given, "--json")[1]
    assert run("check", tmp_path / "line.npz", "--model", "N")[0] == 0


def test_compare_with_a_datasheet(run, log, tmp_path):
    needs("deviation")
    # White noise of 0.1 deg/s at 100 Hz: N = 0.01 deg/s/√Hz = 0.6 deg/√h; the sheet lost the 60.
    sheet = tmp_path / "sheet.toml"
    sheet.write_text('[figures]\nangle_random_walk = "0.01 deg/√h"\n')
    code, out, _ = run("compare", log, "--model", "N", "--datasheet", sheet)
    assert code == 0
    assert "looks as if a density in deg/s/√Hz was read as a random walk" in " ".join(out.split())
    document = strict(run("compare", log, "--model", "N", "--datasheet", sheet, "--json")[1])
    assert document["figures"][0]["ratio"]["value"] == pytest.approx(60, rel=0.05)


def test_notes_of_the_audit_are_shown_unless_quiet(run, tmp_path):
    needs("deviation")
    x = np.minimum(RNG.standard_normal(5000), 1.5)
    np.savez(tmp_path / "clipped.npz", data=x, rate_hz=10.0)
    assert "the range was exceeded" in run("adev", tmp_path / "clipped.npz")[1]
    assert "the range was exceeded" not in run("adev", tmp_path / "clipped.npz", "--quiet")[1]
    document = strict(run("adev", tmp_path / "clipped.npz", "--json")[1])
    assert document["recording"]["audit"][0]["kind"] == "clipping"


@pytest.mark.slow
@pytest.mark.parametrize("kind", ESTIMATORS)
def test_every_kind_of_deviation(run, tmp_path, kind):
    needs("deviation")
    log, figure = tmp_path / "gyro.csv", tmp_path / "figure.svg"
    log.write_text("gyro_x\n" + "".join(f"{v:.9f}\n" for v in RNG.standard_normal(600)))
    options = ("--kind", kind, "--rate", 10, "--unit", "deg/s")
    code, out, err = run("adev", log, *options, "--json", "--plot", figure)
    assert (code, err) == (0, "")
    document = strict(out)
    assert document["schema"] == "allanite/adev/1"
    assert document["kind"] == kind
    phase = kind in ("tdev", "ttotdev", "tierms", "mtie")
    assert document["unit"] == ("deg" if phase else "deg/s")
    for point in document["points"]:
        assert set(point) == {"tau_s", "m", "n", "deviation", "low", "high", "edf"}
        share = 0.75 if kind == "theo1" or (kind == "theoh" and point["tau_s"] > 6.0) else 1.0
        assert point["tau_s"] == pytest.approx(share * point["m"] / 10)
        if kind in ("tierms", "mtie"):
            assert (point["low"], point["high"], point["edf"]) == (None, None, None)
    assert document["points"][0]["deviation"] > 0
    said = " ".join(document["diagnostics"])
    assert ("published bias" in said) == (
        kind in ("mtotdev", "ttotdev", "htotdev")
    ) or kind == "totdev"
    assert figure.read_text().startswith("<?xml")
    code, out, err = run("adev", log, *options)
    assert (code, err) == (0, "")
    assert f"{kind} ({'°' if phase else '°/h'})" in out
    assert "nan" not in out


def test_the_table_makes_the_functions_and_the_choice():
    import allanite
    from allanite import deviation
    from allanite.cli.commands.adev import command

    choice = next(option for option in command.params if option.name == "kind").type
    assert list(choice.choices) == list(ESTIMATORS)
    for name, row in ESTIMATORS.items():
        function = getattr(allanite, name)
        assert function is getattr(deviation, name)
        assert name in allanite.__all__
        assert (function.__name__, row.name) == (name, name)
        assert row.source in function.__doc__
        assert pickle.loads(pickle.dumps(function)) is function


def test_a_digit_that_is_no_number_is_refused(run, log):
    refused(run("adev", log, "--taus", "²"), 2, "²", "octave")
    refused(run("adev", log, "--taus", "-1"), 2, "-1", "octave")
    refused(run("adev", log, "--taus", "9" * 5000), 2, "999", "octave")
    refused(run("adev", log, "--taus", "0"), 2, "0 averaging times")


def test_sensors_without_a_unit_are_no_clocks(run, tmp_path):
    path = tmp_path / "log.csv"
    # Quiet enough for an accelerometer in m/s^2, so that no draw looks like motion.
    x = 0.1 * np.random.default_rng(5).standard_normal((500, 2))
    path.write_text("gyro_x,acc_x\n" + "".join(f"{a:.6f},{b:.6f}\n" for a, b in x))
    code, out, err = run("fit", path, "--rate", 100, "--model", "N")
    assert code == 0
    assert "no unit given for gyro_x, acc_x: values are treated as dimensionless" in err
    assert "add --unit deg/s,m/s^2" in err
    assert "angle random walk" in out
    assert "velocity random walk" in out
    assert "white FM" not in out
    # A gyroscope and an accelerometer are not pooled.
    assert "recordings" not in out
    assert run("fit", path, "--rate", 100, "--model", "N", "--quiet")[2] == ""


def test_the_phase_of_a_clock_starts_with_white_and_flicker_pm(run, tmp_path):
    phase = np.random.default_rng(3).normal(0, 1e-9, 2000)
    clock, gyro = tmp_path / "clock.csv", tmp_path / "gyro.csv"
    np.savetxt(clock, phase, header="phase (s)", comments="")
    np.savetxt(gyro, phase, header="gyro (rad/s)", comments="")
    for path, kinds in ((clock, 5), (gyro, 3)):
        code, out, _ = run("fit", path, "--rate", "1", "--json", "--quiet")
        assert code == 0
        effects = strict(out)["effects"]
        assert len(effects) == kinds
        assert ("flicker_phase" in {e["kind"] for e in effects}) == (kinds == 5)
