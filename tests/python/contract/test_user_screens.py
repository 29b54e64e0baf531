"""A search of an installed package: the example of the docs, and some that are broken."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import allanite as al

PAGE = Path(__file__).parents[3] / "docs" / "own-effect.md"
CHECK = """
import json, allanite as al
truth = al.parse_model("N(N=0.1)+STEP(time=100,height=0.02)")
check = al.AngleRandomWalk().fit(truth.simulate(n=2000, rate=10.0, seed=3)).check()
print(json.dumps([[s.kind, s.effect.values.get("time"), s.significant] for s in check.suggestions]))
"""


@pytest.fixture
def installed(tmp_path):
    """The example of the docs as an installer leaves it: its entry points and its environment."""
    section = PAGE.read_text(encoding="utf-8").partition("## A search of your own")[2]
    (tmp_path / "my_package").mkdir()
    code = re.search(r"```python\n(.*?)```", section, re.DOTALL)[1]
    (tmp_path / "my_package" / "heater.py").write_text(code, encoding="utf-8")
    info = tmp_path / "mine-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: mine\nVersion: 1.0\n")
    points = info / "entry_points.txt"
    point = re.search(r"heater = \"(.*)\"", section)[1]
    points.write_text(f"[allanite.screens]\nheater = {point}\n")
    here = str(Path(al.__file__).parents[1])
    return points, {**os.environ, "PYTHONPATH": os.pathsep.join((here, str(tmp_path)))}


def run(program, environment):
    return subprocess.run(
        [sys.executable, "-c", program], env=environment, capture_output=True, text=True
    )


def test_a_search_of_another_package_is_run_and_judged(installed):
    points, environment = installed
    with_screen = run(CHECK, environment)
    assert with_screen.returncode == 0, with_screen.stderr
    points.write_text("")
    without = run(CHECK, environment)
    steps = [
        [time for kind, time, _ in json.loads(answer.stdout) if kind == "bias_step"]
        for answer in (with_screen, without)
    ]
    assert 100.0 in steps[0]
    assert 100.0 not in steps[1]


@pytest.mark.parametrize(
    ("point", "told"),
    [
        ("mine = my_package.heater:look", "is not an allanite.suggestion.screens.Screen"),
        ("mine = my_package.missing:SCREEN", "No module"),
        ("mine = allanite.suggestion.screens.lines:SCREEN", "belongs to another screen"),
    ],
)
def test_a_search_that_is_broken_is_left_out_aloud(installed, point, told):
    points, environment = installed
    points.write_text(f"[allanite.screens]\n{point}\n")
    answer = run(
        "from allanite.suggestion.suggest import SCREENS; print(len(SCREENS))", environment
    )
    assert answer.returncode == 0
    assert f"the screen {point}" in answer.stderr
    assert told in answer.stderr


FAILING = """
from allanite.suggestion.screens import Screen


def fails(context):
    raise RuntimeError("no heater")


LOOK = Screen("mine", "nothing", "time", fails)
SEARCHES = Screen("mine", "nothing", "time", lambda context: [], searches=fails)
"""


@pytest.mark.parametrize("screen", ["LOOK", "SEARCHES"])
def test_a_search_that_fails_does_not_end_the_check(installed, screen):
    points, environment = installed
    (points.parents[1] / "my_package" / "failing.py").write_text(FAILING, encoding="utf-8")
    points.write_text(f"[allanite.screens]\nmine = my_package.failing:{screen}\n")
    failing = run(CHECK, environment)
    assert failing.returncode == 0, failing.stderr
    assert "screen 'mine'" in failing.stderr
    assert "no heater" in failing.stderr
    points.write_text("")
    assert failing.stdout == run(CHECK, environment).stdout


def test_the_order_in_which_searches_are_installed_does_not_matter(installed):
    points, environment = installed
    (points.parents[1] / "my_package" / "later.py").write_text(
        "from allanite.suggestion.screens import Screen\n"
        'SCREEN = Screen("later", "", "time", lambda context: [], after=("heater",))\n',
        encoding="utf-8",
    )
    found = []
    lines = ["heater = my_package.heater:SCREEN", "later = my_package.later:SCREEN"]
    for order in (lines, lines[::-1]):
        points.write_text("\n".join(["[allanite.screens]", *order]))
        answer = run(
            "from allanite.suggestion.suggest import SCREENS; print(*sorted(SCREENS))", environment
        )
        assert answer.stderr == ""
        found.append(answer.stdout.split())
    assert found[0] == found[1]
    assert {"heater", "later"} <= set(found[0])
