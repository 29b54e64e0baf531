"""Figures that commands write: paper, slides, and the stability of a clock with two deviations."""

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest

pytest.importorskip("matplotlib")


def drawn(path):
    """Width in mm, element names, and words of an SVG file."""
    text = path.read_text(encoding="utf-8")
    root = ET.fromstring(text)
    width = float(root.get("width").removesuffix("pt")) * 25.4 / 72
    names = {element.tag.rpartition("}")[2] for element in root.iter()}
    # Letters are paths; a comment before each has its words.
    return width, names, re.findall(r"<!-- (.*?) -->", text)


def test_paper_is_a_column_of_vectors_without_title_and_file_name(run, log, tmp_path):
    target = tmp_path / "paper.svg"
    code, _, err = run("fit", log, "--model", "N", "--plot", target, "--style", "paper", "--quiet")
    assert (code, err) == (0, "")
    width, names, words = drawn(target)
    assert width == pytest.approx(88.0, abs=0.1)
    assert "image" not in names
    assert not any("gyro.csv" in text or str(tmp_path) in text for text in words)
    assert any(text.startswith("averaging time τ (s)") for text in words)
    slides = tmp_path / "slides.svg"
    assert run("fit", log, "--model", "N", "--plot", slides, "--style", "slides", "--quiet")[0] == 0
    width, names, title = drawn(slides)
    assert width > 200
    # The title, which the paper leaves to its caption, names the log and never its folder.
    assert any("gyro" in text for text in set(title) - set(words))
    assert not any(str(tmp_path) in text for text in title)


def test_both_kinds_of_a_clock_are_drawn_with_guides_and_a_table(run, tmp_path):
    rng = np.random.default_rng(3)
    phase = np.cumsum(rng.normal(0, 1e-11, 3000)) + rng.normal(0, 1e-9, 3000)
    clock, target = tmp_path / "clock.csv", tmp_path / "clock.svg"
    np.savetxt(clock, phase, header="phase (s)", comments="")
    kinds = ["--kind", "oadev", "--kind", "mdev", "--confidence", "0.683"]
    code, out, _ = run("adev", clock, "--rate", 1, *kinds, "--plot", target, "--style", "paper")
    assert code == 0
    assert "oadev, 68.3 % interval" in out
    assert "mdev, 68.3 % interval" in out
    # The y of σ_y is set as a subscript.
    words = [text.replace("$\\sigma_y$", "σ_y") for text in drawn(target)[2]]
    assert "σ_y(τ)" in words
    assert {"σ_y(τ) OADEV ± 68.3 %", "Mod σ_y(τ) MDEV ± 68.3 %"} <= set(words)
    assert {"τ⁻¹", "τ⁻¹ᐟ²"} <= set(words)
    head = next(text for text in words if text.startswith("τ (s)"))
    assert head.split()[:3] == ["τ", "(s)", "oadev"]
    # The first row of the drawn table is that of the printed one, rounded.
    printed = next(line for line in out.splitlines() if line.split()[:1] == ["1"]).split()[1]
    row = next(text for text in words if text.split()[:1] == ["1"] and len(text.split()) == 4)
    plain = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")
    values = [
        float(text.replace("·10", "e").translate(plain)) for text in (row.split()[1], printed)
    ]
    assert values[0] == pytest.approx(values[1], rel=5e-3)
