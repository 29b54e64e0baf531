"""Measures of agreement of a fit, by which steps of model building are compared."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from allanite.common.documents import fields_dict

if TYPE_CHECKING:
    from allanite.fit.prediction import Prediction

#: Minimum probability of a larger, and of a smaller, χ² of an adequate model: its share of the 1 % false-alarm probability
#: of a check, which also tests about ten families of effects.
MIN_ADEQUATE_P = 0.001


@dataclass(frozen=True, slots=True)
class Misfit:
    """χ² of the spectrum (groups of bins, ten per decade) and its p-value, the probability of a larger χ²."""

    chi2: float
    dof: int
    p_value: float

    @property
    def reduced(self) -> float:
        """χ² per degree of freedom."""
        return self.chi2 / self.dof

    @property
    def is_too_small(self) -> bool:
        """True if χ² is improbably small for a true model (0.1 %): the record is then not noise.

        A few samples with nearly all of the power, for example, have a spectrum without scatter.
        """
        from scipy.special import chdtr

        return bool(chdtr(self.dof, self.chi2) < MIN_ADEQUATE_P)


@dataclass(frozen=True, slots=True)
class Error:
    """Error of the Allan deviation (τ with edf ≥ 10) and predictive score.

    `adev_rms_percent` is the geometric error 100·(e^{rms of ln(model/measured)} − 1); `chance_rms_percent` is that expected
    of a true model. `adev_worst` is the ratio model/measured furthest from 1, and its τ in s. All three are None if no τ
    has edf ≥ 10; `predictive` is None for fewer than 128 samples.
    """

    adev_rms_percent: float | None
    adev_worst: tuple[float, float] | None
    chance_rms_percent: float | None
    predictive: Prediction | None

    @property
    def predictive_score(self) -> float | None:
        """Predictive loss on unseen data, nats per bin; None if the record is too short."""
        return None if self.predictive is None else self.predictive.score

    def to_dict(self) -> dict[str, Any]:
        """Dict of the attributes, for JSON (``error``)."""
        worst = self.adev_worst
        return {
            "adev_rms_percent": self.adev_rms_percent,
            "adev_worst": None if worst is None else {"factor": worst[0], "tau_s": worst[1]},
            "chance_rms_percent": self.chance_rms_percent,
            "predictive": None if self.predictive is None else self.predictive.to_dict(),
        }


@dataclass(frozen=True, slots=True)
class Discrepancy:
    """Model discrepancy δ in % of the deviation, and its 95 % interval.

    δ is the scale of a Student t₂ distribution of the model's errors: half of the bins are within 0.8 δ, a few may be far
    off.
    """

    percent: float
    interval: tuple[float, float]

    def is_below(self, other: Discrepancy) -> bool:
        """True if the whole interval lies below that of another discrepancy."""
        return self.interval[1] < other.interval[0]

    def to_dict(self) -> dict[str, Any]:
        """Dict of percent and interval, for JSON (``discrepancy``)."""
        return fields_dict(self)
