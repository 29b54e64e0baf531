"""Declaration of a screen, what it is given and what it returns, and the table of all screens."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from allanite.common.errors import InputError
from allanite.common.extensions import EntryPoints, values_of_modules
from allanite.common.showing import brief
from allanite.fit.likelihood.remembered import MIN_TRIM_SAMPLES

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from allanite.effects import Effect
    from allanite.fit.likelihood.data import Data
    from allanite.fit.likelihood.whitened import Whitened
    from allanite.fit.solution import Solution
    from allanite.suggestion.p_values import Family

#: Group of the entry points of installed packages.
ENTRY_POINTS = "allanite.screens"

T = TypeVar("T")


def parallel_searches(data: Data) -> int:
    """Number of searches that run at a time: 2, or 1 for a large record, since each search holds copies of the record."""
    return 2 if data.samples.size < MIN_TRIM_SAMPLES else 1


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """Effect that a model may lack, its ΔlogL (`gain`, nats), and the refitted solution with it (None if not refitted).

    Candidates of one `family` share their false alarms.
    """

    effect: Effect
    gain: float
    family: Family
    solution: Solution | None = None
    #: Number of parameters that the effect adds to the model, for BIC.
    parameters: int = 1
    #: ln of the p-value, if the screen computes it; None: it follows from the family.
    log_p_value: float | None = None
    #: Part of `gain` for which the p-value is computed; None: all of it.
    judged_gain: float | None = None
    #: Data without the excluded samples, to which the solution was refitted; None if the effect excludes none.
    data: Data | None = None
    #: Further sentence for the explanation; may be empty.
    note: str = ""

    __repr__ = brief


@dataclass(frozen=True, slots=True, eq=False)
class Context:
    """Input of a screen: the fitted model, the data and the residual.

    `whitened` is the whitened residual in time. `white`, shape (kept,), are the cosine ordinates of the residual, whitened
    by the model without a discrepancy. `found` are the candidates of the screens that have ended, by name.
    """

    solution: Solution
    data: Data
    whitened: Whitened
    white: NDArray[Any]
    found: dict[str, tuple[Candidate, ...]] = field(default_factory=dict)
    _shared: dict[Callable[[Context], Any], Any] = field(default_factory=dict)

    def shared(self, compute: Callable[[Context], T]) -> T:
        """Result of ``compute(context)``, which is kept for all screens."""
        if compute not in self._shared:
            self._shared[compute] = compute(self)
        result: T = self._shared[compute]
        return result


@dataclass(frozen=True, slots=True)
class Screen:
    """Search for one sort of missing effect.

    Attributes
    ----------
    name : str
        Its name, for `after` and `Context.found`.
    looks_for : str
        Missing effect that the screen searches, and the method of the search.
    acts_in : str
        Where the effects act: ``"frequency"``, ``"time"`` (also functions of logged columns) or ``"both"``.
    look : callable
        ``look(context)`` returns the candidates. They need a refitted `solution`, and a `log_p_value` unless their family
        has the trials of the search.
    after : tuple of str
        Screens that must end first, because `look` uses their candidates.
    needs_samples : bool
        True if it needs all single samples; then it is not run for a summary.
    searches : callable
        ``searches(context)`` returns the number of searches in which `look` may raise a false alarm, after it has ended.
        0 if its candidates share the family of another screen.
    """

    name: str
    looks_for: str
    acts_in: Literal["frequency", "time", "both"]
    look: Callable[[Context], Iterable[Candidate]]
    after: tuple[str, ...] = ()
    needs_samples: bool = False
    searches: Callable[[Context], int] = lambda _: 1


class Screens(Mapping[str, Screen]):
    """Mapping of all screens by name: from the modules of a package, and from installed packages, which load once."""

    def __init__(self, package: str) -> None:
        self._screens: dict[str, Screen] = {s.name: s for s in values_of_modules("SCREEN", package)}
        self._own = frozenset(self._screens)
        self._installed = EntryPoints(ENTRY_POINTS, "screen", self._add)

    def __getitem__(self, name: str) -> Screen:
        self._installed.load()
        return self._screens[name]

    def __iter__(self) -> Iterator[str]:
        self._installed.load()
        return iter(tuple(self._screens))

    def __len__(self) -> int:
        self._installed.load()
        return len(self._screens)

    def is_installed(self, screen: Screen) -> bool:
        """True if the screen comes from an installed package, not from the package of this table."""
        return screen.name not in self._own

    def _add(self, screen: object) -> None:
        """Add one screen. Raises `InputError` for another type, a name that is used, or an unknown name in `after`."""
        if not isinstance(screen, Screen):
            raise InputError(f"{screen!r} is not an allanite.suggestion.screens.Screen")
        if screen.name in self._screens:
            raise InputError(f"the name {screen.name!r} belongs to another screen")
        unknown = set(screen.after) - self._screens.keys()
        if unknown:
            raise InputError(f"it runs after {min(unknown)!r}, which is not known")
        self._screens[screen.name] = screen
