"""The catalogue of effects; users' effects join it by `register` or an entry point."""

from __future__ import annotations

from collections.abc import Iterator
from threading import RLock
from typing import TypeVar

from allanite.common.errors import InputError
from allanite.common.extensions import add_installed
from allanite.effects._base import SCREENS, Effect, Stochastic

__all__ = ["CATALOGUE", "Catalogue", "find", "register", "standard", "white_noise"]

#: Group of entry points under which an installed package offers effects: ``name = "package.module:MyEffect"``.
ENTRY_POINTS = "allanite.effects"

E = TypeVar("E", bound=type[Effect])


class Catalogue:
    """Every effect, in the order in which models are written: ours, then those of installed packages and of `register`.

    Examples
    --------
    >>> al.CATALOGUE.find("GM") is al.GaussMarkov, al.CATALOGUE[0].title, len(al.CATALOGUE) >= 29
    (True, 'quantization noise', True)
    >>> [effect.short for effect in al.CATALOGUE if "1/f" in effect.physics]
    ['B', 'F']
    """

    def __init__(self) -> None:
        self._effects: list[type[Effect]] = []
        self._ours = 0
        self._asked = False
        self._lock = RLock()

    def __iter__(self) -> Iterator[type[Effect]]:
        self._ask()
        return iter(tuple(self._effects))

    def __len__(self) -> int:
        self._ask()
        return len(self._effects)

    def __getitem__(self, place: int) -> type[Effect]:
        self._ask()
        return self._effects[place]

    def begin(self, *ours: type[Effect]) -> None:
        """Fill the catalogue with the effects of this package."""
        self._effects[: self._ours] = ours
        self._ours = len(ours)

    def find(self, name: str) -> type[Effect] | None:
        """The effect of a short or long name, or None."""
        return _named(name, self._effects[: self._ours]) or _named(name, list(self))

    def add(self, effect: type[Effect]) -> None:
        """See `register`."""
        _require(effect)
        with self._lock:
            if effect in self._effects:
                return
            for name in (effect.kind, effect.short):
                other = _named(name, self._effects)
                if other is not None and not _same(other, effect):
                    raise InputError(
                        f"{effect.__qualname__}: the name {name!r} is that of {other.__qualname__}:"
                        " choose another"
                    )
            # A notebook's cell is run again, a module reloaded.
            self._effects = [e for e in self._effects if not _same(e, effect)] + [effect]

    def remove(self, effect: type[Effect]) -> None:
        """Take out an effect that was registered."""
        with self._lock:
            mine = self._effects[self._ours :]
            self._effects[self._ours :] = [e for e in mine if e is not effect]

    def _ask(self) -> None:
        """Load the effects of installed packages, once."""
        with self._lock:
            if self._asked:
                return
            self._asked = True
            add_installed(ENTRY_POINTS, "effect", self.add)


def _named(name: str, effects: list[type[Effect]]) -> type[Effect] | None:
    return next((e for e in effects if name in (e.short, e.kind)), None)


def _same(one: type[Effect], other: type[Effect]) -> bool:
    return (one.__module__, one.__qualname__) == (other.__module__, other.__qualname__)


def _require(effect: type[Effect]) -> None:
    """An effect is declared as far as everything that reads the catalogue needs it."""
    if not (isinstance(effect, type) and issubclass(effect, Effect)):
        raise InputError(f"{effect!r} is not a class derived from allanite.Effect")
    name = effect.__qualname__
    for given in ("kind", "short", "title", "physics", "looks_like", "check_by", "parameters"):
        if not getattr(effect, given, None):
            raise InputError(f"{name}: declare {given}")
    for given in (effect.kind, effect.short):
        if not given.isidentifier():
            raise InputError(f"{name}: {given!r} cannot stand in a model string: use letters")
    if effect.screened not in SCREENS:
        raise InputError(f"{name}: screened = {effect.screened!r} (known: {', '.join(SCREENS)})")


#: Every effect; those of installed packages are loaded when it is first looked through.
CATALOGUE = Catalogue()


def find(name: str) -> type[Effect] | None:
    """The effect of a short or long name, or None."""
    return CATALOGUE.find(name)


def title_of(kind: str) -> str:
    """What an effect of a kind is called; of one that is not registered the words of its kind."""
    effect = find(kind)
    return kind.replace("_", " ") if effect is None else effect.title


def register(effect: E) -> E:
    """Add your own effect to the catalogue: model strings and files, checks, plans and figures know it.

    Parameters
    ----------
    effect : type
        A class derived from `Stochastic`, `Deterministic`, `Periodic` or `Modifier`; `allanite.testing.check_effect` proves
        what it declares.

    Returns
    -------
    type
        The same, so that it serves as a decorator. A class of the same module and name takes the place of the earlier one.

    Raises
    ------
    InputError
        A declaration is missing, or one of its names is taken.

    Examples
    --------
    Your own effect, with the declarations that `docs/own-effect.md` explains:

    >>> class Breathing(al.Sinusoid):
    ...     kind, short, title = "breathing", "BREATH", "breathing of the mount"
    >>> al.register(Breathing).kind
    'breathing'
    >>> al.parse_model("N+BREATH(frequency=0.2)").name
    'N+BREATH'
    >>> al.CATALOGUE.remove(Breathing)
    """
    CATALOGUE.add(effect)
    return effect


def standard() -> dict[str, type[Effect]]:
    """The five effects of IEEE 952-1997 by the names of their coefficients: Q, N, B, K, R."""
    return {e.standard.name: e for e in CATALOGUE if e.standard is not None}


def white_noise(coefficient: float | None = None) -> Stochastic:
    """The effect that is white noise, with this coefficient or to be fitted."""
    cls = next(e for e in CATALOGUE if issubclass(e, Stochastic) and e.white)
    return cls().with_values(**{cls.coefficient: coefficient})
