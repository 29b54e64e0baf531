"""Which physical effect is missing?"""

from allanite.suggestion.check import Check, check_fit
from allanite.suggestion.suggest import Suggestion, same_misfit, suggest

__all__ = ["Check", "Suggestion", "check_fit", "same_misfit", "suggest"]
