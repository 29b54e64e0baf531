"""Logarithmic ageing: a slow function of time that the catalogue does not have."""

from dataclasses import dataclass

import numpy as np

from allanite.effects import Deterministic, Parameter


@dataclass(frozen=True)
class Ageing(Deterministic):
    """x(t) = A ln(1 + t/τ)."""

    onset: float | None = None
    amplitude: float | None = None

    kind = "ageing"
    short = "AGE"
    title = "logarithmic ageing"
    parameters = (
        Parameter("onset", "s", "time from which it is logarithmic", "shape", low=1e-6, symbol="τ"),
        Parameter("amplitude", 0.0, "change by a factor of e", low=-np.inf),
    )
    physics = "the stress of the mounting relaxes"
    looks_like = "a drift that slows down and never ends"
    check_by = "repeat after a month"
    rivals = ("warm_up", "rate_ramp", "rate_random_walk", "bias_step")

    def grid(self, name, n, rate):
        return np.geomspace(n / 2000.0, n / 4.0, 16) / rate

    def regressors(self, time, covariates):
        return np.log1p(time / (self.onset or 1.0))[:, None]
