"""A name that would be code, a control or a formula somewhere is a name everywhere."""

import json
import re
import xml.etree.ElementTree as ET
from html.parser import HTMLParser

import numpy as np
import pytest

import allanite as al

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
    """Tags and texts of a page, as a browser's parser splits them."""

    def __init__(self):
        super().__init__()
        self.tags, self.texts = [], []

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))

    def handle_data(self, data):
        self.texts.append(data)


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
