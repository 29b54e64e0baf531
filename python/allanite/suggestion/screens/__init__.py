"""Searches for missing effects in the residual of a fit, one module for each.

Input: a `Context`, i.e. a fit and its residual. Output: `Candidate`, whose model is fitted with `solve`. Add a search as
a module here that declares its `Screen` as `SCREEN`; `suggest.py` runs all screens.

Four modules are parts of a screen that have a method of their own: `several_excursions` of `slow_functions`, and
`level_forms`, `level_borders` and `band_levels` of `level_changes`.
"""

from allanite.fit.engine import solve
from allanite.suggestion.p_values import Family
from allanite.suggestion.screens._screen import Candidate, Context, Screen

__all__ = ["Candidate", "Context", "Family", "Screen", "solve"]
