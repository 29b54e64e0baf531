"""The form of the law b(T): which power of the temperature, and which memory, chosen by evidence."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from allanite.effects import Model
from allanite.effects.bias_step import BiasStep
from allanite.effects.covariate import Covariate
from allanite.effects.hysteresis import Hysteresis
from allanite.effects.rate_of_change import RateOfChange
from allanite.fit import Fit, fit_model
from allanite.fit.engine import solve
from allanite.fit.estimates import shape_slope
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE, discrepancy_gain, parameter_cost
from allanite.fit.shapes.matched import grid_points, matched_gains

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from allanite.calibration.runs import Runs
    from allanite.effects import Deterministic

__all__ = [
    "Form",
    "Tried",
    "chosen",
    "design",
    "fitted",
    "law_of",
    "memory_of",
    "near_the_best",
    "tried_forms",
]

POWERS = ("constant", "linear", "quadratic", "cubic")
#: Highest power of the temperature: what PX4 and ArduPilot evaluate.
HIGHEST = 3
#: Most alternations between the noise and the law: a law that stood for a random walk leaves it slowly.
ROUNDS = 30


@dataclass(frozen=True, slots=True)
class Form:
    """A form of the law.

    Attributes
    ----------
    power : int
        Highest power of the temperature, 0 to 3.
    memory : str
        ``"none"``, ``"lag"``, ``"hysteresis"`` or ``"rate"``.
    """

    power: int
    memory: str = "none"

    @property
    def numbers(self) -> int:
        """How many numbers the law has."""
        return self.power + {"none": 0, "lag": 1}.get(self.memory, 2)

    @property
    def name(self) -> str:
        """``cubic``, ``linear with hysteresis``."""
        words = {"none": "", "lag": " with a lag", "hysteresis": " with hysteresis"}
        return POWERS[self.power] + words.get(self.memory, " with rate dependence")

    def effects(self, runs: Runs) -> tuple[Deterministic, ...]:
        """The effects of the catalogue that are this form, and a step to the offset of each later run."""
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
    """A fitted form.

    Attributes
    ----------
    form : Form
    fit : Fit
    log_likelihood : float
        Over that of a constant.
    log_evidence : float
        The same less what its numbers cost; what a larger misfit of the noise brings does not count.
    """

    form: Form
    fit: Fit
    log_likelihood: float
    log_evidence: float


#: Every form, the constant first; those with a memory after the same power without.
FORMS = tuple(
    Form(power, memory)
    for memory in ("none", "lag", "rate", "hysteresis")
    for power in range(HIGHEST + 1)
    if memory != "lag" or power > 0
)


def tried_forms(
    runs: Runs, noise: Model, on_progress: Callable[[int, int], None] | None = None
) -> tuple[Tried, ...]:
    """Every form fitted with the same noise model; the constant first.

    Parameters
    ----------
    runs : Runs
    noise : Model
        Random effects, whose values are fitted anew beside each form.
    on_progress : callable, optional
        Called with (forms done, forms in all).
    """
    # Missing samples are completed once, under a law that follows the temperature, and stay for all forms.
    first = fit_model(runs.recording, Model((*noise, *Form(HIGHEST).effects(runs))))
    fits: dict[Form, Fit] = {}
    found: list[Tried] = []
    for place, form in enumerate(FORMS):
        effects = form.effects(runs)
        if form.memory != "none":
            effects = _with_shape(effects, fits[Form(form.power)])
        fit = fitted(first, Model((*noise, *effects)))
        fits[form] = fit
        base = fits[FORMS[0]]
        gain = fit.solution.log_likelihood - base.solution.log_likelihood
        more = discrepancy_gain(fit.solution, fit.data) - discrepancy_gain(base.solution, base.data)
        if not _works_against(fit):
            found.append(Tried(form, fit, gain, gain - max(more, 0.0) - cost(fit)))
        if on_progress is not None:
            on_progress(place + 1, len(FORMS))
    return tuple(found)


def _works_against(fit: Fit) -> bool:
    """Whether a play takes back a part of what the temperature does: it stands for a drift."""
    law, own = (memory_of(fit, kind) for kind in (Covariate, Hysteresis))
    return law is not None and own is not None and law.amplitudes()[0] * own.amplitudes()[0] < 0.0


def fitted(first: Fit, model: Model) -> Fit:
    """The samples of a fit with another model."""
    solution = solve(first.data, model, like=first.solution, rounds=ROUNDS)
    return Fit(first.recording, solution.model, "whittle", first.data, solution)


def _with_shape(effects: tuple[Deterministic, ...], plain: Fit) -> tuple[Deterministic, ...]:
    """The effects with the lag or play at which the last of them explains most, in the noise beside the plain law."""
    *beside, last = effects
    points = grid_points(last, plain.data)
    noise = plain.solution.noise(plain.data)
    gain, _ = matched_gains(points, plain.data.ordinates, noise, plain.data, beside)
    return (*beside, points[int(np.argmax(gain))])


def near_the_best(tried: Sequence[Tried]) -> list[Tried]:
    """The forms that the evidence cannot tell from the best."""
    top = max((one.log_evidence for one in tried), default=0.0)
    return [one for one in tried if one.log_evidence >= top - MAX_RIVAL_LOG_EVIDENCE]


def chosen(tried: Sequence[Tried]) -> Tried:
    """The form with the fewest numbers among those that the evidence cannot tell from the best; of these the best."""
    return min(near_the_best(tried), key=lambda one: (one.form.numbers, -one.log_evidence))


def law_of(fit: Fit) -> list[Deterministic]:
    """The effects of a fit that follow the temperature."""
    return [e for e in fit.model.deterministic if e.follows is not None]


def memory_of(fit: Fit, kind: type[Deterministic]) -> Deterministic | None:
    """The effect of a fit of this kind."""
    return next((e for e in fit.model.deterministic if isinstance(e, kind)), None)


def design(fit: Fit) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """What the law is in the ordinates that the fit looks at.

    Returns
    -------
    matrix : ndarray, shape (k, p)
        Offsets of runs, amplitudes of the law, then the slope of each free shape.
    values : ndarray, shape (p,)
        Fitted values of these numbers.
    own : ndarray of bool, shape (p,)
        Which of them are of the law.
    """
    columns, values, own = [], [], []
    for part in fit.solution.functions:
        columns.append(part.matrix)
        values.append(part.amplitudes)
        own += [part.effect.follows is not None] * part.amplitudes.size
    for effect in law_of(fit):
        for name in effect.free_shapes:
            slope = shape_slope(effect, name, fit.solution.seen, fit.data)
            if slope is not None and slope.any():
                columns.append(slope[:, None])
                values.append(np.array([effect.values[name]]))
                own.append(True)
    if not columns:
        return np.zeros((0, 0)), np.zeros(0), np.zeros(0, dtype=bool)
    return np.hstack(columns), np.concatenate(values), np.array(own)


def cost(fit: Fit) -> float:
    """Cost of the law's numbers in ln of the evidence.

    Each number pays for how well it is known beyond those before it (`parameter_cost`): the offsets of runs first, then the
    powers in their order, then the memory.
    """
    matrix, values, own = design(fit)
    if not own.any():
        return 0.0
    variance = fit.solution.noise(fit.data).variance(fit.solution.seen)
    scaled = matrix * values / np.sqrt(variance)[:, None]
    # R of a QR: its columns end at the rows of the numbers before them, so that row k is what is new with number k.
    upper: NDArray[np.float64] = np.asarray(np.linalg.qr(scaled, mode="r"))
    squares = upper.sum(axis=1) ** 2
    return float(
        sum(parameter_cost(float(z)) for z, is_own in zip(squares, own, strict=True) if is_own)
    )
