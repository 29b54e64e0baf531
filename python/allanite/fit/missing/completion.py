"""Complete a record with missing samples under the fitted model, and iterate the fit and the completion.

Let x be the present samples, m = E(record | x) the conditional mean of the record, and e a draw of the unknown part.
If the model is true, m + e is a record of the model (conditional simulation, Durbin & Koopman 2002). The checks over time
and over τ use m + e. The fit uses only the ordinates of m, divided by √(1 − r), where r is the share of the power of e
in the model's power. Their variance is again S for any gaps. Known functions of time appear in them with gain √(1 − r).

A model would confirm itself if the gaps were filled under it (Dempster, Laird & Rubin 1977 converge in this way: slowly,
and to the nearest maximum). Therefore a model is compared with its spectrum after the same filling: gaps mix the power
of ordinates (`shares.py`).

The model's covariance is diagonal in the ordinates (rust/spectrum.rs), so that m needs only cosine transforms. The missing
samples solve Q_mm x_m = −Q_mo x_o, Q = Cᵀ S⁻¹ C, by conjugate gradients (Stroud, Stein & Lysen 2017).
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.common.arrays import Array, runs_of
from allanite.common.threads import stop_if_unwanted
from allanite.fit.engine import solve, with_coefficients
from allanite.fit.likelihood.data import CACHE_BYTES_LOWEST, Data, without_samples
from allanite.fit.likelihood.expected import column, expected_power
from allanite.fit.likelihood.remembered import ArrayCache
from allanite.fit.likelihood.stop_band import EMPTY_BIN_FREEDOM, is_empty
from allanite.fit.likelihood.whitened import log_density_at_nodes
from allanite.fit.missing.shares import MAX_CELLS, known_ordinates, mixing_of, unknown_share

if TYPE_CHECKING:
    from allanite.effects import Model
    from allanite.fit.solution import Solution
    from allanite.spectrum import Bins

Mask = NDArray[np.bool_]

#: Maximum rounds of completion and fit. Chosen by judgment; not measured.
MAX_ROUNDS = 8
#: Maximum change of logL between rounds at which the iteration ends; bins have the weight that the discrepancy leaves them.
#: Chosen by judgment; not measured.
MAX_SETTLED_DELTA_LOGL = 0.02
#: Maximum number of draws of the unknown part, from which its share in each ordinate is estimated. Chosen by judgment; not
#: measured.
MAX_DRAWS = 8
#: Minimum number of draws of a long record. Chosen by judgment; not measured.
MIN_DRAWS = 2
#: Total number of samples in all draws, which sets the number of draws between the two limits. Chosen by judgment; not
#: measured.
DRAWN_SAMPLES = 200_000
#: Maximum number of missing samples that are solved for directly (Cholesky); more use conjugate gradients.
#: Chosen by judgment; not measured.
MAX_DIRECT_MISSING = 2048
#: Mixing between bins is neglected if gaps change the power of every bin by less than this fraction of its standard
#: error. Chosen by judgment; not measured.
MAX_NEGLECTED_MIXING = 0.01
#: Relative increases of the diagonal that are tried if rounding makes the matrix of missing samples indefinite.
#: Chosen by judgment; not measured.
DIAGONAL_INCREASES = (1e-12, 1e-10, 1e-8)
#: Relative residual at which conjugate gradients stop. Chosen by judgment; not measured.
GRADIENT_TOLERANCE = 1e-5
#: The same in the rounds of completion and fit, where each round starts from the solutions of the last one. With two
#: thirds of 100 000 samples missing, all coefficients are within 0.07 standard errors of those with 1e-5, which take twice
#: as long (benches/decisions/chosen_values.py rounds).
ROUND_TOLERANCE = 1e-3
#: Maximum steps of conjugate gradients. Chosen by judgment; not measured.
MAX_GRADIENT_STEPS = 400
#: Maximum of ½ Σ n s² (share s of the ends in a bin of n ordinates) up to which the ends are not masked. It is the ratio of
#: two relative variances of a fitted level. The two random numbers at the ends change all ordinates together and add the
#: variance 1. Independent ordinates have the variance 1/(½ Σ n s²). The value widens intervals by 5 %.
MAX_ADDED_VARIANCE = 0.1


class _ConditionalMean:
    """Solver for the conditional mean of missing samples under a spectrum.

    C is the orthonormal cosine transform of the record. The covariance of the samples is Cᵀ diag(spectrum) C, and its
    inverse is Q = Cᵀ diag(`precision`) C, with `precision` = 1/spectrum. Index m denotes the missing samples. `starts` are
    the missing samples under a similar spectrum, in the order of the calls, from which conjugate gradients start;
    `solutions` are those under this spectrum.

    Transforms take up to five times as long if the number of samples n is odd or has large prime factors. If conjugate
    gradients are used, the record therefore ends with further missing samples, up to an even length with small factors.
    `missing` and the `spectrum` have this length.
    """

    def __init__(
        self,
        missing: Mask,
        spectrum: Array,
        starts: Sequence[Array] = (),
        tolerance: float = GRADIENT_TOLERANCE,
    ) -> None:
        self.n, self.tolerance = missing.size, tolerance
        self.starts = list(starts)
        self.solutions: list[Array] = []
        self._set_spectrum(missing, spectrum)
        self.exact = _cholesky_of_missing(missing, self.precision)
        if self.exact is not None:
            return
        from scipy.fft import next_fast_len

        n = 2 * next_fast_len(-(-missing.size // 2))
        ends = np.ones(n - missing.size, dtype=bool)
        j = np.arange(n) * (missing.size / n)
        self._set_spectrum(
            np.append(missing, ends), np.interp(j, np.arange(missing.size), spectrum)
        )
        # Inside a gap of L samples only periods below 2L matter; there S is a good preconditioner for Q.
        first, end = runs_of(missing)
        lengths = (end - first).astype(float)
        typical = float((lengths**2).sum() / lengths.sum())
        slow = min(n - 1, int(n / typical))
        self.rough = np.minimum(self.spectrum, self.spectrum[max(1, slow)])

    def _set_spectrum(self, missing: Mask, spectrum: Array) -> None:
        """Set the missing samples and the spectrum, of the same length."""
        self.missing, self.spectrum = missing, spectrum
        self.at = np.flatnonzero(missing)  # numpy indexes faster by places than by a mask
        self.precision = 1.0 / spectrum
        self.precision[0] = 0.0

    def _apply(self, values: Array, weight: Array) -> Array:
        """Cᵀ diag(weight) C x at the missing samples; x is `values` there and 0 elsewhere."""
        whole = np.zeros(self.missing.size)
        whole[self.at] = values
        return self._weighted(whole, weight)

    def _weighted(self, whole: Array, weight: Array) -> Array:
        """Cᵀ diag(weight) C · `whole` at the missing samples; `whole` is a series, shape (n,)."""
        stop_if_unwanted()
        ordinates = _kernels.cosine_transform(whole)
        ordinates *= weight
        return _kernels.inverse_cosine_transform(ordinates)[self.at]

    def mean(self, samples: Array) -> Array:
        """Array of `samples` in which the missing ones are replaced by their conditional mean, shape (n,)."""
        out = np.append(samples, np.full(self.missing.size - self.n, samples[-1]))
        out[self.missing] = self._solved(-self._weighted(out, self.precision), out[self.missing])
        return out[: self.n]

    def drawn(self, rng: np.random.Generator) -> tuple[Array, Array]:
        """Pair: a random record, and it minus the conditional mean given its present samples, each of shape (n,)."""
        root = np.sqrt(self.spectrum)
        root[0] = 0.0
        draw = rng.standard_normal(root.size)
        out = np.zeros(root.size)
        # Q_mm (x_m − E x_m) = Q_mm x_m + Q_mo x_o, which is Q x at the missing samples.
        weighted = _kernels.inverse_cosine_transform(draw * np.sqrt(self.precision))
        out[self.missing] = self._solved(weighted[self.missing], np.zeros(int(self.missing.sum())))
        return _kernels.inverse_cosine_transform(draw * root)[: self.n], out[: self.n]

    def _solved(self, right: Array, given: Array) -> Array:
        """`given` plus the solution z of Q z = `right`; Q is the precision matrix of the missing samples.

        With at most 2048 missing samples, z follows from the Cholesky factor of Q, if it exists. Otherwise conjugate
        gradients are used up to a relative residual of `tolerance`, at most 400 iterations.
        They take the next of `starts` off the list and append their result to `solutions`.
        """
        if self.exact is not None:
            from scipy.linalg import cho_solve

            return np.asarray(given + cho_solve(self.exact, right))
        first = _inner(right, self._apply(right, self.rough))
        step, residual = np.zeros(right.size), right
        if self.starts:
            start = self.starts.pop(0)
            step[: start.size] = start - given[: start.size]
            residual = right - self._apply(step, self.precision)
        searched = rough = self._apply(residual, self.rough)
        size = _inner(residual, rough)
        for _ in range(MAX_GRADIENT_STEPS):
            if size <= self.tolerance**2 * first:
                break
            changed = self._apply(searched, self.precision)
            length = size / _inner(searched, changed)
            step = step + length * searched
            residual = residual - length * changed
            rough = self._apply(residual, self.rough)
            size, before = _inner(residual, rough), size
            searched = rough + (size / before) * searched
        self.solutions.append((given + step)[: int(self.missing[: self.n].sum())])
        return np.asarray(given + step)


def _inner(a: Array, b: Array) -> float:
    """Inner product of two vectors, without BLAS: starting its threads for each product takes longer on busy processors."""
    return float(np.einsum("i,i", a, b))


def _cholesky_of_missing(missing: Mask, precision: Array) -> tuple[Array, bool] | None:
    """Cholesky factor of the precision matrix of the missing samples, as `scipy.linalg.cho_factor` returns it.

    None if more than 2048 samples are missing, or if rounding makes the matrix indefinite even with a slightly raised
    diagonal.
    """
    from scipy.linalg import LinAlgError, cho_factor

    at = np.flatnonzero(missing)
    if at.size > MAX_DIRECT_MISSING:
        return None
    n = missing.size
    waves = np.fft.rfft(np.concatenate([precision, [0.0], precision[:0:-1]])).real / (2 * n)
    waves = np.concatenate([waves, waves[-2:0:-1]])
    matrix = waves[np.abs(at[:, None] - at)] + waves[at[:, None] + at + 1]
    own = matrix.diagonal().copy()
    for more in (0.0, *DIAGONAL_INCREASES):
        # The matrix is positive definite except for rounding: some samples are present, which fixes the mean.
        np.fill_diagonal(matrix, own * (1.0 + more))
        with suppress(LinAlgError):
            return cho_factor(matrix, lower=True)
    return None


def _seen_part(
    bridge: _ConditionalMean, spectrum: Array, gain: Array, signal: Array
) -> tuple[Array, float]:
    """Pair: `signal` with its missing samples replaced by their conditional mean, and a ratio of information.

    The ratio is the information that the present samples contain about the height of the signal, divided by that of its
    ordinates multiplied by `gain`. (`signal`, 1) if the latter change logL by less than 0.02 nats.
    """
    precision = 1.0 / spectrum
    precision[0] = 0.0
    assumed = float((gain * _kernels.cosine_transform(signal)) ** 2 @ precision)
    if 0.5 * assumed < MAX_SETTLED_DELTA_LOGL:
        return signal, 1.0
    known = bridge.mean(np.where(bridge.missing[: bridge.n], 0.0, signal))
    return known, float(_kernels.cosine_transform(known) ** 2 @ precision) / assumed


def information_ratio(data: Data, solution: Solution) -> float:
    """Information of the present samples about the height of the last effect, a known function, over that of the fit.

    The fit multiplies the ordinates of a function by `Data.gain`, which depends on the frequency alone. Gaps of a length
    similar to that of the function hide more or less of it. 1 if no missing sample is completed.
    """
    if data.missing is None or data.gain is None:
        return 1.0
    spectrum = _spectrum(data, solution.model, solution.level)
    bridge = _ConditionalMean(data.missing, spectrum, (), ROUND_TOLERANCE)
    return _seen_part(bridge, spectrum, data.gain, data.signal(solution.model.deterministic[-1:]))[
        1
    ]


def _spectrum(data: Data, model: Model, level: Array | None) -> Array:
    """Array of the spectrum of a model, multiplied by `level` in each bin, at all ordinates, U² per sample, shape (n,)."""
    at, known = log_density_at_nodes(model, data, level)
    log_j = np.log(np.maximum(np.arange(data.n, dtype=np.float64), 1.0))
    return np.asarray(np.exp(np.interp(log_j, at, known)))


def complete(
    data: Data, model: Model, level: Array | None = None, starts: tuple[Array, ...] | None = None
) -> Data:
    """`Data` of the record with its missing samples completed under a model with values.

    Missing samples are random draws given the present ones. Ordinates are those of the conditional mean, scaled to the
    variance of the model; `gain` is the inverse of this scale. `mixing` and the degrees of freedom of the bins state what
    the gaps leave known.

    `level`, shape (bins,), is the estimated ratio of true to modeled power (`Solution.level`). With it, the completed
    record contains effects that the model lacks. `starts` are the `Data.completions` of the last completion of this record,
    from which this one starts; conjugate gradients then stop at `ROUND_TOLERANCE`.
    """
    missing = data.missing
    assert missing is not None
    spectrum = _spectrum(data, model, level)
    signal = data.signal(model.deterministic) if model.deterministic else np.zeros(data.n)
    near = list(starts or ())
    near[:1] = [s - signal[missing] for s in near[:1]]
    tolerance = GRADIENT_TOLERANCE if starts is None else ROUND_TOLERANCE
    bridge = _ConditionalMean(missing, spectrum, near, tolerance)
    mean = bridge.mean(data.samples - signal)
    unknown, unseen, seen = _drawn_unknown_part(bridge)
    drawn = None if data.n <= MAX_CELLS else (unseen, seen)
    share = unknown_share(missing, spectrum, drawn, data.bins)
    gain, completions = np.sqrt(1.0 - share), tuple(bridge.solutions)
    if data.completed_signal is not None:
        change = signal - data.completed_signal
        known, ratio = _seen_part(bridge, spectrum, gain, change)
        # The fit overestimates the change by this ratio.
        excess = 1.0 - 1.0 / max(ratio, 1.0)
        mean, signal = mean + excess * known, signal - excess * change
    samples = mean + signal + unknown
    ordinates = _kernels.cosine_transform(mean) / gain + gain * _kernels.cosine_transform(signal)
    bins, mixing = _bins_and_mixing(data, model, missing, share)
    return replace(
        data,
        samples=samples,
        ordinates=ordinates,
        bins=bins,
        gain=gain,
        mixing=mixing,
        completions=tuple((mean + signal)[missing] for _ in completions[:1]) + completions[1:],
        completed_signal=signal,
        of_bins=ArrayCache(CACHE_BYTES_LOWEST),
    )


def _bins_and_mixing(
    data: Data, model: Model, missing: Mask, share: Array
) -> tuple[Bins, Array | None]:
    """Pair: bins with the degrees of freedom that missing samples leave, and `Data.mixing` (None if it is negligible).

    `share` is the unknown share of the power of each ordinate.
    """
    mixing = mixing_of(missing, share, data.bins)
    # The information of all bins about the power in one is Σ (δ − c)² = seen × mixing; bins with common power share it.
    count = known_ordinates(share, data.bins) * mixing.diagonal() / (mixing**2).sum(axis=0)
    power = column(data.terms(model), replace(data, mixing=None))
    mixing *= np.outer(power, 1.0 / power)
    number = np.diff(data.bins.edges)
    unknown_part = 1.0 - known_ordinates(share, data.bins) / number
    few = bool((unknown_part * np.sqrt(0.5 * number) < MAX_NEGLECTED_MIXING).all())
    count = np.where(is_empty(data.bins), EMPTY_BIN_FREEDOM * count, count)
    return replace(data.bins, count=count), None if few else mixing


def _drawn_unknown_part(bridge: _ConditionalMean) -> tuple[Array, Array, Array]:
    """Tuple (unknown, power of unknown, power of known), each of shape (n,), from random records.

    `unknown` is the last drawn record minus its conditional mean given the present samples. The powers are squared cosine
    transforms of this difference and of the mean, averaged over the records. The seed is fixed.
    """
    n = bridge.n
    rng = np.random.default_rng(0)
    unknown, unseen, seen = np.zeros((3, n))
    draws = 1 if n <= MAX_CELLS else min(MAX_DRAWS, max(MIN_DRAWS, DRAWN_SAMPLES // n))
    for _ in range(draws):
        whole, unknown = bridge.drawn(rng)
        unseen += _kernels.cosine_transform(unknown) ** 2 / draws
        seen += _kernels.cosine_transform(whole - unknown) ** 2 / draws
    return unknown, unseen, seen


def _max_logl_loss(count: Array, one: Array, other: Array) -> float:
    """Upper bound, nats, on the loss of logL if the bin power `one` is used as the spectrum of a record with power `other`.

    The bound is ½ Σ count·ln²(one/other). It is twice the loss for small differences, and holds for ratios below 6.
    """
    return 0.5 * float(count @ np.log(one / other) ** 2)


def _raised_level(solution: Solution) -> Array:
    """Array of the ratio of true to modeled power in each bin, at least 1: power that the model lacks, shape (bins,).

    A lower level would confirm itself: with little power in a bin, its present samples say little about the missing ones,
    and the next estimate is lower still.
    """
    return np.maximum(solution.level, 1.0)


def is_still_complete(data: Data, before: Solution, after: Solution) -> bool:
    """True if completing the missing samples again, now under the fit `after`, would change logL by less than 0.02 nats.

    `before` is the fit under which the missing samples of `data` were completed; False if they were not. Two changes of the
    power of a bin are added. The first is r·ln(ratio of the spectra) with the unknown share r of the bin. The second is the
    power of effects that only one of the fits has: in missing samples, it acts like white noise.
    """
    if data.gain is None:
        return data.missing is None
    number = np.diff(data.bins.edges)
    unknown = 1.0 - np.add.reduceat(data.gain**2, data.bins.edges[:-1]) / number
    old, new = (fit.spectrum * _raised_level(fit) for fit in (before, after))
    lacking = number @ (np.abs(new - old) + np.abs(after.power - before.power)) / data.n
    change = unknown * np.abs(np.log(new / old)) + data.lost * lacking / new
    return 0.5 * float(after.weight @ change**2) < MAX_SETTLED_DELTA_LOGL


def complete_and_fit(
    data: Data, model: Model, start: Solution | None = None
) -> tuple[Data, Solution]:
    """Pair (data, solution): record whose missing samples are drawn from the model fitted to it, and this fit.

    Each round draws the missing samples and fits again. At most 8 rounds are made, until one changes logL by less than 0.02
    nats. If the fit then has a discrepancy, up to 8 rounds follow whose draws have the power estimated in each bin instead
    of that of the model. They also end with a round that changes logL by over half as much as the one before. `start` is a
    fit to `data` that were completed under another model.
    """
    known = all(
        value is not None
        for effect in model
        for name, value in effect.values.items()
        if not effect.parameter(name).optional
    )
    if start is None and known and model.stochastic:
        data = complete(data, model, starts=())
    solution = start or solve(data, model)
    # First complete by the model alone, then with the estimated level of each bin. If the levels were used from the
    # start, every first guess would confirm itself where regular gaps alias frequencies.
    for trusting in (True, False):
        last = np.inf
        theta = solution.theta
        for _ in range(MAX_ROUNDS):
            level = None if trusting else _raised_level(solution)
            before = solution.spectrum if level is None else solution.spectrum * level
            now = with_coefficients(solution.model, theta)
            completed = complete(data, now, level, data.completions)
            if data.gain is not None:
                loss = _max_logl_loss(solution.weight, data.power, completed.power)
                if loss < MAX_SETTLED_DELTA_LOGL:
                    break
            data = completed
            # Search free shapes again: their first values may describe the bridged gaps.
            solution = solve(data, model if trusting else solution.model)
            after = solution.spectrum * (1.0 if level is None else _raised_level(solution))
            moved = _max_logl_loss(solution.weight, before, after)
            slow = moved >= 0.5 * last
            # Levels that gaps hide confirm themselves and drift.
            if moved < MAX_SETTLED_DELTA_LOGL or (slow and not trusting):
                break
            # If two models alternate, continue from their mean.
            theta = 0.5 * (theta + solution.theta) if slow else solution.theta
            last = moved
        if not solution.discrepancy:
            break
    return data, solution


def without_ends(data: Data, solution: Solution) -> Data | None:
    """Copy of the data with the first and last sample masked; None if leakage from the ends of the record is negligible.

    A counter outputs differences x_k = p_{k+1} − p_k of a phase with white noise. Each ordinate contains ±p_n − p_0, in
    addition to the differenced phase noise, which falls toward low frequencies. If nothing else exceeds them, hundreds of
    the lowest ordinates show only these two random numbers. The ordinates are then not independent, and two large or small
    numbers can imitate an effect. The two numbers affect only the first and the last sample. Without these samples the
    ordinates are exactly independent, and weaker low-frequency noise becomes visible.

    Leakage is negligible if ½ Σ n s² ≤ 0.1, summed over bins. Here n is the degrees of freedom of a bin, and s is the part
    of its expected power that is leakage.
    """
    if not data.whole or data.ends_missing:
        return None
    if all(term.inside is term for term in data.terms(solution.model)):
        return None
    whole, inside = (
        expected_power(solution.model, data, ends_missing) for ends_missing in (False, True)
    )
    share = 1.0 - inside / np.maximum(whole, 1e-300)
    if 0.5 * float(data.bins.count @ share**2) <= MAX_ADDED_VARIANCE:
        return None
    ends = np.zeros(data.n, dtype=bool)
    ends[[0, -1]] = True
    return without_samples(data, ends)
