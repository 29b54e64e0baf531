"""Fit lines whose frequency drifts: demodulate a band around them at every drift rate.

The whitened ordinates of the band are converted into a complex time series. Multiplied by e^{−iπdt²}, a line that drifts by
d becomes a steady line, whose Fourier power is its rise of logL.

For a wide band the cost of this search grows with the square of its width. There the powers of sections of the record are
first summed along all straight frequency courses (the Hough transform of a spectrogram). Within a section the line is
nearly steady. Around each of the best courses, a demodulated narrow band is then searched as above.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.arrays import Array
from allanite.common.threads import stop_if_unwanted
from allanite.fit.shapes.simplex import MIN_SHAPE_DELTA_LOGL, local_maximum

if TYPE_CHECKING:
    from allanite.effects import Deterministic
    from allanite.fit.likelihood.data import Data
    from allanite.fit.likelihood.expected import Noise

#: Number of ordinates to each side of the frequencies that a line passes, in its regression. Chosen by judgment; not
#: measured.
ORDINATES_BESIDE_DRIFT = 512
#: Minimum number of frequencies of a searched band. Chosen by judgment; not measured.
MIN_BAND_FREQUENCIES = 1024
#: Maximum number of frequencies of a band that is searched at every drift rate. Chosen by judgment; not measured.
MAX_EXHAUSTIVE_FREQUENCIES = 4096
#: Maximum number of frequencies of a band; lines that drift further are not searched. Chosen by judgment; not measured.
MAX_BAND_FREQUENCIES = 65536
#: Maximum number of values of a section of a wide band. Chosen by judgment; not measured.
MAX_SECTION_VALUES = 1024
#: Minimum number of sections of a wide band. Chosen by judgment; not measured.
MIN_SECTIONS = 16
#: Number of best courses of a wide band that are searched closely. Chosen by judgment; not measured.
MAX_COURSES = 8
#: Number of frequencies of the narrow band around a course. Chosen by judgment; not measured.
COURSE_BAND_FREQUENCIES = 512
#: Step of the drift in a search, in cycles per record duration squared. Chosen by judgment; not measured.
DRIFT_STEP = 2.0
#: Minimum rough height, relative to the highest, of drift rates that are evaluated exactly. Chosen by judgment; not
#: measured.
MIN_RELATIVE_HEIGHT = 0.6
#: Maximum number of drift rates that are evaluated exactly. Chosen by judgment; not measured.
MAX_EXACT_DRIFTS = 128
#: Number of values of the series that are demodulated together: a block of 0.5 MB stays in the cache of a processor.
#: It changes only the speed.
BLOCK_VALUES = 1 << 14
#: Number of frequencies to each side of a line at which the noise along its course is measured. Twice as many values as the
#: shortest interval of the search for lines; their median has a standard error of 13 %.
FREQUENCIES_BESIDE_COURSE = 64


@dataclass(frozen=True, slots=True, eq=False)
class Band:
    """Complex time series of a band of the whitened record, scaled so that |Fourier sum|² is the ΔlogL of a line.

    `first` is the frequency of the record at frequency 0 of the series, in cycles per record. `duration` is in s.
    """

    series: NDArray[np.complex128]
    first: int
    duration: float

    @property
    def trials(self) -> int:
        """Number of drift rates, from negative to positive ones, that `search` tries in a band of up to 4096 values."""
        return 2 * int(0.8 * self.series.size / DRIFT_STEP) + 1

    def search(self) -> tuple[float, float, float]:
        """Tuple (frequency at mid-record, drift over the record, ΔlogL) of the best drifting line on a grid.

        Frequency and drift are in cycles per record. In bands above 4096 values, only lines near the eight best lines of a
        coarse search are tried.
        """
        if self.series.size > MAX_EXHAUSTIVE_FREQUENCIES:
            found = [self._best_near_course(*course) for course in self._courses()]
            return max(found, key=lambda one: one[2])
        return self._best_demodulated(self.trials // 2)

    def _best_demodulated(self, max_steps: int) -> tuple[float, float, float]:
        """Tuple (frequency, drift, ΔlogL), in units as for `search`, of the best line with a limited drift.

        Drifts from −`max_steps` to +`max_steps` steps of 2 cycles per record are tried. Their ΔlogL is first estimated
        coarsely. Drifts with at least 0.6 of the largest estimate, at most the best 128, are then evaluated exactly.
        """
        k = self.series.size
        u = np.arange(k) / k - 0.5
        drifts = DRIFT_STEP * np.arange(-max_steps, max_steps + 1, dtype=np.float64)
        # Evaluate all roughly, then the promising ones exactly.
        heights = _kernels.chirp_heights(
            self.series.view(np.float64), float(drifts[0]), DRIFT_STEP, drifts.size
        )
        near = np.flatnonzero(heights >= MIN_RELATIVE_HEIGHT * heights.max())
        exact = drifts[near[np.argsort(-heights[near], kind="stable")[:MAX_EXACT_DRIFTS]]]
        best = (0.0, 0.0, -np.inf)
        for block in np.array_split(exact, -(-exact.size * k // BLOCK_VALUES)):
            turned = self.series * np.exp((-1j * np.pi * block[:, None]) * (u * u))
            sums = np.fft.fft(turned, 2 * k)
            power = sums.real**2 + sums.imag**2
            places = np.argmax(power, axis=1)
            heights = power[np.arange(block.size), places]
            top = int(np.argmax(heights))
            if heights[top] > best[2]:
                at = self.first + 0.5 * float(places[top])
                best = (at, float(block[top]), float(heights[top]))
        return best

    @property
    def _sections(self) -> int:
        """Number of equal time sections into which the series is divided: a power of two, at least 16.

        Each section has about 1024 values or fewer.
        """
        return max(MIN_SECTIONS, 1 << (self.series.size // MAX_SECTION_VALUES - 1).bit_length())

    def _courses(self) -> list[tuple[int, float]]:
        """List of (mid-record frequency minus `first`, change of frequency over the record) of the 8 best drifting lines.

        Both are in cycles per record; the best line comes first. The search is coarse and meant for wide bands.
        """
        number = self._sections
        # With this step a course deviates by at most a quarter of a section's frequency resolution at either end.
        max_steps = int(0.5 * DRIFT_STEP * self.trials / number)
        places, heights = _kernels.best_courses(
            self.series.view(np.float64), number, DRIFT_STEP, max_steps
        )
        best = np.argsort(-heights, kind="stable")[:MAX_COURSES]
        # Frequencies of a section are half a cycle per section apart.
        return [(int(places[at]) * number // 2, float(number * (at - max_steps))) for at in best]

    def _best_near_course(self, place: int, drift: float) -> tuple[float, float, float]:
        """Tuple (frequency at mid-record, drift, ΔlogL) of the best line near a course, in units as for `search`.

        A course is a line with the mid-record frequency `first` + `place` and the given `drift`. Demodulation removes its
        drift, so that only a narrow band around its frequency must be searched.
        """
        near = self._demodulated_along(place, drift)
        # Search drift rates up to the second neighboring course.
        frequency, more, gain = near._best_demodulated(int(2.0 * self._sections / DRIFT_STEP))
        return frequency, drift + more, gain

    def _demodulated_along(self, place: int, drift: float) -> Band:
        """Narrow `Band` around a linear course of frequency, demodulated so that its frequency becomes constant."""
        k = self.series.size
        u = np.arange(k) / k - 0.5
        spectrum = np.fft.fft(self.series * np.exp(-1j * np.pi * drift * u * u))
        low = min(max(place - COURSE_BAND_FREQUENCIES // 2, 0), k - COURSE_BAND_FREQUENCIES)
        series = np.fft.ifft(spectrum[low : low + COURSE_BAND_FREQUENCIES])
        return Band(series, self.first + low, self.duration)

    def gain(self, frequency: float, drift: float) -> float:
        """ΔlogL of a line with this mid-record frequency and drift (cycles per record)."""
        stop_if_unwanted()
        return float(abs(self._conjugate_line(frequency, drift) @ self.series) ** 2)

    def _conjugate_line(self, frequency: float, drift: float) -> NDArray[np.complex128]:
        """Complex conjugate of a line with this mid-record frequency and drift, cycles per record, shape (k,)."""
        u = np.arange(self.series.size) / self.series.size
        phase = (frequency - self.first) * u + 0.5 * drift * (u - 0.5) ** 2
        return np.exp(-2j * np.pi * phase)

    def relative_noise(self, frequency: float, drift: float) -> float:
        """Ratio, at least 1: noise power around a drifting line, without the line, over the expected noise power.

        A ratio above 1 shows a random band that moves with the line; in the mean spectrum such a band is spread and looks
        weaker.
        """
        turn = self._conjugate_line(frequency, drift)
        line = turn @ self.series
        sidebands = np.fft.fft(turn * self.series - line / self.series.size)
        places = np.arange(1, min(FREQUENCIES_BESIDE_COURSE, (self.series.size - 1) // 2) + 1)
        power = np.abs(sidebands[np.concatenate([places, -places])]) ** 2
        return max(1.0, float(np.median(power)) / np.log(2.0))

    def polished(self, frequency: float, drift: float) -> tuple[float, float, float]:
        """Tuple (frequency, drift, ΔlogL) of the local maximum of ΔlogL near a drifting line, by the simplex method.

        Frequency and drift are in cycles per record. In bands above 4096 values, only a narrow band around the given line
        is used.
        """
        near, course = self, 0.0
        if self.series.size > MAX_EXHAUSTIVE_FREQUENCIES:
            near, course = self._demodulated_along(round(frequency) - self.first, drift), drift
        start, steps = np.array([frequency, drift - course]), np.array([0.2, 0.7])
        found, _ = local_maximum(lambda x: near.gain(float(x[0]), float(x[1])), start, steps)
        frequency, drift = float(found[0]), course + float(found[1])
        return frequency, drift, self.gain(frequency, drift)


def ordinates_of_drift(effect: Deterministic, data: Data) -> NDArray[np.int64]:
    """Array of the indices of the ordinates on which a drifting line is regressed: its range and 512 on either side."""
    low, high = effect.seen_between(data.start, data.start + data.duration) or (0.0, 0.0)
    first, last = (round(2.0 * f * data.duration) for f in (low, high))
    first = min(max(1, first - ORDINATES_BESIDE_DRIFT), data.ordinates.size - 1)
    return np.arange(
        first, max(first + 1, min(data.ordinates.size, last + ORDINATES_BESIDE_DRIFT + 1))
    )


def band_about(
    low: float,
    high: float,
    ordinates: Array,
    noise: Noise,
    data: Data,
    min_values: int = MIN_BAND_FREQUENCIES,
) -> Band:
    """`Band` around the frequencies from `low` to `high`, Hz, of residual ordinates, shape (n,), whitened with `noise`.

    The band extends beyond `low` and `high` by their distance, or by half of it if the band would have more than 4096
    frequencies (cycles per record). It has at least `min_values` and at most 65 536 frequencies, fewer for short records.
    """
    middle, width = 0.5 * (low + high) * data.duration, (high - low) * data.duration
    half = int(
        np.clip(1.5 * width, 0.5 * min_values, 0.5 * max(min_values, MAX_EXHAUSTIVE_FREQUENCIES))
    )
    half = max(min(half, data.n // 8), min(int(width), MAX_BAND_FREQUENCIES // 2, data.n // 4 - 1))
    first = int(np.clip(round(middle) - half, 1, data.n // 2 - 2 * half))
    j = np.arange(max(1, 2 * first - 64), min(data.n, 2 * (first + 2 * half) + 64))
    white = ordinates[j] / np.sqrt(noise.variance(j))
    spectrum = fourier_sums(white, int(j[0]), first, 2 * half, data.n)
    return Band(np.fft.ifft(spectrum) / np.sqrt(data.n), first, data.duration)


def fourier_sums(
    ordinates: Array, start: int, first: int, count: int, n: int
) -> NDArray[np.complex128]:
    """Fourier sums of n samples, complex, shape (count,), from a band of consecutive cosine ordinates.

    The sums are Σ x_t e^{−2πikt/n} for k = first … first + count − 1 ≤ n/2. The given ordinates start at index `start`; all
    others are 0. An even ordinate j contributes only at k = j/2. An odd one contributes ½ √(2/n) e^{±iπj/2n} Σ_t
    e^{±iπ(j ∓ 2k)t/n}, which depends only on j − 2k and j + 2k. The sums are therefore two convolutions of the length of
    the band, not of the record.
    """
    from scipy.fft import fft, ifft, next_fast_len

    j = start + np.arange(ordinates.size)
    turned = np.sqrt(0.5 / n) * ordinates * np.exp(0.5j * np.pi * j / n)
    out = np.zeros(count, dtype=np.complex128)
    even = turned[(j % 2 == 0) & (j >= 2 * first) & (j < 2 * (first + count))]
    begin = max(0, -(-start // 2) - first)
    out[begin : begin + even.size] = n * even
    odd, low = turned[j % 2 == 1], start // 2  # j = 2i + 1, i from `low` on
    size = odd.size + count - 1
    length = next_fast_len(size)

    def sums(u: Array) -> NDArray[np.complex128]:
        """Sums of e^{2πiut/n} over t = 0 … n − 1, for half-integers u; equal to 2/(1 − e^{2πiu/n})."""
        return 1.0 + 1j / np.tan(np.pi * u / n)

    apart = low - first + 0.5 + np.arange(odd.size - 1, -count, -1)
    together = low + first + 0.5 + np.arange(size)
    product = fft(odd, length) * fft(sums(apart), length)
    product += fft(odd[::-1].conj(), length) * fft(sums(-together), length)
    out += ifft(product)[odd.size - 1 : size]
    return out


def loudest_frequency(effect: Deterministic, ordinates: Array, noise: Noise, data: Data) -> float:
    """Frequency of the largest whitened ordinate within the limits of a line, Hz.

    The lowest eight ordinates are not used. If the limits contain no ordinate, the largest of all is clipped to the limits.
    """
    j = np.arange(8, ordinates.size)
    if "frequency" in effect.limits:
        low, high = effect.checked_limits["frequency"]
        near = (j >= 2.0 * low * data.duration) & (j <= 2.0 * high * data.duration)
        # Limits closer together than two ordinates may contain none.
        j = j[near] if near.any() else j
    ratio = ordinates[j] ** 2 / noise.variance(j)
    found = float(j[int(np.argmax(ratio))] / (2.0 * data.duration))
    return float(effect.checked_limits.clipped("frequency", found))


def polished_line(
    effect: Deterministic, ordinates: Array, noise: Noise, data: Data
) -> tuple[Deterministic, float]:
    """Pair: copy of the drifting line with the frequency and drift that maximize logL, and its ΔlogL over no line.

    Without a drift, the strongest line near the frequency is searched. Without a frequency, it is searched near the largest
    whitened ordinate within the limits. A line with both values keeps them if ΔlogL rises by less than 1e-3.
    """
    values, T = effect.values, data.duration
    f, d = values["frequency"], values["drift"]
    if f is None or d is None:
        if f is None:
            f = loudest_frequency(effect, ordinates, noise, data)
        band = band_about(f, f, ordinates, noise, data)
        middle, drift, gain = band.polished(*band.search()[:2])
    else:
        ends = f + d * data.start, f + d * (data.start + T)
        band = band_about(min(ends), max(ends), ordinates, noise, data)
        at = (f + d * (data.start + 0.5 * T)) * T, d * T * T
        middle, drift, gain = band.polished(*at)
        before = band.gain(*at)
        if gain - before < MIN_SHAPE_DELTA_LOGL:
            return effect, before
    line = effect.with_values(
        frequency=max((middle - drift * (0.5 + data.start / T)) / T, 1e-12), drift=drift / T**2
    )
    return line, gain
