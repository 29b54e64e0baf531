"""The report: its numbers are those of the other commands, and the file stands by itself."""

import base64
import hashlib
import json
import re
from html import unescape
from html.parser import HTMLParser
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.cli import main
from allanite.common.numbers import (
    number,
    percent_text,
    value_and_interval_text,
    value_and_interval_texts,
    with_readable_numbers,
)
from allanite.effects import find
from allanite.effects.sheet_units import in_sheet_unit, requested_units
from allanite.fit import engine
from allanite.plots.svg_painter import inline_svg, path_data
from allanite.report.html import UNITS
from allanite.report.words import COMPLETED
from page_browser import BROWSERS, launched

pytestmark = pytest.mark.slow

pytest.importorskip("matplotlib")

HIDDEN = "N(N=0.01)+K(K=1e-4)+SIN(frequency=3.1,amplitude=0.004)"


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    """Seven minutes of a gyroscope with the line of a fan."""
    path = tmp_path_factory.mktemp("log") / "gyro.npz"
    samples = al.parse_model(HIDDEN).simulate(duration=450, rate=20, seed=3, unit="rad/s").samples
    np.savez(path, data=samples[:, None], rate_hz=20.0, channels=["gyro_x"], unit=["rad/s"])
    return path


@pytest.fixture(scope="module")
def report(log):
    return al.make_report(al.read(log), "N+K")


@pytest.fixture(scope="module")
def page(report):
    return report.to_html()


@pytest.fixture
def run(capsys):
    def call(*arguments):
        with pytest.raises(SystemExit) as caught:
            main([str(a) for a in arguments])
        out, err = capsys.readouterr()
        return caught.value.code, out, err

    return call


def test_the_first_model_is_checked_once(report):
    entry = report.entries[0]
    assert len(entry.study.ladder) > 1
    assert entry.first is entry.study.first_check
    assert entry.first.fit is entry.study.ladder[0].fit


def test_a_report_of_finished_models_fits_no_model(tmp_path, monkeypatch):
    # Undecided alternatives were fitted in the search, and belong to the fit.
    truth = al.parse_model("N(N=0.1)+K(K=0.02)")
    columns = [truth.simulate(duration=1000.0, rate=10.0, seed=k).samples for k in (1, 2)]
    samples = np.column_stack(columns)
    log = al.Recording(samples, 10.0, unit="deg/s", columns=["gyro_x", "gyro_y"])
    found = al.characterize(log, "N+B")
    assert all(study.adequate for study in found.studies.values())
    monkeypatch.setattr(engine, "_fit", None)
    assert found.report().save(tmp_path / "report.html").exists()


