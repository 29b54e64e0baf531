"""allanite accept: each figure of a data sheet against the measured interval, with exit codes for production lines."""

import csv
import io
import json
import re

import numpy as np
import pytest

import allanite as al
from allanite.cli import main
from documents import valid

SHEET = """
name = "Part"
temperature = "25 degC"
[gyroscope]
angle_random_walk = "0.3 deg/sqrt(h)"
bias_instability = "60 deg/h"
"""


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as ended:
        main([str(a) for a in arguments])
    out, err = capsys.readouterr()
    return ended.value.code or 0, out, err


def part(folder, noise, seconds=600.0, rate=20.0, axes=1, seed=3, name="part"):
    """A log of white noise; `noise` in deg/√h."""
    rng = np.random.default_rng(seed)
    samples = noise / 60 * np.sqrt(rate) * rng.standard_normal((int(seconds * rate), axes))
    channels = [f"gyro_{a}" for a in "xyz"[:axes]]
    path = folder / f"{name}.npz"
    np.savez(path, data=samples, rate_hz=rate, unit="deg/s", channels=channels)
    return path


@pytest.fixture
def sheet(tmp_path):
    path = tmp_path / "part.toml"
    path.write_text(SHEET, encoding="utf-8")
    return path


@pytest.mark.slow
@pytest.mark.parametrize(("noise", "code"), [(0.2, 0), (0.45, 1), (0.3, 3)])
def test_exit_codes(noise, code, tmp_path, sheet, capsys):
    got, out, err = run(capsys, "accept", part(tmp_path, noise), "--sheet", sheet)
    assert got == code, out + err
    assert {0: "meets", 1: "does not meet", 3: "undecided"}[code] in out


@pytest.mark.slow
def test_a_margin_is_an_allowance(tmp_path, sheet, capsys):
    log = part(tmp_path, 0.315)
    assert run(capsys, "accept", log, "--sheet", sheet)[0] == 1
    assert run(capsys, "accept", log, "--sheet", sheet, "--margin", "10%")[0] == 0


@pytest.mark.slow
def test_json_has_its_schema(tmp_path, sheet, capsys):
    log = part(tmp_path, 0.3, axes=2)
    code, out, _ = run(capsys, "accept", log, "--sheet", sheet, "--json")
    assert code == 3
    document = json.loads(out)
    valid(document)
    figure = document["columns"][0]["figures"][0]
    assert figure["name"] == "angle_random_walk"
    assert figure["limit"] == 0.3
    assert figure["unit"] == "deg/sqrt(h)"
    assert figure["interval"][0] < 0.3 < figure["interval"][1]


def test_rows_for_a_production_line(tmp_path, sheet, capsys):
    log = part(tmp_path, 0.2)
    code, out, _ = run(capsys, "accept", log, "--sheet", sheet, "--csv", "--serial", "=1+1")
    assert code == 0
    rows = list(csv.DictReader(io.StringIO(out)))
    assert [row["figure"] for row in rows] == ["angle_random_walk", "bias_instability"]
    assert rows[0]["verdict"] == "meets"
    # A spreadsheet must not compute it.
    assert rows[0]["serial"] == "'=1+1"


@pytest.mark.slow
def test_one_page_with_everything(tmp_path, sheet, capsys):
    log, page = part(tmp_path, 0.2), tmp_path / "page.html"
    run(
        capsys,
        "accept",
        log,
        "--sheet",
        sheet,
        "--report",
        page,
        "--serial",
        "SN-7",
        "--date",
        "2026-11-28",
    )
    text = page.read_text(encoding="utf-8")
    for words in (
        "SN-7",
        "2026-11-28",
        "25 degC",
        "not logged",
        "0.3\xa0°/√h",
        "meets",
        "<svg",
    ):
        assert words in text, words


@pytest.mark.slow
def test_a_stability_that_the_record_cannot_show_is_not_reported(tmp_path, capsys):
    """450 s of white noise: the curve still falls, so its lowest point is no bias stability."""
    path = tmp_path / "stability.toml"
    path.write_text('[figures]\nin_run_bias_stability = "1 deg/h"', encoding="utf-8")
    log = part(tmp_path, 0.3, seconds=450)
    code, out, _ = run(capsys, "accept", log, "--sheet", path)
    assert code == 3
    # The table and the sentence below it state the same limit, with a unit.
    row, sentence = (line for line in out.splitlines() if "in_run_bias_stability" in line)
    assert "1 °/h" in row
    assert "not reached" in row
    limit = re.search(r"at most ([\d.]+) °/h", row)[1]
    assert f"the minimum is at most {float(limit):.3g} °/h (95 % limit)" in sentence
    code, out, _ = run(capsys, "compare", log, "--datasheet", path)
    assert code == 0
    assert "not reached" in out


