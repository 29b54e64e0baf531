"""Former names of functions, methods and properties: they work, and warn."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any


def warn_of_former_name(former: str, present: str, stacklevel: int = 3) -> None:
    """Give a `DeprecationWarning` that the name `former` has been replaced by the name `present`.

    With `stacklevel` 3 the warning names the line that uses the caller of this function.
    """
    warnings.warn(f"{former} is now {present}", DeprecationWarning, stacklevel=stacklevel)


class Former:
    """Class method under a former name, which warns of the `present` name of the method.

    `call` gets the class and the arguments of the former method.
    """

    def __init__(self, present: str, call: Callable[..., Any]) -> None:
        self._present, self._call = present, call

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    def __get__(self, instance: object, owner: type) -> Callable[..., Any]:
        def method(*args: Any, **kwargs: Any) -> Any:
            kind = owner.__name__
            warn_of_former_name(f"{kind}.{self._name}", f"{kind}.{self._present}")
            return self._call(owner, *args, **kwargs)

        return method
