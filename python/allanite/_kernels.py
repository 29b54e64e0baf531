"""Bindings of the compiled core: array conversion and argument order, nothing else."""

from __future__ import annotations

from allanite import _core
from allanite.common.memory import clear_caches

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


# -- process: only programs call these, because they change signals and the allocator
end_with_line = _core.end_with_line
own_process = _core.own_process
trim = _core.trim


# -- memory


def free_buffers() -> int:
    """Return to the operating system the memory that allanite keeps between calls; return the freed bytes.

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
stamped_filter = _core.stamped_filter

# -- lstsq
gls_nonnegative = _core.gls_nonnegative

# -- envelope
envelope = _core.envelope
