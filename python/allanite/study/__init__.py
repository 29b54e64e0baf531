"""The ladder: check, add what is missing, keep only what is needed, until nothing helps."""

from allanite.study.final_replacement import exchanged
from allanite.study.ladder import Rung, Study, misfit_left
from allanite.study.search import full, improve, improve_columns, next_rung
from allanite.suggestion.constants import MAX_ADDED_EFFECTS

__all__ = [
    "MAX_ADDED_EFFECTS",
    "Rung",
    "Study",
    "exchanged",
    "full",
    "improve",
    "improve_columns",
    "misfit_left",
    "next_rung",
]
