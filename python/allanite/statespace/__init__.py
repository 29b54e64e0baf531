"""The model as a filter sees it: state space, innovations."""

from allanite.statespace.filtering import (
    Innovations,
    NisByTau,
    filter_samples,
    innovations,
    smooth_samples,
)
from allanite.statespace.model import StateSpace, state_space
from allanite.statespace.reduction import Cost

__all__ = [
    "Cost",
    "Innovations",
    "NisByTau",
    "StateSpace",
    "filter_samples",
    "innovations",
    "smooth_samples",
    "state_space",
]
