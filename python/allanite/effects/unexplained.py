"""Unexplained noise: a smooth shape of the spectrum that no effect of the catalog explains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from allanite.common.errors import InputError
from allanite.effects._base import Stochastic
from allanite.effects._declared import Parameter, texts_for_clocks
from allanite.effects.terms import Exponential, Term

#: Damping ratio ζ of a band: its density exceeds half its maximum over 0.9 octaves, three times the distance of the bands.
#: Chosen by judgment; not measured.
BAND_DAMPING = 0.3
#: Number of bands per octave. Chosen by judgment; not measured.
BANDS_PER_OCTAVE = 3.0
#: Lowest center frequency, in periods per record. Chosen by judgment; not measured.
MIN_PERIODS = 16.0
#: Highest center frequency, as a fraction of the sampling rate. Chosen by judgment; not measured.
MAX_BAND_FREQUENCY = 0.45


@dataclass(frozen=True)
class Unexplained(Stochastic):
    """Sum of a few broad bands of noise, r(t) = rms² Σ s_i e^{−ζω_i t}(cos ω_d t − ζ/√(1−ζ²) sin ω_d t), ζ = 0.3.

    Each band has a density ∝ f²/((f_i² − f²)² + (2ζ f_i f)²). A fit chooses at most six bands that describe the power left
    by the rest of the model. The tails of the bands fall only as 1/f². Therefore N of the same model may be a few percent
    too low, outside its interval.

    `bands` lists frequency (Hz) and share of the variance of each band in turn: f₁, s₁, f₂, s₂ …

    Examples
    --------
    >>> rest = al.effects.Unexplained(rms=0.02, bands=(8.0, 0.7, 14.0, 0.3))
    >>> x = (al.AngleRandomWalk(N=0.01) + rest).simulate(duration=600, rate=100, seed=1)
    >>> fit = al.fit_model(x, "N+X")
    >>> print(fit.model.effects[1].kind, round(fit["X.rms"].value, 2))
    unexplained 0.02
    """

    rms: float | None = None
    bands: tuple[float, ...] | None = None

    kind = "unexplained"
    short = "X"
    catalog_place = 19
    title = "unexplained shape"
    screened = "none"
    coefficient = "rms"
    last_resort = True
    nameless = True
    unplanned = "it has no fixed shape: plan the effects that may cause it"
    parameters = (
        Parameter("rms", 0.0, "standard deviation of the whole shape"),
        Parameter(
            "bands", "text", "frequency in Hz and share of the variance of each band", "choice"
        ),
    )
    physics = "unknown: no effect of the catalog explains it; it takes up the remaining power, so that others are right"
    looks_like = "a smooth excess over some octaves of the spectrum"
    check_by = "change one thing at a time (mount, supply, filter, temperature) and see whether the shape moves"
    texts = texts_for_clocks(
        check_by="change one thing at a time (place, supply, counter, temperature) and see whether the shape moves"
    )

    def __post_init__(self) -> None:
        """Check the parameter values; InputError unless `bands` holds pairs of positive numbers."""
        super().__post_init__()
        given = self.bands
        if given is not None and (not given or len(given) % 2 or min(given) <= 0.0):
            raise InputError(
                f"unexplained: bands = {given} must list a positive frequency and a positive share of each band"
            )

    @property
    def numbers(self) -> int:
        """Number of parameters: two for each band; 0 without bands."""
        return len(self.bands or ())

    @classmethod
    def pieces(cls, n: int, rate: float) -> tuple[Self, ...]:
        """Effects with one band each, about three per octave, in ascending order.

        Their center frequencies reach from 16/T, with T the duration of `n` samples at `rate` Hz, to 0.45 times `rate`.
        """
        low, high = MIN_PERIODS * rate / n, MAX_BAND_FREQUENCY * rate
        count = max(2, int(BANDS_PER_OCTAVE * np.log2(high / low)))
        return tuple(cls(bands=(float(f), 1.0)) for f in np.geomspace(low, high, count))

    @classmethod
    def joined(cls, pieces: Sequence[Self], variances: Sequence[float]) -> Self:
        """New effect with the bands of all `pieces` with positive `variances`, by frequency; `rms` is √(Σ variances)."""
        total = float(sum(variances))
        bands = [
            (piece.bands[0], variance / total)
            for piece, variance in zip(pieces, variances, strict=True)
            if piece.bands is not None and variance > 0.0
        ]
        return cls(
            rms=float(np.sqrt(total)), bands=tuple(v for band in sorted(bands) for v in band)
        )

    def unit_terms(self, rate: float) -> tuple[Term, ...]:
        """A complex exponential for each band, with total variance 1; without values one band at 1 Hz."""
        bands = self.bands or (1.0, 1.0)
        root = float(np.sqrt(1.0 - BAND_DAMPING**2))
        total = sum(bands[1::2])
        return tuple(
            Exponential(
                complex(1.0, BAND_DAMPING / root) * share / total,
                complex(np.exp((-BAND_DAMPING + 1j * root) * 2.0 * np.pi * f / rate)),
            )
            for f, share in zip(bands[::2], bands[1::2], strict=True)
        )
