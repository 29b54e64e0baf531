"""Bindings of the compiled core: array conversion and argument order, nothing else."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite import _core
from allanite.common.memory import clear_caches

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

__all__ = [
    "Accumulator",
    "Lapped",
    "Likelihood",
    "Ordinates",
    "Simulator",
    "TextReader",
    "add_rows",
    "adjacent_allan",
    "allan_covariance",
    "allan_law",
    "allan_variances",
    "averaging_factors",
    "best_courses",
    "best_pair",
    "chirp_heights",
    "cosine_transform",
    "end_with_line",
    "envelope",
    "family_variance",
    "few_arenas",
    "free_buffers",
    "gls_nonnegative",
    "in_order",
    "inverse_cosine_transform",
    "kalman_filter",
    "kalman_smooth",
    "order",
    "overlapping_allan",
    "padded_periodogram",
    "power_law_bank",
    "read_text",
    "simulate",
    "squares",
    "stamped_filter",
    "steps",
    "trim",
    "version",
]

version = _core.version

# -- spectrum
cosine_transform = _core.cosine_transform
inverse_cosine_transform = _core.inverse_cosine_transform
padded_periodogram = _core.padded_periodogram
Lapped = _core.Lapped
add_rows = _core.add_rows
best_courses = _core.best_courses
best_pair = _core.best_pair
chirp_heights = _core.chirp_heights
squares = _core.squares
steps = _core.steps
few_arenas = _core.few_arenas

# -- ranks
in_order = _core.in_order
order = _core.order

# -- noise
Simulator = _core.Simulator
power_law_bank = _core.power_law_bank
simulate = _core.simulate


# -- memory
def end_with_line(line: str, code: int) -> None:
    """Say this and end with this code where a mapped file becomes shorter; for programs, a library leaves signals alone."""
    _core.end_with_line(line, code)


def free_buffers() -> int:
    """Give the memory that is kept between calls back to the system.

    At most two arrays stay for the next call, a simulated record and the phase of one, each of less than twice the
    bytes that its last user took and of at most 256 MiB: fresh memory costs more than the sums made in it. So do plans of
    the transforms of the last four lengths, up to 2.5·10⁷ samples in all, and spectra of the effects of fitted models,
    which are not counted.
    Arrays in use are not touched; a fit made before still works and computes anew what it needs.

    Returns
    -------
    int
        Bytes given back.

    Raises nothing.

    Examples
    --------
    >>> freed = al.free_buffers()
    >>> al.free_buffers()
    0
    """
    clear_caches()
    return _core.release()


trim = _core.trim

# -- deviation
Accumulator = _core.Accumulator
adjacent_allan = _core.adjacent_allan
averaging_factors = _core.averaging_factors
family_variance = _core.family_variance
overlapping_allan = _core.overlapping_allan

# -- text
TextReader = _core.TextReader
read_text = _core.read_text

# -- covariance
Ordinates = _core.Ordinates
allan_covariance = _core.allan_covariance
allan_law = _core.allan_law
allan_variances = _core.allan_variances

# -- likelihood
Likelihood = _core.Likelihood
# -- kalman
kalman_filter = _core.kalman_filter
kalman_smooth = _core.kalman_smooth


def stamped_filter(
    times: NDArray[np.float64],
    there: NDArray[np.bool_],
    columns: NDArray[np.float64],
    lags: Sequence[tuple[float, float, bool]],
    walk: float,
    white: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return innovations of columns (k, n) at times (n,) under lags, a random walk and white noise, and their variances.

    Lags are (variance, rate in 1/s, whether the integral is seen). Where `there` is False nothing is observed.
    """
    return _core.stamped_filter(times, there, columns, lags, walk, white)


# -- lstsq
gls_nonnegative = _core.gls_nonnegative

# -- envelope
envelope = _core.envelope
