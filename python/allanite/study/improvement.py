"""Improve a model step by step: the search of one column, and of several."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import TYPE_CHECKING

from allanite.common.several import Several, results_by_column
from allanite.common.threads import columns_at_work, results_or_raise, side_by_side
from allanite.common.validation import positive, require_one_column, require_recording
from allanite.effects import Effect, Model, Modifier, as_model
from allanite.fit import fit_model
from allanite.study.ladder import Rung, SearchInterrupted, Study
from allanite.study.search import Search
from allanite.suggestion.constants import (
    DEFAULT_SECONDS,
    DEFAULT_SECONDS_PER_SAMPLE,
    MAX_ADDED_EFFECTS,
)

if TYPE_CHECKING:
    from collections.abc import Callable

    from allanite.recording import Recording
    from allanite.summary import Summary


def improve(
    recording: Recording | Summary,
    model: Model | Effect | str = "N+B+K",
    on_progress: Callable[[int, int], None] | None = None,
    limit: int = MAX_ADDED_EFFECTS,
    tolerance: float | None = None,
    seconds: float | None = None,
) -> Study:
    """`Study`: steps that each add the best missing effect to the first model, until nothing significant is left.

    Parameters
    ----------
    recording : Recording or Summary
        One column; `improve_columns` takes several.
    model : Model, Effect or str
        First model. Filter designs and orders that have a value are held.
    on_progress : callable, optional
        Called after each check with (number of models so far, maximum number of models).
    limit : int
        Number of steps after the first model from which on no effect is added; replacements may follow.
    tolerance : float, optional
        % of the deviation. The search ends if the model discrepancy is below it.
    seconds : float, optional
        Limit of the elapsed time, s. The first model is always fitted and checked. By default the limit is 60 s of
        processor time and 10 s more for each million samples. Steps after the last finished check are discarded, and
        the others are then shown in the order of the search, with those that it took back.

    Returns
    -------
    Study

    Raises
    ------
    InputError
        Samples that cannot be fitted, an unknown model, or a tolerance or time that is not positive.
    TooShortError
        Fewer than 32 samples, or constant ones.
    SearchInterrupted
        Ctrl-C after the first check. This `KeyboardInterrupt` (`allanite.study.SearchInterrupted`) holds the steps
        found so far in `study`.

    Examples
    --------
    >>> truth = al.parse_model("N(N=0.1)+K(K=0.02)")
    >>> study = al.improve(truth.simulate(duration=1000, rate=10, seed=1), "N")
    >>> study.fit.model.name, study.stopped_because
    ('N+K', 'adequate')
    """
    require_one_column(recording, "al.improve_columns(recording, model)")
    if tolerance is not None:
        tolerance = positive(
            tolerance, "tolerance", "%", "give per cent of the deviation, such as 5"
        )
    if seconds is None:
        clock = time.process_time
        allowed = columns_at_work() * (DEFAULT_SECONDS + DEFAULT_SECONDS_PER_SAMPLE * recording.n)
    else:
        clock = time.monotonic
        allowed = positive(seconds, "seconds", "s", "give seconds, such as 60")
    deadline = clock() + allowed
    fit = fit_model(recording, with_given_designs(as_model(model)))
    search = Search([Rung(fit)], limit, tolerance, deadline, clock, on_progress)
    try:
        stop = search.run()
    except KeyboardInterrupt:
        if search.check is None:
            raise
        raise SearchInterrupted(search.study("interrupted")) from None
    return search.study(stop)


def improve_columns(
    recording: Recording | Summary,
    model: Model | Effect | str = "N+B+K",
    on_progress: Callable[[int, int], None] | None = None,
    limit: int = MAX_ADDED_EFFECTS,
    tolerance: float | None = None,
    seconds: float | None = None,
) -> Several[Study]:
    """`Several` that maps each column to its `Study`; two columns are improved at a time.

    `allanite.characterize` also compares the columns.

    Parameters
    ----------
    recording : Recording or Summary
        One or more columns.
    model, on_progress, limit, tolerance
        As of `improve`.
    seconds : float, optional
        Time limit of each column, s: every column gets this time. `allanite.characterize` shares its limit among the
        columns.

    Returns
    -------
    Several
        A mapping from the name of a column to its `Study`.

    Raises
    ------
    InputError, TooShortError
        As of `improve`.

    Examples
    --------
    >>> white = np.random.default_rng(1).standard_normal((5000, 2))
    >>> log = al.Recording(white, rate=100, unit="deg/s", columns=["gyro_x", "gyro_y"])
    >>> studies = al.improve_columns(log, "N")
    >>> [study.stopped_because for study in studies.values()]
    ['adequate', 'adequate']
    """
    require_recording(recording)
    tasks = results_by_column(
        recording, lambda c: lambda: improve(c, model, on_progress, limit, tolerance, seconds)
    )
    return Several(
        dict(zip(tasks, results_or_raise(side_by_side(list(tasks.values()))), strict=True))
    )


def with_given_designs(model: Model) -> Model:
    """Copy of a model in which the type and order of each filter, if given by the user, are fixed during the search."""

    def held(effect: Effect) -> Effect:
        """Copy of a filter in which the type and order that have a value are fixed; other effects stay."""
        given = (p.name for p in effect.parameters if p.role == "choice" and p.name != "column")
        names = [n for n in given if effect.values[n] is not None and n not in effect.held]
        filtering = isinstance(effect, Modifier) and names
        return replace(effect, hold=(*effect.hold, *names)) if filtering else effect

    return Model(tuple(map(held, model.effects)))
