"""Lines whose frequency drifts: a band about them turned back at every rate of drift.

The whitened ordinates of the band become a complex series of as many values as the band has frequencies; multiplied by
e^{−iπdt²} a line that drifts by d is a line again, whose Fourier power is the rise of logL that it brings.

Of a wide band that would take as long as its square. There the powers of sections of the record, in each of which the line
is nearly one, are summed along all straight courses first (the Hough transform of a spectrogram); about the best courses a
narrow band, turned back along each, is searched as any other.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.threads import go_on

if TYPE_CHECKING:
    from allanite.effects import Deterministic
    from allanite.fit.likelihood.data import Data
    from allanite.fit.likelihood.expected import Noise

__all__ = [
    "MOST_WIDTH",
    "SAME",
    "WIDEST",
    "Band",
    "band_about",
    "loudest",
    "polish_drifting",
    "seen_at",
]

#: Ordinates beside the frequencies that a line passes, in its regression; frequencies of a band that is searched at every
#: rate of drift, and of the widest.
BESIDE, LEAST_WIDTH, MOST_WIDTH, WIDEST = 512, 1024, 4096, 65536
#: Values of a section of a wide band at most, and fewest sections; as many of the best courses are looked at closely, each
#: in a band of so many frequencies.
SECTION, SECTIONS, COURSES, ABOUT = 1024, 16, 8, 512
#: Step of the drift in a search, in cycles of the record squared.
STEP = 2.0
#: Part of the rough height of the best from which another may be the best, with room; and so many are looked at closely.
ROUGH, MAY_BE = 0.6, 128
#: A change of the shapes that gains less of logL stays where it is.
SAME = 1e-3


@dataclass(frozen=True, slots=True, eq=False)
class Band:
    """A complex series of a narrow band of the whitened record.

    Attributes
    ----------
    series : ndarray of complex, shape (k,)
        |Fourier sum|² is a rise of logL.
    first : int
        Its frequency 0, in cycles of the record.
    duration : float
        Of the record, s.
    """

    series: NDArray[np.complex128]
    first: int
    duration: float

    @property
    def trials(self) -> int:
        """Rates of drift that a search tries."""
        return 2 * int(0.8 * self.series.size / STEP) + 1

    def search(self) -> tuple[float, float, float]:
        """Frequency in the middle of the record (cycles of it), drift (cycles over it) and gain of the best line tried."""
        if self.series.size > MOST_WIDTH:
            found = [self._about(*course) for course in self._courses()]
            return max(found, key=lambda one: one[2])
        return self._turned_back(self.trials // 2)

    def _turned_back(self, most: int) -> tuple[float, float, float]:
        """What `search` finds at so many rates of drift to either side of none."""
        k = self.series.size
        u = np.arange(k) / k - 0.5
        drifts = STEP * np.arange(-most, most + 1, dtype=np.float64)
        # All of them roughly; then those that may be the highest.
        heights = _kernels.chirp_heights(
            self.series.view(np.float64), float(drifts[0]), STEP, drifts.size
        )
        near = np.flatnonzero(heights >= ROUGH * heights.max())
        best = (0.0, 0.0, -np.inf)
        for drift in drifts[near[np.argsort(-heights[near], kind="stable")[:MAY_BE]]]:
            turned = self.series * np.exp(-1j * np.pi * drift * u * u)
            power = np.abs(np.fft.fft(turned, 2 * k)) ** 2
            at = int(np.argmax(power))
            if power[at] > best[2]:
                best = (self.first + 0.5 * float(at), float(drift), float(power[at]))
        return best

    @property
    def _sections(self) -> int:
        """Into how many its record is cut where it is wide."""
        return max(SECTIONS, 1 << (self.series.size // SECTION - 1).bit_length())

    def _courses(self) -> list[tuple[int, float]]:
        """The best straight courses: frequency in the middle of the record, less `first`, and drift."""
        number = self._sections
        # So that a course is at most a quarter of a section's frequency off at either end; within a section a drift is its
        # square root's part of that of the record.
        most = int(0.5 * STEP * self.trials / number)
        places, heights = _kernels.best_courses(self.series.view(np.float64), number, STEP, most)
        best = np.argsort(-heights, kind="stable")[:COURSES]
        # Frequencies of a section are half a cycle of it apart.
        return [(int(places[at]) * number // 2, float(number * (at - most))) for at in best]

    def _about(self, place: int, drift: float) -> tuple[float, float, float]:
        """What `search` finds about a course: in a narrow band turned back along it."""
        k = self.series.size
        u = np.arange(k) / k - 0.5
        spectrum = np.fft.fft(self.series * np.exp(-1j * np.pi * drift * u * u))
        low = min(max(place - ABOUT // 2, 0), k - ABOUT)
        near = Band(np.fft.ifft(spectrum[low : low + ABOUT]), self.first + low, self.duration)
        # As far as the second course to either side.
        frequency, more, gain = near._turned_back(int(2.0 * self._sections / STEP))
        return frequency, drift + more, gain

    def gain(self, frequency: float, drift: float) -> float:
        """Rise of logL by a line of this frequency in the middle and this drift."""
        go_on()
        u = np.arange(self.series.size) / self.series.size
        turn = np.exp(-2j * np.pi * ((frequency - self.first) * u + 0.5 * drift * (u - 0.5) ** 2))
        return float(abs(turn @ self.series) ** 2)

    def polished(self, frequency: float, drift: float) -> tuple[float, float, float]:
        """The maximum of the gain near a frequency and a drift."""
        from scipy.optimize import minimize

        first = [(frequency, drift), (frequency + 0.2, drift), (frequency, drift + 0.7)]

        def loss(x: NDArray[np.float64], *_: Any, **__: Any) -> float:
            return -self.gain(float(x[0]), float(x[1]))

        options: Any = {
            "initial_simplex": np.array(first),
            "xatol": 1e-4,
            "fatol": 1e-5,
            "maxiter": 200,
        }
        found = minimize(loss, np.array([frequency, drift]), method="Nelder-Mead", options=options)
        return float(found.x[0]), float(found.x[1]), float(-found.fun)


def seen_at(effect: Deterministic, data: Data) -> NDArray[np.int64]:
    """Ordinates in which a line that drifts is regressed."""
    low, high = effect.seen_between(data.start, data.start + data.duration) or (0.0, 0.0)
    first, last = (round(2.0 * f * data.duration) for f in (low, high))
    first = min(max(1, first - BESIDE), data.ordinates.size - 1)
    return np.arange(first, max(first + 1, min(data.ordinates.size, last + BESIDE + 1)))


def band_about(
    low: float,
    high: float,
    ordinates: NDArray[np.float64],
    noise: Noise,
    data: Data,
    least: int = LEAST_WIDTH,
) -> Band:
    """The band of these frequencies (Hz), and as much again to either side, of a wide one half as much, of ordinates (n,).

    Its series has `least` values or more, where the record has as many frequencies.
    """
    middle, width = 0.5 * (low + high) * data.duration, (high - low) * data.duration
    half = int(np.clip(1.5 * width, 0.5 * least, 0.5 * max(least, MOST_WIDTH)))
    half = max(min(half, data.n // 8), min(int(width), WIDEST // 2, data.n // 4 - 1))
    first = int(np.clip(round(middle) - half, 1, data.n // 2 - 2 * half))
    j = np.arange(max(1, 2 * first - 64), min(data.n, 2 * (first + 2 * half) + 64))
    white = ordinates[j] / np.sqrt(noise.variance(j))
    spectrum = fourier_sums(white, int(j[0]), first, 2 * half, data.n)
    return Band(np.fft.ifft(spectrum) / np.sqrt(data.n), first, data.duration)


def fourier_sums(
    ordinates: NDArray[np.float64], start: int, first: int, count: int, n: int
) -> NDArray[np.complex128]:
    """Σ x_t e^{−2πikt/n}, k = first … first + count − 1 ≤ n/2, of n samples that have no others than these ordinates.

    They begin with `start`. Of an even ordinate j the sum is at k = j/2; of an odd one it is ½ √(2/n) e^{±iπj/2n}
    Σ_t e^{±iπ(j ∓ 2k)t/n}, which depends on j − 2k and on j + 2k alone: two convolutions, as long as the band and not as
    the record.
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

    def sums(u: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Σ_t e^{2πiut/n} of half an odd number u."""
        return 1j * np.exp(-1j * np.pi * u / n) / np.sin(np.pi * u / n)

    def convolved(
        values: NDArray[np.complex128], kernel: NDArray[np.complex128]
    ) -> NDArray[np.complex128]:
        product = fft(values, length) * fft(kernel, length)
        return np.asarray(ifft(product)[odd.size - 1 : size])

    apart = low - first + 0.5 + np.arange(odd.size - 1, -count, -1)
    together = low + first + 0.5 + np.arange(size)
    out += convolved(odd, sums(apart))
    out += convolved(odd[::-1].conj(), sums(-together))
    return out


def loudest(
    effect: Deterministic, ordinates: NDArray[np.float64], noise: Noise, data: Data
) -> float:
    """Frequency of the largest whitened ordinate within the limits of a line, Hz."""
    j = np.arange(8, ordinates.size)
    if "frequency" in effect.limits:
        low, high = effect.limits["frequency"]
        near = (j >= 2.0 * low * data.duration) & (j <= 2.0 * high * data.duration)
        # Limits closer than two ordinates have none between them.
        j = j[near] if near.any() else j
    ratio = ordinates[j] ** 2 / noise.variance(j)
    found = float(j[int(np.argmax(ratio))] / (2.0 * data.duration))
    return float(effect.limits.clipped("frequency", found))


def polish_drifting(
    effect: Deterministic, ordinates: NDArray[np.float64], noise: Noise, data: Data
) -> Deterministic:
    """The line with the frequency and the drift that explain most of the ordinates (n,) without it.

    Without values, the strongest anywhere near the largest ordinate.
    """
    values, T = effect.values, data.duration
    f, d = values["frequency"], values["drift"]
    if f is None or d is None:
        if f is None:
            f = loudest(effect, ordinates, noise, data)
        band = band_about(f, f, ordinates, noise, data)
        middle, drift, _ = band.polished(*band.search()[:2])
    else:
        ends = f + d * data.start, f + d * (data.start + T)
        band = band_about(min(ends), max(ends), ordinates, noise, data)
        at = (f + d * (data.start + 0.5 * T)) * T, d * T * T
        middle, drift, gain = band.polished(*at)
        if gain - band.gain(*at) < SAME:
            return effect
    return effect.with_values(
        frequency=max((middle - drift * (0.5 + data.start / T)) / T, 1e-12), drift=drift / T**2
    )
