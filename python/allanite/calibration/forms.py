"""The form of the thermal law b(T): its power of the temperature and its memory, chosen by evidence."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from allanite.effects import BiasStep, Covariate, Hysteresis, Model, RateOfChange
from allanite.fit import Fit, fit_model
from allanite.fit.engine import solve
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE, discrepancy_gain, parameter_cost
from allanite.fit.shapes.deterministic import shape_slope
from allanite.fit.shapes.matched import grid_points, matched_gains

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from allanite.calibration.runs import Runs
    from allanite.common.arrays import Array
    from allanite.effects import Deterministic

#: Name of each highest power of the temperature, 0 to 3.
POWERS = ("constant", "linear", "quadratic", "cubic")
#: Highest power of the temperature: PX4 and ArduPilot evaluate polynomials up to the third power.
MAX_POWER = 3
#: Maximum number of iterations between the fit of the noise and the fit of the law. Many are needed if law and random walk
#: are similar. Chosen by judgment; not measured.
MAX_ROUNDS = 30


@dataclass(frozen=True, slots=True)
class Form:
    """Form of the thermal law: highest `power` of the temperature, 0 to 3, and kind of `memory`.

    The memory is ``"none"``, ``"lag"``, ``"hysteresis"`` or ``"rate"``.
    """

    power: int
    memory: str = "none"

    @property
    def numbers(self) -> int:
        """Number of fitted parameters of the law (coefficients, lag, width), without the bias offsets of the logs."""
        return self.power + {"none": 0, "lag": 1}.get(self.memory, 2)

    @property
    def name(self) -> str:
        """Name such as ``cubic`` or ``linear with hysteresis``."""
        words = {"none": "", "lag": " with a lag", "hysteresis": " with hysteresis"}
        return POWERS[self.power] + words.get(self.memory, " with rate dependence")

    def effects(self, runs: Runs) -> tuple[Deterministic, ...]:
        """Effects for a fit, without values: a bias step where each log after the first begins, then the law b(T).

        The half-width of a hysteresis is searched from 1/16 to 1/2.2 of the temperature range.
        """
        column, starts, rate = runs.column, runs.starts, runs.recording.rate
        found: list[Deterministic] = [
            BiasStep(time=start / rate, hold=("time",)) for start in starts
        ]
        if self.power > 0:
            law = Covariate(
                column=column,
                starts=starts,
                quadratic=0.0 if self.power >= 2 else None,
                cubic=0.0 if self.power >= 3 else None,
            )
            held = law.with_values(lag=0.0, hold=("lag",))
            found.append(law if self.memory == "lag" else held)
        if self.memory == "hysteresis":
            span = float(np.ptp(runs.temperature))
            found.append(Hysteresis(column=column, starts=starts, reach=(span / 16.0, span / 2.2)))
        if self.memory == "rate":
            found.append(RateOfChange(column=column, starts=starts))
        return tuple(found)


@dataclass(frozen=True, slots=True, eq=False)
class Tried:
    """Fit of one form of the law, and its `log_likelihood` and evidence relative to the constant form.

    `log_evidence` is `log_likelihood` minus the cost of the coefficients. Gains that come only from a larger misfit of
    the noise are subtracted as well.
    """

    form: Form
    fit: Fit
    log_likelihood: float
    log_evidence: float


#: All forms. The constant is first, and each form with memory comes after the same power without memory.
FORMS = tuple(
    Form(power, memory)
    for memory in ("none", "lag", "rate", "hysteresis")
    for power in range(MAX_POWER + 1)
    if memory != "lag" or power > 0
)


def tried_forms(
    runs: Runs, noise: Model, on_progress: Callable[[int, int], None]
) -> tuple[Tried, ...]:
    """Fits of all forms of the thermal law, each with the effects of `noise`; the constant form is first.

    Forms whose hysteresis opposes the linear term are omitted. `on_progress` gets (forms done, forms in all).
    """
    # Missing samples are filled once, with a cubic law, and used for all forms, so that their likelihoods are comparable.
    first = fit_model(runs.recording, Model((*noise, *Form(MAX_POWER).effects(runs))))
    fits: dict[Form, Fit] = {}
    found: list[Tried] = []
    for place, form in enumerate(FORMS):
        effects = form.effects(runs)
        if form.memory != "none":
            effects = _with_best_shape(effects, fits[Form(form.power)])
        fit = refitted(first, Model((*noise, *effects)))
        fits[form] = fit
        base = fits[FORMS[0]]
        gain = fit.solution.log_likelihood - base.solution.log_likelihood
        more = discrepancy_gain(fit.solution, fit.data) - discrepancy_gain(base.solution, base.data)
        if not _opposes_temperature(fit):
            found.append(Tried(form, fit, gain, gain - max(more, 0.0) - law_cost(fit)))
        on_progress(place + 1, len(FORMS))
    return tuple(found)


def _opposes_temperature(fit: Fit) -> bool:
    """True if the coefficients of the hysteresis and of the linear term have opposite signs.

    Such a fit describes a slow drift of the bias rather than a hysteresis.
    """
    law = law_of(fit)
    linear = next((e.amplitudes()[0] for e in law if e.column_powers and not e.column_loop), 0.0)
    return bool(linear * sum(e.column_loop for e in law) < 0.0)


def refitted(first: Fit, model: Model) -> Fit:
    """`Fit` of `model` to the samples of the fit `first`; the optimization starts from the solution of `first`."""
    solution = solve(first.data, model, like=first.solution, rounds=MAX_ROUNDS)
    return Fit(first.recording, solution.model, "whittle", first.data, solution)


def _with_best_shape(effects: tuple[Deterministic, ...], plain: Fit) -> tuple[Deterministic, ...]:
    """`effects`, with the last effect replaced by a copy that has the best lag (or hysteresis width) of a fixed grid.

    `plain` is a fit of the same polynomial in T without lag and hysteresis; its noise gives the weights of the least
    squares.
    """
    *others, last = effects
    points = grid_points(last, plain.data.n, plain.data.rate)
    noise = plain.solution.noise(plain.data)
    gain, _ = matched_gains(points, plain.data.ordinates, noise, plain.data, others)
    return (*others, points[int(np.argmax(gain))])


def with_near_best_evidence(tried: Sequence[Tried]) -> list[Tried]:
    """List of the members of `tried` whose log evidence is at most 3 nats below the highest, in the given order."""
    top = max((one.log_evidence for one in tried), default=0.0)
    return [one for one in tried if one.log_evidence >= top - MAX_RIVAL_LOG_EVIDENCE]


def chosen(tried: Sequence[Tried]) -> Tried:
    """The form with the fewest parameters, among those with log evidence within 3 nats of the highest."""
    return min(
        with_near_best_evidence(tried), key=lambda one: (one.form.numbers, -one.log_evidence)
    )


def law_of(fit: Fit) -> list[Deterministic]:
    """List of the effects of a fit that follow the temperature; empty for the constant form."""
    return [e for e in fit.model.deterministic if e.follows is not None]


def design(fit: Fit) -> tuple[Array, Array, NDArray[np.bool_]]:
    """(matrix, values, own): linearized least-squares problem of the log offsets and the thermal law of a fit.

    The columns of `matrix`, shape (k, p), are derivatives of the fitted function with respect to the offset of each
    log, each amplitude of the law, and each free lag or width. Its rows are the ordinates of the cosine transform of
    the record that the fit used. `values` are the fitted values of these parameters. `own` is True for the columns of
    the law, False for the offsets. All are empty if the fit has neither.
    """
    columns, values, own = [], [], []
    for part in fit.solution.functions:
        columns.append(part.matrix)
        values.append(part.amplitudes)
        own += [part.effect.follows is not None] * part.amplitudes.size
    for effect in law_of(fit):
        for name in effect.free_shapes:
            slope = shape_slope(effect, name, fit.solution.regressed_ordinates, fit.data)
            if slope is not None and slope.any():
                columns.append(slope[:, None])
                values.append(np.array([effect.values[name]]))
                own.append(True)
    if not columns:
        return np.zeros((0, 0)), np.zeros(0), np.zeros(0, dtype=bool)
    return np.hstack(columns), np.concatenate(values), np.array(own)


def law_cost(fit: Fit) -> float:
    """Cost in nats that the log evidence subtracts from logL for the parameters of the thermal law.

    It is the sum of `parameter_cost` over the coefficients, the lag and the width of the law. The cost of a parameter
    grows with the precision with which it is known, given the offset of each recording and the parameters before it.
    The offsets cost nothing.
    """
    matrix, values, own = design(fit)
    if not own.any():
        return 0.0
    variance = fit.solution.noise(fit.data).variance(fit.solution.regressed_ordinates)
    scaled = matrix * values / np.sqrt(variance)[:, None]
    # Row k of R in the QR decomposition contains what coefficient k adds to those before it.
    upper: Array = np.asarray(np.linalg.qr(scaled, mode="r"))
    squares = upper.sum(axis=1) ** 2
    return float(
        sum(parameter_cost(float(z)) for z, is_own in zip(squares, own, strict=True) if is_own)
    )
