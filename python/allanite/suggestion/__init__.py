"""Suggest effects that a fitted model lacks: screens find candidates, p-values judge them, a score ranks them."""

from allanite.suggestion.check import Check, check_fit
from allanite.suggestion.suggest import Suggestion, same_misfit, suggest

__all__ = ["Check", "Suggestion", "check_fit", "same_misfit", "suggest"]
