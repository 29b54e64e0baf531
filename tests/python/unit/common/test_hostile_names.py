"""A name that would be code, a control or a formula somewhere is a name everywhere."""

import ast
import json
import re
import xml.etree.ElementTree as ET
from html.parser import HTMLParser

import numpy as np
import pytest

import allanite as al
from allanite.effects.files import model_to_dict
from allanite.exports import axes_of
from page_browser import launched

NAMES = {
    "code": "gx\nsystem('rm -rf /'); %",
    "html": "</script><img src=x onerror=alert(1)>\"'&amp;",
    "formula": r"$\frac{$ $x_$ \$",
    "markdown": "![x](javascript:1) | `a` <b> __c__ # d ~~e~~",
    "terminal": "\x1b[2J\x1b]0;gone\x07\x9b31m\r\u202e\u2028",
    "path": "../../etc/passwd",
    "hidden": "_gx",
    "long": "x" * 5000,
    "surrogate": "g\udcffx",
    "script": "漢字\U0001f600",
    "blank": " ",
}
MODEL = "N+B"


def named(name):
    samples = np.random.default_rng(3).standard_normal(600)
    return al.Recording(samples, rate=10, unit="deg/s", columns=[name])


class Page(HTMLParser):
    """Tags and texts of a page, as a browser's parser separates them."""

    def __init__(self):
        super().__init__()
        self.tags, self.texts = [], []

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))

    def handle_data(self, data):
        self.texts.append(data)


@pytest.mark.long
@pytest.mark.parametrize("name", ["code", "html", "markdown", "path", "surrogate"])
def test_reports(name, tmp_path):
    recording = named(NAMES[name])
    name = recording.columns[0]
    assert name.isprintable()
    report = al.make_report(recording, MODEL)
    page = Page()
    page.feed(report.to_html())
    assert name.strip() in "\n".join(page.texts)
    assert not {"img", "script", "iframe"} & {tag for tag, _ in page.tags if tag != "svg"}
    assert not any(key.startswith("on") for _, attributes in page.tags for key in attributes)
    interactive = report.to_html(True)
    page = Page()
    page.feed(interactive)
    assert "img" not in {tag for tag, _ in page.tags}
    for line in report.to_markdown().splitlines():
        assert line.isprintable()
        bare = re.sub(r"\\.", "", line)
        assert "](javascript" not in bare
        assert "<" not in bare.removeprefix("> ")
    path = report.save(tmp_path / "r.md")
    inside = [p for p in tmp_path.rglob("*") if p.is_file()]
    assert path in inside
    assert len(inside) > 1
    for file in inside:
        assert file.resolve().is_relative_to(tmp_path.resolve())
        if file.suffix == ".svg":
            ET.fromstring(file.read_text(encoding="utf-8"))
    json.loads(json.dumps(report.to_dict(), ensure_ascii=False).encode("utf-8"))


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_figures(name, tmp_path):
    recording = named(NAMES[name])
    check = al.fit_model(recording, MODEL).check()
    for thing in (recording, recording.oadev(), check):
        thing.plot(tmp_path / "x.svg")
        ET.fromstring((tmp_path / "x.svg").read_text(encoding="utf-8"))
        drawn = json.dumps(thing.plot().to_plotly("light"))
        assert "<img" not in drawn
        assert "</script" not in drawn
    for thing in (recording, recording.oadev(), check):
        str(thing).encode("utf-8")
        assert "\x1b" not in str(thing)


def exported(name, target):
    documents = []
    for unit in ("deg/s", "mg"):
        document = model_to_dict(al.parse_model("N(N=0.01)+B(B=1e-3)"))
        document["recording"] = {"unit": unit, "rate_hz": 100.0, "column": name, "path": name}
        documents.append(document)
    return al.export(axes_of(documents), target)


def matlab(text):
    """Code of a MATLAB script without comments; raises an error for a character that begins no token."""
    token = re.compile(
        r"(%[^\n]*|\.\.\.[^\n]*)|('(?:[^'\n]|'')*'|[\d.]+(?:e[-+]?\d+)?|\w+|[=(),;.\n\[\]])|[ \t]+"
    )
    found, at = [], 0
    while at < len(text):
        match = token.match(text, at)
        assert match, text[at : at + 50]
        # Lines of comments alone leave nothing.
        if match[2] and not (match[2] == "\n" and found[-1:] in ([], ["\n"])):
            found.append(match[2])
        at = match.end()
    return found


def yaml(text):
    return pytest.importorskip("ruamel.yaml").YAML(typ="safe", pure=True).load(text)


PARSERS = {
    **dict.fromkeys(
        [
            "kalibr",
            "ros",
            "vins",
            "orbslam3",
            "liosam",
            "fastlio",
            "kfgins",
            "cuvslam",
            "dmvio",
            "fastlivo2",
            "pointlio",
        ],
        yaml,
    ),
    "matlab": matlab,
    "gtsam": lambda text: ast.dump(ast.parse(text)),
    **dict.fromkeys(["gnss-ins-sim", "carla", "isaaclab"], lambda text: ast.dump(ast.parse(text))),
    "psins": matlab,
}


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("target", PARSERS)
def test_exports_by_the_parser_of_their_target(name, target):
    parse = PARSERS[target]
    assert parse(exported(NAMES[name], target)) == parse(exported("gx", target))


@pytest.mark.long
@pytest.mark.browser
def test_reports_in_a_browser(tmp_path):
    """The browser requests and opens nothing, and the name is readable."""
    happened = []
    with launched("chromium") as browser:
        tab = browser.new_page()
        tab.on("dialog", lambda dialog: (happened.append(dialog.message), dialog.dismiss()))
        tab.on("request", lambda request: happened.append(request.url))
        tab.on("pageerror", lambda error: happened.append(str(error)))
        for name in ("html", "markdown", "code", "formula", "terminal", "surrogate"):
            recording = named(NAMES[name])
            report = al.make_report(recording, MODEL)
            for interactive in (False, True):
                path = tmp_path / f"{name}-{interactive}.html"
                path.write_text(report.to_html(interactive), encoding="utf-8")
                tab.goto(path.as_uri())
                assert recording.columns[0].strip() in tab.inner_text("body")
                assert happened.pop(0) == path.as_uri()
                assert not happened
