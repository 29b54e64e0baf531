"""Which column a watch takes, and in which unit."""

import json

import numpy as np
import pytest

import allanite as al
from documents import valid

N, RATE = 0.01, 100.0
RNG = np.random.default_rng(5)


@pytest.fixture
def model(tmp_path):
    """What `fit --save` writes: with the column, unit and rate of its log."""
    noisy = al.AngleRandomWalk(N=N)
    recording = noisy.simulate(duration=200, rate=RATE, seed=1, unit="deg/s")
    fit = al.fit_model(al.Recording(recording.samples, RATE, unit="deg/s", columns=["gy"]), "N")
    path = tmp_path / "model.json"
    fit.save(path)
    return path


def written(path, header, *columns, delimiter=","):
    """A log of these columns."""
    table = np.column_stack(columns)
    np.savetxt(path, table, delimiter=delimiter, fmt="%.9g", header=header, comments="")
    return path


def times(n=3000):
    return np.arange(n) / RATE


def noise(n=3000, factor=1.0):
    return factor * N * np.sqrt(RATE) * RNG.standard_normal(n)


def last(out):
    return json.loads(out.splitlines()[-1])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("header", "factors", "options", "holds"),
    [
        ("time [s],gx [deg/s],gy [deg/s]", (9, 1), (), True),  # the column that the model names
        ("time [s],wx,wy", (1, 9), (), True),  # else the first that is no time
        ("time [s],temperature,wy", (9, 1), (), True),
        ("time [s],gx,gy", (1, 9), ("--column", "gx"), True),
        ("time [s],gx,gy", (1, 9), ("--column", "1"), True),
        ("time [s],gx,gy", (1, 9), ("--column", "gy"), False),
        ("", (1, 9), (), True),  # without a header time is known by its numbers
        ("# time [s],gx,gy", (9, 1), (), True),
        ("time [s]\tgx [deg/s]\tgy [deg/s]", (9, 1), (), True),
    ],
)
def test_the_column_that_is_meant_is_watched(run, tmp_path, model, header, factors, options, holds):
    columns = (times(), *(noise(factor=factor) for factor in factors))
    mark = "\t" if "\t" in header else ","
    log = written(tmp_path / "log.csv", header, *columns, delimiter=mark)
    code, out, err = run("watch", log, "--model", model, *options)
    assert (code, last(out)["samples"], last(out)["holds"]) == (0, 3000, holds), err


@pytest.mark.slow
@pytest.mark.parametrize(
    ("header", "column", "words"),
    [
        ("time [s],gx,gy", "0", ["column time", "time stamps", "--column"]),
        ("time [s],gx,gy", "time", ["column time", "time stamps", "--column"]),
        ("", "0", ["column x0", "time stamps", "--column"]),
        ("time [s],gx,gy", "gz", ["unknown column 'gz'", "gx"]),
        ("time [s],gx,gy", "7", ["unknown column '7'", "gx"]),
    ],
)
def test_a_column_that_cannot_be_watched_is_one_line(run, tmp_path, model, header, column, words):
    log = written(tmp_path / "log.csv", header, times(500), noise(500), noise(500))
    code, out, err = run("watch", log, "--model", model, "--column", column)
    assert (code, out, len(err.splitlines())) == (2, "", 1), err
    assert all(word in err for word in ["log.csv", *words]), err


def test_one_of_several_columns_is_said_unless_it_is_named(run, tmp_path, model):
    log = written(tmp_path / "log.csv", "time [s],wx,wy", times(200), noise(200), noise(200))
    assert "wx" in run("watch", log, "--model", model)[2]
    assert run("watch", log, "--model", model, "--column", "wx")[2] == ""


def test_of_a_file_of_several_models_that_of_the_column_is_taken(run, tmp_path, model):
    one = json.loads(model.read_text())
    other = json.loads(model.read_text())
    other["recording"]["column"] = "gz"
    other["effects"][0]["parameters"]["N"]["value"] *= 9
    model.write_text(json.dumps({"schema": one["schema"], "columns": [one, other]}))
    log = written(tmp_path / "log.csv", "gy,gz", noise(), noise(factor=9))
    code, out, err = run("watch", log, "--model", model, "--column", "gz")
    assert (code, last(out)["holds"]) == (0, True), err
    code, _, err = run("watch", log, "--model", model)
    assert code == 2
    assert "gy, gz" in err
    assert "--column" in err


def test_the_unit_is_that_of_the_model_file(run, tmp_path, model):
    log = written(tmp_path / "log.csv", "gy", noise())
    state = tmp_path / "a.state"
    assert run("watch", log, "--model", model, "--state", state)[0] == 0
    assert al.Summary.load(tmp_path / "a.state.summary").units == ("deg/s",)
    assert "unit" in run("watch", log, "--model", model, "--unit", "furlong")[2]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("header", "factor", "options", "holds"),
    [
        ("gy [mdeg/s]", 1e3, (), True),
        ("gyro_x_mdps", 1e3, (), True),
        ("gy", 1e3, ("--unit", "mdeg/s"), True),
        ("gy", 1e3, (), False),
    ],
)
def test_samples_are_converted_to_the_unit_of_the_model(
    run, tmp_path, model, header, factor, options, holds
):
    log = written(tmp_path / "log.csv", header, factor * noise())
    code, out, err = run("watch", log, "--model", model, *options)
    assert (code, last(out)["holds"]) == (0, holds), err


