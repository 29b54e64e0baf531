"""Models, data sheets, states, summaries and tables that others wrote: read, or refused in one line."""

import json
import os
import subprocess
import sys
import zipfile
from contextlib import suppress

import numpy as np
import pytest

import allanite as al
from allanite.cli.models import models_of
from allanite.scale.logs import logs_of

#: Documents that no reader may answer with anything but one line.
DEEP = {"lists in lists": "[" * 100_000, "objects in objects": '{"a":' * 100_000}
NO_JSON = {
    **DEEP,
    "zeros": "\0" * 1000,
    "a number": "3",
    "a long number": "1" * 5000,
    "nothing": "",
}
FIT = {"schema": "allanite/fit/1", "effects": [{"kind": "N", "parameters": {"N": {"value": 1.0}}}]}
BIG = int("9" * 400)


def refused(read, *arguments):
    with pytest.raises(al.AllaniteError) as caught:
        read(*arguments)
    said = str(caught.value)
    assert said.isprintable()
    assert len(said) <= 300


def watch_with(state):
    al.Watch("N(N=1)", rate=10).restore(state)


READERS = {
    "model": (".json", al.parse_model),
    "model for a command": (".json", models_of),
    "sheet in JSON": (".json", al.read_datasheet),
    "sheet in TOML": (".toml", al.read_datasheet),
    "results of Kalibr": (".yaml", models_of),
    "script of MATLAB": (".m", models_of),
    "state of a watch": (".json", watch_with),
    "summary": (".summary", al.Summary.load),
    "table of a fleet": (".csv", al.fleet),
}


@pytest.mark.parametrize("name", READERS)
@pytest.mark.parametrize("text", NO_JSON.values(), ids=NO_JSON)
def test_what_is_no_document_is_one_line(tmp_path, name, text):
    suffix, read = READERS[name]
    path = tmp_path / f"x{suffix}"
    path.write_text(text)
    refused(read, str(path))


@pytest.mark.skipif(os.name != "posix", reason="POSIX has pipes with names")
@pytest.mark.parametrize("name", READERS)
def test_a_pipe_and_a_device_are_no_document(tmp_path, name):
    suffix, read = READERS[name]
    pipe, device = tmp_path / f"pipe{suffix}", tmp_path / f"device{suffix}"
    os.mkfifo(pipe)
    device.symlink_to("/dev/zero")
    for path in (pipe, device):
        refused(read, str(path))


DOCUMENTS = {
    "steps that are no objects": {**FIT, "columns": [{"ladder": [1]}]},
    "steps that are no list": {**FIT, "columns": [{"ladder": {"a": 1}}]},
    "a recording that is a list": {**FIT, "recording": [1]},
    "a unit that is a number": {**FIT, "recording": {"unit": 7}},
    "a rate that is a text": {**FIT, "recording": {"rate_hz": "x"}},
    "a rate beyond all numbers": {**FIT, "recording": {"rate_hz": BIG}},
    "a value beyond all numbers": {
        **FIT, "effects": [{"kind": "N", "parameters": {"N": {"value": BIG}}}],
    },
    "a figure beyond all numbers": {
        "figures": {"angle_random_walk": {"value": BIG, "unit": "rad/s/√Hz"}}
    },
    "a figure that is a list": {"figures": {"angle_random_walk": [[]]}},
}  # fmt: skip


@pytest.mark.parametrize("document", DOCUMENTS.values(), ids=DOCUMENTS)
def test_parts_of_another_type_are_one_line(tmp_path, document):
    path = tmp_path / "x.json"
    path.write_text(json.dumps(document))
    refused(models_of, str(path))


#: Ten lines that stand for 10⁹ numbers.
ALIASES = "a0: &a0 {x: 1}\n" + "".join(
    f"a{k + 1}: &a{k + 1} {{<<: [{', '.join([f'*a{k}'] * 9)}]}}\n" for k in range(9)
)


@pytest.mark.parametrize(
    "text",
    [
        ALIASES,
        f"gyroscope_noise_density: {BIG}\ngyroscope_random_walk: 1\n",
        "gyroscope_noise_density: [[[x]]]\ngyroscope_random_walk: 1\n",
        "? [a, b]\n: 1\n",
        "a: 2026-13-45\n",
    ],
    ids=["aliases", "a long number", "lists", "a key that is a list", "no date"],
)
def test_yaml_that_no_tool_writes_is_one_line(tmp_path, text):
    path = tmp_path / "imu.yaml"
    path.write_text(text)
    refused(models_of, str(path))


