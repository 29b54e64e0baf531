"""The catalogue of physical effects, one a file, and their sums."""

from allanite.effects._base import Effect, Parameter, Stochastic, StraightLine
from allanite.effects._event import Away
from allanite.effects._known import Deterministic, Periodic
from allanite.effects._level import Level
from allanite.effects._limits import limitable
from allanite.effects._modifier import Modifier
from allanite.effects._moving import Moving, weights
from allanite.effects.files import as_model, model_from_dict, model_to_dict, parse_model
from allanite.effects.model import Model
from allanite.effects.registry import CATALOGUE, find, register, standard, title_of, white_noise

__all__ = [
    "CATALOGUE",
    "Away",
    "Deterministic",
    "Effect",
    "Level",
    "Model",
    "Modifier",
    "Moving",
    "Parameter",
    "Periodic",
    "Stochastic",
    "StraightLine",
    "as_model",
    "find",
    "limitable",
    "model_from_dict",
    "model_to_dict",
    "parse_model",
    "register",
    "standard",
    "title_of",
    "weights",
    "white_noise",
]