@pytest.mark.slow
def test_a_phase_in_ns_is_watched_as_it_was_fitted(run, tmp_path):
    clock = al.parse_model("Q(Q=2e-9)+N(N=1e-11)").simulate(n=8000, rate=1.0, seed=1, unit="1")
    phase = 1e9 * np.cumsum(clock.samples)
    first = written(tmp_path / "first.csv", "phase", phase[:4000])
    model = tmp_path / "clock.json"
    code, _, err = run(
        "fit", first, "--unit", "ns", "--quantity", "angle", "--rate", "1", "--save", model,
        "--model", "Q+N",
    )  # fmt: skip
    assert code == 0, err
    assert valid(json.loads(model.read_text()))["recording"]["log_unit"] == "ns"
    for header in ("phase", "phase_ns", "phase [ns]"):
        log = written(tmp_path / "log.csv", header, phase[4000:])
        code, out, err = run("watch", log, "--model", model, "--quantity", "angle")
        assert (code, last(out)["samples"], last(out)["holds"]) == (0, 3999, True), err


@pytest.mark.slow
def test_a_restart_knows_the_header(run, tmp_path, model):
    log = written(tmp_path / "log.csv", "time [s],gx,gy [mdeg/s]", times(), noise(), 1e3 * noise())
    options = ("watch", log, "--model", model, "--column", "gy", "--state", tmp_path / "a.state")
    assert run(*options)[0] == 0
    with log.open("a") as stream:
        stream.writelines(
            f"{t:.2f},9,{1e3 * x:.9g}\n" for t, x in zip(times(), noise(), strict=True)
        )
    code, out, err = run(*options)
    assert (code, last(out)["samples"], last(out)["holds"]) == (0, 6000, True), err


@pytest.mark.parametrize(
    ("head", "row", "factor"),
    [
        ("gyro_z\n", "{x}", 1.0),  # decimal commas in one column, which are no delimiters
        ("t|gyro_z\n", "{t}|{x}", 1.0),
        ("t,gyro_z\n(s),(mdeg/s)\n", "{t},{x}", 1e3),  # units below the names
    ],
)
def test_rows_are_split_as_the_reader_of_logs_splits_them(run, tmp_path, model, head, row, factor):
    rows = (row.format(t=t, x=f"{factor * x:.6f}") for t, x in zip(times(), noise(), strict=True))
    text = head + "\n".join(rows) + "\n"
    log = tmp_path / "log.csv"
    log.write_text(text.replace(".", ",") if "," not in head else text)
    code, out, err = run("watch", log, "--model", model)
    assert (code, last(out)["samples"], last(out)["holds"], err) == (0, 3000, True, "")


def test_a_row_of_many_cells_is_said_in_one_line(run, tmp_path, model):
    """Rows as `ros2 topic echo --csv` prints them: the first column that varies is watched, and a cut list is printed."""
    rest = [np.zeros(200)] * 14 + [noise(200)] * 24
    log = written(tmp_path / "ros.csv", "", np.ones(200), *rest)
    code, out, err = run("watch", log, "--model", model)
    assert (code, last(out)["samples"], len(err.splitlines())) == (0, 200, 1)
    assert "column x15" in err
    assert len(err) < 400


def test_a_binary_log_is_refused(run, tmp_path, model):
    np.savez(tmp_path / "log.npz", data=noise(500))
    code, out, err = run("watch", tmp_path / "log.npz", "--model", model)
    assert (code, out, len(err.splitlines())) == (2, "", 1)
    assert "binary" in err
    assert "log.npz" in err


@pytest.mark.slow
@pytest.mark.parametrize("louder", [1, 3])
def test_a_phase_is_watched_by_its_differences(run, tmp_path, louder):
    model = tmp_path / "clock.json"
    clock = al.AngleRandomWalk(N=1e-11)
    al.fit_model(clock.simulate(n=20000, rate=1.0, seed=1, unit="1"), "N").save(model)
    phase = np.cumsum(louder * clock.simulate(n=6000, rate=1.0, seed=2, unit="1").samples)
    log, state = tmp_path / "phase.csv", tmp_path / "state.json"
    rows = [f"{value:.15e}\n" for value in phase]
    # The second call continues with the difference from the last phase of the first.
    for some in (rows[:3000], rows):
        log.write_text("phase [s]\n" + "".join(some))
        code, out, err = run(
            "watch", log, "--model", model, "--quantity", "angle", "--state", state
        )
        assert code == 0, err
    document = last(out)
    assert document["samples"] == 5999
    assert document["holds"] == (louder == 1)


def test_a_watch_of_increments_and_angles_is_one_of_rates():
    x = al.AngleRandomWalk(N=N).simulate(n=5000, rate=RATE, seed=3).samples
    values = []
    for quantity, samples in (
        ("rate", x),
        ("increment", x / RATE),
        ("angle", np.concatenate([[0.0], np.cumsum(x)]) / RATE),
    ):
        watch = al.Watch(al.AngleRandomWalk(N=N), RATE, quantity=quantity)
        watch.update(samples[:1000])
        watch.update(samples[1000:])
        values.append((watch.taken, watch.e_value))
    assert values[1] == (5000, pytest.approx(values[0][1], rel=1e-9))
    assert values[2] == (5000, pytest.approx(values[0][1], rel=1e-6))
    with pytest.raises(al.InputError, match="one of rate"):
        al.Watch(al.AngleRandomWalk(N=N), RATE, quantity="phase")