class Tags(HTMLParser):
    """Every tag of a page with its attributes, and every id."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.ids = [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self.tags.append((tag, given))
        if "id" in given:
            self.ids.append(given["id"])


def texts(page):
    """Texts of a page without its figures, one per line."""
    inside = re.sub(r"<svg.*?</svg>", "", page[page.index("<main") :], flags=re.DOTALL)
    return unescape(re.sub(r"<[^>]*>", "\n", inside)).replace("\xa0", " ")


def printed(text):
    """Value of a printed number: 1.9·10⁻⁵, −0.3, 720 000."""
    plain = text.translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹−", "-0123456789-")).replace("\u202f", "")
    if "·10" in plain:
        mantissa, power = plain.split("·10", 1)
        return float(mantissa) * 10.0 ** int(power)
    if re.fullmatch(r"10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+", text):
        return 10.0 ** int(plain[2:])
    return float(plain)


def assert_numbers_are_those_of(page, document, units=None):
    """Check that curve, misfits, steps and parameters of the page are those of the JSON document."""
    columns = document.get("columns", [document])
    tables = page.split("Allan deviation in numbers")[1:]
    assert len(tables) == len(columns)
    shown = texts(page)
    for column, table in zip(columns, tables, strict=True):
        rows = re.findall(r"<tr><td.*?</tr>", table.split("</table>")[0])
        points = column["adev"]["points"]
        assert len(rows) == len(points) > 5
        for row, point in zip(rows, points, strict=True):
            cells = re.findall(r"<td[^>]*>(.*?)</td>", row)
            # Three figures at least are printed, so half a unit of the third is at most 0.5 %.
            for cell, value in zip(cells, point.values(), strict=True):
                assert (
                    cell == "–"
                    if value is None
                    else printed(cell) == pytest.approx(value, rel=5.1e-3)
                )
        for name in ("check", "fit"):
            misfit = column[name]["misfit"]
            told = f"χ²/dof = {misfit['reduced']:.2f} ({misfit['chi2']:.0f}/{misfit['dof']})"
            assert told in shown, name
        ladder = column["improve"]["ladder"]
        for step in ladder if len(ladder) > 1 else ():
            assert f"\n{number(step['error']['misfit_left_percent'])} %\n" in shown
        with requested_units(units or {}):
            for effect in column["fit"]["effects"]:
                for name, value in effect["parameters"].items():
                    if (
                        value.get("interval")
                        and value["detected"]
                        and name not in effect.get("held", ())
                    ):
                        own = al.Estimate(value["value"], None, value["interval"], value["unit"])
                        own = in_sheet_unit(own, find(effect["kind"]).parameter(name))
                        _, low, high = value_and_interval_texts(own.value, own.interval)
                        assert f"\n{low} … {high}\n" in shown, (effect["kind"], name)


@pytest.mark.long
def test_numbers_equal_those_of_the_commands(log, run):
    """The document holds those of adev, check, improve and fit; nothing is computed in two ways."""
    documents = {}
    for command in ("report", "adev", "check", "improve"):
        model = [] if command == "adev" else ["--model", "N+K"]
        code, out, _ = run(command, log, *model, "--json")
        assert code == 0
        documents[command] = json.loads(out)
    found = documents["report"]
    assert found["schema"] == "allanite/report/1"
    for command in ("adev", "check", "improve"):
        expected = documents[command]
        assert found["recording"] == expected["recording"]
        assert found["version"] == expected["version"]
        for key, value in expected.items():
            if key not in ("recording", "version") and (command, key) != ("adev", "schema"):
                assert found[command][key] == value, (command, key)
    last = found["improve"]["ladder"][-1]
    assert found["fit"]["effects"] == last["effects"]
    assert found["fit"]["model"] == last["model"] == "N+K+SIN"


def test_every_number_of_the_page_is_in_the_document(report, page):
    assert_numbers_are_those_of(page, report.to_dict())


def test_output_unit_is_that_of_the_numbers(log, run, tmp_path):
    target = tmp_path / "r.html"
    model = ["--model", "N", "--trim", ":200", "--output-unit", "deg/h"]
    code, out, _ = run("report", log, *model, "--json", "-o", target)
    assert code == 0
    document = json.loads(out)
    assert document["fit"]["effects"][0]["parameters"]["N"]["unit"] == "deg/h·s^½"
    page = target.read_text(encoding="utf-8")
    assert_numbers_are_those_of(page, document, {"angular rate": "deg/h"})


def test_page_stands_by_itself(page):
    """No script and no request: the only addresses are the names of the SVG and XML grammars."""
    seen = Tags(page)
    kinds = {tag for tag, _ in seen.tags}
    assert not kinds & {"script", "link", "iframe", "img", "object", "embed"}
    assert set(re.findall(r"https?://[^\s\"'<)]+", page)) <= {"http://www.w3.org/2000/svg"}
    assert "url(http" not in page
    assert "@import" not in page
    links = [v for _, g in seen.tags for k, v in g.items() if k in ("href", "src")]
    assert all(link.startswith("#") for link in links)
    assert len(seen.ids) == len(set(seen.ids))
    assert {link[1:] for link in links} <= set(seen.ids)
    (policy,) = [g["content"] for tag, g in seen.tags if "http-equiv" in g]
    assert "default-src 'none'" in policy
    assert "script-src 'none'" in policy
    drawings = [g for tag, g in seen.tags if tag == "svg" and "viewbox" in g]
    assert len(drawings) >= 5
    assert all(g["role"] == "img" and g["aria-label"] for g in drawings)
    for words in ("@media print", "color-scheme: light dark", "light-dark("):
        assert words in page


def test_page_says_what_a_reader_asks(page):
    for words in ("Record", "Where N+K fails", "Stepwise model building", "Unexplained misfit",
                  "How this report was computed", "allanite 0.", "sinusoid", "°/√h", "to confirm"):  # fmt: skip
        assert words in page, words
    assert "e-0" not in re.sub(r"<[^>]*>", "", page.split("</style>")[1])


def test_no_line_ends_between_a_number_and_its_unit(page):
    inside = re.sub(r"<text.*?</text>", "", page[page.index("<main") :])
    text = re.sub(r"<[^>]*>", "\n", inside)
    assert re.search(r"[0-9]\xa0%", text)
    assert re.search(r"[0-9]\xa0Hz", text)
    assert not re.search(f"[0-9] (?={UNITS})", text, re.ASCII)
    # The page has the same rule.
    core = resources.files("allanite.page").joinpath("static", "core.js").read_text("utf-8")
    assert f"String.raw`{UNITS}`" in core


def test_same_bytes_on_every_run(report, page):
    assert report.to_html() == page


def test_adequate_model_has_one_step():
    recording = al.AngleRandomWalk(N=0.01).simulate(duration=300, rate=20, seed=1, unit="m/s^2")
    page = al.make_report(recording, "N").to_html()
    assert "N describes this record; nothing is significantly missing." in page
    assert "velocity random walk" in page
    assert "No effect was added" in page
    assert "N fits the record" in page
    assert "Where N fails" not in page


def test_markdown_and_its_figures(report, tmp_path):
    target = report.save(tmp_path / "a report.md")
    text = target.read_text(encoding="utf-8")
    links = re.findall(r"!\[[^]]*\]\(([^)]*)\)", text)
    assert len(links) >= 5
    for link in links:
        assert (tmp_path / link.replace("%20", " ")).read_bytes().startswith(b"<?xml")
    points = report.to_dict()["adev"]["points"]
    rows = [line for line in text.splitlines() if re.match(r"\| [\d.]+ \| [\d\u202f]+ \| ", line)]
    assert len(rows) == len(points)
    for row, point in zip(rows, points, strict=True):
        assert float(row.split("|")[4]) == pytest.approx(point["deviation"], rel=1e-4)
    assert "`" not in text
    assert report.to_markdown().count("![") == 0
    assert "model/measured = " in report.to_markdown()


def test_interactive_embeds_plotly_once(report, run, log, tmp_path):
    pytest.importorskip("plotly")
    text = report.to_html(interactive=True)
    figures = re.findall(r'<script type="application/json" id="([^"]+)">(.*?)</script>', text)
    places = re.findall(r'data-figure="([^"]+)"', text)
    assert [name for name, _ in figures] == places
    for _, both in figures:
        light, dark = json.loads(both)
        assert light["data"]
        assert light["layout"]["paper_bgcolor"] != dark["layout"]["paper_bgcolor"]
    assert len(re.findall(r"<script[ >]", text)) == len(figures) + 2
    programs = re.findall(r"<script>(.*?)</script>", text, re.DOTALL)
    hashed = [base64.b64encode(hashlib.sha256(p.encode()).digest()).decode() for p in programs]
    sources = " ".join(f"'sha256-{digest}'" for digest in hashed)
    policy = re.search(r'http-equiv="Content-Security-Policy" content="([^"]+)"', text)[1]
    assert f"script-src {sources}" in policy
    assert not re.search(r"<(script|link|img)[^>]+(src|href)=", text)
    # A rule for the drawings of plotly too would cover them.
    assert ".allanite figure svg" not in text
    with pytest.raises(al.InputError, match=r"\.html"):
        report.save(tmp_path / "r.md", interactive=True)
    code, _, err = run("report", log, "--interactive", "-o", tmp_path / "r.md")
    assert code == 2
    assert ".html" in err


def test_several_columns_and_logs(log, tmp_path, run):
    other = tmp_path / "two.npz"
    rng = np.random.default_rng(5)
    np.savez(other, data=rng.standard_normal((1000, 2)), rate_hz=10.0, channels=["a", "b"], unit=["g", "g"])  # fmt: skip
    code, out, _ = run("report", other, "--model", "N", "--json", "-o", tmp_path / "x.html")
    assert code == 0
    document = json.loads(out)
    assert [d["recording"]["column"] for d in document["columns"]] == ["a", "b"]
    page = (tmp_path / "x.html").read_text(encoding="utf-8")
    assert_numbers_are_those_of(page, document)
    assert page.count('id="column-') == 2
    assert page.count("How this report was computed") == 1


@pytest.mark.parametrize(
    ("name", "words"),
    [("r.pdf", ".html or .md"), ("none/r.html", "does not exist"), ("r", ".html or .md")],
)
def test_targets_that_are_refused(report, log, run, tmp_path, name, words):
    with pytest.raises(al.InputError, match=words):
        report.save(tmp_path / name)
    code, out, err = run("report", log, "-o", tmp_path / name)
    assert (code, out) == (2, "")
    assert words in err
    assert err.count("\n") == 1


def test_default_name_is_the_logs(log, run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, _ = run("report", log, "--model", "N", "--trim", ":100", "--seed", 4)
    assert code == 0
    assert "gyro-report.html" in out
    assert "<td>4</td>" in (tmp_path / "gyro-report.html").read_text(encoding="utf-8")


def test_words():
    assert with_readable_numbers("c = (-1.26 ± 0.12)e-07 s") == "c = (−1.26 ± 0.12)·10⁻⁷ s"
    assert percent_text(0.00471, 2) == "0.47 %"
    assert with_readable_numbers("at 42.2–2.37e+03 s, z = -6.4, up to 1e+02 % and 3.5e-05") == (
        "at 42.2–2370 s, z = −6.4, up to 100 % and 3.5·10⁻⁵"
    )
    assert (
        with_readable_numbers("gyro-1e and m1e5 stay, 10-20 too")
        == "gyro-1e and m1e5 stay, 10-20 too"
    )
    assert (
        value_and_interval_text(9.96e-5, (9.93e-5, 1.014e-4)) == "9.96·10⁻⁵ (9.93·10⁻⁵ … 1.01·10⁻⁴)"
    )
    assert value_and_interval_text(1e-5, (0.0, 2.0)) == "10⁻⁵ (0 … 2)"
    # A correlation time at the lowest end of its search: any shorter time is as likely.
    assert value_and_interval_text(0.2, (1e-12, 0.28)) == "0.2 (0 … 0.28)"


def test_a_drawing_is_small_and_in_the_colors_of_the_page(report, page):
    drawing = inline_svg(report.entries[0].first.plot(), (10.0, 5.0), "label")
    assert "#" not in drawing
    used = set(re.findall(r'class="(k-[\w]+)"', page))
    assert {"k-measured", "k-model", "k-c1", "k-fail", "k-raw", "k-low"} <= used
    for role in used:
        assert re.search(rf"\.allanite \.{role} \{{ color: #\w+; color: light-dark\(", page), role
    # Six axes take less than 600 kB: a sixth of that each.
    assert len(page.encode()) < 100_000


def test_the_first_page_says_what_who_and_what_next(log, run, tmp_path):
    target = tmp_path / "r.html"
    told = ["--sensor", "ACME-3", "--serial", "0042", "--date", "2026-11-28"]
    code, _, err = run("report", log, "--model", "N+K", "--trim", ":200", *told, "-o", target)
    assert code == 0, err
    first = target.read_text(encoding="utf-8").split("<h3>Record</h3>")[0]
    shown = re.sub(r"<[^>]*>", " ", first.split("</style>")[-1])
    for words in ("ACME-3", "0042", "2026-11-28", "not logged", "3.33\xa0min", "Verdict and coefficients",
                  "gyro_x", "°/√h", "Next step", "allanite characterize"):  # fmt: skip
        assert words in shown, words


@pytest.mark.long
@pytest.mark.browser
@pytest.mark.parametrize("name", BROWSERS)
def test_page_in_a_browser(report, tmp_path, name):
    """The interactive figures are drawn without a request to another computer."""
    pytest.importorskip("plotly")
    target, asked = report.save(tmp_path / "r.html", interactive=True), []
    with launched(name) as browser:
        tab = browser.new_page()
        tab.on("request", lambda request: asked.append(request.url))
        tab.goto(target.as_uri())
        tab.wait_for_function("() => document.querySelectorAll('.main-svg').length >= 5")
    assert [url for url in asked if not url.startswith(("file:", "data:", "blob:"))] == []


COLUMNS = {
    "adis16405_imu1.npz": {"column": "gyro_x"},
    "adis16405_imu2.npz": {"column": "acc_y"},
    "adis16405_imu3.npz": {"column": "gyro_z"},
    "mtig_gyrox_contaminated.npz": {},
    "hfi_10hz.npz": {"column": "gyro_x"},
    "cats_thermal_a.npz": {"column": "acc_y"},
    "cats_thermal_b.npz": {"column": "gyro_y"},
    "phone_gyro_b.npz": {},
    "mpu6050_raw_7min.npz": {"column": "gyro_y"},
    "clock_cs5071a_phase.npz": {"quantity": "angle", "unit": "1"},
    "clock_gps1pps_phase.npz": {"quantity": "angle", "unit": "1"},
    "clock_tic_noisefloor_phase.npz": {"quantity": "angle", "unit": "1"},
}

#: A gyroscope and a clock, whose ladder is climbed a second time by the other command.
CLIMBED = ("phone_gyro_b.npz", "clock_tic_noisefloor_phase.npz")


@pytest.mark.long
@pytest.mark.data
@pytest.mark.parametrize("name", COLUMNS)
def test_report_on_a_real_recording(data, name, run, tmp_path):
    """The file opens by itself and has the numbers of the JSON; two thousand samples, to be quick."""
    options = dict(COLUMNS[name])
    recording = al.read(data(name), column=options.pop("column", None), **options)
    column = recording.columns[0]
    end = 2_000 / recording.rate
    shared = ["--trim", f":{end:.6g}", "--column", column]
    for key, value in options.items():
        shared += [f"--{key}", value]
    target = tmp_path / "r.html"
    code, out, err = run("report", data(name), *shared, "--json", "-o", target)
    assert code == 0, err
    document = json.loads(out)
    page = Path(target).read_text(encoding="utf-8")
    assert "<script" not in page
    assert_numbers_are_those_of(page, document)
    code, out, _ = run("adev", data(name), *shared, "--json")
    assert json.loads(out)["points"] == document["adev"]["points"]
    if name not in CLIMBED:
        return
    code, out, _ = run("improve", data(name), *shared, "--json")
    expected = json.loads(out)
    assert expected["ladder"] == document["improve"]["ladder"]
    assert expected["recording"] == document["recording"]


def test_the_figure_of_a_record_with_holes_says_what_its_points_are():
    white = al.AngleRandomWalk(N=0.01).simulate(duration=300, rate=20, seed=1, unit="m/s^2")
    assert COMPLETED not in al.make_report(white, "N").to_html()
    holes = white.samples.copy()
    holes[np.random.default_rng(1).permutation(holes.size)[:60]] = np.nan
    page = al.make_report(al.Recording(holes, rate=20, unit="m/s^2"), "N").to_html()
    assert COMPLETED in page
    assert "The fit uses all other samples" in page


def test_the_steps_of_a_path_lead_through_its_points():
    # A step of 10.5 or -20.3 must not lose its zero: later points would be somewhere else.
    x = np.array([0.0, 10.5, 30.8, 30.3, 40.3, 240.3])
    y = np.array([5.0, 4.5, 15.1, 215.6, 195.3, 195.3])
    way = path_data(x, y)
    start, _, steps = way.partition("l")
    numbers = [float(v) for v in re.findall(r"-?\d*\.?\d+", steps)]
    here = np.array([float(v) for v in start[1:].split()])
    through = [here, *(here + np.cumsum(np.reshape(numbers, (-1, 2)), axis=0))]
    np.testing.assert_allclose(through, np.column_stack([x, y]), atol=1e-9)


@pytest.mark.parametrize(
    ("start", "remark"),
    [("N+GM", "N and K of a filter file also cover GM, so they can be larger."), ("N", "")],
)
def test_the_first_page_says_why_a_filter_file_has_other_numbers(start, remark, tmp_path, capsys):
    """The report has the fitted N, the file an N that also covers the slow process."""
    from allanite.cli import main

    model = al.parse_model("N(N=0.005)+GM(T=2,q_c=0.01)" if remark else "N(N=0.005)")
    samples = model.simulate(duration=600.0, rate=50.0, seed=1, unit="deg/s").samples
    log, page, file = (tmp_path / name for name in ("imu.csv", "imu.html", "imu.yaml"))
    log.write_text("gyro_x [deg/s]\n" + "\n".join(map(repr, samples.tolist())), encoding="utf-8")
    options = ["--rate", "50", "--model", start, "--report", str(page)]
    with pytest.raises(SystemExit):
        main(["characterize", str(log), *options, "--export", "kalibr", "--output", str(file)])
    capsys.readouterr()
    text = page.read_text(encoding="utf-8")
    (density,) = re.findall(r"noise_density: (\S+)", file.read_text(encoding="utf-8"))
    larger = float(density) / np.radians(0.005)
    assert (remark in text) if remark else ("filter file also cover" not in text)
    assert (larger > 1.2) == bool(remark)
