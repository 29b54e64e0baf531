"""Noise of a sensor at work: what a second log, with motors or engine running, adds to the model of the first log.

The spectrum of the working log adds vibration and motion to the noise at rest:

* Lines are single frequencies far above their neighbors. Multiples that fold at half of the rate are named as aliases.
* Motion is excess that falls from the lowest frequency on, below 10 Hz: no vehicle is steered faster. A filter must follow
  motion, so it is not noise.
* Vibration is the remaining excess. Its density in the octave above motion, or up to 10 Hz, adds to N, because an
  integral accumulates it. Each higher band becomes a line of the same power, which adds as much to an angle or a velocity.

Slow noise is that of the log at rest, since motion hides it.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.arrays import Array, runs_of
from allanite.common.documents import fields_dict
from allanite.common.errors import InputError, TooShortError
from allanite.common.numbers import number
from allanite.common.units import parse_unit
from allanite.effects.files import model_to_dict
from allanite.effects.model import Model
from allanite.effects.registry import single_line
from allanite.spectrum.spectrum import bridge_gaps

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.fit.result import Fit
    from allanite.recording import Recording
    from allanite.study import Study


#: Highest frequency of motion, Hz: attitude loops of small multicopters cross over at 2 to 8 Hz, other vehicles are slower.
MAX_MOTION_FREQUENCY = 10.0
#: Number of segments (half overlap) whose spectra are averaged, so that each density is known to 18 %, and minimum number
#: of samples of a segment.
SEGMENTS, MIN_SEGMENT_SAMPLES = 32, 64
#: Variance of an average over Hann segments with half overlap, divided by that over as many independent segments.
OVERLAP_VARIANCE_RATIO = 1.0 + 2.0 / 36.0
#: Maximum relative difference of the rates of both logs. Chosen by judgment; a line moves by less than a bin.
MAX_RATE_DIFFERENCE = 0.01
#: Number of bins from frequency zero on that are omitted, because the window mixes them with the mean.
OMITTED_BINS = 3
#: False-alarm probability: that white noise shows a line anywhere in a spectrum.
FALSE_LINE_PROBABILITY = 1e-3
#: Number of bins on each side of a line whose median is the noise level, and half width of the window's main lobe in bins.
LEVEL_BINS, LOBE_BINS = 15, 2
#: A band shows motion if it exceeds the minimum of the excess above it by this many standard errors. Chosen by judgment;
#: not measured.
MIN_MOTION_EXCESS = 4.0
#: Number of bands per octave in which spectra are averaged.
BANDS_PER_OCTAVE = 3
#: Vibration is reported if its power exceeds this share of that at rest. Chosen by judgment; not measured.
MIN_REPORTED_EXCESS = 0.1
#: Highest harmonic of a line that is searched among the other lines.
MAX_MULTIPLE = 12


@dataclass(frozen=True, slots=True)
class Line:
    """Line in the spectrum of the working log: `frequency` in Hz, `rms` in the unit of the samples.

    The line is the (aliased) harmonic of the order `multiple` of the frequency `base` (Hz); 1 and 0 without a base.
    """

    frequency: float
    rms: float
    multiple: int = 1
    base: float = 0.0

    def __str__(self) -> str:
        where = f"{number(self.frequency, 3)} Hz"
        if self.multiple == 1:
            return where
        whole = self.multiple * self.base
        folded = abs(whole - self.frequency) > 0.5 * self.base
        what = f"{self.multiple} x {number(self.base, 3)} Hz"
        return f"{where} (alias of {what})" if folded else f"{where} ({what})"


@dataclass(frozen=True, slots=True)
class Working:
    """Noise of one axis at work.

    Attributes
    ----------
    source : str
        Name of the working log.
    model : Model
        Model at rest with the N of the working state, and with lines and bands of vibration.
    effects : tuple of dict
        Effects of `model` as in the JSON of a fit, with the intervals of the log at rest where they still hold.
    N, interval : float, (float, float)
        White noise of the working state and its 95 % interval, in the recording's unit.
    level : float
        Ratio of N at work to N at rest.
    lines : tuple of Line
    broad : float
        Frequency up to which N describes the density, Hz.
    bands : tuple of (float, float, float)
        Lowest and highest frequency in Hz and rms of vibration above N.
    motion : (float, float)
        Highest frequency of motion in Hz and its rms; zeros without motion.
    """

    source: str
    model: Model
    effects: tuple[dict[str, Any], ...]
    N: float
    interval: tuple[float, float]
    level: float
    lines: tuple[Line, ...]
    broad: float
    bands: tuple[tuple[float, float, float], ...]
    motion: tuple[float, float]
    rate: float
    unit: str

    @property
    def reasons(self) -> list[str]:
        """ASCII sentences, one for each kind of noise that the running motors add to the noise at rest."""
        out = []
        if self.level > 1.0 + MIN_REPORTED_EXCESS:
            half = 0.5 * self.rate
            out.append(
                f"N x{self.level:.2g}: vibration at 0-{number(self.broad, 2)} Hz, or folded there from above {half:g} Hz"
            )
        out += [
            f"vibration at {number(low, 2)}-{number(high, 2)} Hz, {number(rms, 2)} {self.unit} rms"
            for low, high, rms in self.bands
        ]
        out += [f"line at {line}, {number(line.rms, 2)} {self.unit} rms" for line in self.lines]
        if self.motion[0]:
            out.append(
                f"motion below {number(self.motion[0], 2)} Hz ({number(self.motion[1], 2)} {self.unit} rms)"
                " is ignored, because a filter follows it"
            )
        return out or ["nothing above the noise at rest"]

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON of all results; the entry ``notes`` repeats `reasons`, and ``motion`` is None without motion."""
        below, _ = self.motion
        return {
            **fields_dict(self, broad="broad_hz", interval="", rate="", unit=""),
            "N": {"value": self.N, "interval": list(self.interval)},
            "lines": [fields_dict(line, frequency="frequency_hz", base="") for line in self.lines],
            "bands": [{"low_hz": a, "high_hz": b, "rms": rms} for a, b, rms in self.bands],
            "motion": dict(zip(("below_hz", "rms"), self.motion, strict=True)) if below else None,
            "model": self.model.name,
            "notes": [f"working state, from {self.source}:", *self.reasons],
        }


