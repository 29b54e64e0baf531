"""Searches for missing effects in the residual of a fit, one module for each.

Input: a `Context`, i.e. a fit and its residual. Output: `Candidate`. Add a search as a module here that declares its
`Screen` as `SCREEN`; `suggest.py` runs all screens.
"""

from allanite.suggestion.p_values import Family
from allanite.suggestion.screens._screen import Candidate, Context, Screen

__all__ = ["Candidate", "Context", "Family", "Screen"]
