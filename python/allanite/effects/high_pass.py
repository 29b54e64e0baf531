"""High-pass: a filter that blocks slow signals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from allanite.common.errors import InputError
from allanite.effects._declared import CUTOFF, Array, Parameter, log_grid, texts_for_clocks
from allanite.effects._filter import Filter, Response

if TYPE_CHECKING:
    from allanite.effects.model import Model

#: Admissible orders.
ORDERS = (1, 2)
#: Maximum ratio of the lowest density below the cutoff to the median density above it for the filter to be visible. With a
#: higher ratio the spectrum is that of a Gauss-Markov process. Chosen by judgment; not measured.
MAX_DENSITY_RATIO = 0.5
#: Maximum visible cutoff, as a fraction of the sampling rate. With a higher cutoff the density rises up to Nyquist, like
#: white PM and quantization noise. Chosen by judgment; not measured.
MAX_VISIBLE_CUTOFF = 0.125


@dataclass(frozen=True)
class HighPass(Filter):
    """|H|² = (f/f_c)^{2k}/(1 + (f/f_c)^{2k}) of order k = 1 or 2: Butterworth by bilinear transform, gain 1 at Nyquist.

    The filter acts on every random process of the model; N, B and K are the coefficients before the filter. A random walk
    after a first-order high-pass is a Gauss-Markov process. Therefore the filter is suggested only if the density falls
    below the white level.

    Examples
    --------
    >>> model = al.AngleRandomWalk(N=0.1) + al.effects.HighPass(cutoff=0.2, order=1)
    >>> print((model.psd([0.002, 0.2, 40.0], rate=100) / 0.1**2).round(2))
    [0.  0.5 1. ]
    >>> model.effects[1].response(rate=100).settling > 1000, len(model.effects[1].passed((), 100))
    (True, 0)
    """

    cutoff: float | None = None
    order: float | None = None

    kind = "high_pass"
    short = "HP"
    catalog_place = 11
    title = "high-pass"
    family = "filter"
    parameters = (
        CUTOFF,
        Parameter("order", "1", "1 or 2", "choice", low=1, high=2),
    )
    single = True
    blocks: ClassVar[bool] = True
    physics = "a capacitor couples the signal, or a filter removes the drift: offset removal, washout, a leaky baseline"
    looks_like = "a density that falls towards low frequencies; an Allan deviation that falls as 1/τ or faster to its end"
    check_by = "turn the sensor steadily, or tilt it: a step must decay with 1/(2πf); look for an offset-removal setting"
    texts = texts_for_clocks(
        physics="a loop steers the clock to its reference and removes slow changes of the frequency",
        check_by="let the clock run free, or change the time constant of the loop: the cutoff must move",
    )
    rivals = ("quantization", "power_law", "gauss_markov")

    def __post_init__(self) -> None:
        """Check the parameter values; InputError for an order other than 1 and 2."""
        super().__post_init__()
        if self.order is not None and self.order not in ORDERS:
            raise InputError(f"high_pass: order {self.order:g} (known: 1, 2)")

    def variants(self) -> tuple[HighPass, ...]:
        """Tuple of filters of order 1 and 2, or only of the given order."""
        return tuple(self.with_values(order=float(o)) for o in ORDERS if self.order in (None, o))

    def grid(self, name: str, n: int, rate: float) -> Array:
        """Cutoffs to try, Hz, about eight per decade, from 4/T (T: duration of the record) to a quarter of the rate."""
        return log_grid(min(4.0 / n, 0.1) * rate, 0.25 * rate, at_least=6)

    def shows(self, model: Model, rate: float, duration: float) -> bool:
        """True if the lowest density below half the cutoff is under half of the median density above twice the cutoff.

        Otherwise a Gauss-Markov process fits as well. False for a cutoff above 1/8 of the rate, where quantization
        noise has the same spectrum.
        """
        cutoff = self.cutoff or rate
        if cutoff > MAX_VISIBLE_CUTOFF * rate:
            return False
        below = np.geomspace(max(0.5 / duration, 1e-3 * cutoff), 0.5 * cutoff, 16)
        above = np.geomspace(min(2.0 * cutoff, 0.4 * rate), 0.5 * rate, 16)
        return bool(
            model.psd(below, rate).min()
            < MAX_DENSITY_RATIO * float(np.median(model.psd(above, rate)))
        )

    def response(self, rate: float) -> Response:
        """`Response` of the Butterworth high-pass (bilinear transform) at sampling rate `rate`, Hz.

        The cutoff is at most 0.49 of the rate. Without values, the cutoff is 1 % of the rate and the order is 1.
        """
        k = np.tan(np.pi * min((self.cutoff or 0.01 * rate) / rate, 0.49))
        if int(self.order or 1) == 1:
            p = (1.0 - k) / (1.0 + k)
            # Avoid a pole at zero, which has no residue.
            p = p if abs(p) > 1e-5 else 1e-5
            return Response(0.5 * (1.0 + p), (1.0 + 0.0j,), (complex(p),))
        s = k * np.exp(0.75j * np.pi)
        p = complex((1.0 + s) / (1.0 - s))
        gain = float((abs(1.0 + p) ** 2) / 4.0)
        return Response(gain, (1.0 + 0.0j, 1.0 + 0.0j), (p, p.conjugate()))