def working_states(
    studies: Mapping[str, Study], recordings: Sequence[Recording]
) -> dict[str, Working]:
    """`Working` of each column that both logs have, by name; `studies` are those of the log at rest.

    Raises `InputError` for a model without white noise.
    """
    at_work = {column.columns[0]: column for one in recordings for column in one.measured}
    return {
        name: _working_state(s.fit, at_work[name]) for name, s in studies.items() if name in at_work
    }


def check_working(quiet: Sequence[Recording], recordings: Sequence[Recording]) -> None:
    """Raise `InputError` or `TooShortError` unless the working log can be compared with the log at rest, `quiet`.

    At least one column must be in both logs. Each common column needs the same kind of unit, the same rate within 1 %,
    and enough samples.
    """
    at_rest = {column.columns[0]: column for one in quiet for column in one}
    at_work = {column.columns[0]: column for one in recordings for column in one}
    if at_rest.keys().isdisjoint(at_work):
        raise InputError(
            f"no column of the log at rest ({', '.join(at_rest)}): it has {', '.join(at_work)}"
        )
    needed = MIN_SEGMENT_SAMPLES * (SEGMENTS + 1) // 2
    for name, own in at_work.items():
        other = at_rest.get(name)
        if other is None:
            continue
        if parse_unit(own.unit).kind != parse_unit(other.unit).kind:
            raise InputError(
                f"{name} is in {own.unit}, at rest in {other.unit}: give both logs one unit"
            )
        if not np.isclose(own.rate, other.rate, rtol=MAX_RATE_DIFFERENCE):
            raise InputError(
                f"{name} is at {own.rate:.6g} Hz, at rest at {other.rate:.6g} Hz, and vibration folds elsewhere: record"
                " both at one rate"
            )
        if own.n < needed:
            raise TooShortError(f"{name}: {own.n} samples at work are too few: {needed} are needed")


