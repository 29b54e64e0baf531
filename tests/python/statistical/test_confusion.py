"""Confusion matrix of the catalog: one record of each effect, and the effect that the check names first.

The records are those of benches/decisions, where the true model gains a log-likelihood of more than 30. The benchmark
searches them with many seeds; here the first suggestion for one record of each effect is tested.
"""

import runpy
from pathlib import Path

import pytest

import allanite as al

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
    assert set(HIDDEN) == {effect.kind for effect in al.CATALOGUE} - {"flicker_phase"}
    assert set(NAMED_FIRST) < set(HIDDEN)


@pytest.mark.slow
@pytest.mark.parametrize("kind", HIDDEN)
def test_the_check_names_one_effect_first(kind):
    check = al.fit_model(RECORDS["record"](kind, 0), HIDDEN[kind].start).check()
    assert check.suggestions, kind
    assert check.suggestions[0].kind == NAMED_FIRST.get(kind, kind)
