"""Bad input: one line that names it, a code, and no file written."""

import numpy as np
import pytest

from command_line import refused

RNG = np.random.default_rng(7)
LOG_COMMANDS = ["adev", "fit", "check", "improve", "compare"]


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
            ["inf.csv", "infinite", "row 4", "(gyro)", "nan"],
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


def test_deviations_of_a_clock_refuse_another_unit(run, tmp_path):
    path = tmp_path / "phase.csv"
    np.savetxt(path, 1e-9 * np.cumsum(RNG.standard_normal(500)))
    arguments = [path, "--rate", 1, "--unit", "s", "--kind", "tdev", "--output-unit", "ns"]
    refused(run("adev", *arguments), 2, "--output-unit ns", "in s")


@pytest.fixture
def rows():
    return [f"{k},{k % 7 / 8},{k % 5 / 8}" for k in range(200)]


def test_inspect_names_the_file_and_the_cell(run, tmp_path, rows):
    refused(run("inspect", tmp_path / "absent.csv"), 2, "absent.csv: no such file")
    path = tmp_path / "log.csv"
    path.write_text("\n".join(["time,gx,gy", *rows, "1,2"]))
    refused(run("inspect", path), 2, "log.csv: row 202 has 2 columns, the others 3")
    path.write_text("\n".join(["time,gx,gy", *rows, "200,ERR,0"]))
    code, out, _ = run("inspect", path)
    assert code == 0
    assert 'log.csv: row 202, column 2 (gx): "ERR" is not a number: delete the row' in out


def test_inspect_refuses_what_is_no_unit(run, tmp_path, rows):
    path = tmp_path / "log.csv"
    path.write_text("\n".join(["time,gx,gy", *rows]))
    refused(run("inspect", path, "--unit", "dgs/s"), 2, "log.csv: unknown unit 'dgs/s'")


def test_a_decimal_comma_between_commas_is_asked_for(run, tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("time,gx,gy\n" + "".join(f"{k},0,{k % 7},1,{k % 5}\n" for k in range(99)))
    for command in ("inspect", "fit"):
        refused(
            run(command, path),
            2,
            "log.csv: row 2 has 5 columns",
            "for decimal commas, separate the columns",
        )


def test_a_column_that_is_nearly_one_is_asked_for(run, tmp_path, rows):
    path = tmp_path / "log.csv"
    path.write_text("\n".join(["time,GyrX,GyrY", *rows]))
    refused(run("fit", path, "--column", "GryX"), 2, "'GryX': did you mean GyrX?")