def _working_state(fit: Fit, log: Recording) -> Working:
    """`Working`: noise of one column while motors run, from its fit at rest and a recording of the same column at work.

    N is raised by the mean excess of the measured spectral density over the model. The excess is averaged above the
    frequencies of motion, up to 10 Hz or twice the highest frequency of motion, whichever is larger, but at most a
    quarter of the rate. Spectral lines, and bands of vibration above this range, become sinusoids of the same rms in
    the model. Raises `InputError` if the model at rest has no white noise.
    """
    recording = fit.recording
    model = fit.model.steady((0.0, recording.duration))
    white = model.white
    if white is None:
        raise InputError(
            f"{recording.columns[0]}: the model at rest, {model.name}, has no white noise"
        )
    f, S, count, variance = _welch_spectrum(log.to(recording.unit))
    nu = 2.0 * count / OVERLAP_VARIANCE_RATIO
    quiet = model.psd(f, recording.rate)
    lines, smooth = _lines_and_smooth_spectrum(f, S, nu, log.rate)
    begin = _end_of_motion(f, smooth, quiet, nu)
    unit = Model((white.with_values(**{white.coefficient: 1.0}), *model.modifiers))
    each = unit.psd(f, recording.rate)
    top = min(max(MAX_MOTION_FREQUENCY, 2.0 * begin), log.rate / 4.0)
    near = (f >= begin) & (f <= max(top, begin + 2.0 * (f[1] - f[0])))
    # All densities have the same relative error.
    ratio = float((smooth[near] / quiet[near]).mean())
    square = float((quiet[near] / each[near]).mean())
    error = square * ratio * np.sqrt(2.0 / (nu * near.sum()))
    excess = max(ratio - 1.0, 0.0) * square
    at_rest = float(getattr(white, white.coefficient))
    N = float(np.sqrt(at_rest**2 + excess))
    ends = [np.sqrt(max(N**2 + side * 1.96 * error, 0.0)) for side in (-1.0, 1.0)]
    floor = quiet + excess * each
    bands, broad = _vibration_bands(f, smooth, floor, float(f[near][-1]))
    tones = [(one.frequency, one.rms) for one in lines]
    tones += [(float(np.sqrt(low * high)), rms) for low, high, rms in bands]
    sines = [single_line(frequency, float(np.sqrt(2.0) * rms)) for frequency, rms in tones]
    entries = fit.body(searched=False)["effects"]
    for entry in entries:
        if entry["kind"] == white.kind:
            given = entry["parameters"][white.coefficient]
            given |= {"value": N, "interval": [float(end) for end in ends], "detected": True}
    entries += model_to_dict(Model(tuple(sines)))["effects"]
    place = next(i for i, e in enumerate(model.effects) if e is white)
    moving = f < begin
    width = f[1] - f[0]
    motion = float(np.sqrt(max(variance - 2.0 * width * S[~moving].sum(), 0.0)))
    return Working(
        source=Path(log.path).name if log.path else "working log",
        model=Model((*model.replaced(place, **{white.coefficient: N}).effects, *sines)),
        effects=tuple(entries),
        N=N,
        interval=(float(ends[0]), float(ends[1])),
        level=N / at_rest,
        lines=lines,
        broad=broad,
        bands=_merge_adjacent(bands, width),
        motion=(float(begin), motion) if moving.any() else (0.0, 0.0),
        rate=log.rate,
        unit=recording.unit,
    )


