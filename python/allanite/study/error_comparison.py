"""Whether the errors of a model fall with a change, are as small as they were, or rise."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.fit import removes
from allanite.fit.prediction import compare, worse
from allanite.suggestion.constants import MAX_ALLAN_ERROR_SCATTERS, MAX_IGNORED_ALLAN_RISE

if TYPE_CHECKING:
    from allanite.fit.result import Fit

__all__ = ["as_good", "errors_fall", "predicts", "refusal", "rises", "wider", "within_chance"]


def rises(before: Fit, after: Fit) -> bool:
    """Whether the Allan error is larger, by anything."""
    old, new = before.curve.rms_percent, after.curve.rms_percent
    return old is not None and new is not None and new > old


def wider(before: Fit, after: Fit) -> bool:
    """Whether the discrepancy is larger, by anything."""
    return after.discrepancy.percent > before.discrepancy.percent


def errors_fall(before: Fit, after: Fit) -> bool:
    """Whether neither the discrepancy nor the Allan error rises by more than its own scatter."""
    old, new = before.curve, after.curve
    other = after.data is not before.data and removes(after.model.effects[-1])
    if other and after.model.effects[-1].when is None:
        return True  # samples that do not belong hide by how much a model is wrong
    if after.discrepancy.interval[0] > before.discrepancy.interval[1]:
        return False
    if old.rms_percent is None or new.rms_percent is None:
        return True
    # A true model's error is within twice its scatter, whatever the error before; with more missing it may rise by once.
    chance = new.chance_percent or 0.0
    if new.rms_percent > max(MAX_ALLAN_ERROR_SCATTERS * chance, np.hypot(old.rms_percent, chance)):
        return False
    if other:
        return True  # the curve of another record
    # Chance is large at long τ alone, and excuses nothing at short ones.
    return new.risen(old, MAX_ALLAN_ERROR_SCATTERS) <= MAX_IGNORED_ALLAN_RISE**2


def predicts(before: Fit, after: Fit) -> bool:
    """Whether unseen data are not predicted worse by more than the standard error of the difference.

    Where the discrepancy rises as well, by any amount.
    """
    old, new = before.error.predictive, after.error.predictive
    if old is None or new is None:
        return True
    if wider(before, after) and compare(old, new)[0] > 0.0:
        return False
    return not worse(old, new)


def as_good(before: Fit, after: Fit) -> bool:
    """Whether a model with less in it is as good: no error rises, the Allan error to no more than chance leads to."""
    return errors_fall(before, after) and (not rises(before, after) or within_chance(after))


def refusal(before: Fit, after: Fit, once: bool) -> str:
    """Why what is significant was not added, a clause; what happens `once` predicts nothing.

    Where nothing rises it leads nowhere else: its place is taken, or what it needs beside it raises an error.
    """
    if not once and not predicts(before, after):
        return "predicts unseen data worse"
    if rises(before, after):
        return "raises the Allan error"
    if wider(before, after):
        return "raises the discrepancy"
    return "stands where another effect does"


def within_chance(fit: Fit) -> bool:
    """Whether the Allan error is no larger than chance leads to."""
    return (fit.curve.rms_percent or 0.0) <= (fit.curve.chance_percent or 0.0)
