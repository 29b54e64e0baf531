"""Records that distinguish two effects which explain another record equally well."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.common.errors import InputError
from allanite.effects import Deterministic, Model, parse_model
from allanite.fit.likelihood.whittle import log_likelihood
from allanite.planning import expected as _expected

if TYPE_CHECKING:
    from allanite.fit.likelihood.data import Data


def alternative_model(base: Model, names: tuple[str, str]) -> Model:
    """Copy of the model `base` in which one of two named effects is replaced by the other one.

    `base` must contain exactly one of the two. The other effect has no values and is the last effect of the copy.

    Parameters
    ----------
    base : Model
        Model with values that contains one of the two.
    names : (str, str)
        Names of the two effects: ``GM``, ``K``.

    Raises
    ------
    InputError
        Not exactly two names; the model has none or both of the two effects; or the other effect is a known function of
        time.
    """
    if len(names) != 2:
        raise InputError(f"tell = {', '.join(names)}: two effects, such as GM,K")
    given = [parse_model(name).effects[0] for name in names]
    held = [e.kind in {b.kind for b in base} for e in given]
    if sum(held) != 1:
        count = "both" if all(held) else "none"
        raise InputError(
            f"tell = {', '.join(names)}: the model {base.name} has {count} of the two, it needs one of them with values"
        )
    own, other = (given[0], given[1]) if held[0] else (given[1], given[0])
    if isinstance(other, Deterministic):
        raise InputError(
            f"tell = {', '.join(names)}: a {other.short} cannot be predicted from a {own.short}; swap them: put"
            f" {other.short} with values in the model and tell it from {own.short}"
        )
    place = next(i for i, e in enumerate(base) if e.kind == own.kind)
    return Model((*base.effects[:place], *base.effects[place + 1 :], other))


def log_odds(truth: Model, other: Model, data: Data, grid: Data) -> float:
    """Expected log odds of `truth`, nats: loss of logL if the model `other` is fitted to a record of `truth`.

    Positive or 0. Known functions of `truth` whose kind is also in `other` cost nothing.

    Parameters
    ----------
    truth, other : Model
        The true model with values, and the one to be excluded, such as an `alternative_model`.
    data : Data
        Length and rate of the record (`expected.blank_data`).
    grid : Data
        The same record at a lower rate, with the expected course of each column (`expected.coarse_data`).
    """
    power = _expected.expected_power(truth, data)
    for effect in truth.deterministic:
        if effect.kind not in {e.kind for e in other}:
            power = power + _expected.signal_power(effect, data, grid) / data.bins.count
    best = _expected.best_fit(_expected.random_part(other), power, data).log_likelihood
    noise = _expected.expected_power(truth, data)
    return log_likelihood(noise, data.bins.count, noise) - best
