"""Notch: a filter removes a band around one frequency from the signal."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from allanite.effects._declared import (
    Array,
    Parameter,
    frequency_parameter,
    log_grid,
    texts_for_clocks,
)
from allanite.effects._filter import Filter, Response

if TYPE_CHECKING:
    from allanite.effects.model import Model

#: Qualities that are tried, from a wide to a narrow notch. Chosen by judgment; not measured.
TRIED_QUALITIES = (1.4, 4.0, 12.0)
#: Values of `left` (amplitude gain at the center) that are tried. A grid with deep notches only would miss notches between
#: grid frequencies. Chosen by judgment; not measured.
TRIED_AMPLITUDES_LEFT = (0.002, 0.3)
#: Minimum distance of each of the two poles from their mean, so that they differ. Chosen by judgment; not measured.
MIN_POLE_DISTANCE = 1e-3


@dataclass(frozen=True)
class Notch(Filter):
    """Second-order digital notch: |H|² is ½ at two frequencies at distance frequency/quality, and 1 far from them.

    H = left + (1 − left) g (1 − 2 cos ω0 z⁻¹ + z⁻²)/(1 − 2g cos ω0 z⁻¹ + (2g − 1) z⁻²), g = 1/(1 + tan(ω0/2Q)) with Q the
    quality. `left` is the amplitude left at the center; its minimum 0.001 means a complete notch. The notch acts on all
    random processes of the model.

    Examples
    --------
    >>> model = al.AngleRandomWalk(N=0.1) + al.effects.Notch(frequency=25.0, quality=5.0)
    >>> print((model.psd([0.01, 22.5, 25.0], rate=100) / 0.1**2).round(1).clip(0))
    [1.  0.5 0. ]
    >>> len(al.effects.Notch(frequency=25.0, quality=5.0).response(rate=100).poles), len(model.effects[1].passed((), 100))
    (2, 0)
    """

    frequency: float | None = None
    quality: float | None = None
    left: float | None = None

    kind = "notch"
    short = "NOTCH"
    catalog_place = 12
    title = "notch"
    family = "filter"
    parameters = (
        frequency_parameter("center of the removed band"),
        Parameter(
            "quality",
            "1",
            "center frequency over −3 dB width",
            "shape",
            low=0.7,
            high=100.0,
            aliases=("Q",),
            symbol="Q",
        ),
        Parameter(
            "left", "1", "amplitude left at the center", "shape", low=0.001, high=0.9, optional=True
        ),
    )
    legend = ("frequency", "quality")
    physics = "a notch filter in the driver or the flight controller removes a band with vibration"
    looks_like = "a gap of the spectrum down to zero at f; hardly anything in the Allan curve"
    check_by = "look for a notch in the settings of driver and firmware; switch it off: the gap must disappear"
    texts = texts_for_clocks(
        physics="a filter of the counter, or of the loop that steers the clock, removes a band",
        check_by="look for a filter in the settings of counter and loop; switch it off: the gap must disappear",
    )
    rivals = ("resonance", "bandwidth")

    def grid(self, name: str, n: int, rate: float) -> Array:
        """Values to try for the parameter `name`: frequencies (Hz), qualities, or amplitude gains at the center.

        Frequencies are about 10 % apart, up to 0.48 of the rate. The lowest is the higher of 1/200 of the rate and
        100/T, with T the duration of the record.
        """
        if name != "frequency":
            return np.array(TRIED_QUALITIES if name == "quality" else TRIED_AMPLITUDES_LEFT)
        return log_grid(min(max(100.0 / n, 0.005), 0.4) * rate, 0.48 * rate, 24)

    @property
    def occupies(self) -> tuple[float, float] | None:
        """Pair (low, high) of the −3 dB band of the notch, Hz; None without values."""
        if self.frequency is None or self.quality is None:
            return None
        half = 0.5 * self.frequency / self.quality
        return self.frequency - half, self.frequency + half

    def shows(self, model: Model, rate: float, duration: float) -> bool:
        """True if the upper half of the notch, where the density rises again, lies below Nyquist; else it is a low-pass."""
        beyond = self.occupies
        return beyond is not None and 0.5 * ((self.frequency or 0.0) + beyond[1]) < 0.5 * rate

    def response(self, rate: float) -> Response:
        """`Response` (gain, zeros, poles) of the notch at sampling rate `rate`, Hz; its gain is 1 at frequency zero.

        Without values, the frequency is 0.1 of the rate and the quality is 1. The frequency is at most 0.4999 of the
        rate.
        """
        w = 2.0 * np.pi * min((self.frequency or 0.1 * rate) / rate, 0.4999)
        # The argument of the tangent is limited below π/2, to the widest possible notch.
        g = 1.0 / (1.0 + np.tan(min(0.5 * w / (self.quality or 1.0), 1.55)))
        middle, apart = g * np.cos(w), (1.0 - g) ** 2 - (g * np.sin(w)) ** 2
        root = max(abs(apart), MIN_POLE_DISTANCE**2) ** 0.5
        pair = (
            (complex(middle, root), complex(middle, -root))
            if apart < 0.0
            else (complex(middle + root), complex(middle - root))
        )
        # Second and third coefficients of denominator and numerator in powers of 1/z; the first is 1.
        a = -(pair[0] + pair[1]).real, (pair[0] * pair[1]).real
        b = -2.0 * float(np.cos(w)), 1.0
        # Gain 1 at frequency zero, even if the poles were moved.
        left = self.left or 0.0
        share = (1.0 - left) * (1.0 + a[0] + a[1]) / (2.0 + b[0])
        top = [left + share, left * a[0] + share * b[0], left * a[1] + share * b[1]]
        return Response(float(top[0]), tuple(map(complex, np.roots(top))), pair)
