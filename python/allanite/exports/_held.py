"""Numbers of a format with white noise and one slow process."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from allanite.effects import Effect, GaussMarkov, Model, standard, white_noise


@dataclass(frozen=True, slots=True)
class NoiseParameters:
    """Noise that a file states for one axis, in SI units with two-sided densities: white noise and one slow process.

    Attributes
    ----------
    N, K : float
        White noise and random walk. K is 0 if there is a Gauss-Markov process instead.
    q_c, correlation_time : float
        Gauss-Markov process; 0 if there is none.
    remarks : tuple of (str, str)
        Name of a number, and a remark on it.
    holds : tuple of str or None
        Labels of the effects whose fitted coefficients are written; None if the numbers follow the whole model.
    overbound : bool
        Whether the numbers cover the upper limits of the model.
    B : float
        Bias instability, for formats that hold one; otherwise 0.
    others : tuple of (str, str)
        Name of a number, and the axis from which it comes, for formats with one number for all axes.
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
        """Standard deviation of the Gauss-Markov process, q_c √(correlation time/2), SI; 0 without one."""
        return float(self.q_c * np.sqrt(self.correlation_time / 2.0))

    def remark(self, name: str) -> str:
        """Remark on the number with this name, such as ``N``; an empty text if there is none."""
        return dict(self.remarks).get(name, "")

    @property
    def model(self) -> Model:
        """`Model` (SI) with white noise N and random walk K, and with B and a Gauss-Markov process if they are not 0."""
        out = white_noise(self.N) + random_walk_effect(self.K)
        if self.B:
            out = out + standard()["B"]().with_values(B=self.B)
        if self.q_c:
            out = out + gauss_markov_effect(self.q_c, self.correlation_time)
        return out


def random_walk_effect(K: float) -> Effect:
    """`RateRandomWalk` effect with coefficient K: the slow process of most filters."""
    return standard()["K"]().with_values(K=K)


def gauss_markov_effect(q_c: float, time: float) -> GaussMarkov:
    """`GaussMarkov` effect with density coefficient `q_c` and correlation time `time` (s): slow process of some filters."""
    return GaussMarkov(q_c=q_c, correlation_time=float(time))