@pytest.mark.slow
def test_a_stability_that_the_record_shows_is_below_the_limit(tmp_path, capsys):
    """White noise alone: the minimum is below any limit that the curve has passed."""
    path = tmp_path / "stability.toml"
    path.write_text('[figures]\nin_run_bias_stability = "40 deg/h"', encoding="utf-8")
    code, out, _ = run(capsys, "accept", part(tmp_path, 0.3), "--sheet", path)
    assert code == 0, out


@pytest.mark.long
def test_a_record_that_is_recommended_decides(tmp_path, sheet):
    """The recommended length decides in most records, and a tenth of it does not."""
    figures = al.DataSheet("sheet", (al.Quoted("angle_random_walk", 0.3, "deg/sqrt(h)"),))
    recording = al.read(part(tmp_path, 0.306, seconds=100))
    tested = al.accept(recording, figures).figures[0]
    assert tested.verdict == "undecided"
    assert tested.needs is None or tested.needs > 100.0
    decided = 0
    for seed in range(6):
        longer = al.read(part(tmp_path, 0.33, seconds=600, seed=seed, name=f"p{seed}"))
        decided += al.accept(longer, figures).verdict == "does not meet"
    assert decided >= 5


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('[accelerometer]\nvelocity_random_walk = "0.1 m/s/sqrt(h)"', "no figure for angular rate"),
        ("[figures]\n", "needs a table"),
        ('[figures]\nangle_random_walk = "0.005"', "has no unit"),
    ],
)
def test_sheets_that_do_not_fit(text, words, tmp_path, capsys):
    path = tmp_path / "other.toml"
    path.write_text(text, encoding="utf-8")
    code, out, err = run(capsys, "accept", part(tmp_path, 0.2), "--sheet", path)
    assert (code, out) == (2, "")
    assert words in err
    assert err.count("\n") == 1


def test_a_small_number_without_a_unit_is_read_whole(tmp_path):
    """``0.005`` is not 0.00 in the unit 5."""
    path = tmp_path / "small.toml"
    path.write_text('[figures]\nangle_random_walk = "0.005"', encoding="utf-8")
    with pytest.raises(al.InputError, match=r"'0\.005' has no unit"):
        al.read_datasheet(path)


def test_compare_draws_one_log_with_its_sheet(tmp_path, sheet, capsys):
    figure = tmp_path / "figure.svg"
    log = part(tmp_path, 0.2)
    code, _, err = run(capsys, "compare", log, "--sheet", sheet, "--plot", figure)
    assert code == 0, err
    assert "Part" in figure.read_text(encoding="utf-8") or "part.toml" in figure.read_text(
        encoding="utf-8"
    )


def test_compare_prints_one_unit(tmp_path, capsys):
    sheet = tmp_path / "part.toml"
    sheet.write_text('[gyroscope]\nangle_random_walk = "1.2 deg/sqrt(h)"\n', encoding="utf-8")
    code, out, err = run(capsys, "compare", part(tmp_path, 0.2), sheet)
    assert code == 0, err
    head = next(line for line in out.splitlines() if "tau (s)" in line)
    assert "[1] °/h" in head
    assert "[2] °/h" in head
    assert "rad/s" not in head
    table = out.partition("tau (s)")[2].splitlines()[1:]
    one, other, ratio = map(float, table[0].split()[1:4])
    assert ratio == pytest.approx(other / one, rel=2e-3)


def test_compare_takes_what_other_tools_wrote(tmp_path, sheet, capsys):
    log = part(tmp_path, 0.2)
    yaml = tmp_path / "kalibr.yaml"
    yaml.write_text(
        "gyroscope_noise_density: 1.0e-4\ngyroscope_random_walk: 1.0e-6\nupdate_rate: 20.0\n",
        encoding="utf-8",
    )
    curve = al.oadev(al.read(log))
    table = tmp_path / "table.csv"
    np.savetxt(table, np.c_[curve.tau, curve.deviation], delimiter=",", header="tau,gyro_x")
    code, out, err = run(capsys, "compare", log, sheet, yaml, table, "--unit", "deg/s", "--json")
    assert code == 0, err
    names = [item["name"] for item in json.loads(out)["items"]]
    assert len(names) == 4
