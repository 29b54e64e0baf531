"""What a record cannot tell from an effect of its model: other effects, and two together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from allanite.fit.rivals.alternatives import shown
from allanite.fit.rivals.evidence import RIVAL

if TYPE_CHECKING:
    from allanite.fit.result import Fit

__all__ = ["Rivals", "rivals"]


@dataclass(frozen=True, slots=True)
class Rivals:
    """Kinds by which the record may be explained as well.

    Attributes
    ----------
    alone : tuple of str
        Kinds that explain the record as well in the place of an effect.
    pairs : tuple of (str, str)
        Kinds that do so together, the best first.
    """

    alone: tuple[str, ...] = ()
    pairs: tuple[tuple[str, str], ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Of the contract: every kind that is in one of them, and the pairs."""
        every = (*self.alone, *(kind for pair in self.pairs for kind in pair))
        return {
            "rivals": list(dict.fromkeys(every)),
            "rival_pairs": [list(pair) for pair in self.pairs],
        }


def rivals(fit: Fit, place: int) -> Rivals:
    """What explains the record as well as an effect of the model that the record shows."""
    if not shown(fit, place):
        return Rivals()
    alone = [a.effect.kind for a in fit.alternatives(place) if a.evidence > -RIVAL]
    return Rivals(tuple(alone), tuple(pair.kinds for pair in fit.together(place)))
