"""Former names of functions, methods and properties: they work, and warn."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any


def warn_of_former_name(former: str, present: str, stacklevel: int = 3) -> None:
    """Give a `DeprecationWarning` that the name `former` has been replaced by the name `present`."""
    warnings.warn(f"{former} is now {present}", DeprecationWarning, stacklevel=stacklevel)


class Former:
    """Attribute under a former name, which warns of the `present` name of the property or method.

    With `call`, a class method: `call` gets the class and the arguments of the former method.
    """

    def __init__(self, present: str, call: Callable[..., Any] | None = None) -> None:
        self._present, self._call = present, call

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, instance: object, owner: type) -> Any:
        if self._call is None:
            return (
                self if instance is None else self._warned(getattr(instance, self._present), owner)
            )
        return lambda *args, **kwargs: self._warned(self._call, owner, 4)(owner, *args, **kwargs)

    def _warned(self, value: Any, owner: type, stacklevel: int = 4) -> Any:
        """The given `value`, after a `DeprecationWarning` that the attribute of the class `owner` has a new name."""
        kind = owner.__name__
        warn_of_former_name(f"{kind}.{self._name}", f"{kind}.{self._present}", stacklevel)
        return value
