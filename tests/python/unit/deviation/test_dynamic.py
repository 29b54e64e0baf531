"""The dynamic deviation shows itself, and says what is missing."""

import numpy as np
import pytest

import allanite as al

RNG = np.random.default_rng(5)


@pytest.fixture(scope="module")
def dynamic():
    x = RNG.standard_normal(20_000)
    x[8_000:12_000] = np.nan
    return al.dynamic_oadev(al.Recording(x, rate=10.0, unit="deg/s"), window=100.0)


def test_table(dynamic):
    lines = str(dynamic).splitlines()
    assert lines[0] == "overlapping Allan deviation (°/s) of windows of 100 s"
    assert lines[1].split("τ = ")[1].strip() == "0.1 s"
    assert len(lines[2].split()) == 7
    assert (
        f"24 of {dynamic.time.size} windows and 6 of {dynamic.tau.size} averaging times"
        in lines[-1]
    )
    assert "nan" not in str(dynamic)
    assert float(lines[2].split()[1]) == pytest.approx(dynamic.deviation[0, 0], rel=5e-3)
    html = dynamic._repr_html_()
    assert "<table>" in html
    assert "°/s" in html
    assert "4000 of 20000 samples are missing" in html


def test_missing_samples_are_said(dynamic):
    said = " ".join(dynamic.diagnostics)
    assert "4000 of 20000 samples are missing" in said
    assert "differences that touch them are not used" in said
    empty = int(np.isnan(dynamic.deviation).all(axis=1).sum())
    assert empty > 0
    assert f"{empty} of {dynamic.time.size} windows have too few samples" in said
    assert al.dynamic_oadev(RNG.standard_normal(500), window=100.0).diagnostics == ()
    phase = np.cumsum(RNG.standard_normal(500))
    assert al.dynamic_oadev(phase, window=100.0, quantity="angle").diagnostics == ()


def test_figure(dynamic, tmp_path):
    pytest.importorskip("matplotlib")
    figure = dynamic.plot(tmp_path / "figure.svg")
    assert (tmp_path / "figure.svg").read_text().startswith("<?xml")
    assert figure.panels[0].y.label == "overlapping Allan deviation (°/h)"
    assert figure.panels[0].x.label == "time (min)"
    assert len(figure.legend()) == 6
    assert figure.to_plotly()["data"]
    one = al.dynamic_oadev(RNG.standard_normal(100), window=100.0, factors=[1])
    assert one.plot().panels[0].marks
    assert str(one).count("\n") == 2


@pytest.mark.parametrize(
    "options",
    [{"window": v} for v in ("a", 0, -1, np.nan, np.inf, None)]
    + [{"window": 10.0, "step": v} for v in ("a", 0, -1, np.nan, np.inf)],
)
def test_windows_and_steps_that_cannot_be(options):
    name = "step" if "step" in options else "window"
    with pytest.raises(al.InputError, match=f"{name} = "):
        al.dynamic_oadev(np.arange(100.0), **options)


def test_a_step_longer_than_the_record():
    assert al.dynamic_oadev(RNG.standard_normal(100), window=10.0, step=1e100).time.size == 1
