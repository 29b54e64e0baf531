"""Numbers by which a fit is judged and two rungs of a ladder are compared."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from allanite.fit.prediction import Prediction

__all__ = ["Discrepancy", "Error", "Misfit"]


@dataclass(frozen=True, slots=True)
class Misfit:
    """χ² of the spectrum (groups of bins, ten a decade) and the probability of a larger one under the model."""

    chi2: float
    dof: int
    p_value: float

    @property
    def reduced(self) -> float:
        """χ² per degree of freedom."""
        return self.chi2 / self.dof


@dataclass(frozen=True, slots=True)
class Error:
    """Error of the Allan deviation (τ with edf ≥ 10), what chance alone gives, and the predictive score.

    Attributes
    ----------
    adev_rms_percent, chance_rms_percent : float or None
        Geometric: 100·(e^{rms of ln(model/measured)} − 1), and what chance gives.
    adev_worst : (factor, τ in s) or None
        Model over measured where that is furthest from 1.
    """

    adev_rms_percent: float | None
    adev_worst: tuple[float, float] | None
    chance_rms_percent: float | None
    predictive: Prediction | None

    @property
    def predictive_score(self) -> float | None:
        """Loss on unseen data, nats a bin; None where the record is too short."""
        return None if self.predictive is None else self.predictive.score

    def to_dict(self) -> dict[str, Any]:
        """The contract's ``error``."""
        worst = self.adev_worst
        return {
            "adev_rms_percent": self.adev_rms_percent,
            "adev_worst": None if worst is None else {"factor": worst[0], "tau_s": worst[1]},
            "chance_rms_percent": self.chance_rms_percent,
            "predictive": None if self.predictive is None else self.predictive.to_dict(),
        }


@dataclass(frozen=True, slots=True)
class Discrepancy:
    """How far the model is from the spectrum beyond chance, in per cent of the deviation, and its 95 % interval.

    The scale of a Student t₂ law: half of the bins are within 0.8 of it, a few may be far off.
    """

    percent: float
    interval: tuple[float, float]

    def to_dict(self) -> dict[str, Any]:
        """The contract's ``discrepancy``."""
        return {"percent": self.percent, "interval": list(self.interval)}
