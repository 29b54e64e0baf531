"""Correlations of fitted parameters, and parameters or effects that a record cannot distinguish."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.arrays import Array
from allanite.common.documents import fields_dict
from allanite.fit.covariance import joint_covariance
from allanite.fit.models import parameter_label

if TYPE_CHECKING:
    from allanite.effects import Model
    from allanite.fit.likelihood.data import Data
    from allanite.fit.solution import Solution

#: Correlation above which two parameters cannot be distinguished: their standard errors are then five times (1/√(1 −
#: 0.98²)) those with the other parameter given.
MAX_CORRELATION = 0.98
#: Maximum correlation time, as a fraction of the record, that can be distinguished from a random walk. Chosen by judgment;
#: not measured.
MAX_CORRELATION_TIME_FRACTION = 0.25


@dataclass(frozen=True, slots=True, eq=False)
class Correlations:
    """Correlations of the fitted parameters of random effects.

    Attributes
    ----------
    names : tuple of str
        ``N``, ``GM.q_c``, …; parameters at zero are excluded.
    matrix : ndarray, shape (p, p)
        Correlation matrix.
    """

    names: tuple[str, ...]
    matrix: Array

    def __post_init__(self) -> None:
        self.matrix.flags.writeable = False

    def to_dict(self) -> dict[str, Any]:
        """Dict of names and matrix (as nested lists), for JSON."""
        return fields_dict(self)


def correlations(solution: Solution, data: Data) -> Correlations:
    """`Correlations` of the fitted parameters of random effects and modifiers, from their joint covariance.

    They are those of the logarithms of the parameters, or of the parameter itself if it may be negative.
    """
    places, covariance = joint_covariance(solution, data)
    labels = solution.model.labels
    names = tuple(parameter_label(labels[place], name) for place, name in places)
    spread = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    return Correlations(names, covariance / np.outer(spread, spread))


def degeneracies(found: Correlations, model: Model, data: Data) -> list[str]:
    """List of a sentence for each correlation time or pair of parameters that this record cannot determine.

    A correlation time is determined between the sampling interval and `MAX_CORRELATION_TIME_FRACTION` of the duration,
    a pair up to a correlation of ±`MAX_CORRELATION`. Empty if all are determined.
    """
    out = []
    for effect, label in zip(model, model.labels, strict=True):
        time = effect.values.get("correlation_time")
        if time is None or isinstance(time, (str, tuple)):
            continue
        if time > MAX_CORRELATION_TIME_FRACTION * data.duration:
            out.append(
                f"{label}: a correlation time of {time:.3g} s in a record of {data.duration:.3g} s cannot be distinguished "
                f"from a rate random walk; only q_c is known"
            )
        elif time * data.rate < 1.0:
            out.append(
                f"{label}: a correlation time below the sampling interval cannot be distinguished from white noise"
            )
    for a in range(len(found.names)):
        for b in range(a):
            value = float(found.matrix[a, b])
            if abs(value) > MAX_CORRELATION:
                out.append(
                    f"{found.names[b]} and {found.names[a]} cannot be distinguished (correlation {value:+.3f}); "
                    f"hold or remove one of them"
                )
    return out
