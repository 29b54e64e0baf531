"""The compiled core. Never imported by users: only `_kernels.py` imports it."""

from collections.abc import Sequence
from os import PathLike
from typing import Any, Self, final

import numpy as np
from numpy.typing import NDArray

# -- gil
def version() -> str: ...

# -- spectrum
def cosine_transform(samples: NDArray[np.float64]) -> NDArray[np.float64]: ...
def inverse_cosine_transform(ordinates: NDArray[np.float64]) -> NDArray[np.float64]: ...
def padded_periodogram(samples: NDArray[np.float64]) -> NDArray[np.float64]: ...
def best_courses(
    series: NDArray[np.float64], sections: int, step: float, most: int
) -> tuple[NDArray[np.int64], NDArray[np.float64]]: ...
def best_pair(
    score: NDArray[np.float64],
    own: NDArray[np.float64],
    waves: NDArray[np.float64],
    beside: NDArray[np.float64],
    least: int,
    floor: float,
) -> tuple[int, int, float]: ...
def in_order(values: NDArray[np.float64]) -> NDArray[np.float64]: ...
def play(values: NDArray[np.float64], width: float) -> NDArray[np.float64]: ...
def order(values: NDArray[np.float64]) -> NDArray[np.int64]: ...
def chirp_heights(
    series: NDArray[np.float64], first: float, step: float, count: int
) -> NDArray[np.float64]: ...

@final
class Lapped:
    def __new__(
        cls, after: NDArray[np.float64], before: NDArray[np.float64], taps: NDArray[np.float64]
    ) -> Self: ...
    def halved(self, x: NDArray[np.float64]) -> NDArray[np.float64]: ...
    def segments(self, x: NDArray[np.float64]) -> NDArray[np.float64]: ...
    def tiles(
        self,
        x: NDArray[np.float64],
        halved: NDArray[np.float64],
        sums: tuple[int, NDArray[np.float64], NDArray[np.float64]],
        bands: int,
        threads: int,
    ) -> tuple[NDArray[np.float64], int]: ...

def add_rows(
    high: NDArray[np.float64], low: NDArray[np.float64], rows: NDArray[np.float64]
) -> None: ...
def squares(ordinates: NDArray[np.float64], edges: NDArray[np.int64]) -> NDArray[np.float64]: ...
def steps(x: NDArray[np.float64]) -> list[float]: ...

# -- noise
def simulate(
    processes: Sequence[tuple[str, Sequence[float]]],
    n: int,
    seed: int,
    replicate: int = 0,
    axis: int = 0,
    threads: int = 0,
) -> NDArray[np.float64]: ...

@final
class Simulator:
    def __new__(
        cls,
        processes: Sequence[tuple[str, Sequence[float]]],
        seed: int,
        replicate: int,
        axis: int,
        total: int,
    ) -> Self: ...
    def next(self, n: int) -> NDArray[np.float64]: ...

def end_with_line(line: str, code: int) -> None: ...
def own_process() -> None: ...
def release() -> int: ...
def trim() -> bool: ...
def vector_unit(most: str | None = None) -> str: ...
def power_law_bank(exponent: float, n: int) -> list[tuple[float, float]]: ...

# -- deviation
@final
class Accumulator:
    def __new__(cls, per_octave: int, start: int) -> Self: ...
    def update(self, samples: NDArray[np.float64]) -> None: ...
    def merge(self, other: Accumulator, higher: float) -> None: ...
    def copy(self) -> Self: ...
    def __getnewargs__(self) -> tuple[int, int]: ...
    def __getstate__(self) -> tuple[Any, ...]: ...
    def __setstate__(self, state: tuple[Any, ...]) -> None: ...
    def samples(self) -> int: ...
    def gaps(self) -> int: ...
    def reading(self) -> list[tuple[int, int, float, int, int]]: ...

def averaging_factors(grid: str, each: int, most: int) -> NDArray[np.int64]: ...
def family_variance(
    kind: str, samples: NDArray[Any], factors: NDArray[np.int64], angle: bool, threads: int = 0
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64], int]: ...
def overlapping_allan(
    samples: NDArray[Any], factors: NDArray[np.int64], angle: bool, threads: int = 0
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64], int]: ...
def adjacent_allan(
    samples: NDArray[Any], factors: NDArray[np.int64], angle: bool, threads: int = 0
) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.float64], int]: ...