@pytest.mark.parametrize("value", ['"x"', "1e999", "null", "[]", str(BIG)])
@pytest.mark.parametrize("name", ["taken", "rest", "bets", "alarm", "position"])
def test_a_state_with_other_values_is_one_line(tmp_path, name, value):
    path = tmp_path / "state.json"
    watch = al.Watch("N(N=1)", rate=10)
    watch.update(np.random.default_rng(1).standard_normal(3000))
    watch.save(path)
    state = json.loads(path.read_text())
    text = json.dumps({**state, name: "here"}).replace('"here"', value)
    path.write_text(text)
    if (name, value) in {("alarm", "null"), ("position", "null"), ("rest", "[]")}:
        watch.restore(path)
    else:
        refused(watch_with, path)


def test_a_summary_that_is_damaged_is_one_line(tmp_path):
    path = tmp_path / "x.summary"
    al.summarize(np.random.default_rng(1).standard_normal(3000), rate=10).save(path)
    data = path.read_bytes()
    al.Summary.load(path)
    for at in range(0, len(data), max(len(data) // 50, 1)):
        path.write_bytes(data[:at])
        refused(al.Summary.load, path)
    np.save(path.with_suffix(".npy"), np.zeros(3))
    refused(al.Summary.load, path.with_suffix(".npy"))


def test_a_summary_larger_than_the_budget_is_one_line(tmp_path, monkeypatch):
    path = tmp_path / "x.summary"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("header.npy", bytes(30_000_000))
    monkeypatch.setenv("ALLANITE_MEMORY", "10M")
    refused(al.Summary.load, path)


ROW = {"file": "a", "column": "gx", "status": "done", "effects": "{}", "remarks": ""}


@pytest.mark.parametrize(
    "numbers", ["[", "3", '{"N": 1}', '{"N": [1, 2]}', '{"N": [NaN, 1, 1, 1]}', '{"N": ["x", 1, 1, 1]}']
)  # fmt: skip
def test_a_table_with_other_numbers_is_one_line(tmp_path, numbers):
    import csv

    path = tmp_path / "x.csv"
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, [*ROW, "numbers"])
        writer.writeheader()
        writer.writerow({**ROW, "numbers": numbers})
    refused(al.fleet, path)


def test_cells_longer_than_the_limit_of_the_library_are_read(tmp_path):
    path = tmp_path / "x.csv"
    remark = "x" * 200_000
    path.write_text(f"file,column,status,numbers,effects,remarks\na,gx,failed,,,{remark}\n")
    with pytest.raises(al.TooShortError, match="no axis"):
        al.fleet(path)


@pytest.mark.slow
def test_a_parquet_table_is_read_in_a_child(tmp_path, monkeypatch):
    """600 bytes that decompress to 60 GB of text."""
    pa, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    rows = pa.array(np.zeros(200_000, np.int32))
    long = pa.DictionaryArray.from_arrays(rows, pa.array(["x" * 300_000]))
    parquet.write_table(pa.table({"file": long, "remarks": long}), tmp_path / "x.parquet")
    monkeypatch.setenv("ALLANITE_MEMORY", "200M")
    refused(al.fleet, tmp_path / "x.parquet")
    good = {**ROW, "numbers": '{"N": [1.0, null, null, 0.1]}'}
    parquet.write_table(pa.Table.from_pylist([good]), tmp_path / "y.parquet")
    assert al.fleet(tmp_path / "y.parquet").axes == 1


@pytest.mark.skipif(os.name != "posix", reason="limited the POSIX way")
@pytest.mark.slow
def test_a_large_log_is_no_list_of_logs(tmp_path):
    """To learn that a log is no list of logs, a fleet reads its first line, not 3 GB."""
    path = tmp_path / "x.csv"
    with path.open("wb") as file:
        file.truncate(3_000_000_000)
    code = (
        "import resource; resource.setrlimit(resource.RLIMIT_AS, (3 * 10**9,) * 2)\n"
        "import sys; from allanite.scale.logs import logs_of; print(logs_of(sys.argv[1]))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, path], capture_output=True, text=True, check=True
    )
    assert "x.csv" in done.stdout


def test_a_list_names_logs_and_a_log_does_not(tmp_path):
    np.savetxt(tmp_path / "a.csv", np.zeros(200))
    path = tmp_path / "list.txt"
    path.write_text("a.csv\n\nb.csv\n")
    assert [log.name for log in logs_of(path)] == ["a.csv", "b.csv"]
    assert logs_of(tmp_path / "a.csv") == [tmp_path / "a.csv"]


HECTOR = "# sampling period 1.0\n{}\n" + "".join(
    f"{55000 + k} {0.1 * k % 0.7}\n" for k in range(60)
)


@pytest.mark.parametrize("line", ["# offset 1.2.3", "# offset " + "9" * 300, "# offset nan", "# offset ..."])  # fmt: skip
def test_an_offset_that_is_no_date_is_one_line(tmp_path, line):
    from allanite.readers.texts.hector import offsets_of

    path = tmp_path / "x.mom"
    path.write_text(HECTOR.format(line))
    refused(offsets_of, path)
    assert al.read(path).n == 60


@pytest.mark.parametrize("day", ["nan", "1e300", "-99999999"])
def test_a_day_that_no_date_has_is_one_line(tmp_path, day):
    path = tmp_path / "x.mom"
    path.write_text(HECTOR.format("").replace("55007", day))
    refused(al.read, path)


@pytest.mark.parametrize("shape", ["(0, 1000000000000)", "(5, 10)", "(2**60, 2)", "(3,"])
def test_an_array_read_in_chunks_with_another_shape_is_one_line(tmp_path, monkeypatch, shape, run):
    """A log above the budget is read in chunks, and its header may be wrong."""
    path = tmp_path / "x.npy"
    head = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}}}".ljust(117) + "\n"
    path.write_bytes(b"\x93NUMPY\x01\0" + (118).to_bytes(2, "little") + head.encode() + bytes(300))
    for budget in ("100", "1G"):
        monkeypatch.setenv("ALLANITE_MEMORY", budget)
        code, _, said = run("adev", path, "--rate", 10)
        assert code in (2, 3), said
        assert said.count("\n") == 1


