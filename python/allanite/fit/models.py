"""Copies of a model with one effect replaced or removed, and names of its parameters."""

from __future__ import annotations

from allanite.effects import Effect, Model


def with_effect(model: Model, place: int, effect: Effect) -> Model:
    """Copy of the model in which `effect` replaces the effect at index `place`."""
    return Model((*model.effects[:place], effect, *model.effects[place + 1 :]))


def without_effect(model: Model, place: int) -> Model:
    """Copy of the model without the effect at index `place`."""
    return Model(model.effects[:place] + model.effects[place + 1 :])


def parameter_label(label: str, name: str) -> str:
    """Name of a parameter in tables: label and parameter, as in ``GM.q_c``, or one of them if both are equal (``N``)."""
    return name if name == label else f"{label}.{name}"
