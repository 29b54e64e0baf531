"""Figures painted to files by matplotlib."""

import subprocess
import sys

import numpy as np
import pytest

import allanite as al
from allanite.plots import Figure, plot_deviation
from allanite.plots.matplotlib_painter import render
from allanite.plots.spec import (
    Axis,
    Band,
    Bars,
    HeatMap,
    Line,
    Note,
    Panel,
    Points,
    Rule,
    Span,
)

pytest.importorskip("matplotlib")


@pytest.fixture(scope="module")
def everything():
    """A figure with each kind of mark."""
    x = np.array([1.0, 10.0, 100.0])
    logarithmic = Axis("τ (s)", 0.5, 200.0, True, ((1.0, "1"), (10.0, "10")), (2.0, 3.0))
    level = Axis("y", 0.0, 2.0, ticks=((0.0, "0"), (1.0, "1")))
    rungs = Axis("", -0.6, 1.6, ticks=((0.0, "start\nN"), (1.0, "+ K")), reverse=True)
    curve = (
        Span(2.0, 5.0, "fail", "fails"),
        Band(x, [0.5] * 3, [1.5] * 3, "model", "band"),
        Line(x, [1.0] * 3, "model", "model"),
        Points(x, [1.1, 0.9, 1.0], "measured", "measured", [1.0, 0.8, 0.9], [1.2, 1.0, 1.1]),
        Rule(1.0, "y", "guide"),
        Note(0.5, 0.9, "words ½ √ ° µ"),
    )
    heat = HeatMap(
        [0.0, 1.0, 2.0],
        [1.0, 2.0, 4.0],
        [[0.0, 1.0], [np.nan, -1.0]],
        2.0,
        "ratio",
        ((0.0, "1"),),
        np.array([[False, True], [False, False]]),
    )
    panels = (
        Panel(logarithmic, level, curve, title="curve"),
        Panel(level, rungs, (Bars([1.0, -0.5], ("1", "−0.5"), ("c1", "c2")),), column=1),
        Panel(level, Axis("f", 1.0, 4.0, True), (heat,), column=2),
    )
    return Figure("title", "first line\nsecond line", panels, widths=(2.0, 1.0, 1.0))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("suffix", "start"), [("svg", b"<?xml"), ("PNG", b"\x89PNG"), ("pdf", b"%PDF")]
)
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_every_mark_in_every_format(everything, tmp_path, suffix, start, theme):
    target = tmp_path / f"figure.{suffix}"
    everything.save(target, theme)
    assert target.read_bytes().startswith(start)
    assert [p.name for p in tmp_path.iterdir()] == [target.name]


def test_png_has_the_promised_size(everything):
    header = render(everything, "png")[16:24]
    assert (int.from_bytes(header[:4], "big"), int.from_bytes(header[4:], "big")) == (1280, 720)


def test_nothing_global_is_touched(everything):
    import matplotlib as mpl

    before = dict(mpl.rcParams)
    render(everything, "svg")
    assert dict(mpl.rcParams) == before


@pytest.mark.slow
def test_pyplot_is_not_imported():
    code = (
        "import sys, numpy as np, allanite as al\n"
        "from allanite.plots import plot_deviation\n"
        "assert 'matplotlib' not in sys.modules\n"
        "f = plot_deviation(al.Recording(np.random.default_rng(0).standard_normal(500), rate=1.0).oadev())\n"
        "f._repr_svg_()\n"
        "assert 'matplotlib.pyplot' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-W", "error", "-c", code], check=True)


def test_words_stay_inside_and_apart(everything):
    """No two tick texts of an axis overlap, and no text leaves the figure."""
    from matplotlib.figure import Figure as Canvas

    drawn = []
    original = Canvas.savefig

    def keep(self, *args, **options):
        original(self, *args, **options)
        drawn.append(self)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Canvas, "savefig", keep)
        render(everything, "png")
    (canvas,) = drawn
    for axes in canvas.axes:
        for labels in (axes.get_xticklabels(), axes.get_yticklabels()):
            boxes = [t.get_window_extent() for t in labels if t.get_text()]
            assert not any(a.overlaps(b) for i, a in enumerate(boxes) for b in boxes[i + 1 :]), axes
            for box in boxes:
                assert box.x0 >= 0
                assert box.y0 >= 0
                assert box.x1 <= 1280
                assert box.y1 <= 720


@pytest.mark.parametrize("name", ["figure.jpg", "figure", "figure.svg.gz"])
def test_an_unknown_suffix_is_refused(everything, tmp_path, name):
    with pytest.raises(al.InputError, match=r"\.svg, \.png or \.pdf"):
        everything.save(tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_a_missing_folder_is_named(everything, tmp_path):
    with pytest.raises(al.InputError, match="nowhere does not exist"):
        everything.save(tmp_path / "nowhere" / "figure.svg")


def test_a_folder_is_not_a_file(everything, tmp_path):
    (tmp_path / "folder.svg").mkdir()
    with pytest.raises(al.InputError, match="is a folder"):
        everything.save(tmp_path / "folder.svg")


def test_without_matplotlib_the_extra_is_named(everything, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(al.InputError, match=r"allanite\[plots\]"):
        everything.save(tmp_path / "figure.svg")


def test_an_old_file_stays_if_drawing_fails(everything, tmp_path):
    target = tmp_path / "figure.svg"
    target.write_text("old")
    with pytest.raises(al.InputError, match="theme"):
        everything.save(target, "blue")
    assert target.read_text() == "old"


def test_a_deviation_is_written(tmp_path):
    deviation = al.Recording(np.random.default_rng(0).standard_normal(2000), rate=10.0).oadev()
    figure = plot_deviation(deviation, tmp_path / "deviation.svg")
    assert isinstance(figure, Figure)
    assert (tmp_path / "deviation.svg").stat().st_size > 5000
    assert figure._repr_svg_().lstrip().startswith("<?xml")
