"""First-order Gauss-Markov process: correlated noise with one time constant (IEEE 952-1997 C.1.6)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from allanite.effects._base import Stochastic
from allanite.effects._declared import Array, Parameter, lag_parameter, log_grid, texts_for_clocks
from allanite.effects.terms import Exponential, Term


@dataclass(frozen=True)
class GaussMarkov(Stochastic):
    """r(h) = σ² φ^h, φ = e^{−τ0/T}, σ² = q_c² T/2. Allan peak 0.4365 q_c √T at τ = 1.8926 T.

    References
    ----------
    IEEE 952-1997, C.1.6.

    Examples
    --------
    The Allan deviation has its maximum, 0.437 q_c √T, at τ = 1.89 T:

    >>> lag = al.GaussMarkov(q_c=0.01, correlation_time=100.0)
    >>> print(np.sqrt(lag.allan_variance([189.0], rate=10)).round(4))
    [0.0437]
    """

    q_c: float | None = None
    correlation_time: float | None = None

    kind = "gauss_markov"
    short = "GM"
    catalog_place = 6
    common = True
    title = "Gauss-Markov process"
    coefficient = "q_c"
    parameters = (
        lag_parameter("correlation_time", "time constant of the lag"),
        Parameter("q_c", -0.5, "root of the driving white density"),
        Parameter("sigma", 0.0, "standard deviation of the process", "derived", symbol="σ"),
    )
    wanders = True
    legend = ("sigma", "correlation_time")
    physics = "a lag with one time constant driven by white noise: a thermal mass, a bias filter, the bandwidth of a loop"
    looks_like = (
        "a hump of the Allan deviation at 1.89 T, 0.437 q_c √T high; a density that is flat below 1/(2πT) and falls "
        "as 1/f² above"
    )
    check_by = (
        "look for a part whose time constant is T (heater, fan, filter of the electronics); change it and repeat; "
        "log its temperature"
    )
    texts = texts_for_clocks(
        physics="a lag with one time constant driven by white noise: a thermal mass, an oven, or the steering loop"
    )
    rivals = ("bias_instability", "rate_random_walk", "power_law", "burst_noise")

    @property
    def sigma(self) -> float | None:
        """Standard deviation q_c √(T/2) of the process, U; None without values."""
        if self.q_c is None or self.correlation_time is None:
            return None
        return self.q_c * float(np.sqrt(self.correlation_time / 2.0))

    @property
    def gauss_markov(self) -> tuple[float, float] | None:
        """Pair (q_c, correlation time in s); None without values."""
        return (self.q_c, self.correlation_time) if self.q_c and self.correlation_time else None

    def grid(self, name: str, n: int, rate: float) -> Array:
        """Correlation times to try, s, about 8 per decade, from four samples to half the record.

        A faster process would be a filter of white noise, a slower one a random walk.
        """
        return log_grid(4.0 / rate, 0.5 * n / rate)

    def unit_terms(self, rate: float) -> tuple[Term, ...]:
        """Tuple with one term: an exponential with variance T/2 and time constant T."""
        time = self.correlation_time or 1.0
        return (Exponential(time / 2.0, float(np.exp(-1.0 / (rate * time)))),)
