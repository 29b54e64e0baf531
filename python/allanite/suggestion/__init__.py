"""Suggest effects that a fitted model lacks: screens find candidates, p-values judge them, a score ranks them.

Input: a fit. Output: a `Check` with suggestions, best first. Add a search for one kind of effect as a module in
`screens/` that declares `SCREEN`.
"""

from allanite.suggestion.check import Check, check_fit
from allanite.suggestion.suggest import Suggestion, explain_same_misfit, suggest

__all__ = ["Check", "Suggestion", "check_fit", "explain_same_misfit", "suggest"]
