"""The catalogue of physical effects, one a file, and their sums."""

from allanite.effects._base import Deterministic, Effect, Modifier, Parameter, Periodic, Stochastic
from allanite.effects.files import model_from_dict, model_to_dict, parse_model
from allanite.effects.model import Model
from allanite.effects.registry import CATALOGUE, find

__all__ = [
    "CATALOGUE",
    "Deterministic",
    "Effect",
    "Model",
    "Modifier",
    "Parameter",
    "Periodic",
    "Stochastic",
    "find",
    "model_from_dict",
    "model_to_dict",
    "parse_model",
]
