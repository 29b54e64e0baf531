"""Find extensions: modules of this package that declare something, and entry points of installed packages."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from importlib import import_module
from pkgutil import iter_modules
from threading import RLock
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint


def modules_of(*packages: str) -> Iterator[ModuleType]:
    """Iterator over the modules of some packages, imported: the packages in this order, the modules of each by name.

    Subpackages and modules whose names begin with ``_`` are skipped.
    """
    for package in packages:
        for found in sorted(iter_modules(import_module(package).__path__), key=lambda m: m.name):
            if not (found.ispkg or found.name.startswith("_")):
                yield import_module(f"{package}.{found.name}")


def values_of_modules(name: str, *packages: str) -> Iterator[Any]:
    """Iterator over the values of the variable `name` in `modules_of` some packages; modules without it are skipped."""
    return (getattr(module, name) for module in modules_of(*packages) if hasattr(module, name))


class EntryPoints:
    """Entry points of a group of the installed packages, which `load` passes to `add` of a registry at its first call.

    An entry point that cannot be loaded or added is skipped with a warning about `what` it is, because one faulty
    package must not disable the others.
    """

    def __init__(self, group: str, what: str, add: Callable[[Any], None]) -> None:
        self._group, self._what, self._add = group, what, add
        self._loaded = False
        self._lock = RLock()

    def load(self) -> None:
        """Load all entry points of the group and pass them to the registry's `add`, in any order; only once."""
        from importlib.metadata import entry_points

        with self._lock:
            if self._loaded:
                return
            self._loaded = True
            points = list(entry_points(group=self._group))
            failed: list[tuple[EntryPoint, Exception]] = []
            # An object may need another one, so that failed ones are tried again while others are added.
            while points:
                failed = []
                for point in points:
                    try:
                        self._add(point.load())
                    except Exception as error:  # whatever a foreign module raises
                        failed.append((point, error))
                points = [p for p, _ in failed] if len(failed) < len(points) else []
            for point, reason in failed:
                where = point.dist.name if point.dist is not None else "an installed package"
                warnings.warn(
                    f"the {self._what} {point.name} = {point.value} of {where} was not loaded: {reason}",
                    stacklevel=3,
                )
