"""Confusion matrix of the catalog: the effect of a record, and the effect that the check names first.

The records are those of benches/decisions, where the true model gains a log-likelihood of more than 30. Here each
effect has one record, or three with ALLANITE_FULL=1; the benchmark uses many seeds. test_usual_effects.py has weaker
effects, ten records of each, and also tests their intervals.
"""

import runpy
from pathlib import Path

import pytest

import allanite as al
from counts import records

RECORDS = runpy.run_path(
    str(Path(__file__).parents[3] / "benches" / "decisions" / "records.py"), run_name="records"
)
HIDDEN = RECORDS["HIDDEN"]
#: Hidden effect → the effect that the check names first in its place. All other effects are named themselves.
NAMED_FIRST = {
    # A ramp beside white noise alone is first the usual slow noise; a replacement at the end of the search names it.
    "rate_ramp": "rate_random_walk",
    # A usual coefficient leads a power law that gains less than 6 nats more.
    "power_law": "bias_instability",
    # A band before its modulation or its drift is found.
    "modulated_vibration": "resonance",
    "drifting_resonance": "resonance",
    # The filter of this record is not in the catalog.
    "unexplained": "resonance",
}


def test_every_effect_has_a_record():
    """Flicker PM is never searched, since clocks start with it."""
    assert set(HIDDEN) == {effect.kind for effect in al.CATALOG} - {"flicker_phase"}
    assert set(NAMED_FIRST) < set(HIDDEN)


@pytest.mark.statistical
@pytest.mark.parametrize("kind", HIDDEN)
def test_the_check_names_one_effect_first(kind):
    """At most one of three records has another first suggestion; the benchmark measures the share."""
    expected, named = NAMED_FIRST.get(kind, kind), []
    for seed in range(records(1, 3)):
        check = al.fit_model(RECORDS["record"](kind, seed), HIDDEN[kind].start).check()
        assert check.suggestions, kind
        named.append(check.suggestions[0].kind if check.suggestions[0].significant else None)
    assert named.count(expected) >= records(1, 2), named
