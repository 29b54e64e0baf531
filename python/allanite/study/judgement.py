"""Tests of a change of the model: its change of score, its errors, and its prediction of unseen data.

The decisions are in `allanite.study.steps`. A replacement must raise the score by more than 0.5 nats, and no error may
rise beyond its scatter. The score of an added suggestion was judged by the check. No error may rise beyond its scatter (not
tested for changes of level), and unseen data must be predicted as well (not tested for effects that happen once).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.effects import Deterministic
from allanite.fit.prediction import compare
from allanite.fit.rivals.evidence import evidence_gain
from allanite.fit.rivals.score import prior_change
from allanite.suggestion.constants import MAX_ALLAN_ERROR_SCATTERS, MAX_EVENT_LOG10_P
from allanite.suggestion.screens.slow_functions import has_known_time

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from allanite.fit.result import Fit
    from allanite.study.ladder import Rung
    from allanite.suggestion import Suggestion


def score_change(before: Fit, after: Fit) -> float:
    """Score of the fit `after` minus that of the fit `before`, nats: change of log evidence plus change of priors."""
    gain = evidence_gain(after.solution, before.solution, before.data)
    return gain + prior_change(before.model, after.model)


def allan_error_rises(before: Fit, after: Fit) -> bool:
    """True if the Allan error (rms, %) of the fit `after` is larger than that of `before`; False if either has none."""
    old, new = before.curve.rms_percent, after.curve.rms_percent
    return old is not None and new is not None and new > old


def discrepancy_rises(before: Fit, after: Fit) -> bool:
    """True if the model discrepancy of the fit `after` is larger than that of `before`, by any amount."""
    return after.discrepancy.percent > before.discrepancy.percent


def no_error_rises(before: Fit, after: Fit) -> bool:
    """True if neither the model discrepancy nor the Allan error rises from `before` to `after` by more than its scatter.

    * The discrepancy rises if its interval lies completely above the old interval.
    * The Allan error (rms, %) may rise to twice its expected scatter, or to √(old² + scatter²) if that is larger.
    * At each τ, the error may rise by twice its scatter. This is not tested if the last effect newly excludes a segment.

    Without an Allan error, only the discrepancy counts. Always True if the last effect newly excludes outliers.
    """
    other = after.data is not before.data and after.model.effects[-1].removes
    if other and after.model.effects[-1].when is None:
        return True  # outliers hide how wrong the model is, so the errors are not comparable
    if before.discrepancy.is_below(after.discrepancy):
        return False
    old, new = before.curve, after.curve
    if old.rms_percent is None or new.rms_percent is None:
        return True
    # The error of a true model is within twice its scatter. While effects are missing it may rise by its scatter.
    scatter = new.expected_scatter_percent or 0.0
    if new.rms_percent > max(
        MAX_ALLAN_ERROR_SCATTERS * scatter, np.hypot(old.rms_percent, scatter)
    ):
        return False
    if other:
        return True  # the curves are of different samples
    # Large scatter at long τ must not excuse a rise at short τ, so the rises are compared τ by τ.
    return new.error_increase(old, MAX_ALLAN_ERROR_SCATTERS) <= 0.0


def predicts_as_well(before: Fit, after: Fit) -> bool:
    """True unless `after` predicts unseen data worse than `before` by more than the standard error of the difference.

    If the model discrepancy rises, False for any worse prediction. True if one of the fits has no prediction.
    """
    old, new = before.error.predictive, after.error.predictive
    if old is None or new is None:
        return True
    difference, std_error = compare(old, new)
    return difference <= (0.0 if discrepancy_rises(before, after) else std_error)


def is_as_good(before: Fit, after: Fit) -> bool:
    """True if the smaller model `after` describes the record as well as `before`.

    No error may rise beyond its scatter (`no_error_rises`). In addition, the Allan error must not rise, or must stay at or
    below its expected scatter.
    """
    return no_error_rises(before, after) and (
        not allan_error_rises(before, after) or allan_error_within_scatter(after)
    )


def refusal_reason(before: Fit, after: Fit, suggestion: Suggestion) -> str:
    """Clause that states why a significant suggestion was not added, such as "raises the Allan error".

    `after` is the fit with the suggestion alone. The first reason that holds is named:

    * `after` predicts unseen data worse (not tested for effects that happen once).
    * An error rises beyond its scatter (not tested for changes of level), or the suggestion is a doubtful event: the
      discrepancy if its interval lies above the old one, otherwise the Allan error.
    * A time of the effect is not known.
    * Otherwise, it "acts where another effect already acts".
    """
    if not suggestion.effect_happens_once and not predicts_as_well(before, after):
        return "predicts unseen data worse"
    risen = not suggestion.effect.changes_level and not no_error_rises(before, after)
    if risen or is_doubtful_event(before, after, suggestion):
        # Only the discrepancy is judged by its interval, so any other rise is one of the Allan error.
        above = before.discrepancy.is_below(after.discrepancy)
        return "raises the discrepancy" if above else "raises the Allan error"
    if not has_known_time(after.solution.effects[-1], after.solution, after.data):
        return "has an uncertain time"
    return "acts where another effect already acts"


def allan_error_within_scatter(fit: Fit) -> bool:
    """True if the Allan error (rms, %) is at most its expected scatter. A value that is None counts as 0."""
    return (fit.curve.rms_percent or 0.0) <= (fit.curve.expected_scatter_percent or 0.0)


def delta_logl(before: Fit, after: Fit) -> float:
    """LogL of `after` minus that of `before`, nats; 0 if different numbers of excluded samples prevent this."""
    counts = [0 if f.data.missing is None else int(f.data.missing.sum()) for f in (before, after)]
    if counts[0] != counts[1]:
        return 0.0
    return after.solution.log_likelihood - before.solution.log_likelihood


def changed_bins(before: Fit, after: Fit) -> NDArray[np.bool_]:
    """Boolean mask of the bins in which the expected power of two fits differs by more than the scatter of the bin.

    All True if the fits have different numbers of bins.
    """
    old, new = before.solution.spectrum, after.solution.spectrum
    if old.size != new.size:
        return np.ones(new.size, dtype=bool)
    scatter = np.sqrt(2.0 / np.maximum(after.solution.weight, 1e-9))
    return np.asarray(np.abs(np.log(new / old)) > scatter)


def is_doubtful_event(before: Fit, after: Fit, suggestion: Suggestion) -> bool:
    """True if an effect that happens once has p > 1e-4, and with it the Allan error rises and exceeds its expected scatter.

    It then probably belongs to another effect. Changes of level and exclusions count as events, too
    (`effect_happens_once`).
    """
    return (
        suggestion.effect_happens_once
        and suggestion.log10_p > MAX_EVENT_LOG10_P
        and allan_error_rises(before, after)
        and not allan_error_within_scatter(after)
    )


def leaves_others_unchanged(before: Fit, rung: Rung) -> bool:
    """True if the step `rung` leaves the spectrum as it was for the other suggestions.

    No bin then changes its expected power beyond the scatter of the bin, and no slow function of time is added.
    """
    slow = any(isinstance(effect, Deterministic) and effect.low for effect in rung.new)
    return not slow and not changed_bins(before, rung.fit).any()
