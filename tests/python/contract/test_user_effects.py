"""An effect of one's own, declared in one file, is everywhere where ours are."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import allanite as al
from allanite import testing
from allanite.cli import cli
from allanite.effects import Parameter, Stochastic, find
from allanite.page.shown.cards import cards, chips
from toy_effects.ageing import Ageing
from toy_effects.double_lag import DoubleLag
from toy_effects.mains_hum import MainsHum

TOYS = {
    # The effect as it hides beside N, the rate in Hz; 20 000 samples in all.
    "double_lag": (DoubleLag(correlation_time=20.0, size=0.02), 20.0),
    "ageing": (Ageing(onset=10.0, amplitude=0.01), 20.0),
    # The third harmonic is to rise by (0.02/0.002)²/2 = 50 nats: its two numbers cost ln n = 10, and 3 more are
    # wanted of what has a rival.
    "mains_hum": (
        MainsHum(frequency=50.02, amplitude=0.02, phase=1.0, third=0.02, third_phase=0.0),
        400.0,
    ),
}
WHITE = al.AngleRandomWalk(N=0.01)
SAMPLES = 20_000


@pytest.fixture(scope="module", params=TOYS)
def toy(request):
    """Effect, recording that has it, and the check of N alone."""
    effect, rate = TOYS[request.param]
    al.register(type(effect))
    try:
        recording = (WHITE + effect).simulate(n=SAMPLES, rate=rate, seed=4, unit="rad/s")
        yield effect, recording, al.AngleRandomWalk().fit(recording).check()
    finally:
        al.CATALOG.remove(type(effect))


@pytest.fixture
def better(toy):
    effect, _, check = toy
    return check.fit.add(next(s for s in check.suggestions if s.kind == effect.kind))


def test_suggested(toy):
    effect, _, check = toy
    found = {s.kind: s for s in check.significant}
    assert effect.kind in found, check
    suggestion = found[effect.kind]
    for name in effect.free_shapes:
        low, high = suggestion.estimates[name].interval
        # One interval of 95 %, twice as wide as it is: two in 10 000 records miss it.
        middle, half = (low + high) / 2.0, high - low
        assert middle - half < effect.values[name] < middle + half
    assert suggestion.check_by == effect.check_by
    assert effect.physics in suggestion.explanation
    assert set(effect.rivals) & {s.kind for s in check.suggestions}


def test_planned_as_it_is_found(toy):
    effect, recording, check = toy
    found = al.detection_power(WHITE, effect, duration=recording.duration, rate=recording.rate)
    assert found.probability > 0.99
    seen = next(s for s in check.suggestions if s.kind == effect.kind)
    # Rises of logL scatter from record to record; five of their standard deviations.
    assert abs(seen.delta_log_likelihood - found.delta_log_likelihood) < 5.0 * found.spread
    assert np.isfinite(list(found.standard_errors.values())).all()
    asked = al.plan(WHITE, find=effect, rate=recording.rate)
    assert asked.duration < recording.duration


@pytest.mark.long
def test_drawn(toy, better, tmp_path):
    effect, _, check = toy
    better.plot(tmp_path / "fit.svg")
    check.plot(tmp_path / "check.svg")
    drawn = (tmp_path / "fit.svg").read_text(encoding="utf-8")
    assert effect.title in drawn
    from allanite.plots.curves import component_styles

    label = component_styles(better)[-1].label
    for name in effect.legend or effect.free_shapes:
        assert f"{effect.parameter(name).symbol or name} " in label


def test_exported(toy, better, tmp_path):
    effect, _, _ = toy
    path = tmp_path / "fit.json"
    better.save(path)
    for target in ("json", "ros"):  # which have no room for it, and say so
        answer = CliRunner().invoke(cli, ["export", str(path), "--format", target])
        assert answer.exit_code == 0, answer.output
        assert effect.kind in answer.output


def test_saved_and_read_back(toy, better, tmp_path):
    effect, _, _ = toy
    path = tmp_path / "fit.json"
    better.save(path)
    back = al.parse_model(str(path))
    assert [e.kind for e in back] == ["angle_random_walk", effect.kind]
    assert back.effects[1].values == better.model.effects[1].values
    assert al.parse_model(f"N+{effect.short}").effects[1] == type(effect)()
    assert al.parse_model(f"N+{effect.kind}").effects[1] == type(effect)()
    answer = CliRunner().invoke(
        cli,
        ["simulate", str(path), "-n", "500", "--rate", "400", "-o", str(tmp_path / "x.npy")],
    )
    assert answer.exit_code == 0, answer.output


@pytest.mark.long
def test_in_the_ladder_and_its_report(toy):
    effect, recording, _ = toy
    report = al.make_report(recording, al.AngleRandomWalk())
    study = report.entries[0].study
    assert study.adequate, study
    if effect.kind == "mains_hum":  # the others have rivals that no record of this length excludes
        assert study.ladder[1].added.kind == effect.kind
        assert effect.title in report.to_html()


def test_on_the_page(toy, better):
    effect, _, check = toy
    chip = chips(better)[1]
    assert (chip["kind"], chip["name"]) == (effect.kind, effect.title)
    assert chip["color"]
    assert {v["name"] for v in chip["values"]} >= set(effect.shown())
    card = next(c for c in cards(check) if c["kind"] == effect.kind)
    assert card["name"] == effect.title
    assert card["acts"]["tau"]


def test_proved_by_the_contract():
    for effect in (
        DoubleLag(correlation_time=2.0, size=0.5),
        Ageing(onset=3.0, amplitude=0.2),
    ):
        al.register(type(effect))
        try:
            testing.check_effect(effect)
        finally:
            al.CATALOG.remove(type(effect))


def test_a_forgotten_declaration_is_named():
    class Nameless(Stochastic):
        kind = "nameless"
        short = "NL"

    with pytest.raises(al.InputError, match="Nameless: declare title"):
        al.register(Nameless)

    class Thief(DoubleLag):
        kind = "gauss_markov"

    with pytest.raises(al.InputError, match="'gauss_markov' is already used by GaussMarkov"):
        al.register(Thief)

    class Elsewhere(DoubleLag):
        screened = "by hand"

    with pytest.raises(al.InputError, match="screened = 'by hand'"):
        al.register(Elsewhere)
    with pytest.raises(al.InputError, match="not a class"):
        al.register(DoubleLag())
    assert find("DL") is None


def test_a_cell_that_is_run_again_takes_the_place_of_the_first():
    def made():
        class Mine(DoubleLag):
            parameters = (*DoubleLag.parameters[:1], Parameter("size", 0.0, "of both"))

        return Mine

    first, second = made(), made()
    before = len(al.CATALOG)
    al.register(first)
    try:
        al.register(second)
        assert find("DL") is second
        assert len(al.CATALOG) == before + 1
        al.register(al.GaussMarkov)  # which changes nothing
        assert len(al.CATALOG) == before + 1
    finally:
        al.CATALOG.remove(second)


def test_the_page_of_the_manual_runs(capsys):
    page = (Path(__file__).parents[3] / "docs" / "own-effect.md").read_text(encoding="utf-8")
    names = {"__name__": "manual"}
    # The toy of that name may be registered for other tests of this process.
    there = Ageing in set(al.CATALOG)
    al.CATALOG.remove(Ageing)
    try:
        exec(re.search(r"```python\n(.*?)```", page, re.DOTALL)[1], names)
    finally:
        al.CATALOG.remove(names.get("Aging"))
        if there:
            al.register(Ageing)
    assert "AGE(" in capsys.readouterr().out


PACKAGE = Path(__file__).parents[1] / "toy_effects"


@pytest.fixture
def installed(tmp_path):
    """A package with an effect, as an installer leaves it, and a package that cannot be imported."""
    (tmp_path / "drifts.py").write_text((PACKAGE / "ageing.py").read_text(encoding="utf-8"))
    info = tmp_path / "drifts-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: drifts\nVersion: 1.0\n")
    points = info / "entry_points.txt"
    points.write_text("[allanite.effects]\nageing = drifts:Ageing\n")
    here = str(Path(al.__file__).parents[1])
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join((here, str(tmp_path)))}
    return points, environment


def run(program, environment):
    return subprocess.run(
        [sys.executable, "-c", program], env=environment, capture_output=True, text=True
    )


def test_an_effect_of_another_package(installed):
    _, environment = installed
    program = """
import json, allanite as al
model = al.parse_model("N(N=0.01)+AGE(onset=10,amplitude=0.01)")
recording = model.simulate(n=20000, rate=20.0, seed=4)
check = al.AngleRandomWalk().fit(recording).check()
print(json.dumps([model.effects[1].kind, [s.kind for s in check.significant]]))
"""
    answer = run(program, environment)
    assert answer.returncode == 0, answer.stderr
    kind, significant = json.loads(answer.stdout)
    assert kind == "ageing"
    assert "ageing" in significant


def test_a_package_that_is_broken_is_left_out_aloud(installed):
    points, environment = installed
    points.write_text("[allanite.effects]\nageing = drifts:Missing\n")
    answer = run("import allanite as al; print(len(al.CATALOG))", environment)
    assert answer.returncode == 0
    ours = [e for e in al.CATALOG if e.__module__.startswith("allanite.")]
    assert int(answer.stdout) == len(ours)
    assert "ageing = drifts:Missing of drifts was not loaded" in answer.stderr
