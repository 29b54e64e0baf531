"""Where cores that were compiled before look for the exceptions."""

from allanite.common.errors import InputError, TooShortError

__all__ = ["InputError", "TooShortError"]
