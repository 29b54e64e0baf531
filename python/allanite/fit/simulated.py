"""Check a fit by refitting records simulated from it: p-value of the misfit, bias and scatter of the parameters."""

from __future__ import annotations

from concurrent.futures import as_completed
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite import _kernels
from allanite.common.arrays import Array
from allanite.common.errors import InputError
from allanite.common.threads import Pool
from allanite.fit.estimates import parameter_unit
from allanite.fit.fitting import fit_model
from allanite.fit.models import parameter_label
from allanite.recording import Recording
from allanite.simulate import simulate
from allanite.spectrum import bridge_gaps

if TYPE_CHECKING:
    from collections.abc import Callable

    from allanite.effects import Effect, Parameter
    from allanite.fit.result import Fit

#: Number of threads that simulate and refit. Transforms release the interpreter lock; more threads mainly need more memory.
#: Chosen by judgment; not measured.
MAX_THREADS = 2


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedCheck:
    """Result of refitting m simulated records.

    `chi2` is χ² of the recording, and `simulated_chi2`, shape (m,), that of each replicate, fitted like the recording.
    `fitted`, `simulated` and `units` are the fitted parameters of the recording, those of the replicates, shape (m,), and
    their units, all by ``SHORT.name``.
    """

    chi2: float
    simulated_chi2: Array
    fitted: dict[str, float]
    simulated: dict[str, Array]
    units: dict[str, str]

    def __post_init__(self) -> None:
        for values in (self.simulated_chi2, *self.simulated.values()):
            values.flags.writeable = False

    @property
    def p_value(self) -> float:
        """p-value (b + 1)/(m + 1) with b of m replicates at least as large in χ² (Davison & Hinkley 1997, eq. 4.11)."""
        return float(
            (np.sum(self.simulated_chi2 >= self.chi2) + 1) / (self.simulated_chi2.size + 1)
        )

    def spread(self, name: str) -> tuple[float, float, float]:
        """Tuple (bias, standard deviation, rms error) of the fitted parameter `name` over the replicates."""
        error = self.simulated[name] - self.fitted[name]
        return float(error.mean()), float(error.std()), float(np.sqrt(np.mean(error**2)))

    def to_dict(self) -> dict[str, Any]:
        """Dict (JSON form ``allanite/simulate-check/1``) with χ², p-value, and bias and scatter of each parameter."""
        rows = {}
        for name, values in self.simulated.items():
            bias, deviation, _ = self.spread(name)
            low, high = np.quantile(values, [0.025, 0.975])
            rows[name] = {
                "value": self.fitted[name],
                "bias": bias,
                "standard_deviation": deviation,
                "simulated_95": [float(low), float(high)],
                "unit": self.units[name],
            }
        return {
            "schema": "allanite/simulate-check/1",
            "version": _kernels.version(),
            "replicates": int(self.simulated_chi2.size),
            "chi2": self.chi2,
            "p_value": self.p_value,
            "parameters": rows,
        }

    def __str__(self) -> str:
        m = self.simulated_chi2.size
        lines = [
            (
                f"{m} records simulated from the fit and refitted: χ² at least as large in "
                f"{int(np.sum(self.simulated_chi2 >= self.chi2))}, p = {self.p_value:.2g}"
            ),
            "",
            f"{'':24} {'fitted':>11} {'bias':>11} {'std. dev.':>11} {'95 % of refits':>25}",
        ]
        for name, row in self.to_dict()["parameters"].items():
            low, high = row["simulated_95"]
            lines.append(
                f"{name:24} {row['value']:11.5g} {row['bias']:11.2g} {row['standard_deviation']:11.3g} "
                f"{f'{low:.4g} … {high:.4g}':>25} {'' if row['unit'] == '1' else row['unit']}".rstrip()
            )
        return "\n".join(lines)


def simulate_check(
    fit: Fit, n: int, seed: int, progress: Callable[[int, int], None] | None
) -> SimulatedCheck:
    """`SimulatedCheck`: comparison of a fit with refits of `n` records simulated from it; see `Fit.simulate_check`.

    `InputError` for n below 1 and for a model that excludes samples.
    """
    if n < 1:
        raise InputError(
            f"n is {n}; use at least 1 replicate, or 200 for a p-value with two digits"
        )
    removing = [e for e in fit.model.modifiers if e.removes]
    if removing:
        raise InputError(f"{removing[0].kind} cannot be simulated; remove it from the model first")
    with Pool(MAX_THREADS) as pool:
        jobs = [pool.submit(_replicate, fit, seed, number) for number in range(n)]
        try:
            for done, job in enumerate(as_completed(jobs), start=1):
                job.result()
                if progress is not None:
                    progress(done, n)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    replicates = [job.result() for job in jobs]
    fitted, recording = _parameter_values(fit), fit.recording
    return SimulatedCheck(
        fit.misfit.chi2,
        np.array([chi2 for chi2, _ in replicates]),
        fitted,
        {name: np.array([values[name] for _, values in replicates]) for name in fitted},
        {
            name: parameter_unit(effect, declared.name, recording.unit, recording.covariate_units)
            for name, (effect, declared) in _free_parameters(fit).items()
        },
    )


def _replicate(fit: Fit, seed: int, number: int) -> tuple[float, dict[str, float]]:
    """Pair: χ² of the misfit, and dict of parameter values, of a fit to one record simulated from `fit`.

    `seed` and `number` select the random numbers. Missing samples of the real record are missing here, too.
    """
    recording, data = fit.recording, fit.data
    missing = np.isnan(np.asarray(recording.rate_samples(), dtype=np.float64))
    # Stream 0 of a seed is used by `fit.simulate(seed=…)`.
    twin = simulate(
        fit.model,
        n=data.n,
        rate=data.rate,
        seed=seed,
        unit=recording.unit,
        covariates=data.covariates,
        axis=1 + number,
    )
    if missing.any():
        samples = bridge_gaps(np.asarray(twin.samples), missing)
        twin = Recording(
            samples, rate=data.rate, unit=recording.unit, covariates=data.covariates or None
        )
    again = fit_model(twin, fit.model, method=fit.method)
    return again.misfit.chi2, _parameter_values(again)


def _free_parameters(fit: Fit) -> dict[str, tuple[Effect, Parameter]]:
    """Dict from name (``N``, ``GM.q_c``) to (effect, declaration) of each parameter of a fit, not held and not derived."""
    return {
        parameter_label(label, p.name): (effect, p)
        for effect, label in zip(fit.model, fit.model.labels, strict=True)
        for p in effect.parameters
        if p.role != "derived" and p.name not in effect.held
    }


def _parameter_values(fit: Fit) -> dict[str, float]:
    """Dict of the values of a fit's free numeric parameters by name; no intervals are computed."""
    return {
        name: float(value)
        for name, (effect, p) in _free_parameters(fit).items()
        if isinstance(value := effect.values[p.name], (int, float)) and not isinstance(value, bool)
    }
