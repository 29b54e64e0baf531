"""Characterization of every axis of a recording."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from allanite.axes.characterization import Characterization, common_of
from allanite.axes.turn_on import turn_on_biases
from allanite.axes.working import check_working, working_states
from allanite.common.errors import AllaniteError, InputError
from allanite.common.threads import max_parallel_columns, side_by_side
from allanite.common.validation import positive, require_recording
from allanite.fit.likelihood.remembered import trim_memory
from allanite.study import MAX_ADDED_EFFECTS, improve

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from allanite.effects import Effect, Model
    from allanite.recording import Recording
    from allanite.study import Study

    Start = Model | Effect | str

#: Number of suggestions that a study keeps in any case; further ones are kept only if significant.
KEPT_SUGGESTIONS = 2
#: Time limit, s, of a column that begins after the common limit: only its first model is fitted.
MIN_SECONDS = 1e-3


def characterize(
    recording: Recording | Sequence[Recording],
    model: Start | Mapping[str, Start] = "N+B+K",
    on_progress: Callable[[str, int, int], None] | None = None,
    limit: int = MAX_ADDED_EFFECTS,
    tolerance: float | None = None,
    seconds: float | None = None,
    on_study: Callable[[Study], None] | None = None,
    working: Recording | Sequence[Recording] = (),
    further: Sequence[Sequence[Recording]] = (),
) -> Characterization:
    """`Characterization`: models of every axis, and what the axes have in common.

    Parameters
    ----------
    recording : Recording or sequence of Recording
        One or more columns; its covariates may explain each of them. Several recordings are the sensors of one device
        with different rates, as `allanite.readers.read_sensors` returns them.
    model : Model, Effect, str or mapping
        Initial model of every column, or a mapping from column names to initial models.
    on_progress : callable, optional
        Called with (column, steps done, maximum number of steps) from the computing threads. The two numbers are equal
        once the column is done.
    limit : int
        Maximum number of effects that are added to a model.
    tolerance : float, optional
        Model discrepancy in % of the deviation at which the search ends.
    seconds : float, optional
        Time limit of all columns together, s; the columns share it. Each column gets at least its initial model.
        `allanite.improve_columns` gives this time to each column instead.
    on_study : callable, optional
        Called with the study of a column as soon as it is finished, from the thread that computed it.
    working : Recording or sequence of Recording
        Recording of the same columns with motors or engine running. Exported files then use the noise at work.
    further : sequence of sequence of Recording
        Further logs of the same sensor, each after another switch-on, from which the bias at switch-on is estimated.

    Returns
    -------
    Characterization
        A column that cannot be characterized gives its reason in `failed`.

    Raises
    ------
    InputError, TooShortError
        No column can be characterized (the error is that of the first column), two recordings have a column of one name,
        or the working log does not match.

    Examples
    --------
    >>> x = np.random.default_rng(1).normal(0, 0.1, (4000, 2))
    >>> log = al.Recording(x, rate=10, unit="deg/s", columns=["gx", "gy"])
    >>> found = al.characterize(log, "N+K")
    >>> list(found.studies), dict(found.failed)
    (['gx', 'gy'], {})
    """
    several = isinstance(recording, list | tuple) and any(hasattr(r, "columns") for r in recording)
    given: tuple[Any, ...] = tuple(recording) if several else (recording,)
    for one in given:
        require_recording(one)
    recordings: tuple[Recording, ...] = tuple(one.measured for one in given)
    at_work = tuple(working) if isinstance(working, list | tuple) else (working,)
    if at_work:
        check_working(recordings, at_work)
    columns = [column for one in recordings for column in one]
    names = [column.columns[0] for column in columns]
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise InputError(f"the column {twice} is in two of the recordings: name the columns apart")
    starts = [model[name] if isinstance(model, Mapping) else model for name in names]
    results = improve_columns(columns, starts, on_progress, limit, tolerance, seconds, on_study)
    found = dict(zip(names, results, strict=True))
    studies = {name: one for name, one in found.items() if not isinstance(one, AllaniteError)}
    failed = {name: one for name, one in found.items() if isinstance(one, AllaniteError)}
    if not studies:
        raise next(iter(failed.values()))
    states = working_states(studies, at_work) if at_work else {}
    return Characterization(
        recordings,
        MappingProxyType(studies),
        MappingProxyType({name: str(error) for name, error in failed.items()}),
        common_of(studies),
        MappingProxyType(states),
        MappingProxyType(turn_on_biases(recordings, further)),
    )


def _without_search_data(study: Study) -> Study:
    """Copy of a study that needs less memory: its last check keeps only the significant and the first two suggestions.

    Each suggestion holds a fit, which is as large as the record. Side effect: the fits of all steps of `study` clear
    the data that they cached for the search.
    """
    check = study.check
    for rung in study.ladder:
        rung.fit.data.clear_caches()
    shown = tuple(
        s for i, s in enumerate(check.suggestions) if s.significant or i < KEPT_SUGGESTIONS
    )
    return replace(study, check=replace(check, suggestions=shown))


def improve_columns(
    columns: Sequence[Recording],
    models: Sequence[Start],
    on_progress: Callable[[str, int, int], None] | None = None,
    limit: int = MAX_ADDED_EFFECTS,
    tolerance: float | None = None,
    seconds: float | None = None,
    on_study: Callable[[Study], None] | None = None,
) -> list[Study | AllaniteError]:
    """List with one entry per column: its `Study`, or the `AllaniteError` that explains why there is none.

    Columns are computed in parallel and share `seconds`. (`allanite.improve_columns` gives `seconds` to each column.)
    Other exceptions are raised.
    """
    end = None
    if seconds is not None:
        end = time.monotonic() + positive(seconds, "seconds", "s", "give seconds, such as 60")
    waiting = list(columns)

    def time_share() -> float | None:
        """Time limit in s for the next of the `waiting` columns, its share of the remaining time; None without a limit."""
        left = len(waiting)
        waiting.pop()
        if end is None:
            return None
        return max((end - time.monotonic()) * min(max_parallel_columns(), left) / left, MIN_SECONDS)

    def study(column: Recording, model: Start) -> Study:
        """`Study` of one column within its share of the time; calls `on_progress` at its end, also after an error."""
        name, most = column.columns[0], limit + 1

        def report(done: int, _total: int) -> None:
            """Call ``on_progress(name, done, most)`` after each step but the last one, which `study` itself reports."""
            if on_progress is not None and done < most:
                on_progress(name, done, most)

        own = time_share()
        # Computed here, in the thread of the column; the column caches the audit.
        _ = column.audit
        try:
            found: Study = improve(column, model, report, limit, tolerance, own)
        finally:
            if on_progress is not None:
                on_progress(name, most, most)
        found = _without_search_data(found)
        trim_memory(found.fit.data.n)
        if on_study is not None:
            on_study(found)
        return found

    return side_by_side([partial(study, *one) for one in zip(columns, models, strict=True)])
