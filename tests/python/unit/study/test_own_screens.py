"""A screen of its own is one module that declares `SCREEN`: its candidates are judged like those of other screens."""

import sys

import allanite as al
from allanite.effects import BiasStep
from allanite.suggestion.screens import Candidate, Family, Screen

#: The module; the package has a function of the same name.
suggest = sys.modules["allanite.suggestion.suggest"]
LOG = al.AngleRandomWalk(N=0.1).simulate(n=2000, rate=10.0, seed=3)


def step_in_the_middle(context):
    """A step that the data do not show, with a small p-value."""
    effect = BiasStep(time=100.0, hold=("time",))
    solution = al.fit_model(LOG, context.solution.model + effect).solution
    family = Family("trial")
    return (Candidate(solution.model.effects[-1], 40.0, family, solution, 1, log_p_value=-50.0),)


def test_a_screen_of_its_own_is_run_and_counts_as_one_search(monkeypatch):
    fit = al.fit_model(LOG, "N")
    before = {s.kind: s for s in fit.check().suggestions}
    assert "bias_step" not in before or not before["bias_step"].significant
    own = Screen("trial", "a step in the middle", "time", step_in_the_middle)
    monkeypatch.setattr(suggest, "SCREENS", {**suggest.SCREENS, "trial": own})
    found = next(s for s in fit.check().significant if s.kind == "bias_step")
    assert found.effect.time == 100.0
    # The probability of chance is that of the screen, multiplied by the number of searches.
    assert -50.0 < found.log10_p * 2.302585 < -45.0
