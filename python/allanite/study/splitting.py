"""Splitting: two effects replace one that stood for both."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.effects import Model
from allanite.fit import refitted
from allanite.fit.rivals.alternatives import is_detected
from allanite.fit.rivals.columns import follow_columns_consistently
from allanite.fit.rivals.evidence import MAX_RIVAL_LOG_EVIDENCE, evidence_gain
from allanite.fit.rivals.together import can_be_split
from allanite.study.drop_and_replace import is_same_feature
from allanite.suggestion.constants import MAX_PAIRS_REFITTED

if TYPE_CHECKING:
    from collections.abc import Iterable

    from allanite.effects import Effect
    from allanite.fit.result import Fit

__all__ = ["with_pair"]


def with_pair(fit: Fit, places: Iterable[int]) -> tuple[Fit, int, tuple[Effect, ...]] | None:
    """Fit with two effects in the place of one that stood for both, the place of that one, and the two; or None.

    The first of `places` with a better pair is split. Compared are the best pairs, each with one of its effects alone
    (which then replaces the present effect by itself), and the present effect with either of a pair beside it (which is
    left to a step of its own). Of the models within `MAX_RIVAL_LOG_EVIDENCE` of the best score, the plainest is taken:
    fewest parameters, then fewest refined forms, then the smallest Allan error. A power law gives way unless it is clearly
    better.
    """
    for place in places:
        out = fit.model.effects[place]
        if not can_be_split(out):
            continue
        pairs = [
            pair
            for pair in fit.together(place)
            if not any(
                is_same_feature(old, new, fit)
                for old in fit.model
                for new in pair.model.effects[-2:]
            )
        ]
        # The best of many pairs leads by chance, so each pair pays for their number.
        least = (
            -MAX_RIVAL_LOG_EVIDENCE
            if out.last_resort
            else MAX_RIVAL_LOG_EVIDENCE + float(np.log(max(len(pairs), 1)))
        )
        found = [
            refitted(fit, p.model)
            for p in pairs[:MAX_PAIRS_REFITTED]
            if p.evidence > least - MAX_RIVAL_LOG_EVIDENCE
        ]
        count = len(fit.model) - 1
        found = [f for f in found if _score_gain(f, fit) > least and _columns_consistent(f, count)]
        if not found:
            continue
        # The record may need only one of the two.
        alone = [
            refitted(fit, Model((*f.model.effects[:count], part)))
            for f in found
            for part in f.model.effects[count:]
        ]
        beside: list[Fit] = []
        if not out.last_resort:
            parts = {e.kind: e for f in found for e in f.model.effects[count:]}.values()
            beside = [refitted(fit, fit.model + part) for part in parts]
        every = [
            (_score_gain(f, fit), f)
            for f in (*found, *alone, *beside)
            if _columns_consistent(f, count)
        ]
        top = max(gain for gain, _ in every)
        near = [(gain, f) for gain, f in every if gain > top - MAX_RIVAL_LOG_EVIDENCE]
        gain, plainest = min(near, key=lambda each: _plainness(each[1]))
        came = range(count, len(plainest.model))
        if plainest not in beside and gain > least and all(is_detected(plainest, p) for p in came):
            return plainest, place, plainest.model.effects[count:]
    return None


def _columns_consistent(fit: Fit, count: int) -> bool:
    """True if no column among the effects after the first `count` resembles the samples by chance."""
    return follow_columns_consistently(fit.model.effects[count:], fit.solution, fit.data)


def _score_gain(after: Fit, before: Fit) -> float:
    """Score of one fit over that of another, nats."""
    return evidence_gain(after.solution, before.solution, before.data)


def _plainness(fit: Fit) -> tuple[int, int, float]:
    """Sort key of a fit: number of parameters, of refined forms, then the Allan error."""
    refined = sum(e.refined for e in fit.model.deterministic)
    return sum(e.numbers for e in fit.model), refined, fit.curve.rms_percent or 0.0
