"""The catalog of effects; user effects are added by `register` or an entry point."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from threading import RLock
from types import ModuleType
from typing import TypeVar

import numpy as np

from allanite.common.errors import InputError
from allanite.common.extensions import EntryPoints
from allanite.effects._base import Effect, Stochastic
from allanite.effects._declared import SEARCH_METHODS
from allanite.effects._known import Deterministic

#: Entry-point group of effects in installed packages: ``name = "package.module:MyEffect"``.
ENTRY_POINTS = "allanite.effects"

E = TypeVar("E", bound=type[Effect])


class Catalog:
    """All effects, in the order in which models are written: built-in effects, installed packages, then `register`.

    Examples
    --------
    >>> al.CATALOG.find("GM") is al.GaussMarkov, al.CATALOG[0].title, len(al.CATALOG) >= 29
    (True, 'quantization noise', True)
    >>> [effect.short for effect in al.CATALOG if "1/f" in effect.physics]
    ['B', 'F']
    """

    def __init__(self) -> None:
        self._effects: list[type[Effect]] = []
        self._built_in = 0
        self._lock = RLock()
        self._installed = EntryPoints(ENTRY_POINTS, "effect", self.add)

    def __iter__(self) -> Iterator[type[Effect]]:
        self._installed.load()
        return iter(tuple(self._effects))

    def __len__(self) -> int:
        self._installed.load()
        return len(self._effects)

    def __getitem__(self, place: int) -> type[Effect]:
        self._installed.load()
        return self._effects[place]

    @property
    def built_in(self) -> list[type[Effect]]:
        """List of the effects of this package, in their order."""
        return self._effects[: self._built_in]

    def begin(self, *ours: type[Effect]) -> None:
        """Set the built-in effects, which come first; replaces the present ones."""
        self._effects[: self._built_in] = ours
        self._built_in = len(ours)

    def find(self, name: str) -> type[Effect] | None:
        """Effect class whose short or long name is `name`, built-in effects first; None if unknown."""
        return _class_named(name, self.built_in) or _class_named(name, list(self))

    def add(self, effect: type[Effect]) -> None:
        """Add an effect class at the end, in place of one of the same module and name; errors as in `register`.

        Nothing changes if this very class is present already.
        """
        _require_declarations(effect)
        with self._lock:
            if effect in self._effects:
                return
            for name in (effect.kind, effect.short):
                other = _class_named(name, self._effects)
                if other is not None and not _is_same_class(other, effect):
                    raise InputError(
                        f"{effect.__qualname__}: the name {name!r} is already used by {other.__qualname__};"
                        " choose another"
                    )
            # Replace a class of the same name, e.g. if a notebook cell runs again.
            self._effects = [e for e in self._effects if not _is_same_class(e, effect)] + [effect]

    def remove(self, effect: type[Effect]) -> None:
        """Remove a registered `effect` class, if present; built-in effects stay."""
        with self._lock:
            mine = self._effects[self._built_in :]
            self._effects[self._built_in :] = [e for e in mine if e is not effect]


def _class_named(name: str, effects: list[type[Effect]]) -> type[Effect] | None:
    """First class in `effects` whose short or long name is `name`; None if there is none."""
    return next((e for e in effects if name in (e.short, e.kind)), None)


def _is_same_class(one: type[Effect], other: type[Effect]) -> bool:
    """True if two classes have the same module and name."""
    return (one.__module__, one.__qualname__) == (other.__module__, other.__qualname__)


def _require_declarations(effect: type[Effect]) -> None:
    """Raise InputError if an effect class lacks a declaration that the catalog needs, or has an invalid name."""
    if not (isinstance(effect, type) and issubclass(effect, Effect)):
        raise InputError(f"{effect!r} is not a class derived from allanite.Effect")
    name = effect.__qualname__
    for given in ("kind", "short", "title", "physics", "looks_like", "check_by", "parameters"):
        if not getattr(effect, given, None):
            raise InputError(f"{name}: declare {given}")
    for given in (effect.kind, effect.short):
        if not given.isidentifier():
            raise InputError(f"{name}: {given!r} cannot be used in a model string; use letters")
    if effect.screened not in SEARCH_METHODS:
        raise InputError(
            f"{name}: screened = {effect.screened!r} (known: {', '.join(SEARCH_METHODS)})"
        )


#: The catalog of all effects; effects of installed packages are loaded on first use.
CATALOG = Catalog()


def effects_in(modules: Iterable[ModuleType]) -> list[type[Effect]]:
    """List of the effect classes that these modules define, in the order of `Effect.catalog_place`."""
    found = [
        effect
        for module in modules
        for effect in vars(module).values()
        if isinstance(effect, type)
        and issubclass(effect, Effect)
        and effect.__module__ == module.__name__
        and "kind" in vars(effect)
    ]
    # A subclass does not inherit the place.
    return sorted(found, key=lambda effect: vars(effect).get("catalog_place", math.inf))


def find(name: str) -> type[Effect] | None:
    """Effect class of the catalog whose short or long name is `name`; None if unknown."""
    return CATALOG.find(name)


def title_of(kind: str, sensor: str = "") -> str:
    """Display name of a kind of effect for a kind of sensor; for unknown kinds the words of the kind itself."""
    effect = find(kind)
    return kind.replace("_", " ") if effect is None else effect.titles.get(sensor, effect.title)


def register(effect: E) -> E:
    """Add your own effect to the catalog, for use in model strings and files, checks, plans and figures.

    Parameters
    ----------
    effect : type
        A class derived from `Stochastic`, `Deterministic`, `Periodic` or `Modifier`. `allanite.testing.check_effect` tests
        its declarations.

    Returns
    -------
    type
        The class itself, so that `register` can be used as a decorator. A class of the same module and name replaces the
        earlier one.

    Raises
    ------
    InputError
        A declaration is missing, or a name is already used.

    Examples
    --------
    Your own effect (`docs/own-effect.md` explains the declarations):

    >>> class Breathing(al.Sinusoid):
    ...     kind, short, title = "breathing", "BREATH", "breathing of the mount"
    >>> al.register(Breathing).kind
    'breathing'
    >>> al.parse_model("N+BREATH(frequency=0.2)").name
    'N+BREATH'
    >>> al.CATALOG.remove(Breathing)
    """
    CATALOG.add(effect)
    return effect


def standard() -> dict[str, type[Effect]]:
    """Dict of the five effect classes of IEEE 952-1997 by the name of the coefficient: Q, N, B, K, R."""
    return {e.standard.name: e for e in CATALOG if e.standard is not None}


def white_noise(coefficient: float | None = None) -> Stochastic:
    """White-noise effect (angle random walk) with this `coefficient`; None is a coefficient to be fitted."""
    cls = next(e for e in CATALOG if issubclass(e, Stochastic) and e.white)
    return cls().with_values(**{cls.coefficient: coefficient})


def single_line(frequency: float, amplitude: float) -> Deterministic:
    """Effect with one line at `frequency`, Hz, with this `amplitude` (peak) and phase 0."""
    kinds = (cls for cls in CATALOG if issubclass(cls, Deterministic) and cls.periodic)
    made = next(one for cls in kinds if (one := cls.at(frequency, (1,))) is not None)
    return made.with_amplitudes(np.array([amplitude, 0.0]))
