"""Which physical effect is missing?"""

from allanite.suggestion.check import Check, check_fit
from allanite.suggestion.suggest import Suggestion, suggest

__all__ = ["Check", "Suggestion", "check_fit", "suggest"]
