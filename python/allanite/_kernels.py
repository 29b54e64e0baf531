"""Bindings of the compiled core: array conversion and argument order, nothing else."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite import _core
from allanite.common.memory import clear_caches

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

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

# -- ranks
in_order = _core.in_order
order = _core.order

# -- play
play = _core.play

# -- noise
Simulator = _core.Simulator
power_law_bank = _core.power_law_bank
simulate = _core.simulate


# -- memory
def end_with_line(line: str, code: int) -> None:
    """Let the process print `line` and end with exit code `code` if a memory-mapped file becomes shorter.

    Only programs call this function. It handles a signal of the whole process, which a library must not change.
    """
    _core.end_with_line(line, code)


def free_buffers() -> int:
    """Return the memory that allanite keeps between calls to the operating system.

    The core keeps at most two arrays for the next call: the last simulated record and the last phase. Each array has at
    most 256 MiB. The core also keeps the plans of the transforms of the last four lengths, and the package keeps spectra
    of the effects of fitted models. Keeping them is faster than allocating and computing them again. Results that you hold
    stay valid; they compute their cached values again when needed.

    Returns
    -------
    int
        Number of bytes of the freed arrays and plans. Spectra of effects are freed too, but not counted.

    Raises nothing.

    Examples
    --------
    >>> freed = al.free_buffers()
    >>> al.free_buffers()
    0
    """
    clear_caches()
    return _core.release()


def own_process() -> None:
    """Declare that this process belongs to a program of the package: the allocator has two arenas, and `trim` works."""
    _core.own_process()


def trim() -> bool:
    """Return freed memory to the system if a program of the package owns the process; return whether it did."""
    return _core.trim()


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
    """Innovations of columns at arbitrary times under a noise model, shape (k, n), and their variances, shape (n,).

    Parameters
    ----------
    times : ndarray, shape (n,)
        Times in s.
    there : ndarray of bool, shape (n,)
        False where a sample is missing.
    columns : ndarray, shape (k, n)
        Samples of each column.
    lags : sequence of (float, float, bool)
        First-order lags: variance, rate in 1/s, and True if the samples contain the integral of the lag.
    walk : float
        Variance per s of a random walk.
    white : float
        Variance of white noise.
    """
    return _core.stamped_filter(times, there, columns, lags, walk, white)


# -- lstsq
gls_nonnegative = _core.gls_nonnegative

# -- envelope
envelope = _core.envelope
