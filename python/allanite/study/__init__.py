"""Stepwise model building: check, add the best missing effect, drop or replace what it makes needless, and repeat.

Input: a recording and a first model (`improve`). Output: a `Study` with steps from the first model to the last. Add a
move of the search in `moves/`, and call it in `steps.py`.
"""

from allanite.study.improvement import improve, improve_columns
from allanite.study.ladder import Rung, SearchInterrupted, Study, misfit_left
from allanite.study.search import has_reached_limit
from allanite.study.steps import best_replacement, next_step
from allanite.suggestion.constants import MAX_ADDED_EFFECTS

__all__ = [
    "MAX_ADDED_EFFECTS",
    "Rung",
    "SearchInterrupted",
    "Study",
    "best_replacement",
    "has_reached_limit",
    "improve",
    "improve_columns",
    "misfit_left",
    "next_step",
]
