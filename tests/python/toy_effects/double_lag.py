"""Two lags in a row of one driving heat: a random process that the catalogue does not have."""

from dataclasses import dataclass

import numpy as np

from allanite.effects import Parameter, Stochastic
from allanite.effects.terms import Exponential


@dataclass(frozen=True)
class DoubleLag(Stochastic):
    """r(h) = σ²/2 (e^{−h/T} + e^{−20 h/T})."""

    correlation_time: float | None = None
    size: float | None = None

    kind = "double_lag"
    short = "DL"
    title = "double lag"
    coefficient = "size"
    wanders = True
    parameters = (
        Parameter(
            "correlation_time",
            "s",
            "time constant of the slower lag",
            "shape",
            low=1e-6,
            aliases=("T",),
            symbol="T",
        ),
        Parameter("size", 0.0, "standard deviation of both together", symbol="σ"),
    )
    legend = ("size", "correlation_time")
    physics = "heat reaches the sensor by its case and by its board"
    looks_like = "two humps of the Allan deviation"
    check_by = "insulate the board"
    rivals = ("gauss_markov", "bias_instability", "power_law")

    def unit_terms(self, rate):
        phi = [float(np.exp(-k / (rate * (self.correlation_time or 1.0)))) for k in (1.0, 20.0)]
        return tuple(Exponential(0.5, p) for p in phi)
