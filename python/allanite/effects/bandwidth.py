"""Bandwidth: a low-pass filter of the white noise or of all random processes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from allanite import _kernels
from allanite.common.errors import InputError
from allanite.effects import lowpass
from allanite.effects._declared import CUTOFF, Array, Parameter, texts_for_clocks
from allanite.effects._filter import Filter
from allanite.effects.terms import White

if TYPE_CHECKING:
    from allanite.effects._filter import Response
    from allanite.effects.terms import Term

#: Minimum ratio of the record's length to the length of a moving average. Chosen by judgment; not measured.
MIN_RECORD_PER_MEAN = 10.0
#: Minimum length of a moving average that is read from the zeros of the spectrum, samples. Chosen by judgment; not
#: measured.
MIN_MEAN_SAMPLES = 8
#: Minimum depth of the cepstrum at the length of a moving average, in standard deviations of noise. For records of up to
#: 10⁸ samples the probability that noise reaches this depth at any lag is below 0.1 %.
MIN_CEPSTRUM_SCORE = 6.5
#: Start value of the floor in a fit, relative to N. Chosen by judgment; not measured.
START_FLOOR = 0.1
#: Range of the floor in a fit, relative to N. Chosen by judgment; not measured.
FLOOR_RANGE = (1e-3, 0.45)


@dataclass(frozen=True)
class Bandwidth(Filter):
    """White noise after a low-pass filter with gain |H(f)|²; N is the density at low frequencies.

    Designs and their `order`:

    * ``sampled``: continuous Butterworth low-pass of order 1 to 4 before the sampler, with aliases
    * ``digital``: the same by bilinear transform at the sampling rate (zeros at Nyquist)
    * ``cascaded``: two equal ``digital`` filters of first order
    * ``smoothed``: 2 or 3 equal smoothers y += α(x − y); one smoother is ``sampled`` of order 1
    * ``moving_average``: 1 to 3 equal means over a time, as in a CIC decimator
    * ``fir``: sharp decimation filter, a sinc with a Hamming window, `order` samples long

    Noise added after the filter (rounding, pick-up) is white: `floor` is its density relative to N; by default none.

    `acts_on` is ``white`` (default) or ``all``, which needs a recursive design (the first four). With ``all``, the filter
    also acts on flicker noise and all other random processes. A record in which white noise dominates at the cutoff cannot
    distinguish both.

    Examples
    --------
    >>> model = al.AngleRandomWalk(N=0.1) + al.effects.Bandwidth(cutoff=10.0)
    >>> print((model.psd([0.01, 10.0], rate=1000) / 0.1**2).round(2))  # half the power at the cutoff
    [1.  0.5]
    >>> whole = al.effects.Bandwidth(cutoff=10.0, order=1, design="digital", acts_on="all")
    >>> whole.response(rate=1000).settling, len(whole.passed((), 1000))
    (255, 0)
    """

    cutoff: float | None = None
    order: float | None = None
    design: str | None = None
    floor: float | None = None
    acts_on: str | None = None

    kind = "bandwidth"
    short = "BW"
    catalog_place = 10
    common = True
    title = "low-pass filter"
    family = "filter"
    parameters = (
        CUTOFF,
        Parameter(
            "order",
            "1",
            "order of a Butterworth low-pass, number of equal sections or means, or length of a FIR in samples",
            "choice",
            low=1,
            high=64,
        ),
        Parameter("design", "text", ", ".join(lowpass.DESIGNS), "choice"),
        Parameter(
            "floor",
            "1",
            "density of the white noise added after the filter, relative to N",
            "shape",
            low=1e-6,
            high=0.95,
            optional=True,
        ),
        Parameter("acts_on", "text", "noise that is filtered: white, all", "choice", optional=True),
    )
    single = True
    physics = "the sensor's own digital or anti-alias filter, or the mechanical response, rolls off the white noise"
    looks_like = "a density that falls towards Nyquist; the Allan curve bends down at the first τ"
    check_by = "compare with the filter setting of the data sheet; set the sensor to another bandwidth or output rate"
    texts = texts_for_clocks(
        physics="the filter of the counter, or the loop that steers the clock, rolls off the noise",
        check_by="compare with the filter of the counter and the bandwidth of the loop; change them and repeat",
    )
    rivals = ("gauss_markov", "resonance", "quantization")

    def __post_init__(self) -> None:
        """Check the parameter values; InputError for an unknown or contradictory design, order or `acts_on`."""
        super().__post_init__()
        if self.design is not None and self.design not in lowpass.DESIGNS:
            raise InputError(
                f"bandwidth: unknown design {self.design!r} (known: {', '.join(lowpass.DESIGNS)})"
            )
        if self.acts_on not in (None, "white", "all"):
            raise InputError(f"bandwidth: unknown acts_on {self.acts_on!r} (known: white, all)")
        if self.acts_on == "all" and self.design not in (None, *lowpass.RECURSIVE):
            raise InputError(
                f"bandwidth: design {self.design} can filter only the white noise; for acts_on=all use"
                f" {', '.join(lowpass.RECURSIVE)}"
            )
        if self.acts_on == "all" and self.floor is not None:
            raise InputError("bandwidth: a floor needs acts_on=white")
        known = {order for orders in lowpass.DESIGNS.values() for order in orders}
        orders = lowpass.DESIGNS.get(self.design or "", tuple(sorted(known)))
        if self.order is not None and self.order not in orders:
            raise InputError(
                f"bandwidth: order {self.order:g} is not available for {self.design or 'any design'}"
                f" (known: {', '.join(map(str, orders))})"
            )

    @property
    def free_shapes(self) -> tuple[str, ...]:
        """Tuple of the names of the fitted shape parameters: ``cutoff``, and ``floor`` if it has a value, unless held."""
        return tuple(n for n in super().free_shapes if n != "floor" or self.floor is not None)

    def extended(self) -> tuple[Bandwidth, ...]:
        """One copy to which white noise after the filter (`floor`) is added; empty if there is or must be no floor."""
        if self.floor is not None or "floor" in self.held or self.acts_on == "all":
            return ()
        return (self.with_values(floor=START_FLOOR),)

    def equal_forms(self) -> tuple[Bandwidth, ...]:
        """Filters that act on all random processes instead of the white noise only.

        They have the same design, or the two simplest recursive designs if this design is not recursive.
        """
        if self.acts_on is not None or self.floor is not None or "design" in self.held:
            return ()
        if self.design in lowpass.RECURSIVE:
            return (self.with_values(acts_on="all"),)
        return tuple(
            self.with_values(design=design, order=float(order), acts_on="all")
            for design, order in (("sampled", 1), ("digital", 2))
        )

    def variants(self) -> tuple[Bandwidth, ...]:
        """Filters to try, one for each pair (design, order) that agrees with the given values.

        With a given order, the pairs are all designs of this order, otherwise the 17 pairs `lowpass.TRIED_DESIGNS`. A
        filter that acts on all processes has recursive designs only.
        """
        tried = (
            lowpass.TRIED_DESIGNS
            if self.order is None
            else [(d, o) for d, orders in lowpass.DESIGNS.items() for o in orders]
        )
        return tuple(
            self.with_values(design=design, order=float(order))
            for design, order in tried
            if self.design in (None, design) and self.order in (None, order)
            if self.acts_on != "all" or design in lowpass.RECURSIVE
        )

    def grid(self, name: str, n: int, rate: float) -> Array:
        """Values to try: 24 cutoff frequencies, Hz, or the two ends of the range of `floor`, relative to N.

        The cutoffs reach from 1/100 of the rate (FIR filters: 0.7/order of the rate, if higher) to the highest cutoff
        with a visible effect on the spectrum (`lowpass.MAX_CUTOFF`).
        """
        if name == "floor":
            return np.array(FLOOR_RANGE)
        design, low = self.design or "sampled", 0.01
        if design == "fir":
            # The length limits the lowest cutoff of a FIR filter.
            low = max(low, 0.7 / (self.order or 64.0))
        return rate * np.geomspace(low, lowpass.MAX_CUTOFF[design], 24)

    def search_ends(self, name: str, n: int, rate: float) -> tuple[float, float]:
        """Pair (lowest, highest) value of the shape parameter `name` that a fit of n samples at `rate` Hz may reach.

        The values are half the lowest and twice the highest value of `searched`. Only the lowest ``cutoff`` of a moving
        average may be lower: the cutoff of an average over a tenth of the record, but at least 0.0001 times `rate`.
        """
        low, high = super().search_ends(name, n, rate)
        if name == "cutoff" and self.design == "moving_average":
            slowest = lowpass.MEAN_CUTOFFS[int(self.order or 1)] * MIN_RECORD_PER_MEAN / n
            low = min(low, rate * max(slowest, lowpass.MIN_CUTOFF))
        return low, high

    @classmethod
    def seen_in(cls, power: Array, rate: float) -> tuple[Bandwidth, ...]:
        """Moving averages of 1, 2 and 3 stages with the length L that zeros of the spectrum show; empty without.

        L is 8 samples to a tenth of the record. It is the lag of the minimum of the cepstrum, the cosine transform of
        ln `power`: ln sin²(πfL) is −Σ 2 cos(2πfkL)/k. The minimum must be 6.5 standard deviations π/√n deep. This is
        the noise of the cepstrum for normal ordinates, since ln χ²₁ has the variance π²/2.
        """
        n = power.size
        lags = np.arange(MIN_MEAN_SAMPLES, int(n / MIN_RECORD_PER_MEAN) + 1)
        if not lags.size:
            return ()
        logarithm = np.maximum(power, 1e-300)
        np.log(logarithm, out=logarithm)
        logarithm -= logarithm.mean()
        # The transform is taken half an ordinate higher, which shortens the longest lags by at most 1.2 %.
        cepstrum = np.sqrt(2.0 / n) * _kernels.cosine_transform(logarithm)[lags]
        best = int(np.argmin(cepstrum))
        if cepstrum[best] > -MIN_CEPSTRUM_SCORE * np.pi / np.sqrt(n):
            return ()
        stages = lowpass.MEAN_CUTOFFS.items()
        return tuple(
            cls(cutoff=float(c * rate / lags[best]), order=float(k), design="moving_average")
            for k, c in stages
        )

    @property
    def whole(self) -> Bandwidth | None:
        """The effect itself if the filter acts on all random processes; None if it acts on white noise alone."""
        return self if self.acts_on == "all" else None

    def response(self, rate: float) -> Response:
        """`Response` (gain, zeros, poles) of a recursive design at sampling rate `rate`, Hz, with gain 1 at zero."""
        return lowpass.response(*self._design_values(rate))

    def modify(
        self, white: float, rate: float, span: tuple[float, float] | None = None
    ) -> tuple[Term, ...]:
        """Tuple of the terms of the filtered white noise and of the floor, with total density `white` at frequency zero."""
        after = (self.floor or 0.0) ** 2 * white
        filtered = tuple(t.scaled(white - after) for t in lowpass.terms(*self._design_values(rate)))
        return (*filtered, White(after)) if after else filtered

    def generators(self, white: float, rate: float) -> list[tuple[str, list[float]]]:
        """List of (name, parameters): the core's generators of the filtered white noise and of the floor, if any."""
        after = (self.floor or 0.0) ** 2 * white
        filtered = lowpass.generators(*self._design_values(rate), white - after)
        return [*filtered, ("white", [float(np.sqrt(after))])] if after else filtered

    def _design_values(self, rate: float) -> tuple[str, int, float]:
        """Tuple (design, order, cutoff in cycles per sample) at sampling rate `rate`, with defaults for missing values."""
        design = self.design or "sampled"
        order = int(self.order or lowpass.DESIGNS[design][0])
        return design, order, (self.cutoff or rate) / rate
