"""Kalman filter over a recording: innovations, the part of each sample that the model does not predict."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite import _kernels
from allanite.common.arrays import Array
from allanite.common.documents import rows_of
from allanite.common.errors import InputError, TooShortError
from allanite.common.validation import require_recording
from allanite.effects import Effect, Model, as_model
from allanite.recording import Recording
from allanite.statespace.model import StateSpace, state_space

if TYPE_CHECKING:
    from allanite.fit.result import Fit

#: 95 % quantile of χ² with one degree of freedom.
CHI2_95 = 3.841458820694124
#: Number of lags, in samples, of the whiteness test.
WHITENESS_LAGS = 20


@dataclass(frozen=True, slots=True)
class NisByTau:
    """Normalized innovations of means over τ: expectation 1, with the 95 % band for a true model.

    `nis`, shape (k,), is the mean of (Σ z)²/m over segments of m samples, z = innovation / standard deviation. `low` and
    `high` hold 95 % of white sequences; `tau` is in s.
    """

    tau: Array
    nis: Array
    low: Array
    high: Array


@dataclass(frozen=True, eq=False)
class Innovations:
    """Innovations of a recording under a model.

    Attributes
    ----------
    values : ndarray, shape (n,)
        Sample minus its prediction from all samples before, in the recording's unit; NaN for a missing sample and for
        the first one, which determines the level.
    variances : ndarray, shape (n,)
        Variance of each innovation according to the model.
    space : StateSpace
        The filter.
    recording : Recording

    Examples
    --------
    >>> model = al.parse_model("N(N=0.1)+K(K=0.01)")
    >>> found = al.innovations(model.simulate(duration=500, rate=10, seed=1), model)
    >>> bool(abs(found.mean_nis - 1) < 4 * (2 / found.n) ** 0.5)
    True
    >>> found.to_dict()["schema"]
    'allanite/innovations/1'
    """

    values: Array
    variances: Array
    space: StateSpace
    recording: Recording

    @cached_property
    def nis(self) -> Array:
        """Normalized innovation squared (innovation² / its variance) of each sample, shape (n,); NaN as in `values`.

        Its expectation is 1 if the model is true.
        """
        return self.values**2 / self.variances

    @cached_property
    def n(self) -> int:
        """Number of innovations that are not NaN."""
        return int(np.count_nonzero(~np.isnan(self.values)))

    @property
    def log_likelihood(self) -> float:
        """Exact Gaussian log-likelihood of the samples given the first, in nats."""
        there = ~np.isnan(self.values)
        return float(-0.5 * np.sum(np.log(2.0 * np.pi * self.variances[there]) + self.nis[there]))

    @property
    def mean_nis(self) -> float:
        """Mean of the normalized innovations squared. If the model is true, it is about 1; its standard error is √(2/n)."""
        return float(np.nanmean(self.nis))

    @property
    def coverage(self) -> float:
        """Share of the values in `nis` below the 95 % quantile of χ²₁; about 0.95 for a true model."""
        there = self.nis[~np.isnan(self.nis)]
        return float(np.mean(there <= CHI2_95))

    @cached_property
    def whiteness(self) -> float:
        """p-value of the test that the innovations are uncorrelated (Ljung & Box 1978, 20 lags)."""
        from scipy.special import chdtrc

        there = ~np.isnan(self.values)
        z = np.where(there, self.values, 0.0) / np.sqrt(self.variances)
        power = float(z @ z)
        statistic = 0.0
        for lag in range(1, WHITENESS_LAGS + 1):
            pairs = int(np.count_nonzero(there[lag:] & there[:-lag]))
            if pairs:
                # (n + 2)/(n − lag) of a whole record is 1 over the share of pairs that are there.
                rho = float(z[lag:] @ z[:-lag]) / power * self.n / pairs
                statistic += pairs * rho**2
        return float(chdtrc(WHITENESS_LAGS, statistic))

    @cached_property
    def by_tau(self) -> NisByTau:
        """`NisByTau`: the normalized innovation squared of means over τ, with its 95 % range for a true model.

        τ goes from one sample to a tenth of the record, with two values per octave.
        """
        from scipy.special import chdtri

        z = self.values / np.sqrt(self.variances)
        top = max(1, z.size // 10)
        factors = np.unique(np.round(np.geomspace(1, top, 2 * int(np.log2(top)) + 1)).astype(int))
        found, low, high = [], [], []
        for m in factors:
            groups = z[: z.size // m * m].reshape(-1, m)
            there = np.count_nonzero(~np.isnan(groups), axis=1)
            groups, there = groups[there > 0], there[there > 0]
            found.append(float(np.mean(np.nansum(groups, axis=1) ** 2 / there)))
            k = len(there)
            low.append(float(chdtri(k, 0.975)) / k)
            high.append(float(chdtri(k, 0.025)) / k)
        return NisByTau(
            factors / self.recording.rate, np.array(found), np.array(low), np.array(high)
        )

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON, schema ``allanite/innovations/1``."""
        by_tau = self.by_tau
        return {
            "schema": "allanite/innovations/1",
            "recording": self.recording.describe(),
            "states": self.space.states,
            "n": self.n,
            "log_likelihood": self.log_likelihood,
            "mean_nis": self.mean_nis,
            "coverage_95": self.coverage,
            "whiteness_p_value": self.whiteness,
            "nis": rows_of(tau_s=by_tau.tau, nis=by_tau.nis, low=by_tau.low, high=by_tau.high),
        }

    def __str__(self) -> str:
        spread = 1.96 * np.sqrt(2.0 / self.n)
        mean = f"mean NIS {self.mean_nis:.4f} (95 % {1 - spread:.4f} to {1 + spread:.4f})"
        lines = [
            f"{self.n} innovations with {self.space.states} states: log-likelihood {self.log_likelihood:.6g}",
            f"{mean}, {100 * self.coverage:.2f} % below the 95 % point, whiteness p {self.whiteness:.2g}",
            f"{'τ / s':>10}{'NIS':>10}{'95 % expected':>20}",
        ]
        b = self.by_tau
        for t, v, lo, hi in zip(b.tau, b.nis, b.low, b.high, strict=True):
            mark = "" if lo <= v <= hi else "  !"
            lines.append(f"{t:10.4g}{v:10.3f}{lo:11.3f} to {hi:.3f}{mark}")
        return "\n".join(lines)

    def __repr__(self) -> str:
        return f"Innovations({self.n}, mean NIS {self.mean_nis:.4f})"


