"""Shape of the spectrum that no effect of the catalog explains: its size and range, without a name."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from allanite.common.numbers import with_readable_numbers
from allanite.common.showing import brief
from allanite.effects import CATALOG, Effect
from allanite.fit.rivals.evidence import bic_cost

if TYPE_CHECKING:
    from allanite.fit.result import Fit


@dataclass(frozen=True, slots=True)
class UnexplainedShape:
    """A smooth shape of the spectrum that a model lacks, and the fit with it.

    From `low_hz` to `high_hz`, the shape, relative to the power of the other effects, is at least half of its maximum,
    `percent`.
    """

    fit: Fit
    low_hz: float
    high_hz: float
    percent: float

    __repr__ = brief

    @property
    def effect(self) -> Effect:
        """Effect that has this shape of the spectrum, without a physical name. It can be added to the model."""
        return self.fit.model.effects[-1]

    def __str__(self) -> str:
        return with_readable_numbers(
            f"between {self.low_hz:.3g} and {self.high_hz:.3g} Hz a shape of {self.percent:+.0f} % of the power that no"
            f" effect of the catalog explains: {self.effect.short} describes it"
        )


def unexplained_effect() -> Effect:
    """Effect of the catalog, without values, for a shape of the spectrum that nothing else explains."""
    return next(cls for cls in CATALOG if cls.nameless)()


def unexplained_shape(fit: Fit) -> UnexplainedShape | None:
    """`UnexplainedShape`: a smooth hump or dip of the spectrum, without a physical name, that the model lacks; or None.

    None if it raises logL by less than the BIC cost of its parameters, or if the model already has such a nameless shape.
    """
    if any(effect.nameless for effect in fit.model):
        return None
    with_shape = fit.add(unexplained_effect())
    solution = with_shape.solution
    risen = solution.log_likelihood - fit.solution.log_likelihood
    if risen < with_shape.model.effects[-1].numbers * bic_cost(fit.solution):
        return None
    own = solution.processes[-1].power
    ratio = own / np.maximum(solution.spectrum - own, 1e-300)
    top = int(np.argmax(ratio))
    wide = np.flatnonzero(ratio < 0.5 * ratio[top])
    first = int(wide[wide < top][-1]) + 1 if (wide < top).any() else 0
    last = int(wide[wide > top][0]) if (wide > top).any() else ratio.size
    hertz = fit.data.bins.edges * fit.data.rate / (2.0 * fit.data.n)
    return UnexplainedShape(
        with_shape,
        float(hertz[first]),
        float(hertz[min(last, hertz.size - 1)]),
        100.0 * float(ratio[top]),
    )
