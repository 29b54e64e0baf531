"""The command line: one line and a code for every mistake, files whole or absent."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from allanite.cli import COMMANDS, main
from allanite.cli.adev import KINDS

RNG = np.random.default_rng(7)
LOG_COMMANDS = ["adev", "fit", "check", "improve", "compare"]


@pytest.fixture
def run(capsys):
    """Run a command line; return exit code, stdout, stderr."""

    def call(*arguments):
        with pytest.raises(SystemExit) as caught:
            main([str(argument) for argument in arguments])
        out, err = capsys.readouterr()
        return caught.value.code, out, err

    return call


@pytest.fixture
def log(tmp_path):
    """A gyroscope log with a temperature column, as CSV."""
    path = tmp_path / "gyro.csv"
    x = RNG.standard_normal(4000) * 0.1
    rows = "".join(f"{k / 100:.2f},{v:.9f},{20 + k * 1e-3:.3f}\n" for k, v in enumerate(x))
    path.write_text("time [s],gyro_x [deg/s],temperature\n" + rows)
    return path


def needs(module):
    return pytest.importorskip(f"allanite.{module}")


def refused(result, code, *words):
    got, out, err = result
    assert got == code
    assert out == ""
    assert err.count("\n") == 1, err
    assert err.startswith("allanite: ")
    for word in words:
        assert word in err


# -- help and usage ------------------------------------------------------------------------------


def test_help_lists_every_command(run):
    code, out, err = run("--help")
    assert (code, err) == (0, "")
    for command in COMMANDS:
        assert command in out


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help(run, command):
    code, out, _ = run(command, "--help")
    assert code == 0
    assert "Usage" in out


def test_version(run):
    code, out, _ = run("--version")
    assert code == 0
    assert out.startswith("allanite ")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nothing"], "nothing"),
        (["adev"], "LOG"),
        (["adev", "x.csv", "--rat", "3"], "--rat"),
        (["adev", "x.csv", "--rate", "fast"], "fast"),
        (["adev", "x.csv", "--quantity", "speed"], "speed"),
        (["simulate", "N(N=1)", "--rate", "1"], "--duration"),
        (["simulate", "N(N=1)", "--duration", "1"], "--rate"),
        (["simulate", "N(N=1)", "--rate", "-1", "--duration", "1"], "positive"),
        (["simulate", "N(N=1)", "--rate", "1", "--duration", "-1"], "positive"),
        (["simulate", "N(N=1)", "--rate", "1", "-n", "9", "-o", "x.wav"], ".wav"),
        (["simulate", "N(N=1)", "--rate", "1", "-n", "9", "-o", "no/where.npy"], "no"),
        (["export", "N(N=1)", "--format", "simulink"], "simulink"),
        (["export", "N(N=1)"], "--unit"),
        (["export", "absent.json"], "absent.json"),
    ],
)
def test_usage_errors_are_one_line(run, arguments, words):
    refused(run(*arguments), 2, words)


def test_imports_nothing_heavy_for_help():
    code = (
        "import sys\nfrom allanite.cli import main\n"
        "try:\n    main(['--help'])\nexcept SystemExit:\n    pass\n"
        "print([m for m in ('numpy', 'scipy', 'matplotlib') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


# -- bad input -----------------------------------------------------------------------------------


def bad_inputs(folder):
    """Name → (arguments after the command, exit code, words of the message)."""

    def file(name, text):
        path = folder / name
        path.write_text(text)
        return path

    rows = "".join(f"{v:.6f}\n" for v in RNG.standard_normal(500))
    good = file("good.csv", "gyro\n" + rows)
    np.savez(folder / "good.npz", data=RNG.standard_normal(500), rate_hz=10.0)
    cut = folder / "cut.npz"
    cut.write_bytes((folder / "good.npz").read_bytes()[:700])
    np.savez(folder / "pickled.npz", data=np.array([{}, None], dtype=object), rate_hz=1.0)
    nan = "gyro\n" + "nan\n" * 100
    lengths = "a,b\n" + "1,2\n" * 60 + "3,\n4,\n5,\n"
    return {
        "missing file": ([folder / "absent.csv", "--rate", 1], 2, ["absent.csv", "no such file"]),
        "directory": ([folder, "--rate", 1], 2, [str(folder), "directory"]),
        "empty file": ([file("empty.csv", ""), "--rate", 1], 2, ["empty.csv", "empty"]),
        "text in a column": (
            [file("text.csv", "gyro\n1\n2\nbroken\n"), "--rate", 1],
            2,
            ["text.csv", "row 4", "gyro", "broken"],
        ),
        "all NaN": ([file("nan.csv", nan), "--rate", 1], 3, ["nan.csv", "NaN"]),
        "two lengths": (
            [file("lengths.csv", lengths), "--rate", 1],
            2,
            ["lengths.csv", "column b"],
        ),
        "unknown unit": ([good, "--rate", 1, "--unit", "furlong"], 2, ["furlong", "deg/s"]),
        "unknown output unit": ([good, "--rate", 1, "--output-unit", "furlong"], 2, ["furlong"]),
        "other kind of unit": (
            [good, "--rate", 1, "--unit", "deg/s", "--output-unit", "mg"],
            2,
            ["deg/s", "mg"],
        ),
        "unknown column": ([good, "--rate", 1, "--column", "acc"], 2, ["good.csv", "acc", "gyro"]),
        "unknown covariate": ([good, "--rate", 1, "--covariate", "temp"], 2, ["temp", "gyro"]),
        "no rate": ([good], 2, ["good.csv", "--rate"]),
        "rate 0": ([good, "--rate", 0], 2, ["rate", "0"]),
        "negative rate": ([good, "--rate", -5], 2, ["rate", "-5"]),
        "10 samples": (
            [file("short.csv", "gyro\n" + rows[:90]), "--rate", 1],
            3,
            ["short.csv", "10 samples", "16"],
        ),
        "constant": (
            [file("constant.csv", "gyro\n" + "2.5\n" * 100), "--rate", 1],
            2,
            ["gyro", "constant"],
        ),
        "infinities": (
            [file("inf.csv", "gyro\n" + "1\n2\ninf\n" * 30), "--rate", 1],
            2,
            ["inf.csv", "infinite", "row 2"],
        ),
        "truncated NPZ": ([cut], 2, ["cut.npz", "truncated"]),
        "pickled NPZ": ([folder / "pickled.npz"], 2, ["pickled.npz", "never loaded"]),
        "bad trim": ([good, "--rate", 1, "--trim", "5"], 2, ["--trim", "START:END"]),
        "empty trim": ([good, "--rate", 1, "--trim", "900:"], 2, ["trim"]),
        "bad decimation": ([good, "--rate", 1, "--decimate", 0], 2, ["decimation", "0"]),
    }


NAMES = [
    "missing file",
    "directory",
    "empty file",
    "text in a column",
    "all NaN",
    "two lengths",
    "unknown unit",
    "unknown output unit",
    "other kind of unit",
    "unknown column",
    "unknown covariate",
    "no rate",
    "rate 0",
    "negative rate",
    "10 samples",
    "constant",
    "infinities",
    "truncated NPZ",
    "pickled NPZ",
    "bad trim",
    "empty trim",
    "bad decimation",
]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("command", LOG_COMMANDS)
def test_bad_input_is_one_line_and_writes_nothing(run, tmp_path, command, name):
    cases = bad_inputs(tmp_path)
    assert list(cases) == NAMES
    arguments, code, words = cases[name]
    if command == "compare" and name == "missing file":
        words = words[:1]
    before = sorted(tmp_path.iterdir())
    extra = ["--plot", tmp_path / "figure.svg", "--json"]
    refused(run(command, *arguments, *extra), code, *words)
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize("command", ["fit", "check", "improve"])
@pytest.mark.parametrize(
    ("model", "words"),
    [
        ("N+", "character 3"),
        ("N+XYZ", "XYZ"),
        ("N+GM(T=)", "character"),
        ("absent.json", "absent.json"),
    ],
)
def test_bad_models_point_at_the_place(run, log, command, model, words):
    refused(run(command, log, "--model", model), 2, words)


# -- what works ----------------------------------------------------------------------------------


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


def test_simulate_json(run, tmp_path):
    needs("simulate")
    code, out, _ = run(
        "simulate", "N(N=1)", "--rate", 1, "-n", 50, "-o", tmp_path / "x.npz", "--json"
    )
    assert code == 0
    assert json.loads(out)["recording"]["n"] == 50


def strict(text):
    """JSON without NaN or Infinity."""

    def refuse(name):
        raise AssertionError(f"{name} in JSON")

    return json.loads(text, parse_constant=refuse)


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


@pytest.mark.parametrize(
    ("command", "schema"), [("fit", "fit"), ("check", "check"), ("improve", "improve")]
)
def test_fit_check_improve(run, log, command, schema):
    needs("deviation")
    code, out, err = run(command, log, "--model", "N", "--json")
    assert (code, err) == (0, "")
    document = strict(out)
    assert document["schema"] == f"allanite/{schema}/1"
    assert document["recording"]["path"] == str(log)
    code, out, _ = run(command, log, "--model", "N")
    assert code == 0
    assert "χ²/dof" in out


def test_several_columns_are_one_document(run, tmp_path):
    needs("deviation")
    path = tmp_path / "log.npz"
    np.savez(
        path,
        data=RNG.standard_normal((500, 2)),
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
    refused(run("fit", path, "--model", "N", "--save", tmp_path / "m.json"), 2, "--column")


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


def test_check_strict(run, tmp_path):
    needs("deviation")
    t = np.arange(20_000) / 100
    white = RNG.standard_normal(t.size)
    np.savez(tmp_path / "white.npz", data=white, rate_hz=100.0)
    np.savez(tmp_path / "line.npz", data=white + np.sin(2 * np.pi * 7.3 * t), rate_hz=100.0)
    assert run("check", tmp_path / "white.npz", "--model", "N", "--strict")[0] == 0
    assert run("check", tmp_path / "line.npz", "--model", "N", "--strict")[0] == 1
    assert run("check", tmp_path / "line.npz", "--model", "N")[0] == 0


def test_compare_with_a_datasheet(run, log, tmp_path):
    needs("deviation")
    # White noise of 0.1 deg/s at 100 Hz: N = 0.01 deg/s/√Hz = 0.6 deg/√h; the sheet lost the 60.
    sheet = tmp_path / "sheet.toml"
    sheet.write_text('[figures]\nangle_random_walk = "0.01 deg/√h"\n')
    code, out, _ = run("compare", log, "--model", "N", "--datasheet", sheet)
    assert code == 0
    assert "looks as if a density in deg/s/√Hz was read as a random walk" in out
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


def piped(data, *arguments):
    code = "from allanite.cli import main; main()"
    command = [sys.executable, "-c", code, *map(str, arguments)]
    done = subprocess.run(command, input=data, capture_output=True, check=False)
    return done.returncode, done.stdout.decode(), done.stderr.decode()


def test_a_log_from_a_pipe(run, log, tmp_path):
    needs("deviation")
    code, out, err = piped(log.read_bytes(), "fit", "-", "--model", "N", "--json")
    assert (code, err) == (0, "")
    document = strict(out)
    assert document["recording"]["path"] == "standard input"
    direct = strict(run("fit", log, "--model", "N", "--json")[1])
    assert document["effects"] == direct["effects"]
    np.save(tmp_path / "x.npy", RNG.standard_normal(300))
    code, out, _ = piped((tmp_path / "x.npy").read_bytes(), "fit", "-", "--model", "N", "--rate", 5)
    assert code == 0
    assert "300 samples at 5 Hz" in out


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_deviation(run, log, kind):
    if not hasattr(needs("deviation"), kind):
        pytest.skip(f"no {kind}")
    document = strict(run("adev", log, "--kind", kind, "--json")[1])
    assert document["kind"] == kind
    assert document["points"][0]["deviation"] > 0


def test_a_log_larger_than_memory_is_read_in_chunks(run, log, tmp_path, monkeypatch):
    from allanite.cli import stream

    def adev(*arguments):
        code, out, err = run("adev", *arguments, "--json")
        assert code == 0, err
        return strict(out)

    x = np.cumsum(RNG.standard_normal((3000, 2)), axis=0)
    np.save(tmp_path / "x.npy", x)
    for file, options in ((log, ()), (tmp_path / "x.npy", ("--rate", 10, "--column", "x1"))):
        whole = adev(file, *options)
        with monkeypatch.context() as patch:
            patch.setattr(stream, "free_memory", lambda: 1e3)
            assert stream.too_large(str(file))
            chunked = adev(file, *options)
        assert "chunks" in chunked["diagnostics"][0]
        assert chunked["recording"]["n"] == whole["recording"]["n"]
        assert chunked["recording"]["column"] == whole["recording"]["column"]
        same = {p["m"]: p["deviation"] for p in whole["points"]}
        near = [p for p in chunked["points"] if p["m"] < 32]
        assert len(near) == 5
        for point in near:
            assert point["deviation"] == pytest.approx(same[point["m"]], rel=1e-9)
    assert not stream.too_large(str(log))
    assert not stream.too_large("no such file")


def test_adev_of_a_pipe_needs_no_memory_of_it(run, log):
    needs("accumulator")
    code, out, err = piped(log.read_bytes(), "adev", "-", "--json")
    assert (code, err) == (0, "")
    streamed = strict(out)
    direct = strict(run("adev", log, "--json")[1])
    assert streamed["recording"]["n"] == direct["recording"]["n"] == 4000
    assert streamed["recording"]["column"] == "gyro_x"
    assert streamed["recording"]["rate_hz"] == pytest.approx(100)
    whole = {p["m"]: p["deviation"] for p in direct["points"]}
    for point in streamed["points"]:
        # Below m = 32 the stream has every term; above, its terms are a subset.
        if point["m"] < 32 and point["m"] in whole:
            assert point["deviation"] == pytest.approx(whole[point["m"]], rel=1e-9)
    rad = strict(piped(log.read_bytes(), "adev", "-", "--json", "--output-unit", "rad/s")[1])
    ratio = rad["points"][0]["deviation"] / streamed["points"][0]["deviation"]
    assert ratio == pytest.approx(np.pi / 180)
    phase = np.cumsum(RNG.standard_normal(1000))
    text = "\n".join(map(repr, phase.tolist())).encode()
    options = ["--rate", 1, "--quantity", "angle", "--json"]
    piped_phase = strict(piped(text, "adev", "-", *options)[1])
    expected = np.sqrt(np.mean(np.diff(phase, n=2) ** 2) / 2)
    assert piped_phase["points"][0]["deviation"] == pytest.approx(expected)
    refused(piped(b"x\n1\n2\n3\n4\n", "adev", "-"), 2, "standard input", "--rate")
    refused(piped(b"x\n1\n2\nthree\n", "adev", "-", "--rate", 1), 2, "three")
    refused(piped(b"", "adev", "-", "--rate", 1), 2, "standard input")


def test_bad_pipes():
    refused(piped(b"x\n1\n2\nthree\n", "fit", "-", "--rate", 1), 2, "standard input", "three")
    refused(piped(b"", "fit", "-", "--rate", 1), 2, "standard input", "empty")


def test_whole_file_or_nothing(tmp_path):
    from allanite.cli.output import whole_file
    from allanite.errors import InputError

    target = tmp_path / "x.txt"

    def interrupted():
        with whole_file(target) as draft:
            draft.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert list(tmp_path.iterdir()) == []
    with whole_file(target) as draft:
        draft.write_text("whole")
    assert target.read_text() == "whole"
    assert [p.name for p in tmp_path.iterdir()] == ["x.txt"]
    for bad in (tmp_path, tmp_path / "absent" / "x.txt"):
        with pytest.raises(InputError), whole_file(bad):
            pass


@pytest.mark.skipif(os.name != "posix", reason="signals are sent the POSIX way")
def test_ctrl_c_ends_a_command(tmp_path):
    needs("simulate")
    output = tmp_path / "x.csv"
    arguments = [
        sys.executable, "-c", "from allanite.cli import main; main()", "simulate",
        "N(N=1)+B(B=1)+K(K=1)", "--rate", "100", "-n", "30000000", "-o", str(output),
    ]  # fmt: skip
    process = subprocess.Popen(arguments, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    # click ends the line that a terminal shows ^C in.
    assert err == "\nallanite: interrupted\n"
    assert list(tmp_path.iterdir()) == []


# -- real recordings -----------------------------------------------------------------------------


@pytest.mark.data
def test_adev_agrees_with_the_published_curve_of_an_adis16405(run, data):
    with np.load(data("avar_curves.npz")) as curves:
        tau, published = curves["adis_tau"], curves["adis_adev"]
    document = strict(run("adev", data("adis16405_imu1.npz"), "--json")[1])
    for i, column in enumerate(document["columns"]):
        points = {round(p["tau_s"], 6): p["deviation"] for p in column["points"]}
        found = [points[round(t, 6)] for t in tau]
        np.testing.assert_allclose(found, published[:, i], rtol=1e-5)


@pytest.mark.data
def test_adev_agrees_with_stable32_on_a_caesium_clock(run, data):
    log = data("clock_cs5071a_phase.npz")
    options = ["--quantity", "angle", "--unit", "1", "--taus", "decade", "--json"]
    points = {p["tau_s"]: p["deviation"] for p in strict(run("adev", log, *options)[1])["points"]}
    # Printed to five digits.
    stable32 = {
        1: 3.3171e-10,
        10: 3.2118e-11,
        100: 3.4040e-12,
        1000: 4.7341e-13,
        10_000: 1.0126e-13,
    }
    for tau, value in stable32.items():
        assert points[tau] == pytest.approx(value, rel=1.5e-5)


@pytest.mark.data
def test_published_white_level_of_a_10_hz_log(run, data):
    document = strict(
        run("fit", data("hfi_10hz.npz"), "--column", "gyro_x", "--model", "N", "--json")[1]
    )
    (effect,) = document["effects"]
    assert effect["parameters"]["N"]["value"] == pytest.approx(4.8e-4, rel=0.03)
    assert any("9.862 Hz" in finding["message"] for finding in document["recording"]["audit"])
