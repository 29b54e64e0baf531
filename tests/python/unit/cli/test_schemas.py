"""What the commands write is what the JSON Schemas of the package say."""

import json
import re
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

import allanite as al
from documents import SCHEMAS, valid

SENSOR = al.parse_model("N(N=0.0126)+K(K=9e-4)+SIN(frequency=3.1,amplitude=0.01)")
#: Named in the package, and no document for others: files that only allanite reads again, and what it no longer writes.
WITHOUT_SCHEMA = {"page-study/2", "summary/1", "watch-state/3", "check/1"}
READ = ("--rate", 50, "--unit", "rad/s", "--quiet", "--json")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two columns of 50 seconds at 50 Hz, and a folder with one more log."""
    folder = tmp_path_factory.mktemp("logs")
    both = [
        SENSOR.simulate(duration=50, rate=50, seed=seed, unit="rad/s").samples for seed in (1, 2)
    ]
    rows = "".join(f"{a:.9f},{b:.9f}\n" for a, b in zip(*both, strict=True))
    (folder / "two.csv").write_text(f"gyro_x,gyro_y\n{rows}")
    (folder / "units").mkdir()
    (folder / "units" / "one.csv").write_text(f"gyro_x,gyro_y\n{rows}")
    return folder


@pytest.fixture
def said(run):
    """Document that a command writes, after validation by its schema."""

    def call(*arguments):
        code, out, err = run(*arguments)
        assert code == 0, err
        return [valid(json.loads(line)) for line in ([out] if out[1] == "\n" else out.splitlines())]

    return call


def test_the_schemas_are_schemas():
    for schema in SCHEMAS.values():
        Draft202012Validator.check_schema(schema)
        assert schema["title"]


def test_every_document_that_is_named_has_a_schema():
    sources = Path(al.__file__).parent.rglob("*.py")
    named = {
        name
        for path in sources
        for name in re.findall(r"allanite/([a-z_-]+/\d+)", path.read_text("utf-8"))
    }
    known = {s["$id"].removeprefix("urn:allanite:").replace(":", "/") for s in SCHEMAS.values()}
    assert named - known == WITHOUT_SCHEMA
    assert known - named == {"definitions/1"}


def test_a_field_that_no_schema_knows_is_found():
    document = al.oadev(SENSOR.simulate(duration=10, rate=50, seed=1, unit="rad/s")).to_dict()
    with pytest.raises(AssertionError, match="recording"):
        valid({"schema": "allanite/adev/1", "version": "", **document})


@pytest.mark.slow
@pytest.mark.parametrize("columns", [["gyro_x"], ["gyro_x", "gyro_y"]], ids=["one", "two"])
@pytest.mark.parametrize("command", ["fit", "check", "adev", "improve"])
def test_commands_that_read_a_log(said, folder, command, columns):
    chosen = [f"--column={name}" for name in columns]
    (document,) = said(command, folder / "two.csv", *chosen, *READ)
    assert ("columns" in document) == (len(columns) > 1)


@pytest.mark.parametrize("method", ["gls", "lines"])
def test_other_methods_write_the_same_document(said, folder, method):
    said("fit", folder / "two.csv", "--column=gyro_x", f"--method={method}", *READ)


def test_several_logs_are_pooled(said, folder):
    (document,) = said(
        "fit", folder / "two.csv", folder / "two.csv", "--column=gyro_x", "--model=N+K", *READ
    )
    assert document["pooled"]


def test_inspect(said, folder):
    said("inspect", folder / "two.csv", "--json")


@pytest.mark.slow
@pytest.mark.parametrize("asked", [("--find=GM(T=3,q_c=0.02)",), ("--know=K",)])
@pytest.mark.parametrize("length", [("--rate=10",), ("--duration=120", "--rate=50")])
def test_plan(said, asked, length):
    said("plan", "--model=N(N=0.01)+K(K=9e-4)", *asked, *length, "--json")


def test_predict(said, folder):
    said("predict", "--model=N(N=0.01)+K(K=9e-4)", "--aided=5", *READ[:4], "--json")
    log, model = folder / "two.csv", "--model=N(N=0.01)+K(K=9e-4)"
    (document,) = said("predict", log, model, "--aided=5", "--until=10", *READ)
    assert len(document["columns"]) == 2


@pytest.mark.parametrize("bound", [(), ("--overbound",)])
def test_saved_models_and_their_export(said, run, folder, tmp_path, bound):
    saved, model = tmp_path / "fit.json", tmp_path / "model.json"
    run("fit", folder / "two.csv", "--column=gyro_x", "--model=N+K", *READ[:5], "--save", saved)
    valid(json.loads(saved.read_text("utf-8")))
    said("export", saved, *bound)
    al.parse_model("N+GM(T=3!)").save(model)
    valid(json.loads(model.read_text("utf-8")))


def test_watch(said, folder):
    rows = (folder / "two.csv").read_text().splitlines()[1:]
    (folder / "bare.csv").write_text("\n".join(rows))
    said("watch", folder / "bare.csv", "--model=N(N=0.0126)", *READ[:4])


@pytest.mark.slow
def test_fleet(said, folder, tmp_path):
    said("fleet", folder / "units", "--out", tmp_path / "fleet.csv", "--model=N", *READ)


def test_compare(said, folder):
    log, model = folder / "two.csv", "N(N=0.0126)"
    (document,) = said("compare", log, model, *READ)
    assert [item["kind"] for item in document["items"]] == ["recording", "recording", "model"]
    assert "low" not in document["items"][2]["points"][0]


def test_compare_with_a_data_sheet(said, folder, tmp_path):
    """With several items, the deviations come last, under the schema of the sheet."""
    sheet, log = tmp_path / "sheet.toml", folder / "two.csv"
    sheet.write_text("[figures]\nnoise_density = '1.02 deg/s/sqrt(Hz)'\n")
    asked = ("--datasheet", sheet, "--model=N", *READ)
    (document,) = said("compare", log, "--column=gyro_x", *asked)
    assert document["figures"][0]["figure"] == "noise_density"
    (document,) = said("compare", log, *asked)
    assert [d["schema"].split("/")[1] for d in document["columns"]] == [
        *["datasheet"] * 2,
        "compare",
    ]


def test_simulate(said, tmp_path):
    target = tmp_path / "out.csv"
    length = ("--duration=10", "--rate=50", "--unit=rad/s")
    (document,) = said("simulate", "N(N=0.01)", *length, "--output", target, "--json")
    assert document["recording"]["n"] == 500


@pytest.mark.slow
@pytest.mark.parametrize("columns", [["gyro_x"], ["gyro_x", "gyro_y"]], ids=["one", "two"])
def test_report(said, folder, columns):
    chosen = [f"--column={name}" for name in columns]
    (document,) = said("report", folder / "two.csv", *chosen, "--model=N+K", *READ)
    assert ("common" in document) == (len(columns) > 1)


def test_state_spaces(said):
    asked = ("--format=statespace", "--rate=100", "--unit=rad/s")
    (document,) = said("export", "N(N=0.01)+K(K=9e-4)+R(R=1e-4)", *asked)
    assert document["axes"][0]["known"] == ["rate_ramp"]
    valid(al.parse_model("N(N=0.01)+GM(q_c=1e-3,T=30)").state_space(100.0).to_dict())


def test_documents_of_the_library():
    log = SENSOR.simulate(duration=120, rate=50, seed=1, unit="rad/s")
    valid(al.psd(log).to_dict())
    valid(al.innovations(log, SENSOR).to_dict())
    valid(al.parse_model("N+K").fit(log).simulate_check(3, seed=1).to_dict())
