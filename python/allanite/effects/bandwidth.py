"""Bandwidth: the white part, or all that is random, has passed a low-pass."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from allanite.common.errors import InputError
from allanite.effects import lowpass
from allanite.effects._base import Parameter
from allanite.effects._low_pass import LowPass
from allanite.effects._modifier import Modifier
from allanite.effects.terms import White

if TYPE_CHECKING:
    from allanite.effects.terms import Term

#: The longest mean in parts of the record, the shortest that is read from zeros of the spectrum in samples, and standard
#: deviations by which its lag must stand out.
SHARE, SHORTEST, SURE = 10.0, 8, 6.5
#: Floor from which the one of a record is looked for, and its range.
FLOOR, FLOORS = 0.1, (1e-3, 0.45)


@dataclass(frozen=True)
class Bandwidth(Modifier):
    """White noise through |H(f)|² of a low-pass; N stays its level at low frequency.

    Designs, by `order`: ``sampled`` a continuous Butterworth low-pass of order 1 to 4 before the sampler, aliases
    included; ``digital`` the same by bilinear transform at the sampling rate (zeros at Nyquist); ``cascaded`` two equal
    ``digital`` ones of first order; ``smoothed`` 2 or 3 equal smoothers y += α(x − y) (one is ``sampled`` of order 1);
    ``moving_average`` 1 to 3 equal means over a time, as
    of a CIC decimator; ``fir`` a sharp decimation filter, a sinc in a Hamming window, `order` samples long.

    What is rounded or picked up after the filter is white again: `floor` is its density over N, none where it is not given.

    `acts_on` is ``white`` or, of the designs with poles (the first four), ``all``: a filter behind the sensor takes from
    its flicker noise what it takes from its white noise. A record in which only the white noise is seen there cannot tell.

    Examples
    --------
    >>> model = al.AngleRandomWalk(N=0.1) + al.effects.Bandwidth(cutoff=10.0)
    >>> print((model.psd([0.01, 10.0], rate=1000) / 0.1**2).round(2))  # half the power at the cutoff
    [1.  0.5]
    """

    cutoff: float | None = None
    order: float | None = None
    design: str | None = None
    floor: float | None = None
    acts_on: str | None = None

    kind: ClassVar[str] = "bandwidth"
    short: ClassVar[str] = "BW"
    common: ClassVar[bool] = True
    title: ClassVar[str] = "low-pass filter"
    family: ClassVar[str] = "filter"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter(
            "cutoff", "Hz", "−3 dB frequency", "shape", low=1e-12, aliases=("f", "fc"), symbol="f"
        ),
        Parameter(
            "order",
            "1",
            "of a Butterworth low-pass, number of equal sections or means, length of a FIR in samples",
            "choice",
            low=1,
            high=64,
        ),
        Parameter("design", "text", ", ".join(lowpass.DESIGNS), "choice"),
        Parameter(
            "floor",
            "1",
            "density of the white noise after the filter over N",
            "shape",
            low=1e-6,
            high=0.95,
            optional=True,
        ),
        Parameter("acts_on", "text", "white, all: what passes it", "choice", optional=True),
    )
    single: ClassVar[bool] = True
    physics: ClassVar[str] = (
        "the sensor's own digital or anti-alias filter, or the mechanical response, rolls off the white noise"
    )
    looks_like: ClassVar[str] = (
        "a density that falls towards Nyquist; the Allan curve bends down at the first τ"
    )
    check_by: ClassVar[str] = (
        "compare with the filter setting of the data sheet; set the sensor to another bandwidth or output rate"
    )
    rivals: ClassVar[tuple[str, ...]] = ("gauss_markov", "resonance", "quantization")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.design is not None and self.design not in lowpass.DESIGNS:
            raise InputError(
                f"bandwidth: design {self.design!r} (known: {', '.join(lowpass.DESIGNS)})"
            )
        if self.acts_on not in (None, "white", "all"):
            raise InputError(f"bandwidth: acts_on {self.acts_on!r} (known: white, all)")
        if self.acts_on == "all" and self.design not in (None, *lowpass.RECURSIVE):
            raise InputError(
                f"bandwidth: a filter of design {self.design} acts on the white noise alone"
                f" (on all: {', '.join(lowpass.RECURSIVE)})"
            )
        if self.acts_on == "all" and self.floor is not None:
            raise InputError("bandwidth: a floor is that of a filter of the white noise alone")
        orders = lowpass.DESIGNS.get(self.design or "", self._orders)
        if self.order is not None and self.order not in orders:
            raise InputError(
                f"bandwidth: order {self.order:g} of {self.design or 'any design'}"
                f" (known: {', '.join(map(str, orders))})"
            )

    @property
    def _orders(self) -> tuple[int, ...]:
        return tuple(sorted({o for orders in lowpass.DESIGNS.values() for o in orders}))

    @property
    def free_shapes(self) -> tuple[str, ...]:
        """The cutoff, and the floor where there is one."""
        return tuple(n for n in super().free_shapes if n != "floor" or self.floor is not None)

    def extended(self) -> tuple[Bandwidth, ...]:
        """With white noise after the filter."""
        if self.floor is not None or "floor" in self.held or self.acts_on == "all":
            return ()
        return (self.with_values(floor=FLOOR),)

    def otherwise(self) -> tuple[Bandwidth, ...]:
        """As a filter of all that is random: of the same design, or of the two simplest where that has no poles."""
        if self.acts_on is not None or self.floor is not None or "design" in self.held:
            return ()
        if self.design in lowpass.RECURSIVE:
            return (self.with_values(acts_on="all"),)
        return tuple(
            self.with_values(design=design, order=float(order), acts_on="all")
            for design, order in (("sampled", 1), ("digital", 2))
        )

    def variants(self) -> tuple[Bandwidth, ...]:
        """The designs to try: all that agree with what is given."""
        # An order that is given is tried in every design that has it, one that is not in the few that tell.
        tried = (
            lowpass.SCANNED
            if self.order is None
            else [(d, o) for d, orders in lowpass.DESIGNS.items() for o in orders]
        )
        return tuple(
            self.with_values(design=design, order=float(order))
            for design, order in tried
            if self.design in (None, design) and self.order in (None, order)
            if self.acts_on != "all" or design in lowpass.RECURSIVE
        )

    def grid(self, name: str, n: int, rate: float) -> NDArray[np.float64]:
        """Cutoffs from a hundredth of the rate to where nothing of the roll-off is left to see."""
        if name == "floor":
            return np.array(FLOORS)
        design, low = self.design or "sampled", 0.01
        if design == "fir":
            # A shorter one has no lower cutoff.
            low = max(low, 0.7 / (self.order or 64.0))
        return rate * np.geomspace(low, lowpass.HIGHEST[design], 24)

    def search_ends(self, name: str, n: int, rate: float) -> tuple[float, float]:
        """Ends of a cutoff as of every frequency; means may be as long as a tenth of the record."""
        low, high = super().search_ends(name, n, rate)
        if name == "cutoff" and self.design == "moving_average":
            low = min(
                low, rate * max(lowpass.MEANS[int(self.order or 1)] * SHARE / n, lowpass.LOWEST)
            )
        return low, high

    @classmethod
    def seen_in(cls, power: NDArray[np.float64], rate: float) -> tuple[Bandwidth, ...]:
        """Means over as many samples as the zeros of the spectrum tell, of 8 up to a tenth of the record.

        ln sin²(πfL) is −Σ 2 cos(2πfkL)/k: the cepstrum of the mean of L samples has −2 at lag L, in noise of variance
        π²/n where ordinates are normal (ln χ²₁ has the variance π²/2).
        """
        n = power.size
        lags = np.arange(SHORTEST, int(n / SHARE) + 1)
        if not lags.size:
            return ()
        logarithm = np.log(np.maximum(power, 1e-300))
        cepstrum = 2.0 / n * np.fft.rfft(logarithm - logarithm.mean(), 2 * n)[lags].real
        best = int(np.argmin(cepstrum))
        # The chance that any of the lags is lower is below one in a thousand for records of up to 10⁸ samples.
        if cepstrum[best] > -SURE * np.pi / np.sqrt(n):
            return ()
        orders = lowpass.DESIGNS["moving_average"]
        return tuple(
            cls(
                cutoff=float(lowpass.MEANS[order] * rate / lags[best]),
                order=float(order),
                design="moving_average",
            )
            for order in orders
        )

    @property
    def whole(self) -> LowPass | None:
        """The filter, where it acts on all that is random."""
        return LowPass(*self._at(1.0)) if self.acts_on == "all" else None

    def modify(
        self,
        white: float,
        rate: float,
        span: tuple[float, float] | None = None,
    ) -> tuple[Term, ...]:
        """Autocovariance of the filtered noise, normalized to `white` at zero frequency."""
        after = (self.floor or 0.0) ** 2 * white
        filtered = tuple(t.scaled(white - after) for t in lowpass.terms(*self._at(rate)))
        return (*filtered, White(after)) if after else filtered

    def generators(self, white: float, rate: float) -> list[tuple[str, list[float]]]:
        """The filter itself, and the noise after it."""
        after = (self.floor or 0.0) ** 2 * white
        filtered = lowpass.generators(*self._at(rate), white - after)
        return [*filtered, ("white", [float(np.sqrt(after))])] if after else filtered

    def _at(self, rate: float) -> tuple[str, int, float]:
        design = self.design or "sampled"
        order = int(self.order or lowpass.DESIGNS[design][0])
        return design, order, (self.cutoff or rate) / rate
