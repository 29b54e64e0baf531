"""Alternative explanations of an effect that the record cannot exclude: single effects, and pairs of effects."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from allanite.fit.rivals.alternatives import is_detected
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE

if TYPE_CHECKING:
    from allanite.fit.result import Fit


@dataclass(frozen=True, slots=True)
class Rivals:
    """Alternative explanations of one effect.

    Attributes
    ----------
    alone : tuple of str
        Kinds that explain the record equally well if they replace the effect.
    pairs : tuple of (str, str)
        Pairs of kinds that explain the record equally well if they replace the effect, best first.
    """

    alone: tuple[str, ...] = ()
    pairs: tuple[tuple[str, str], ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """JSON form: ``rivals`` with every kind, and ``rival_pairs``."""
        every = (*self.alone, *(kind for pair in self.pairs for kind in pair))
        return {
            "rivals": list(dict.fromkeys(every)),
            "rival_pairs": [list(pair) for pair in self.pairs],
        }


def rivals(fit: Fit, place: int) -> Rivals:
    """Alternative explanations of the effect at index `place`; empty if the effect is not detected."""
    if not is_detected(fit, place):
        return Rivals()
    alone = [a.effect.kind for a in fit.alternatives(place) if a.evidence > -MAX_RIVAL_LOG_EVIDENCE]
    return Rivals(tuple(alone), tuple(pair.kinds for pair in fit.together(place)))
