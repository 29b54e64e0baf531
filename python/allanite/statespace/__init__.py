"""State space of a model: Kalman filter, innovations, and growth of the error.

Input: a model or a fit. Output: F, Q, H, R and P₀, innovations, or the error after the last fix. Add the state space
of a new kind of noise in `sections.py`.
"""

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