def _welch_spectrum(log: Recording) -> tuple[Array, Array, int, float]:
    """(frequencies in Hz, two-sided Welch density in U²/Hz, number of averaged segments, variance of the samples).

    The three lowest frequencies and the last one are omitted.
    """
    from scipy.signal import welch

    x = bridge_gaps(log.rate_samples())
    size = 1 << int(np.log2(max(2.0 * x.size / (SEGMENTS + 1), 1.0)))
    f, S = welch(x, log.rate, "hann", size, size // 2, detrend="constant")
    count = (x.size - size) // (size // 2) + 1
    return f[OMITTED_BINS:-1], 0.5 * S[OMITTED_BINS:-1], count, float(x.var())


def _lines_and_smooth_spectrum(
    f: Array, S: Array, nu: float, rate: float
) -> tuple[tuple[Line, ...], Array]:
    """(spectral lines, spectral density without them) of the density `S` at the frequencies `f`.

    At a line, the density is replaced by the median of its surroundings. `nu` is the number of degrees of freedom of
    each density, `rate` the sampling rate in Hz. In pure noise, one spectrum in 1000 has a line.
    """
    from scipy.ndimage import median_filter
    from scipy.stats import chi2

    smooth = S.copy()
    width = f[1] - f[0]
    # The median of a chi-squared variable is below its mean.
    level = median_filter(S, 2 * LEVEL_BINS + 1, mode="nearest") * nu / chi2.median(nu)
    high = level * chi2.isf(FALSE_LINE_PROBABILITY / S.size, nu) / nu < S
    found = []
    for first, last in zip(*runs_of(high), strict=True):
        around = slice(max(first - LOBE_BINS, 0), min(last + LOBE_BINS, S.size))
        excess = np.maximum(S[around] - level[around], 0.0)
        smooth[around] = level[around]
        middle = float((f[around] @ excess) / excess.sum())
        # A line has two halves of the two-sided density.
        found.append(Line(middle, float(np.sqrt(2.0 * width * excess.sum()))))
    return tuple(_with_harmonics(found, width, rate)), smooth


def _with_harmonics(lines: list[Line], width: float, rate: float) -> list[Line]:
    """The given `lines`, in which harmonics of one base line carry their order and its frequency.

    The base is the line with the most harmonics among the others; of several such lines, the one with the largest rms.
    `width` is the frequency resolution, Hz.
    """

    def harmonics_of(base: Line) -> dict[int, int]:
        """Index of each harmonic of the line `base` in `lines` → its lowest order k, from 2 to 12.

        A line is a harmonic if its frequency is within k resolution widths of k times that of `base`, or of its alias.
        """
        out: dict[int, int] = {}
        for k in range(2, MAX_MULTIPLE + 1):
            whole = k * base.frequency
            folded = abs(whole - rate * round(whole / rate))
            for place, line in enumerate(lines):
                if line is not base and abs(line.frequency - folded) < k * width:
                    out.setdefault(place, k)
        return out

    if len(lines) < 2:
        return lines
    base = max(lines, key=lambda line: (len(harmonics_of(line)), line.rms))
    found = harmonics_of(base)
    return [
        Line(line.frequency, line.rms, found[place], base.frequency) if place in found else line
        for place, line in enumerate(lines)
    ]


def _end_of_motion(f: Array, S: Array, quiet: Array, nu: float) -> float:
    """Frequency in Hz below which the log shows motion; f[0], the lowest frequency, if there is no motion.

    `S` and `quiet` are the spectral densities at work and at rest; each S has `nu` degrees of freedom. The excess S −
    quiet is averaged in third octaves below 10 Hz. Motion ends where the third octave with the least excess begins. It
    exists only if a lower third octave has more excess, by over 4 standard errors.
    """
    top = min(MAX_MOTION_FREQUENCY, f[-1] / 2.0)
    count = max(2, int(BANDS_PER_OCTAVE * np.log2(top / f[0])) + 1)
    edges = np.unique(np.searchsorted(f, np.geomspace(f[0], top, count)))
    spans = [slice(a, b) for a, b in itertools.pairwise(edges)]
    if not spans:
        return float(f[0])
    level = np.array([S[s].mean() for s in spans])
    excess = level - np.array([quiet[s].mean() for s in spans])
    size = np.array([s.stop - s.start for s in spans])
    error = level * np.sqrt(2.0 / (nu * size))
    valley = int(np.argmin(excess))
    apart = excess[:valley] - excess[valley] > MIN_MOTION_EXCESS * np.hypot(
        error[:valley], error[valley]
    )
    return float(f[spans[valley].start]) if apart.any() else float(f[0])


def _vibration_bands(f: Array, S: Array, floor: Array, low: float) -> tuple[list[Any], float]:
    """(bands, end): third octaves above `low` Hz with vibration, and the frequency (Hz) where the noise floor ends.

    A band is (lowest, highest frequency in Hz, rms of the excess over the floor); its power exceeds that of the floor
    by more than 10 %. The floor ends where the first third octave begins whose power is below half of the floor's
    power.
    """
    high = float(f[-1])
    count = max(1, round(BANDS_PER_OCTAVE * float(np.log2(high / low))))
    edges = np.unique(np.searchsorted(f, np.geomspace(low, high * 1.0001, count + 1)))
    found, broad = [], high
    for first, last in itertools.pairwise(edges):
        own = slice(first, last)
        more = float((S[own] - floor[own]).sum())
        if more > MIN_REPORTED_EXCESS * floor[own].sum():
            rms = float(np.sqrt(2.0 * (f[1] - f[0]) * more))
            found.append((float(f[first]), float(f[last - 1]), rms))
        if broad == high and S[own].sum() < floor[own].sum() / 2.0:
            broad = float(f[first])
    return found, broad


def _merge_adjacent(bands: list[Any], width: float) -> tuple[Any, ...]:
    """Bands (lowest, highest frequency in Hz, rms) after merging those with less than 1.5 `width` (Hz) between them."""
    out: list[list[float]] = []
    for low, high, rms in bands:
        if out and low < out[-1][1] + 1.5 * width:
            out[-1][1:] = high, float(np.hypot(out[-1][2], rms))
        else:
            out.append([low, high, rms])
    return tuple((low, high, rms) for low, high, rms in out)
