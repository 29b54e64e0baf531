"""How results show themselves: a line in a console, a table in a notebook, a figure when asked."""

import re
from dataclasses import dataclass
from html.parser import HTMLParser

import numpy as np
import pytest

import allanite as al
from allanite.common.showing import array_text, brief, html_table

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def results():
    """One of each kind of result; a line is missing from the first model."""
    truth = al.parse_model("N(N=0.1)+SIN(frequency=1.3,amplitude=0.1)")
    samples = truth.simulate(duration=400, rate=10, seed=2).samples.copy()
    samples[100:110] = np.nan
    recording = al.Recording(samples, rate=10, unit="deg/s", columns=["<gyro>"])
    study = al.improve(recording, "N")
    fit = study.ladder[0].fit
    return {
        "recording": recording,
        "deviation": recording.oadev(),
        "spectrum": recording.psd(),
        "fit": fit,
        "check": fit.check(),
        "study": study,
    }


class Tree(HTMLParser):
    """Parser that fails unless every tag is closed."""

    def __init__(self, text):
        super().__init__()
        self.stack, self.words = [], []
        self.feed(text)
        assert not self.stack, self.stack

    def handle_starttag(self, tag, attrs):
        self.stack.append(tag)

    def handle_endtag(self, tag):
        assert self.stack.pop() == tag

    def handle_data(self, data):
        self.words.append(data)


def within(value, seen=None):
    """A result and everything that its repr could show."""
    yield value
    for name in getattr(value, "__dataclass_fields__", {}):
        inner = getattr(value, name)
        for part in inner if isinstance(inner, tuple) else (inner,):
            if hasattr(part, "__dataclass_fields__"):
                yield from within(part)


def test_a_repr_is_a_line(results):
    for result in results.values():
        for part in within(result):
            text = repr(part)
            assert len(text) < 500, (type(part), text[:200])
            assert "\n" not in text
            assert "array(" not in text


def test_reprs_say_what_it_is(results):
    assert repr(results["fit"]).startswith("Fit(<gyro>, whittle: N(N=0.1")
    assert repr(results["check"]).startswith("Check(<gyro>, N: missing: sinusoid")
    assert repr(results["study"]) == "Study(<gyro>: N → N+SIN, adequate)"
    assert repr(results["study"].ladder[1]) == "Rung(+ sinusoid: N+SIN)"
    line = re.match(r"Suggestion\(SIN\(frequency=([\d.]+), ", repr(results["check"].suggestions[0]))
    assert line is not None
    assert float(line[1]) == pytest.approx(1.3, abs=0.5 / 400)  # half of 1/T


@pytest.mark.parametrize("name", ["recording", "deviation", "fit", "check", "study"])
def test_notebook_shows_a_table(results, name):
    text = results[name]._repr_html_()
    words = " ".join(Tree(text).words)
    assert "<table>" in text
    # Names from files are text, not tags.
    assert "<gyro>" not in text
    expected = {
        "recording": ("deg/s", "10"),
        "deviation": ("τ (s)",),
        "fit": ("angle random walk", "95 % interval", "χ²/dof"),
        "check": ("sinusoid", "ΔlogL", "to confirm"),
        "study": ("+ sinusoid", "prediction", "stopped: adequate"),
    }[name]
    for part in expected:
        assert part in words


def test_recording_shows_its_moments_and_holes(results):
    recording = results["recording"]
    words = Tree(recording._repr_html_()).words
    assert "10" in words
    assert f"{np.nanstd(recording.samples):.4g}" in words


@pytest.mark.parametrize("name", ["recording", "deviation", "fit", "check", "study"])
def test_plot_gives_a_figure_of_matplotlib(results, name, tmp_path):
    pytest.importorskip("matplotlib")
    from matplotlib.figure import Figure

    figure = results[name].plot(tmp_path / "figure.svg")
    assert (tmp_path / "figure.svg").stat().st_size > 1000
    assert figure._repr_svg_().startswith("<?xml")
    drawn = figure.to_matplotlib(size=(6.0, 4.0))
    assert isinstance(drawn, Figure)
    assert tuple(drawn.get_size_inches()) == (6.0, 4.0)
    assert drawn.axes
    assert len(repr(figure)) < 200


def test_samples_of_a_figure_are_those_of_the_recording():
    """Minimum and maximum of each segment: a spike is kept, and a gap remains a gap."""
    from allanite.plots import plot_recording
    from allanite.plots.spec import Band, Line

    x = np.random.default_rng(0).standard_normal((100_000, 2))
    x[54_321, 0] = 40.0
    x[20_000:30_000, 0] = np.nan
    figure = plot_recording(al.Recording(x, rate=100, unit="g", columns=["a", "b"]))
    band, other = (panel.find(Band)[0] for panel in figure.panels)
    assert band.x.size == 600
    assert np.nanmax(band.high) == pytest.approx(40_000.0)  # mg
    assert band.x[np.nanargmax(band.high)] == pytest.approx(543.21 / 60, rel=2e-3)
    assert np.isnan(band.high).sum() == pytest.approx(60, abs=1)
    assert other.low.min() == pytest.approx(1000.0 * x[:, 1].min())
    short = plot_recording(al.Recording(np.arange(5), rate=1))
    np.testing.assert_array_equal(short.panels[0].find(Line)[0].y, np.arange(5.0))


def test_brief():
    @dataclass(repr=False)
    class Thing:
        a: object
        b: object = 1.5

        __repr__ = brief

    assert repr(Thing(np.arange(12.0))) == "Thing(a=<12 from 0 to 11>, b=1.5)"
    assert repr(Thing([], "x" * 90)) == "Thing(a=[], b=<90 × str>)"
    assert repr(Thing([], "bias instability")) == "Thing(a=[], b='bias instability')"
    assert repr(Thing(list(range(9)), {"t": np.zeros(3)})) == "Thing(a=<9 × int>, b=<1: t>)"
    assert repr(Thing({}, (1, 2))) == "Thing(a=<none>, b=(1, 2))"
    assert array_text(np.array([True, False])) == "<2 flags, 1 set>"
    assert array_text(np.full((2, 3), np.nan)) == "<2×3>"
    assert array_text(np.array([np.nan, 2.0])) == "<2 from 2 to 2>"


def test_tables_escape():
    text = html_table("<b>", ("x & y",), [("<script>",)], (0,))
    assert "<script>" not in text
    assert "&lt;script&gt;" in text
    assert "right" in text
