"""Fit of a model to a recording: estimates, intervals, and goodness of fit.

Input: a recording (or a summary, or several recordings) and a model. Output: a `Fit`. Add a likelihood in
`likelihood/`, a search for shapes in `shapes/`, and a further fitting method in `classical/`.
"""

from __future__ import annotations

from allanite.fit.fitting import (
    completed_again,
    fit_again,
    fit_columns,
    fit_many,
    fit_model,
    refitted,
)
from allanite.fit.measures import Error, Misfit
from allanite.fit.result import Fit

__all__ = [
    "Error",
    "Fit",
    "Misfit",
    "completed_again",
    "fit_again",
    "fit_columns",
    "fit_many",
    "fit_model",
    "refitted",
]
