"""Burst noise: a random telegraph signal (popcorn noise) with two levels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from allanite.effects._base import Effect, Stochastic
from allanite.effects._declared import Parameter, texts_for_clocks
from allanite.effects.gauss_markov import GaussMarkov
from allanite.effects.terms import Exponential, Term


@dataclass(frozen=True)
class BurstNoise(Stochastic):
    """Two levels ±A with mean dwell time D; r(t) = A² e^{−2t/D}, the spectrum of a Gauss-Markov process with T = D/2.

    References
    ----------
    Machlup, S. (1954). Noise in semiconductors: spectrum of a two-parameter random signal. J. Appl. Phys. 25, 341.

    Examples
    --------
    >>> x = al.effects.BurstNoise(amplitude=0.5, dwell_time=2.0).simulate(duration=100, rate=10, seed=1).samples
    >>> np.unique(x)
    array([-0.5,  0.5])
    """

    amplitude: float | None = None
    dwell_time: float | None = None

    kind = "burst_noise"
    short = "RTS"
    catalog_place = 31
    title = "burst noise"
    coefficient = "amplitude"
    #: Detected by its two levels if a Gauss-Markov process fits the spectrum; the spectra are equal.
    screened = "two levels"
    unplanned = "plan for the gauss_markov of the same spectrum (correlation_time = dwell_time/2)"
    legend = ("amplitude", "dwell_time")
    parameters = (
        Parameter(
            "dwell_time",
            "s",
            "mean time in each level",
            "shape",
            low=1e-12,
            aliases=("D",),
            symbol="T",
        ),
        Parameter(
            "amplitude", 0.0, "half the distance between the levels", aliases=("A",), symbol="a"
        ),
    )
    physics = "a single trapped charge or a contact switches the bias between two levels"
    looks_like = "as a Gauss-Markov process on every curve; two levels in the low-passed samples"
    check_by = "low-pass the samples and look at their histogram: two peaks; it depends steeply on temperature and supply"
    texts = texts_for_clocks(
        physics="a single trapped charge or a contact switches the frequency between two levels"
    )
    rivals = ("gauss_markov",)

    @classmethod
    def like(cls, other: Effect, **values: Any) -> Self | None:
        """Burst noise with the spectrum of the Gauss-Markov process `other`: levels ±σ, mean dwell time 2T.

        None if `other` is another kind of effect, or if any `values` are given.
        """
        if values or not isinstance(other, GaussMarkov):
            return None
        return cls(amplitude=other.sigma, dwell_time=2.0 * (other.correlation_time or 0.0))

    def unit_terms(self, rate: float) -> tuple[Term, ...]:
        """Tuple with one term: an exponential with variance 1 and time constant D/2."""
        return (Exponential(1.0, float(np.exp(-2.0 / (rate * (self.dwell_time or 1.0))))),)

    def generator(self, rate: float) -> tuple[str, list[float]]:
        """Pair ("telegraph", [amplitude, probability ½(1 − e^{−2/(rate·D)}) of a switch per sample])."""
        stay = float(np.exp(-2.0 / (rate * (self.dwell_time or 1.0))))
        return "telegraph", [self.amplitude or 0.0, 0.5 * (1.0 - stay)]
