"""What no effect of the catalogue explains: a smooth shape of the spectrum, without a physical name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from allanite.common.errors import InputError
from allanite.effects._base import Parameter, Stochastic
from allanite.effects.terms import Exponential, Term

#: Damping of a band: its density is above a half over 0.9 octaves, three times the distance of the bands tried.
DAMPING = 0.3
#: Bands tried an octave, from so many periods in the record to this part of the sampling rate.
DENSITY, PERIODS, HIGHEST = 3.0, 16.0, 0.45


@dataclass(frozen=True)
class Unexplained(Stochastic):
    """A few broad bands of noise, r(t) = rms² Σ s_i e^{−ζω_i t}(cos ω_d t − ζ/√(1−ζ²) sin ω_d t), ζ = 0.3.

    Each has a density ∝ f²/((f_i² − f²)² + (2ζ f_i f)²). A fit chooses the bands, at most six, where they describe what the
    rest of the model leaves. The tails of its bands fall as 1/f² only: an N beside it may be some per cent low, beyond its
    interval.

    `bands` are the frequency (Hz) and the share of the variance of each band, one after the other: f₁, s₁, f₂, s₂ …

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

    kind: ClassVar[str] = "unexplained"
    short: ClassVar[str] = "X"
    title: ClassVar[str] = "unexplained shape"
    screened: ClassVar[str] = "none"
    coefficient: ClassVar[str] = "rms"
    last_resort: ClassVar[bool] = True
    nameless: ClassVar[bool] = True
    unplanned: ClassVar[str] = "it has no shape of its own: plan the effects that may be behind it"
    parameters: ClassVar[tuple[Parameter, ...]] = (
        Parameter("rms", 0.0, "standard deviation of the whole shape"),
        Parameter("bands", "text", "frequency and share of the variance of each band", "choice"),
    )
    physics: ClassVar[str] = (
        "nothing that the catalogue knows: it describes what is left, so that the rest can be trusted"
    )
    looks_like: ClassVar[str] = "a smooth excess over some octaves of the spectrum"
    check_by: ClassVar[str] = (
        "change one thing at a time (mount, supply, filter, temperature) and see whether the shape moves"
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        given = self.bands
        if given is not None and (not given or len(given) % 2 or min(given) <= 0.0):
            raise InputError(
                f"unexplained: bands = {given} must be a frequency and a share, both positive, of each band"
            )

    @property
    def numbers(self) -> int:
        """Two for each band."""
        return len(self.bands or ())

    @classmethod
    def pieces(cls, n: int, rate: float) -> tuple[Self, ...]:
        """One band each, over all frequencies that n samples at `rate` Hz show."""
        low, high = PERIODS * rate / n, HIGHEST * rate
        count = max(2, int(DENSITY * np.log2(high / low)))
        return tuple(cls(bands=(float(f), 1.0)) for f in np.geomspace(low, high, count))

    @classmethod
    def joined(cls, pieces: Sequence[Self], variances: Sequence[float]) -> Self:
        """One effect of these pieces, each with this variance."""
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
        """A complex exponential for each band, of variance 1 together."""
        bands = self.bands or (1.0, 1.0)
        root = float(np.sqrt(1.0 - DAMPING**2))
        total = sum(bands[1::2])
        return tuple(
            Exponential(
                complex(1.0, DAMPING / root) * share / total,
                complex(np.exp((-DAMPING + 1j * root) * 2.0 * np.pi * f / rate)),
            )
            for f, share in zip(bands[::2], bands[1::2], strict=True)
        )
