"""Declaration of a screen that needs no other screen than that of the spectrum."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from allanite.fit.likelihood.data import Data
    from allanite.fit.likelihood.whitened import Whitened
    from allanite.fit.solution import Solution
    from allanite.suggestion.screens.spectral import Candidate


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """Input of a screen: the fitted solution, its data, the whitened residual, and the candidates found in the spectrum."""

    solution: Solution
    data: Data
    whitened: Whitened
    spectral: tuple[Candidate, ...]


@dataclass(frozen=True, slots=True)
class OwnScreen:
    """Search for a missing effect that needs no other search than that of the spectrum.

    A module here declares it as `SCREEN`.

    Attributes
    ----------
    family : str
        Family of its candidates, which share the false alarms of one search. Candidates of a family of its own have a
        `log_p_value`.
    look : callable
        ``look(view)`` returns the candidates.
    """

    family: str
    look: Callable[[View], Iterable[Candidate]]