#: Values of other types, sizes and signs than those that belong there.
VALUES = ("x", [], {"a": 1}, None, BIG, -1.0, [[1e308]])


def changed_documents(tree):
    """The document with each of its values replaced by each of `VALUES`."""

    def places(value, path=()):
        inside = ()
        if isinstance(value, (dict, list)):
            inside = value.items() if isinstance(value, dict) else enumerate(value[:2])
        for key, one in inside:
            yield (*path, key)
            yield from places(one, (*path, key))

    text = json.dumps(tree)
    for path in places(tree):
        for value in VALUES:
            document = json.loads(text)
            at = document
            for key in path[:-1]:
                at = at[key]
            at[path[-1]] = value
            yield document


def test_a_fit_with_one_value_replaced_is_exported_or_one_line(tmp_path):
    from allanite.exports import axes_of

    path = tmp_path / "x.json"
    x = np.random.default_rng(1).standard_normal(200)
    found = al.parse_model("N+K").fit(al.Recording(x, rate=10, unit="rad/s")).to_dict()
    small = {name: found[name] for name in ("schema", "effects", "recording")}
    refusals = 0
    for document in changed_documents(small):
        path.write_text(json.dumps(document))
        with suppress(al.AllaniteError):
            axes_of(path, "rad/s", rate=10.0)
            refusals -= 1
        refusals += 1
    assert refusals > 10


def test_a_model_whose_only_noise_is_0_is_no_division_by_zero(tmp_path, run):
    path = tmp_path / "x.json"
    x = np.random.default_rng(1).standard_normal(200)
    found = al.parse_model("N").fit(al.Recording(x, rate=10, unit="rad/s")).to_dict()
    found["effects"][0]["parameters"]["N"]["value"] = 0
    path.write_text(json.dumps(found))
    code, _, said = run("export", path, "--format", "robot_localization", "--rate", 10)
    assert (code, said.count("\n")) == (2, 1), said
    assert "no noise" in said


@pytest.mark.slow
def test_a_fit_with_one_value_replaced_is_predicted_or_one_line(tmp_path, run):
    """The interval of a parameter was once used before it was checked."""
    path = tmp_path / "x.json"
    x = np.random.default_rng(1).standard_normal(200)
    found = al.parse_model("N").fit(al.Recording(x, rate=10, unit="rad/s")).to_dict()
    small = {name: found[name] for name in ("schema", "effects")}
    for document in changed_documents(small):
        path.write_text(json.dumps(document))
        code, _, said = run(
            "predict", "--aided", 1, "--model", path, "--rate", 10, "--unit", "rad/s"
        )
        assert code in (0, 2), said
        assert said.count("\n") == (code == 2), said


def test_a_characterization_with_one_value_replaced_is_simulated_or_one_line():
    from allanite.axes.twin import twin

    rung = {"effects": [{"kind": "N", "parameters": {"N": {"value": 0.1}}}]}
    axis = {
        "recording": {"column": "gx", "rate_hz": 10.0, "duration_s": 5.0, "unit": "rad/s"},
        "ladder": [rung],
    }
    document = {
        "schema": "allanite/characterize/1",
        "columns": [axis],
        "samples": {"gx": {"mean": 1.0, "step": 0.01, "clipped": [2.0]}},
        "common": {"lines": [{"frequency_hz": 3.0, "kinds": ["sinusoid"]}], "shared_noise": []},
        "failed": {"gy": "no samples"},
    }
    assert twin(document).recording.n == 50
    refusals = 0
    for one in changed_documents(document):
        with suppress(al.AllaniteError):
            twin(one, n=20)
            refusals -= 1
        refusals += 1
    assert refusals > 10
