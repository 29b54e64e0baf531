"""Noise that several axes share, each source once, with the line or resonance that causes it if one is known."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from allanite.axes.coherence import CrossBand, CrossSpectrum
    from allanite.axes.lines import CommonLine
    from allanite.common.arrays import Array
    from allanite.fit.result import Fit

T = TypeVar("T")

#: A common line explains a coherence if the coherence that the line would cause is at least this fraction of the measured
#: one. Chosen by judgment; fractions of a spectrum are known roughly.
MIN_EXPLAINED_COHERENCE = 0.5


@dataclass(frozen=True, slots=True)
class SharedNoise:
    """Coherent noise of several columns in neighboring octaves.

    Attributes
    ----------
    columns : tuple of str
    low, high : float
        Ends of the octaves, Hz.
    pair : tuple of str
        The two columns with the clearest coherence.
    band : CrossBand
        The octave of that pair with the clearest coherence.
    line : CommonLine or None
        Line or resonance of these columns that causes the coherence.
    """

    columns: tuple[str, ...]
    low: float
    high: float
    pair: tuple[str, str]
    band: CrossBand
    line: CommonLine | None

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON: columns, low_hz, high_hz, pair, coherence, and line_hz (None without a line)."""
        return {
            "columns": list(self.columns),
            "low_hz": self.low,
            "high_hz": self.high,
            "pair": list(self.pair),
            "coherence": self.band.coherence,
            "line_hz": None if self.line is None else self.line.frequency,
        }

    def __str__(self) -> str:
        where = f"{self.low:.3g}–{self.high:.3g} Hz"
        coherence = (
            f"coherence {self.band.coherence:.2g} (independent axes: up to {self.band.chance:.1g})"
        )
        if self.line is not None:
            return f"{self.line}; {coherence} at {where}"
        low, high = self.band.interval
        of = f" of {' and '.join(self.pair)}" if len(self.columns) > 2 else ""
        correlation = f"correlation {self.band.correlation:.2g} ({low:.2g} … {high:.2g})"
        return f"shared noise at {where}: {', '.join(self.columns)}; {coherence}, {correlation}{of}"


#: Names of two columns, and one octave in which they are coherent.
_Pair = tuple[tuple[str, str], "CrossBand"]


def shared_noise(
    cross: Sequence[CrossSpectrum], lines: Sequence[CommonLine], fits: Mapping[str, Fit]
) -> tuple[SharedNoise, ...]:
    """One `SharedNoise` for each source of coherent noise on several columns; empty without significant noise.

    A common line is the source in an octave of a pair if it explains at least half of the measured coherence. All other
    pairs with a column in common in one octave have one source. Sources in adjacent octaves are merged if one has all
    the columns of the other. Lines come first, then the other sources by frequency.
    """
    of_lines: dict[CommonLine, list[_Pair]] = {}
    unexplained: list[_Pair] = []
    for spectrum in cross:
        for band in spectrum.significant:
            one = (spectrum.columns, band)
            made = {line: _coherence_of_line(line, *one, fits) for line in lines}
            line = max(made, key=lambda of: made[of], default=None)
            if line is not None and made[line] >= MIN_EXPLAINED_COHERENCE * band.coherence:
                of_lines.setdefault(line, []).append(one)
            else:
                unexplained.append(one)
    octaves = _connected_groups(
        unexplained,
        lambda a, b: (
            (a[1].low, a[1].high) == (b[1].low, b[1].high) and not {*a[0]}.isdisjoint(b[0])
        ),
    )
    groups = [
        [one for octave in group for one in octave]
        for group in _connected_groups(octaves, _are_neighbors)
    ]
    groups.sort(key=lambda group: min(band.low for _, band in group))
    found = [_noise_of_pairs(line.columns, pairs, line) for line, pairs in of_lines.items()]
    for group in groups:
        own = _columns_of_pairs(group)
        found.append(_noise_of_pairs(tuple(c for c in fits if c in own), group, None))
    return tuple(found)


def _noise_of_pairs(
    columns: tuple[str, ...], pairs: Sequence[_Pair], line: CommonLine | None
) -> SharedNoise:
    """`SharedNoise` of `columns`: frequency range of all `pairs`, and the coherence of the clearest pair.

    The clearest pair has the largest coherence relative to the 95 % quantile for independent columns.
    """
    # For few ordinates, independent axes have a larger coherence.
    pair, band = max(pairs, key=lambda one: one[1].coherence / one[1].chance)
    low, high = min(b.low for _, b in pairs), max(b.high for _, b in pairs)
    return SharedNoise(columns, low, high, pair, band, line)


def _columns_of_pairs(pairs: Iterable[_Pair]) -> set[str]:
    """Set of the names of all columns in `pairs`. Each pair is ((name, name), their coherence in an octave)."""
    return {column for pair, _ in pairs for column in pair}


def _are_neighbors(one: Sequence[_Pair], other: Sequence[_Pair]) -> bool:
    """True if two groups of coherent column pairs lie in adjacent octaves, and one group has all columns of the other."""
    (_, a), (_, b) = one[0], other[0]
    if a.high != b.low and a.low != b.high:
        return False
    mine, yours = _columns_of_pairs(one), _columns_of_pairs(other)
    return mine <= yours or mine >= yours


def _connected_groups(items: Iterable[T], joins: Callable[[T, T], bool]) -> list[list[T]]:
    """List of lists: connected components of the items, where `joins(a, b)` is True for connected items."""
    groups: list[list[T]] = []
    for item in items:
        near = [group for group in groups if any(joins(item, one) for one in group)]
        groups = [group for group in groups if group not in near]
        groups.append([*(one for group in near for one in group), item])
    return groups


def _coherence_of_line(
    line: CommonLine, pair: tuple[str, str], band: CrossBand, fits: Mapping[str, Fit]
) -> float:
    """Squared coherence of two columns in the octave `band`, if one spectral line is the same signal on both, or 0."""
    shares = [_resonance_share(line, name, fits[name]) for name in pair if name in line.columns]
    if len(shares) < 2:
        return 0.0
    data = fits[pair[0]].data
    low, high = (round(2.0 * data.n * f / data.rate) for f in (band.low, band.high))
    width = np.diff(np.clip(data.bins.edges, low, high))
    return float(width @ np.sqrt(shares[0] * shares[1]) / max(width.sum(), 1)) ** 2


def _resonance_share(line: CommonLine, column: str, fit: Fit) -> Array:
    """Share of the fitted spectrum of `column` that one resonance causes, in each frequency bin.

    The resonance is the random process of the line's kind whose band is nearest to the line. All shares are 0 if the
    fit has no such process, for example if the line is a sinusoid.
    """
    kind = line.kinds[line.columns.index(column)]
    own = [process for process in fit.solution.processes if process.effect.kind == kind]
    if not own:
        return np.zeros(fit.solution.spectrum.size)
    # A process without a band counts as being at the line.
    middles = (np.mean(process.effect.occupies or line.frequency) for process in own)
    nearest = np.argmin([abs(middle - line.frequency) for middle in middles])
    return np.asarray(own[nearest].power / fit.solution.spectrum)
