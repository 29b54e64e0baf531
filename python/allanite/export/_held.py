"""What a format with white noise and one slow process holds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from allanite.effects import Effect, standard, white_noise
from allanite.effects.gauss_markov import GaussMarkov

if TYPE_CHECKING:
    from allanite.effects.model import Model

__all__ = ["Choice", "lag", "walk"]


@dataclass(frozen=True, slots=True)
class Choice:
    """Numbers for one axis, SI, densities two-sided.

    Attributes
    ----------
    N, K : float
        K is 0 where there is a lag instead.
    q_c, correlation_time : float
        Gauss-Markov process; 0 where there is none.
    remarks : dict of str to str
        Remark on a number, by its name.
    holds : tuple of str or None
        Labels of the model's effects that the numbers are those of, as fitted; None where they follow the whole model.
    overbound : bool
        Whether the numbers cover the model's upper limits.
    B : float
        Bias instability, of a format that has a place for it; else 0.
    others : tuple of (str, str)
        Numbers that are those of another axis, by name, and that axis: a format may have one number for all of them.
    """

    N: float
    K: float = 0.0
    q_c: float = 0.0
    correlation_time: float = 0.0
    remarks: tuple[tuple[str, str], ...] = ()
    holds: tuple[str, ...] | None = None
    overbound: bool = False
    B: float = 0.0
    others: tuple[tuple[str, str], ...] = ()

    @property
    def sigma(self) -> float:
        """Standard deviation of the Gauss-Markov process."""
        return float(self.q_c * np.sqrt(self.correlation_time / 2.0))

    def remark(self, name: str) -> str:
        """Remark on a number, or an empty text."""
        return dict(self.remarks).get(name, "")

    @property
    def model(self) -> Model:
        """The numbers as a model in SI."""
        out = white_noise(self.N) + walk(self.K)
        if self.B:
            out = out + standard()["B"]().with_values(B=self.B)
        if self.q_c:
            out = out + lag(self.q_c, self.correlation_time)
        return out


def walk(K: float) -> Effect:
    """The slow process of a filter that has a random walk for it."""
    return standard()["K"]().with_values(K=K)


def lag(q_c: float, time: float) -> GaussMarkov:
    """The slow process of a filter that has a first-order lag for it."""
    return GaussMarkov(q_c=q_c, correlation_time=float(time))