def innovations(
    recording: Recording, model: Model | Effect | str | Fit, *, states: int | None = None
) -> Innovations:
    """Innovations of a recording: each sample minus its prediction by a Kalman filter with the model.

    Parameters
    ----------
    recording : Recording
        One column; missing samples are predicted and skipped.
    model : Model, Effect, Fit or str
        Model with all values, in the unit of the recording. Known functions of time are subtracted; lines are states of
        unknown phase; samples that effects exclude count as missing.
    states : int, optional
        Largest number of states; `state_space` reduces the model to it.

    Returns
    -------
    Innovations

    Raises
    ------
    InputError
        A value or a covariate of the model is missing, or the model has a noise level that changes over time.
    TooShortError
        Fewer than two samples.

    References
    ----------
    Durbin, J. & Koopman, S. J. (2012). Time series analysis by state space methods, 2nd edition. Oxford.

    Examples
    --------
    With half of the noise the filter trusts itself too much:

    >>> x = al.AngleRandomWalk(N=0.1).simulate(duration=500, rate=10, seed=1)
    >>> print(round(al.innovations(x, al.AngleRandomWalk(N=0.05)).mean_nis))
    4
    """
    require_recording(recording)
    model = as_model(model)
    samples = np.array(recording.rate_samples(), dtype=np.float64)
    n, rate = samples.size, recording.rate
    for effect in model.modifiers:
        if effect.changes_level:
            raise InputError(
                f"{effect.kind} changes R during the record: trim the recording to before or after the change"
            )
        if effect.removes:
            samples[effect.missing(n, rate)] = np.nan
    time = np.arange(n) / rate
    covariates = {k: np.asarray(v, dtype=np.float64) for k, v in recording.covariates.items()}
    for known in model.deterministic:
        if not known.periodic:
            samples -= known.signal(time, covariates)
    there = ~np.isnan(samples)
    if np.count_nonzero(there) < 2:
        raise TooShortError("innovations need at least 2 samples")
    samples -= samples[there].mean()
    space = state_space(model, rate, states=states, duration=n / rate).with_level()
    values, variances = filter_samples(samples, space)
    values[np.flatnonzero(there)[0]] = np.nan
    return Innovations(values, variances, space, recording)


def filter_samples(samples: Array, space: StateSpace) -> tuple[Array, Array]:
    """Tuple (innovations of the samples, their variances), each of shape (n,).

    A missing sample (NaN) has the innovation NaN and a finite variance.
    """
    return _kernels.kalman_filter(np.ascontiguousarray(samples), *matrices(space))


def smooth_samples(samples: Array, space: StateSpace) -> Array:
    """Smoothed samples H E[s | all samples], without the white part R, plus the mean of the samples, shape (n,).

    For a missing sample, this is the expected sample. To draw missing samples given the others: draw a whole record
    from the model, smooth (samples − draw), and add the draw (Durbin & Koopman 2002).
    """
    there = ~np.isnan(samples)
    mean = float(samples[there].mean()) if there.any() else 0.0
    return _kernels.kalman_smooth(np.ascontiguousarray(samples - mean), *matrices(space)) + mean


def matrices(space: StateSpace) -> tuple[Array, Array, Array, float, Array]:
    """Tuple (F, Q, H, R, P0) for the compiled filter: H is a vector of shape (d,), R is a float."""
    return space.F, space.Q, space.H[0], float(space.R[0, 0]), space.P0
