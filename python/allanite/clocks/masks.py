"""Limits of ITU-T on MTIE and TDEV of clocks, as tables with their sources.

Each table equals that of public software: G.811 and both classes of G.8272 in `allantools.mask` (allantools 2024.6), and
tables 1, 3, 4 and 5 of G.8262 in timeTools (blueskyjunkie/timeTools, `ituTG8262/*/wanderGeneration.py`). The classes of
G.8273.2 are those of Calnex's one-page summary. G.812 has no mask, because no independent source of its tables was
found.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.common.errors import InputError

Array = NDArray[np.float64]
#: 1 ns in s. The recommendations state limits in ns.
NS = 1e-9


@dataclass(frozen=True)
class Piece:
    """A limit between two averaging times: Σ coefficient · τ^power, in ns.

    Attributes
    ----------
    low, high : float
        The limit holds for low < τ ≤ high, s.
    terms : tuple of (float, float)
        Coefficient in ns and power of τ of each term.

    Examples
    --------
    >>> from allanite.clocks.masks import Piece
    >>> Piece(9.0, 400.0, ((8.0, 0.5),)).at(100.0)
    80.0
    """

    low: float
    high: float
    terms: tuple[tuple[float, float], ...]

    def at(self, tau: Array) -> Array:
        """Limit in ns, Σ c·τ^p, at the averaging times `tau` (s), without a test of their range."""
        return np.sum([coefficient * tau**power for coefficient, power in self.terms], axis=0)


@dataclass(frozen=True)
class Limit:
    """A limit on one deviation.

    Attributes
    ----------
    pieces : tuple of Piece
        In ascending order of τ; each begins where the previous one ends.
    source : str
        Recommendation, edition and clause or table.
    """

    pieces: tuple[Piece, ...]
    source: str

    @property
    def span(self) -> tuple[float, float]:
        """Pair (shortest, exclusive; longest, inclusive) of the averaging times of the limit, s; the longest can be inf."""
        return self.pieces[0].low, self.pieces[-1].high

    def at(self, tau: Array) -> Array:
        """Limit in s at the averaging times `tau` (s), shape of `tau`; NaN where the mask states no limit."""
        tau = np.asarray(tau, dtype=float)
        out = np.full(tau.shape, np.nan)
        for piece in self.pieces:
            inside = (tau > piece.low) & (tau <= piece.high)
            out = np.where(inside, NS * piece.at(tau), out)
        return out


@dataclass(frozen=True)
class Mask:
    """All limits of one kind of clock.

    Attributes
    ----------
    name : str
    title : str
    limits : mapping of str to Limit
        Limit of each deviation, by ``"mtie"`` or ``"tdev"``.
    filter_hz : float or None
        Cutoff of the first-order low-pass filter that is applied to the time error before MTIE and TDEV; None without a
        filter.
    time_error : float or None
        Limit of the largest |time error|, s; None without a limit.
    constant : float or None
        Limit of the |mean time error| over any 1000 s, s; None without a limit.
    source : str
        Recommendation, edition and clause of the two limits of the time error.
    """

    name: str
    title: str
    limits: Mapping[str, Limit]
    filter_hz: float | None = None
    time_error: float | None = None
    constant: float | None = None
    source: str = ""


def _limit_of_pieces(
    source: str, *pieces: tuple[float, float, tuple[tuple[float, float], ...]]
) -> Limit:
    """`Limit` from its source (document and table) and from tuples (low, high, terms), one per piece.

    A piece limits a deviation to Σ c·τ^p ns for low < τ ≤ high, s; `terms` are the pairs (c, p).
    """
    return Limit(tuple(Piece(low, high, terms) for low, high, terms in pieces), source)


def _mask(name: str, title: str, mtie: Limit, tdev: Limit, **more: Any) -> Mask:
    """`Mask` with these limits on MTIE and TDEV; `more` are further attributes of `Mask`, such as `time_error`."""
    return Mask(name, title, MappingProxyType({"mtie": mtie, "tdev": tdev}), **more)


#: MTIE of a primary reference clock at short τ: 0.275e-3 τ + 0.025 µs.
_PRIMARY_CLOCK_MTIE = ((0.275, 1.0), (25.0, 0.0))
_MASKS = (
    _mask(
        "G.811",
        "primary reference clock",
        _limit_of_pieces(
            "G.811 (09/1997) clause 6.1, figure 1",
            (0.1, 1e3, _PRIMARY_CLOCK_MTIE),
            (1e3, np.inf, ((0.01, 1.0), (290.0, 0.0))),
        ),
        _limit_of_pieces(
            "G.811 (09/1997) clause 6.1, figure 2",
            (0.1, 100.0, ((3.0, 0.0),)),
            (100.0, 1e3, ((0.03, 1.0),)),
            (1e3, 1e4, ((30.0, 0.0),)),
        ),
    ),
    _mask(
        "G.8262-1",
        "Ethernet equipment clock, option 1, constant temperature",
        _limit_of_pieces(
            "G.8262 (07/2010) table 1",
            (0.1, 1.0, ((40.0, 0.0),)),
            (1.0, 100.0, ((40.0, 0.1),)),
            (100.0, 1e3, ((25.25, 0.2),)),
        ),
        _limit_of_pieces(
            "G.8262 (07/2010) table 3",
            (0.1, 25.0, ((3.2, 0.0),)),
            (25.0, 100.0, ((0.64, 0.5),)),
            (100.0, 1e3, ((6.4, 0.0),)),
        ),
    ),
    _mask(
        "G.8262-2",
        "Ethernet equipment clock, option 2, constant temperature",
        _limit_of_pieces(
            "G.8262 (07/2010) table 4",
            (0.1, 1.0, ((20.0, 0.0),)),
            (1.0, 10.0, ((20.0, 0.48),)),
            (10.0, 1e3, ((60.0, 0.0),)),
        ),
        _limit_of_pieces(
            "G.8262 (07/2010) table 5",
            (0.1, 2.5, ((3.2, -0.5),)),
            (2.5, 40.0, ((2.0, 0.0),)),
            (40.0, 1e3, ((0.32, 0.5),)),
            (1e3, 1e4, ((10.0, 0.0),)),
        ),
    ),
    _mask(
        "G.8272-A",
        "primary reference time clock, class A",
        _limit_of_pieces(
            "G.8272 (11/2018) table 1",
            (0.1, 273.0, _PRIMARY_CLOCK_MTIE),
            (273.0, 1e5, ((100.0, 0.0),)),
        ),
        _limit_of_pieces(
            "G.8272 (11/2018) table 3",
            (0.1, 100.0, ((3.0, 0.0),)),
            (100.0, 1e3, ((0.03, 1.0),)),
            (1e3, 1e4, ((30.0, 0.0),)),
        ),
        time_error=100.0 * NS,
        source="G.8272 (11/2018) clause 6.1",
    ),
    _mask(
        "G.8272-B",
        "primary reference time clock, class B",
        _limit_of_pieces(
            "G.8272 (11/2018) table 2",
            (0.1, 54.5, _PRIMARY_CLOCK_MTIE),
            (54.5, 1e5, ((40.0, 0.0),)),
        ),
        _limit_of_pieces(
            "G.8272 (11/2018) table 4",
            (0.1, 100.0, ((1.0, 0.0),)),
            (100.0, 500.0, ((0.01, 1.0),)),
            (500.0, 1e5, ((5.0, 0.0),)),
        ),
        time_error=40.0 * NS,
        source="G.8272 (11/2018) clause 6.1",
    ),
    *(
        _mask(
            f"G.8273.2-{grade}",
            f"telecom boundary or time slave clock, class {grade}, constant temperature",
            _limit_of_pieces("G.8273.2 (06/2023) table 7-4", (0.0, 1e3, ((mtie, 0.0),))),
            _limit_of_pieces("G.8273.2 (06/2023) table 7-5", (0.0, 1e3, ((tdev, 0.0),))),
            filter_hz=0.1,
            time_error=largest * NS,
            constant=constant * NS,
            source="G.8273.2 (06/2023) clause 7.1",
        )
        for grade, mtie, tdev, largest, constant in (
            ("A", 40.0, 4.0, 100.0, 50.0),
            ("B", 40.0, 4.0, 70.0, 20.0),
            ("C", 10.0, 2.0, 30.0, 10.0),
        )
    ),
)
#: Name → mask.
MASKS: Mapping[str, Mask] = MappingProxyType({mask.name: mask for mask in _MASKS})


def mask_named(name: str) -> Mask:
    """`Mask` with this name, without regard to case; raises `InputError` with a list of all names if there is none."""
    found = next((mask for key, mask in MASKS.items() if key.lower() == name.strip().lower()), None)
    if found is None:
        raise InputError(f"unknown mask {name!r}; known masks: {', '.join(MASKS)}")
    return found