# -- text
def read_text(
    path: str | PathLike[str],
    delimiter: str | None = None,
    decimal_comma: bool | None = None,
    columns: Sequence[int] | None = None,
    finite: bool = False,
) -> tuple[list[str] | None, list[NDArray[np.float64]], dict[str, Any]]: ...

@final
class TextReader:
    def __new__(
        cls,
        path: str | PathLike[str],
        delimiter: str | None = None,
        decimal_comma: bool | None = None,
        columns: Sequence[int] | None = None,
        finite: bool = False,
    ) -> Self: ...
    @property
    def header(self) -> list[str] | None: ...
    @property
    def width(self) -> int: ...
    def select(self, columns: Sequence[int]) -> None: ...
    def sample(self, rows: int) -> tuple[list[NDArray[np.float64]], list[int], list[str]]: ...
    @property
    def meta(self) -> dict[str, Any]: ...
    def next(self, rows: int) -> NDArray[np.float64] | None: ...

# -- covariance
def allan_covariance(
    terms: Sequence[tuple[str, Sequence[float]]],
    n: int,
    factors: NDArray[np.int64],
    kind: str = "oadev",
) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...
def allan_variances(
    terms: Sequence[tuple[str, Sequence[float]]],
    n: int,
    factors: NDArray[np.int64],
    kind: str = "oadev",
) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...
def allan_law(
    terms: Sequence[tuple[str, Sequence[float]]],
    n: int,
    factor: int,
    probabilities: Sequence[float],
    kind: str = "oadev",
) -> NDArray[np.float64]: ...

@final
class Ordinates:
    def __new__(cls, j: NDArray[np.int64], n: int) -> Self: ...
    def variance(self, terms: Sequence[tuple[str, Sequence[float]]]) -> NDArray[np.float64]: ...
    def means(
        self, terms: Sequence[tuple[str, Sequence[float]]], owner: NDArray[np.int64]
    ) -> NDArray[np.float64]: ...

# -- likelihood
@final
class Likelihood:
    def __new__(
        cls, count: NDArray[np.float64], scales: NDArray[np.float64], cells: Sequence[int]
    ) -> Self: ...
    def judge(
        self, power: NDArray[np.float64], spectrum: NDArray[np.float64], scale: int | None
    ) -> tuple[float, NDArray[np.float64]]: ...
    def profile(
        self, power: NDArray[np.float64], spectra: NDArray[np.float64], scales: Sequence[int]
    ) -> NDArray[np.float64]: ...
    def best_scale(
        self,
        power: NDArray[np.float64],
        spectrum: NDArray[np.float64],
        start: int | None = None,
    ) -> tuple[int, float, NDArray[np.float64]]: ...
    def first(
        self,
        power: NDArray[np.float64],
        matrix: NDArray[np.float64],
        offset: NDArray[np.float64] | None,
    ) -> NDArray[np.float64]: ...
    def climb(
        self,
        power: NDArray[np.float64],
        matrix: NDArray[np.float64],
        theta: NDArray[np.float64],
        scale: int | None,
        offset: NDArray[np.float64] | None,
        rounds: int,
    ) -> tuple[
        NDArray[np.float64], NDArray[np.float64], float, int | None, NDArray[np.float64]
    ]: ...
    def climb_many(
        self,
        power: NDArray[np.float64],
        matrices: NDArray[np.float64],
        thetas: NDArray[np.float64],
        scale: int | None,
        rounds: int,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], list[int | None]]: ...

# -- kalman
def kalman_filter(
    samples: NDArray[np.float64],
    f: NDArray[np.float64],
    q: NDArray[np.float64],
    h: NDArray[np.float64],
    r: float,
    p0: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...
def kalman_smooth(
    samples: NDArray[np.float64],
    f: NDArray[np.float64],
    q: NDArray[np.float64],
    h: NDArray[np.float64],
    r: float,
    p0: NDArray[np.float64],
) -> NDArray[np.float64]: ...
def stamped_filter(
    times: NDArray[np.float64],
    there: NDArray[np.bool_],
    columns: NDArray[np.float64],
    lags: Sequence[tuple[float, float, bool]],
    walk: float,
    white: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...

# -- lstsq
def gls_nonnegative(
    design: NDArray[np.float64],
    target: NDArray[np.float64],
    covariance: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]: ...

# -- envelope
def envelope(
    samples: NDArray[np.float64], buckets: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...
