"""Which fitted numbers stand for each other: correlations, and what a record of this length cannot tell apart."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.fit.covariance import joint_covariance

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from allanite.effects import Model
    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Solution

__all__ = ["Correlations", "correlations", "degeneracies"]

#: Two numbers correlated beyond this are known together five times worse than each with the other given.
STRONG = 0.98
#: A time constant longer than this share of the record shows only its rising side: that of a random walk.
LONG = 0.25


@dataclass(frozen=True, slots=True, eq=False)
class Correlations:
    """Correlations of the fitted numbers of the random effects.

    Attributes
    ----------
    names : tuple of str
        ``N``, ``GM.q_c``, …; numbers at zero take no part.
    matrix : ndarray, shape (p, p)
    """

    names: tuple[str, ...]
    matrix: NDArray[np.float64]

    def __post_init__(self) -> None:
        self.matrix.flags.writeable = False

    def to_dict(self) -> dict[str, Any]:
        """JSON form."""
        return {"names": list(self.names), "matrix": self.matrix.tolist()}


def correlations(solution: Solution, data: Data) -> Correlations:
    """From the Fisher information of all of them together."""
    places, covariance = joint_covariance(solution, data)
    labels = solution.model.labels
    names = tuple(
        name if name == labels[place] else f"{labels[place]}.{name}" for place, name in places
    )
    spread = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    return Correlations(names, covariance / np.outer(spread, spread))


def degeneracies(found: Correlations, model: Model, data: Data) -> list[str]:
    """One sentence for each thing that this record cannot tell."""
    out = []
    for effect, label in zip(model, model.labels, strict=True):
        time = effect.values.get("correlation_time")
        if time is None or isinstance(time, (str, tuple)):
            continue
        if time > LONG * data.duration:
            out.append(
                f"{label}: a correlation time of {time:.3g} s in a record of {data.duration:.3g} s cannot be told "
                f"from a rate random walk: only q_c is known"
            )
        elif time * data.rate < 1.0:
            out.append(
                f"{label}: a correlation time below the sampling interval cannot be told from white noise"
            )
    for a in range(len(found.names)):
        for b in range(a):
            value = float(found.matrix[a, b])
            if abs(value) > STRONG:
                out.append(
                    f"{found.names[b]} and {found.names[a]} cannot be told apart (correlation {value:+.3f}): "
                    f"hold one, or leave one out"
                )
    return out
