"""Tone burst: a line during a part of the record, e.g. a machine that was switched on and off."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from allanite.effects._declared import Array, Columns, frequency_parameter, texts_for_clocks
from allanite.effects._event import START_AND_END, edge_error
from allanite.effects._tone import AMPLITUDE, PHASE, Tone
from allanite.effects._waves import waves

#: Half-width of the frequency range of a burst, in units of 1/length; it contains all but 2 % of the power.
LOBE_HALF_WIDTH = 4.0


@dataclass(frozen=True)
class ToneBurst(Tone):
    """x(t) = A sin(2πft + φ) for start ≤ t < end, otherwise 0; φ is the phase at the first sample of the record.

    Examples
    --------
    >>> fan = al.effects.ToneBurst(frequency=12.3, start=200.0, end=350.0, amplitude=0.04)
    >>> x = (al.AngleRandomWalk(N=0.01) + fan).simulate(duration=600, rate=50, seed=1)
    >>> found = al.AngleRandomWalk().fit(x).check().suggestions[0]
    >>> print(found.kind, round(found.effect.frequency, 2), round(found.effect.start))
    tone_burst 12.3 200
    """

    frequency: float | None = None
    start: float | None = None
    end: float | None = None
    amplitude: float | None = None
    phase: float | None = None

    kind = "tone_burst"
    short = "TONE"
    catalog_place = 9
    title = "tone burst"
    screened = "passing line"
    happens_once = True
    interval = ("start", "end")
    parameters = (frequency_parameter("frequency"), *START_AND_END, AMPLITUDE, PHASE)
    legend = ("frequency", "amplitude", "start", "end")
    unplanned = "it is detected like a line: plan SIN in a record as long as the burst"
    physics = "something that turns or vibrates was switched on for a while: a fan, a pump, a motor, a drill next door"
    looks_like = "a peak of the spectrum wider than 1/T and with side lobes; a segment of the samples with a ripple"
    check_by = "compare the spectrum of the segment with that of the rest; find out what ran then; switch it off and repeat"
    texts = texts_for_clocks(
        physics="something periodic was switched on for a while: a fan, a compressor or a transmitter"
    )
    rivals = ("sinusoid", "drifting_line", "resonance")

    def grid(self, name: str, n: int, rate: float) -> Array:
        """Array of values to try: 1024 times, s, for start and end (ends lie after a given start), or frequencies, Hz."""
        if name in {"start", "end"}:
            first = (self.start or 0.0) if name == "end" else 0.0
            return np.linspace(min(first, n / rate), n / rate, 1026)[1:-1]
        return super().grid(name, n, rate)

    def seen_between(self, start: float, end: float) -> tuple[float, float]:
        """Pair (low, high): frequency ∓ 4/length of the burst, Hz, a range with 98 % of its power.

        A burst without times lasts from `start` to `end`, s. The lower end is at least 0.
        """
        f, when = self.frequency or 0.0, self.when or (start, end)
        lobe_half_width = LOBE_HALF_WIDTH / max(when[1] - when[0], 1e-12)
        return max(0.0, f - lobe_half_width), f + lobe_half_width

    def shape_error(self, name: str, variance: float, duration: float) -> float | None:
        """Standard error 11.2 S/A² of the start or the end of the burst, s; None for its frequency or without times.

        The density S of the noise follows from `variance`, the variance of the amplitude of a sine inside the burst.
        """
        if name == "frequency" or self.when is None:
            return None
        length = min(self.when[1] - self.when[0], duration)
        return edge_error(0.5 * variance * length, 0.5 * (self.amplitude or 0.0) ** 2)

    def regressors(self, time: Array, covariates: Columns) -> Array:
        """Sine and cosine of 2πft inside the interval (without times the whole record), 0 outside, shape (n, 2)."""
        start, end = self.when or (-np.inf, np.inf)
        inside = (time >= start) & (time < end)
        out = np.zeros((2, time.size))
        out[:, inside] = waves(self.frequency or 0.0, time[inside])
        return out.T
