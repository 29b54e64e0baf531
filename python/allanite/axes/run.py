"""From a recording to the characterisation of every axis of it."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from allanite.axes.characterization import Characterization, common_of
from allanite.axes.turn_on import turn_on_biases
from allanite.axes.working import check_working, working_states
from allanite.common.errors import AllaniteError, InputError
from allanite.common.threads import parallel_columns, side_by_side
from allanite.common.validation import positive, require_recording
from allanite.fit.likelihood.remembered import trim_memory
from allanite.study import MAX_ADDED_EFFECTS, improve

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from allanite.effects import Effect, Model
    from allanite.recording import Recording
    from allanite.study import Study

    Start = Model | Effect | str

__all__ = ["characterize", "improve_columns"]

#: Suggestions that are kept of a last model that lacks nothing.
SHOWN = 2
#: Seconds for a column where none are left: it gets its first model alone.
SOON = 1e-3


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
    """Improve a model of every axis, two at a time, and say what the axes have in common.

    Parameters
    ----------
    recording : Recording or sequence of Recording
        One or more columns; its covariates are offered to each as an explanation. Several recordings are the sensors of
        one device at rates of their own, as `allanite.readers.read_sensors` returns them.
    model : Model, Effect, str or mapping
        Where every ladder starts, or the start of each by the name of its column.
    on_progress : callable, optional
        Called with (column, rungs done, most rungs), from the threads that compute; once a column is done, with two equal
        numbers.
    limit : int
        Most additions to a model.
    tolerance : float, optional
        Per cent of the deviation: a model whose discrepancy is below it is good enough.
    seconds : float, optional
        Time after which no further effect is looked for, shared between the columns. Each gets a first model whatever it
        takes.
    on_study : callable, optional
        Called with the study of a column as soon as it is finished, from the thread that computed it.
    working : Recording or sequence of Recording
        The same columns with motors or engine running: files for filters then follow the noise at work.
    further : sequence of sequence of Recording
        Further logs of the same sensor, each after a switch-on of its own: they tell the bias at switch-on.

    Returns
    -------
    Characterization
        A column that cannot be characterised says why in `failed`; the rest go on.

    Raises
    ------
    InputError, TooShortError
        No column can be characterised: what was wrong with the first.

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
    found = improve_columns(columns, starts, on_progress, limit, tolerance, seconds, on_study)
    studies: dict[str, Study] = {}
    failed: dict[str, AllaniteError] = {}
    for column, result in zip(columns, found, strict=True):
        if isinstance(result, AllaniteError):
            failed[column.columns[0]] = result
        else:
            studies[column.columns[0]] = result
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


def _lighter(study: Study) -> Study:
    """The study without what only a search needs: known functions, and suggestions that are never shown.

    Each of these holds a fit, as large as the record.
    """
    check = study.check
    for rung in study.ladder:
        rung.fit.data.forget()
    shown = tuple(s for i, s in enumerate(check.suggestions) if s.significant or i < SHOWN)
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
    """The ladder of each column, two at a time, or why there is none; each has a model to start from.

    Parameters as of `characterize`.
    """
    end = None
    if seconds is not None:
        end = time.monotonic() + positive(seconds, "seconds", "s", "give seconds, such as 60")
    waiting = list(columns)

    def share() -> float | None:
        """Seconds for the column that begins: those that wait get as much."""
        left = len(waiting)
        waiting.pop()
        if end is None:
            return None
        return max((end - time.monotonic()) * min(parallel_columns(), left) / left, SOON)

    def task(column: Recording, model: Start) -> Callable[[], Study]:
        name, most = column.columns[0], limit + 1

        def report(done: int, _total: int) -> None:
            if on_progress is not None and done < most:
                on_progress(name, done, most)

        def study() -> Study:
            own = share()
            _ = column.audit  # kept by the column
            try:
                found: Study = improve(column, model, report, limit, tolerance, own)
            finally:
                if on_progress is not None:
                    on_progress(name, most, most)
            found = _lighter(found)
            trim_memory(found.fit.data.n)
            if on_study is not None:
                on_study(found)
            return found

        return study

    return side_by_side([task(*one) for one in zip(columns, models, strict=True)])
