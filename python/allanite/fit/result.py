"""Fit result: estimates, uncertainties, goodness of fit."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from allanite import _kernels
from allanite.common.arrays import Array
from allanite.common.files import write_text
from allanite.common.former import Former, warn_of_former_name
from allanite.common.parameters import Estimate
from allanite.common.showing import html_list, html_table
from allanite.effects.files import held_and_limits
from allanite.fit import curve as _curve
from allanite.fit.covariance import Correlations, correlations, degeneracies, fitted_freedom
from allanite.fit.estimates import estimates
from allanite.fit.likelihood.data import Data, prepare
from allanite.fit.likelihood.discrepancy import (
    expected_saturated_gain,
    marginal_likelihood,
    scale_interval,
)
from allanite.fit.likelihood.stop_band import empty_ranges
from allanite.fit.likelihood.whittle import normal_scores
from allanite.fit.measures import MIN_ADEQUATE_P, Discrepancy, Error, Misfit
from allanite.fit.missing.completion import complete
from allanite.fit.models import without_effect
from allanite.fit.prediction import predict
from allanite.fit.rivals.alternatives import Alternative, Rivals, alternatives, rivals
from allanite.fit.rivals.pairs import Pair, alternative_pairs, alternatives_to_pairs
from allanite.fit.table import fit_table, method_text, misfit_line, parameter_rows
from allanite.recording.distorted import DISTORTIONS
from allanite.recording.sensor_names import kind_of_sensor

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from allanite.effects import Effect, Model
    from allanite.fit.methods import MethodTable
    from allanite.fit.simulated import SimulatedCheck
    from allanite.fit.solution import Solution
    from allanite.plots import Figure
    from allanite.recording import Recording
    from allanite.simulate import SimulationOptions
    from allanite.statespace import StateSpace
    from allanite.suggestion import Check, Suggestion
    from allanite.summary import Summary


@dataclass(frozen=True, eq=False)
class Fit:
    """A model fitted to a recording.

    Attributes
    ----------
    recording : Recording
        The recording, one column.
    model : Model
        The model with fitted values.
    method : str
        ``whittle``, ``gls`` or ``lines``.

    Examples
    --------
    >>> truth = al.parse_model("N(N=0.1)+K(K=0.01)")
    >>> fit = al.parse_model("N").fit(truth.simulate(duration=1000, rate=10, seed=1, unit="deg/s"))
    >>> better = fit.add(al.RateRandomWalk())
    >>> fit.adequate, better.adequate, better.check().adequate, better.remove(1).model.name
    (False, True, True, 'N')
    >>> fit.text_of(fit.model.effects[0], "looks_like")
    'a slope of −½; a flat density'
    >>> better["K"].unit, better.display_name(better.model.effects[1])
    ('deg/s/s^½', 'rate random walk')
    >>> list(better.estimates_of("K"))
    ['K']
    >>> better.alternatives(0), better.alternative_pairs(0), better.simulate_check(n=3, seed=1).simulated_chi2.shape
    ((), (), (3,))
    >>> print(better.text_of(better.model.effects[0], "looks_like"))
    a slope of −½; a flat density
    >>> better.compare_methods()["N"].name, better.summary() == str(better), better.body()["model"]
    ('N', True, 'N+K')
    >>> better.simulate(duration=60, seed=1).n, better.state_space().states
    (600, 1)
    >>> [piece.n for piece in better.simulate_chunks(duration=60, seed=1, size=400)]
    [400, 200]
    >>> better.save("fit.json")  # better.to_dict() as JSON
    >>> al.parse_model("fit.json").name == better.to_dict()["model"]
    True
    >>> figure = better.plot("fit.svg")
    """

    recording: Recording | Summary
    model: Model
    method: str
    data: Data
    solution: Solution
    given: tuple[dict[str, Any], ...] | None = None

    @cached_property
    def estimates(self) -> tuple[dict[str, Any], ...]:
        """Tuple of a dict for each effect of the model, from parameter name to value.

        Numbers are `Estimate` with standard error and interval; tuples, texts and None are plain values.
        """
        if self.given is not None:
            return self.given
        return estimates(self.solution, self.data, self.recording)

    @cached_property
    def correlations(self) -> Correlations:
        """`Correlations` of the fitted parameters of random effects (by the Whittle likelihood)."""
        return correlations(self.solution, self.data)

    @property
    def degeneracies(self) -> list[str]:
        """List of a sentence for each correlation time or pair of parameters that this record cannot determine."""
        return degeneracies(self.correlations, self.model, self.data)

    @property
    def not_judged(self) -> list[tuple[float, float]]:
        """List of frequency bands (low, high), Hz, that the fit ignores because a filter left almost no power there."""
        return empty_ranges(self.data.bins, self.data.rate)

    @cached_property
    def z(self) -> Array:
        """Array of the standard normal scores of the spectral bins, shape (bins,).

        A score is positive where the measured power exceeds the model.
        """
        s = self.solution
        return normal_scores(s.power, s.count, s.spectrum)

    @cached_property
    def misfit(self) -> Misfit:
        """`Misfit`: χ² goodness of fit of the spectrum, from the normal scores of groups of bins (ten per decade)."""
        from scipy.special import chdtrc

        s, groups = self.solution, self.data.bins.groups
        total = np.add.reduceat(s.count, groups)
        ratio = np.add.reduceat(s.count * s.power / s.spectrum, groups) / total
        z = normal_scores(ratio, total, np.ones(total.size))
        chi2 = float(z @ z)
        dof = max(1, round(np.count_nonzero(z) - fitted_freedom(s, self.data)))
        return Misfit(chi2, dof, float(chdtrc(dof, chi2)))

    @cached_property
    def curve(self) -> _curve.Curve:
        """`Curve`: measured and modeled Allan deviation."""
        return _curve.compare_curves(self.data, self.model)

    @cached_property
    def band(self) -> _curve.DeviationBand:
        """`DeviationBand`: 95 % band of the measured Allan deviation if the model is true, at each τ and simultaneous."""
        return _curve.deviation_band(self.data, self.model, self.curve)

    @cached_property
    def error(self) -> Error:
        """`Error`: error of the Allan deviation and predictive score, by which steps of model building are compared."""
        cleaned = any(e.removes for e in self.model.modifiers)
        raw: Data | None = prepare(self.recording) if cleaned else None
        if raw is not None and raw.missing is not None:
            raw = complete(raw, self.model, self.solution.level)
        curve = self.curve
        predictive = predict(self.data, self.solution, raw)
        return Error(curve.rms_percent, curve.worst, curve.expected_scatter_percent, predictive)

    @cached_property
    def discrepancy(self) -> Discrepancy:
        """`Discrepancy`: model discrepancy δ in % of the deviation, and 95 % interval.

        0 if the data do not contradict the model.
        """
        s = self.solution
        low, high = scale_interval(s.power, s.count, s.spectrum, s.scale)
        # δ refers to ln power; ln deviation has half of it.
        return Discrepancy(50.0 * self.solution.discrepancy, (50.0 * low, 50.0 * high))

    excess = Former("unexplained_misfit")

    @property
    def unexplained_misfit(self) -> float:
        """Unexplained misfit, nats: logL of the saturated model minus that of this model, minus its mean for a true model.

        It may be negative.
        """
        s = self.solution
        best = float(-0.5 * s.count @ (np.log(s.power) + 1.0))
        plain, _ = marginal_likelihood(s.power, s.count, s.spectrum, s.scale)
        return best - plain - expected_saturated_gain(s.count)

    @property
    def adequate(self) -> bool:
        """True if the χ² of the spectrum and the Allan curve do not contradict the model, and it needs no discrepancy.

        False for values with a `distortion`.
        χ² is tested at 0.1 % on either side, the Allan curve at 0.2 %. A discrepancy is a fitted model error (see
        `discrepancy`). Missing effects are not searched; see `check`.
        """
        misfit = self.misfit
        agrees = misfit.p_value >= MIN_ADEQUATE_P and not (misfit.is_too_small or self.distortion)
        return agrees and not self.solution.discrepancy and not self.curve.contradicts_model

    @property
    def distortion(self) -> str:
        """Finding of the audit about a dead zone or dead band, which no noise model describes; empty without one."""
        found = (f.found for f in self.recording.audit if f.kind in DISTORTIONS)
        return next(found, "")

    @property
    def limited_by_quantization(self) -> bool:
        """True if the recording's audit warns of so few codes that the coefficients of any model are biased."""
        return any(
            f.kind == "quantisation" and f.severity == "warning" for f in self.recording.audit
        )

    def __getitem__(self, name: str) -> Estimate:
        """Estimate by parameter name (``N``), or by effect and parameter (``GM.q_c``, ``SIN2.frequency``).

        The first match is returned; a missing name raises `KeyError`. Two former uses return other types, and warn: the
        name of an effect (``GM``) returns the dict of its values (use `estimates_of`), and a parameter that is no number
        (``BW.acts_on``) returns its plain value (use `estimates`).
        """
        key, _, parameter = name.partition(".")
        # Values of former uses have another type, which type checkers need not accept.
        found: Any
        for place, (labels, values) in enumerate(self._labeled_values()):
            if parameter and key not in labels:
                continue
            searched = parameter or key
            if searched in values:
                found = values[searched]
                if not isinstance(found, Estimate):
                    warn_of_former_name(f"fit[{name!r}]", f"fit.estimates[{place}][{searched!r}]")
                return found
            if not parameter and key in labels:
                warn_of_former_name(f"fit[{name!r}]", f"fit.estimates_of({name!r})")
                found = values
                return found
        raise KeyError(f"{name!r} is not in the fit (it has: {self._known_names()})")

    def estimates_of(self, effect: str) -> dict[str, Estimate]:
        """Dict from parameter name to `Estimate` of the effect named ``GM``, ``SIN2`` or by its kind.

        Parameters that are no numbers are omitted. `KeyError` for an effect that is not in the model.
        """
        for labels, values in self._labeled_values():
            if effect in labels:
                return {name: v for name, v in values.items() if isinstance(v, Estimate)}
        raise KeyError(f"{effect!r} is not in the fit (it has: {self._known_names()})")

    def _labeled_values(self) -> Iterator[tuple[set[str], dict[str, Any]]]:
        """Iterator over one pair for each effect: set of names that select the effect, and dict of its values by name."""
        seen: dict[str, int] = {}
        for effect, values in zip(self.model.effects, self.estimates, strict=True):
            seen[effect.short] = seen.get(effect.short, 0) + 1
            number = seen[effect.short]
            labels = {f"{effect.short}{number}", f"{effect.kind}{number}"}
            if number == 1:
                labels |= {effect.short, effect.kind}
            yield labels, values

    def _known_names(self) -> str:
        """Text of all names of effect and parameter: ``N.N GM.q_c GM.correlation_time``."""
        return " ".join(
            f"{e.short}.{p}" for e, v in zip(self.model, self.estimates, strict=True) for p in v
        )

    def display_name(self, effect: Effect) -> str:
        """Name of an effect for this kind of sensor, e.g. "velocity random walk" for N of an accelerometer."""
        return effect.name_for(self.sensor)

    def text_of(self, effect: Effect, name: str) -> str:
        """Text (str) that describes an effect for this kind of sensor; `name` is "physics", "looks_like" or "check_by"."""
        return effect.text_for(name, self.sensor)

    @property
    def sensor(self) -> str:
        """Kind of the sensor: "angular rate", "acceleration", "magnetic field" or "fractional frequency".

        It follows from the unit, and for a pure number from the name of the column. An unknown unit counts as the last.
        """
        return kind_of_sensor(self.recording.columns[0], self.recording.unit)

    def alternatives(self, place: int) -> tuple[Alternative, ...]:
        """Tuple of `Alternative` fits in which another effect replaces the effect at index `place` of the model; cached."""
        return alternatives(self, place)

    together = Former("alternative_pairs")

    def alternative_pairs(self, place: int) -> tuple[Pair, ...]:
        """Tuple of `Pair`, the highest evidence first: two effects that may replace the one at index `place`; cached."""
        return alternative_pairs(self, place)

    instead_of_two = Former("alternatives_to_pairs")

    @property
    def alternatives_to_pairs(self) -> tuple[tuple[float, tuple[int, int], Solution], ...]:
        """Tuple of (ln evidence minus that of this fit, indices, solution) of models without two of its slow processes.

        One or two processes of other kinds replace the two. `indices` (int, int) are the places of the replaced effects
        in this fit's model. Models whose evidence is lower by 3 nats or more are omitted. Cached.
        """
        return alternatives_to_pairs(self)

    @cached_property
    def kept(self) -> dict[str, dict[tuple[Any, ...], Any]]:
        """Dict of the results that searches keep with this fit (`kept_with_fit`), by function and arguments."""
        return {}

    def check(self, on_progress: Callable[[int, int], None] | None = None) -> Check:
        """`Check` of the model: where it fails, and which effects are missing.

        Parameters
        ----------
        on_progress : callable, optional
            Called with (number of finished screens, number of screens).
        """
        import allanite as al

        return al.suggestion.check_fit(self, on_progress)

    def add(self, addition: Effect | Suggestion) -> Fit:
        """New `Fit` of the model plus an `addition`: an effect, or a suggestion of a check. This fit is not changed.

        Values of an effect are start values. For a suggestion of this fit, the fit starts from the suggested model. That
        model may lack effects that the suggestion replaces. Of a suggestion of another fit, only its effect is added.
        """
        import allanite as al

        if not isinstance(addition, al.suggestion.Suggestion):
            return self._fit_again(self.model + addition)
        if addition.before is self:
            return self._fit_again(addition.found.model)
        return self._fit_again(self.model + addition.effect)

    def remove(self, place: int) -> Fit:
        """New `Fit`, by the same method, of the model without the effect at index `place`."""
        return self._fit_again(without_effect(self.model, place))

    def _fit_again(self, model: Model) -> Fit:
        """Fit of another model by the same method; missing samples are completed under the new model."""
        from allanite.fit.fitting import fit_again

        return fit_again(self, model)

    def simulate(self, **options: Unpack[SimulationOptions]) -> Recording:
        """`Recording` simulated from the fitted model.

        For `options` see `Model.simulate`. Rate and unit are those of the fitted recording unless given.
        """
        options.setdefault("rate", self.recording.rate)
        options.setdefault("unit", self.recording.unit)
        return self.model.simulate(**options)

    def state_space(
        self, *, states: int | None = None, duration: float | None = None
    ) -> StateSpace:
        """`StateSpace` (F, Q, H, R, P0) of the fitted model at the recording's sampling rate; see `Model.state_space`.

        `duration`, s, is by default that of the recording. `states` is the maximum number of states.
        """
        duration = self.recording.duration if duration is None else duration
        return self.model.state_space(self.recording.rate, states=states, duration=duration)

    def simulate_chunks(
        self, *, size: int = 2**20, **options: Unpack[SimulationOptions]
    ) -> Iterator[Recording]:
        """Iterator over simulated recordings of `size` consecutive samples.

        For `options` see `Model.simulate_chunks`. Rate and unit are those of the fitted recording unless given.
        """
        options.setdefault("rate", self.recording.rate)
        options.setdefault("unit", self.recording.unit)
        return self.model.simulate_chunks(size=size, **options)

    def simulate_check(
        self, n: int = 200, seed: int = 0, progress: Callable[[int, int], None] | None = None
    ) -> SimulatedCheck:
        """`SimulatedCheck` from `n` simulated and refitted records: p-value of the misfit, bias and scatter of parameters.

        Parameters
        ----------
        n : int
            Number of replicates; the smallest p-value is 1/(n + 1).
        seed : int
            The same seed gives the same replicates.
        progress : callable, optional
            Called with the number done and `n` after each.

        Returns
        -------
        SimulatedCheck

        Raises
        ------
        InputError
            `n` below 1, or a model that excludes samples.
        """
        from allanite.fit.simulated import simulate_check

        return simulate_check(self, n, seed, progress)

    def compare_methods(self) -> MethodTable:
        """`MethodTable`: coefficients by Whittle likelihood, least squares and straight lines, with remarks."""
        from allanite.fit.methods import compare_methods

        return compare_methods(self)

    def plot(self, path: str | Path | None = None, theme: str = "light") -> Figure:
        """Figure of the Allan curve and spectrum with the model.

        Parameters
        ----------
        path : str or Path, optional
            SVG, PNG or PDF, written if given.
        theme : {"light", "dark"}
        """
        import allanite as al

        return al.plots.plot_fit(self, path, theme)

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON (``allanite/fit/1``) of the fit.

        It contains the recording, method, model, effects, misfit, error and adequacy (see `body`), and the band,
        correlations and degeneracies.
        """
        return {
            "schema": "allanite/fit/1",
            "version": _kernels.version(),
            "recording": self.recording.describe(),
            "method": self.method,
            **self.body(),
            "band": self.band.to_dict(),
            "correlations": self.correlations.to_dict(),
            "degeneracies": self.degeneracies,
        }

    def body(self, searched: bool = True) -> dict[str, Any]:
        """Dict (JSON form) of model, effects, misfit, error, discrepancy and adequacy, as used by fits, checks and studies.

        With `searched` False, alternative explanations of the effects are not searched, and their lists are empty.
        ``adequate`` is False also if quantization limits the recording (`limited_by_quantization`).
        """
        misfit = self.misfit
        return {
            "model": self.model.name,
            "effects": [
                {
                    "kind": effect.kind,
                    "name": self.display_name(effect),
                    "parameters": {n: parameter_dict(v) for n, v in values.items()},
                    **held_and_limits(effect),
                    **(rivals(self, place) if searched else Rivals()).to_dict(),
                }
                for place, (effect, values) in enumerate(
                    zip(self.model.effects, self.estimates, strict=True)
                )
            ],
            "misfit": {
                "chi2": misfit.chi2,
                "dof": misfit.dof,
                "reduced": misfit.reduced,
                "p_value": misfit.p_value,
            },
            "error": self.error.to_dict(),
            "discrepancy": self.discrepancy.to_dict(),
            "not_judged_hz": [list(band) for band in self.not_judged],
            "adequate": self.adequate and not self.limited_by_quantization,
        }

    def save(self, path: str | Path) -> None:
        """Write the fit as JSON to `path`, which `allanite simulate`, `compare` and ``--model`` can read."""
        write_text(path, json.dumps(self.to_dict(), indent=1) + "\n")

    def summary(self) -> str:
        """Text table of the fit, the same as ``str(fit)``."""
        return str(self)

    def __str__(self) -> str:
        return fit_table(self)

    def __repr__(self) -> str:
        return f"Fit({self.recording.columns[0]}, {self.method}: {self.model})"

    def _repr_html_(self) -> str:
        """HTML text for notebooks: table of the parameters with their 95 % intervals, and a line on the misfit."""
        r = self.recording
        title = f"{self.model.name} fitted to {r.path or 'recording'} · {r.columns[0]}{method_text(self)}"
        head = ("effect", "parameter", "value", "95 % interval")
        return html_table(title, head, parameter_rows(self), (2, 3)) + html_list(
            [misfit_line(self)]
        )


def parameter_dict(value: Any) -> dict[str, Any]:
    """Dict (JSON form) of the value of a parameter: `Estimate.to_dict()`, or ``{"value": …}`` for any other value."""
    if isinstance(value, Estimate):
        return value.to_dict()
    return {"value": list(value) if isinstance(value, tuple) else value}
