"""Every axis of every log of a fleet: one row each, and a journal from which an interrupted run continues."""

from __future__ import annotations

import hashlib
import itertools
import json
import math
import os
import sys
import warnings
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from queue import SimpleQueue
from threading import Thread
from time import perf_counter, process_time
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite._kernels import version
from allanite.common.errors import AllaniteError, InputError
from allanite.common.files import check_target, is_file, whole_file
from allanite.common.memory import VARIABLE, budget
from allanite.common.parameters import Estimate
from allanite.common.plain import plain, spreadsheet_cell
from allanite.common.threads import processors
from allanite.common.validation import positive_rate
from allanite.effects.files import as_model, model_to_dict
from allanite.effects.registry import CATALOG
from allanite.fit import fit_model
from allanite.fit.models import parameter_label
from allanite.fit.rivals.alternatives import solution_without
from allanite.scale.journal import JOURNAL, Journal, read_journal
from allanite.scale.log_process import Answer, LogProcess, Setup, failed_row, is_child
from allanite.study.improvement import with_given_designs
from allanite.study.ladder import Rung
from allanite.study.search import Search
from allanite.suggestion.constants import (
    DEFAULT_SECONDS,
    DEFAULT_SECONDS_PER_SAMPLE,
    MAX_ADDED_EFFECTS,
)

if TYPE_CHECKING:
    from allanite.effects import Effect, Model
    from allanite.recording import Recording
    from allanite.study import Study
    from allanite.suggestion import Check

#: Default time limit of a log, s. Six axes of 5 min at 100 Hz take 2.4 s of processor time.
DEADLINE = 3600.0
#: Minimum number of independent tests by which the p-value of an added effect is multiplied. A search tries all kinds in
#: each step; the search for one kind alone may count fewer. Chosen by judgment; not measured.
MIN_TRIALS = 1000.0
#: A text is a list of logs only if one of this many first lines names a file. Chosen by judgment.
FIRST_PATHS = 100
#: Maximum length of a path, characters (PATH_MAX of Linux).
MAX_PATH_LENGTH = 4096


def logs_of(source: str | Path | Sequence[str | Path]) -> list[Path]:
    """List of `Path`, sorted: the logs that `source` names.

    `source` is a folder (with its subfolders), a glob pattern, a text file with one path per line, a single log, or a
    sequence of paths. In folders and patterns, hidden files, journals, and tables that have a journal are left out.
    Raises `InputError` if there are no logs.
    """
    if isinstance(source, (str, Path)):
        path = Path(source)
        if path.is_dir():
            found = _logs_among(path.rglob("*"))
        elif any(sign in str(source) for sign in "*?["):
            anchor = Path(path.anchor or ".")
            found = _logs_among(anchor.glob(str(path.relative_to(path.anchor))))
        elif path.is_file():
            found = _logs_in_list(path) or [path]
        else:
            raise InputError(f"{source}: no such folder, pattern or list")
    else:
        found = [Path(p) for p in source]
    if not found:
        raise InputError(f"{source}: no log in it")
    return sorted(found)


def _logs_among(paths: Iterator[Path]) -> list[Path]:
    """List of those `paths` that may be logs: no hidden files, folders, journals, or tables that have a journal."""
    # A pipe, a device or a broken link stays in the list, and gets a failed row.
    return [
        path
        for path in paths
        if not (path.name.startswith(".") or path.is_dir() or path.suffix == JOURNAL)
        and not _journal_of(path).exists()
    ]


def _journal_of(table: Path) -> Path:
    """Path of the journal of a table, in the same folder: ``fleet.csv.journal``."""
    return table.with_name(table.name + JOURNAL)


def _logs_in_list(path: Path) -> list[Path]:
    """List of `Path`: logs that a text file names, one per line, relative to its folder; empty if the file is no list.

    A list has a file among its first 100 lines and no line over 4096 characters. Raises `InputError` if the file cannot
    be read.
    """
    named: list[Path] = []
    try:
        with path.open(encoding="utf-8") as lines:
            # A log may have endless lines, or more lines than fit into memory.
            while line := lines.readline(MAX_PATH_LENGTH + 1):
                if len(line) > MAX_PATH_LENGTH:
                    return []
                if line.strip():
                    named.append(path.parent / line.strip())
                if len(named) == FIRST_PATHS and not any(map(is_file, named)):
                    return []
    except UnicodeDecodeError:
        return []
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error})") from None
    return named if any(map(is_file, named[:FIRST_PATHS])) else []


def rows_of(
    path: str,
    model: str | Model,
    rate: float | str | None,
    unit: str | None,
    *,
    anyway: bool = False,
) -> list[dict[str, Any]]:
    """List of dicts, one per axis of a log; a failed axis, or a log that cannot be read, has a row with the reason.

    The entry ``numbers`` is a JSON text: name → [value, low, high, standard error], for samples in the unit of the row.
    Only `MemoryError` is raised.
    """
    from allanite.axes.turn_on import column_means
    from allanite.readers import read
    from allanite.readers.plausibility import checked

    began = perf_counter()
    head = {"file": plain(path), "content": "", "column": "", "status": "done", "remarks": ""}
    try:
        recording = checked(read(path, rate, unit=unit), anyway=anyway)
    except MemoryError:
        raise
    except Exception as error:
        return [{**head, "status": "failed", "remarks": _reason_text(error)}]
    remarks = "; ".join(f.message for f in recording.audit if f.severity == "warning")
    rows = []
    for column in recording:
        row = {**head, "column": column.columns[0], "unit": column.unit, "n": column.n}
        row |= {"rate_hz": column.rate, "duration_s": column.duration}
        row |= {"temperatures": json.dumps(column_means(column))}
        try:
            numbers = study_columns(study_of_kinds(column, model))
        except MemoryError:
            raise
        except Exception as error:
            rows.append({**row, "status": "failed", "remarks": _reason_text(error)})
            continue
        now = perf_counter()
        rows.append({**row, "remarks": remarks, **numbers, "seconds": now - began})
        began = now
    return rows


def study_of_kinds(column: Recording, model: str | Model) -> Study:
    """`Study` of one column as by `improve`, but no check adds an effect of a kind that the model already has.

    This saves fits of weak further lines, which change neither coefficients nor kinds of effects. All lines that one check
    suggests are added together. Excluded samples and single events are added as by `improve`, because they change the
    coefficients.
    """
    fit = fit_model(column, with_given_designs(as_model(model)))
    seconds = DEFAULT_SECONDS + DEFAULT_SECONDS_PER_SAMPLE * column.n
    search = SearchOfKinds([Rung(fit)], MAX_ADDED_EFFECTS, None, process_time() + seconds)
    return search.study(search.run())


class SearchOfKinds(Search):
    """Search that adds effects of the same kind only from one check, and keeps its steps in the order of the search."""

    def _check_of_last_fit(self) -> Check:
        """`Check` of the last fit, without suggested effects of kinds in the model; `self.check` keeps all suggestions.

        Excluded samples and single events may be suggested again.
        """
        check = super()._check_of_last_fit()
        kinds = {effect.kind for effect in check.fit.model}
        new = (
            s
            for s in check.suggestions
            if s.kind not in kinds or s.effect_happens_once or s.effect.removes
        )
        return replace(check, suggestions=tuple(new))

    def _stop_reason(self, check: Check) -> str | None:
        """Reason to end the search, or None; judges `self.check`, which has all suggestions, not the argument."""
        assert self.check is not None
        return super()._stop_reason(self.check)

    def _steps(self, _stop: str) -> tuple[Rung, ...]:
        """Tuple of the checked steps of the search (models with their fits), oldest first. The argument is not used."""
        return tuple(self.ladder[: self.checked])


def _reason_text(error: Exception) -> str:
    """Text of one line: message of an error of allanite, or for any other error a request to report it."""
    if isinstance(error, AllaniteError):
        return plain(error, 300)
    what = plain(f"{type(error).__name__}: {error}", 200)
    return f"an error of allanite itself ({what}): please report it with the log"


def study_columns(study: Study) -> dict[str, Any]:
    """Dict of a study's entries in a row of the fleet's table: model, verdict, discrepancy_percent, effects and numbers.

    ``numbers`` is a JSON text: name → [value, low, high, standard error], also of the ``mean`` of the samples. ``effects``
    is a JSON text: kind of each added effect that is still in the model → its smallest p-value, corrected for at least 1000
    trials.
    """
    from scipy.special import chdtrc

    fit = study.fit
    numbers: dict[str, list[float | None]] = {}
    labels = zip(fit.model.labels, fit.estimates, fit.model, strict=True)
    for label, values, effect in labels:
        for name, value in values.items():
            if isinstance(value, Estimate) and effect.parameter(name).role != "time":
                low, high = value.interval or (None, None)
                numbers[parameter_label(label, name)] = [float(value), low, high, value.std_error]
    mean = float(np.nanmean(np.asarray(fit.recording.rate_samples(), dtype=np.float64)))
    numbers["mean"] = [mean, None, None, None]
    effects: dict[str, float] = {}
    explained: dict[str, float] = {}
    for before, rung in itertools.pairwise(study.ladder):
        # An effect that takes the place of others explains what they explained.
        risen = rung.risen_since(before) + sum(explained.get(kind, 0.0) for kind in rung.removed)
        for effect in rung.new:
            own = risen
            if effect is not rung.added:
                place = next(i for i, e in enumerate(rung.fit.model) if e is effect)
                less = solution_without(rung.fit, place).log_likelihood
                own = min(risen, rung.fit.solution.log_likelihood - less)
            free = sum(p.role in {"coefficient", "shape", "time"} for p in effect.parameters)
            p = max(rung.trials or MIN_TRIALS, MIN_TRIALS) * float(
                chdtrc(free, max(2.0 * own, 0.0))
            )
            # Several effects of a kind, such as the lines of a comb, count as one: the clearest.
            effects[effect.kind] = min(1.0, p, effects.get(effect.kind, 1.0))
            explained[effect.kind] = max(own, explained.get(effect.kind, 0.0))
    there = {e.kind for e in fit.model}
    return {
        "model": fit.model.name,
        "verdict": study.verdict,
        "discrepancy_percent": fit.discrepancy.percent,
        "effects": json.dumps({kind: p for kind, p in effects.items() if kind in there}),
        "numbers": json.dumps(numbers),
    }


def run_fleet(
    source: str | Path | Sequence[str | Path],
    out: str | Path,
    *,
    model: str | Model = "N+B+K",
    rate: float | str | None = None,
    unit: str | None = None,
    scheduler: str | None = None,
    anyway: bool = False,
    deadline: float = DEADLINE,
    on_done: Callable[[int, int, str], None] | None = None,
    on_note: Callable[[str], None] | None = None,
) -> list[dict[str, Any]]:
    """List of rows (`rows_of`), one per axis of every log, each with its own model; the table is also written to `out`.

    Child processes work on the logs. A log that cannot be read, changes meanwhile, crashes its process, or exceeds its
    memory or `deadline` has one failed row, and does not affect the others. A journal next to the table stores each
    finished log. The next run with the same options takes these logs, recognized by content, from the journal, and
    works on all others, including failed ones. Raises `InputError` if there is no log, the table cannot be written, or
    an option cannot be used.

    `source` is as of `logs_of`, `model` the initial model, `rate` and `unit` as of `allanite.read`. `out` is Parquet,
    or text if it ends with ``.csv``. With `anyway`, logs that are mostly motion, or whose unit contradicts gravity, are
    used. `scheduler` is the address of a Dask scheduler; by default the processors of this machine are used. The memory
    limit of a log is ``ALLANITE_MEMORY``, by default an equal share of half of the free memory. `on_done` is called
    with (logs done, number of logs, path) after each log that was computed. `on_note` is called with a line about each
    unusable part of the journal; by default a warning.
    """
    if is_child():
        raise InputError(
            "run_fleet: a process for the logs runs your program again to find its effects:"
            " call run_fleet under if __name__ == '__main__':"
        )
    target = Path(out)
    check_target(target)
    if target.suffix.lower() != ".csv":
        # If pyarrow is missing, fail before the work.
        import pyarrow.parquet  # noqa: F401
    if not 0.0 < deadline < math.inf:
        raise InputError(f"deadline is {deadline:g} s: it must be above 0 s")
    logs = [str(path) for path in logs_without_table(logs_of(source), target)]
    journal = _journal_of(target)
    known = read_journal(journal, on_note or (lambda note: warnings.warn(note, stacklevel=3)))
    workers = 1 if scheduler is not None else min(len(logs), processors())
    setup = child_setup(model, rate, unit, anyway, deadline, workers, known)
    rows: list[dict[str, Any]] = []
    waiting = set(logs)
    had_table = target.exists()
    try:
        with Journal(journal) as file:
            for answer in _answers_of(logs, setup, scheduler, workers):
                found = answer.rows
                if found is None:
                    found = [{**row, "file": plain(answer.path)} for row in known[answer.key]]
                rows += found
                waiting.discard(answer.path)
                if answer.rows is not None and all(row["status"] == "done" for row in found):
                    file.add(answer.key, found)
                if answer.rows is not None and on_done is not None:
                    on_done(len(logs) - len(waiting), len(logs), answer.path)
    except BaseException:
        if rows and not had_table:
            why = "not reached before the run was ended: run it again"
            _write_sorted(rows + [failed_row(path, why) for path in waiting], target)
        raise
    return _write_sorted(rows, target)


def logs_without_table(logs: list[Path], target: Path) -> list[Path]:
    """The logs without the table `target` and its journal, which are recognized under any name (links).

    `InputError` if the table would replace a log, or if no log is left.
    """
    # `Path.resolve` fails for a loop of links.
    own = {os.path.realpath(place) for place in (target, _journal_of(target))}
    found = [path for path in logs if os.path.realpath(path) not in own]
    if len(found) < len(logs) and target.exists() and not _journal_of(target).exists():
        raise InputError(f"{target} is among the logs: give the table another name")
    if not found:
        raise InputError(f"{target} is the only file that was found: there is no log")
    return found


def child_setup(
    model: str | Model,
    rate: float | str | None,
    unit: str | None,
    anyway: bool,
    deadline: float,
    workers: int,
    known: dict[str, Any],
) -> Setup:
    """`Setup` (settings) of the child processes that work on the logs; `known` has the journal keys of finished logs.

    The memory limit of each child is an equal share of the memory budget, or ``ALLANITE_MEMORY`` if the user set it.
    """
    from allanite.readers import FORMATS
    from allanite.suggestion.suggest import SCREENS

    start = as_model(model)
    effects = tuple(e for e in CATALOG if not e.__module__.startswith("allanite."))
    settings = {
        "version": version(),
        "model": model_to_dict(start),
        "rate": rate if rate is None or isinstance(rate, str) else positive_rate(rate),
        "unit": unit,
        "anyway": anyway,
        "effects": [_name_with_digest(effect) for effect in effects],
        "formats": sorted(
            _name_with_digest(one.read)
            for one in FORMATS
            if not one.read.__module__.startswith("allanite.")
        ),
        "screens": sorted(
            _name_with_digest(one.look)
            for one in SCREENS.values()
            if not one.look.__module__.startswith("allanite.")
        ),
    }
    return Setup(
        start,
        rate,
        unit,
        anyway,
        deadline,
        int(budget() if VARIABLE in os.environ else budget() / workers),
        json.dumps(settings, sort_keys=True),
        frozenset(known),
        effects,
        tuple(path for path in sys.path if path),
        _main_program(effects),
    )


def _name_with_digest(declared: Any) -> str:
    """Text that identifies a class or function: its qualified name, and the SHA-256 of its source file, if any."""
    file = getattr(sys.modules.get(declared.__module__), "__file__", None)
    try:
        digest = "" if file is None else hashlib.sha256(Path(file).read_bytes()).hexdigest()
    except OSError:  # a module of an archive
        digest = ""
    return f"{declared.__module__}.{declared.__qualname__} {digest}".strip()


def _main_program(effects: Sequence[type[Effect]]) -> tuple[tuple[str, str], ...]:
    """Tuple of (key, value) pairs with which `multiprocessing` imports the running program in another process.

    Empty if none of the `effects` is declared in the running program. `InputError` for an effect that is declared at the
    prompt or in a notebook.
    """
    own = [effect for effect in effects if effect.__module__ == "__main__"]
    if not own:
        return ()
    from multiprocessing.spawn import get_preparation_data

    data = get_preparation_data("allanite fleet")
    found = tuple((k, str(v)) for k, v in data.items() if k.startswith("init_main_from"))
    if not found:
        raise InputError(
            f"the effect {own[0].__qualname__} is declared at the prompt or in a notebook, where no other process finds"
            " it: put it into a module and import that"
        )
    return found


def _answers_of(
    logs: list[str], setup: Setup, scheduler: str | None, workers: int
) -> Iterator[Answer]:
    """Yields the `Answer` of each log, in any order, from Dask or from `workers` threads with a child each.

    The child processes are killed when the generator is closed. Dask is used if `scheduler` (an address) is given.
    Raises the exception of a thread.
    """
    if scheduler is not None:
        yield from _answers_by_dask(logs, setup, scheduler)
        return
    waiting = deque(logs)
    answers: SimpleQueue[Answer | BaseException] = SimpleQueue()

    def work(process: LogProcess) -> None:
        """Put the answer of each waiting log, or an exception, which ends the work, into the queue `answers`."""
        try:
            while True:
                answers.put(process.answer(waiting.popleft()))
        except IndexError:
            process.close()
        except BaseException as error:  # the main thread raises it again
            answers.put(error)

    processes = [LogProcess(setup) for _ in range(workers)]
    threads = [Thread(target=work, args=(process,), daemon=True) for process in processes]
    for thread in threads:
        thread.start()
    try:
        for _ in logs:
            answer = answers.get()
            if isinstance(answer, BaseException):
                raise answer
            yield answer
    finally:
        waiting.clear()
        for process in processes:
            process.close()


def _answers_by_dask(logs: list[str], setup: Setup, scheduler: str) -> Iterator[Answer]:
    """Yields the `Answer` of each log from workers of a Dask scheduler at this address, in any order.

    A log whose worker is lost has a failed row. `InputError` if no scheduler answers.
    """
    from dask.distributed import Client, as_completed

    try:
        client = Client(scheduler)
    except (OSError, ValueError) as error:
        raise InputError(
            f"{scheduler}: no scheduler of Dask answers ({plain(error, 120)}): start one with dask scheduler"
        ) from None
    with client:
        (common,) = client.scatter([setup], hash=False)
        paths = {client.submit(_answer_in_child, common, path, pure=False): path for path in logs}
        for task in as_completed(list(paths)):
            path = paths.pop(task)
            try:
                yield task.result()
            except Exception as error:  # the worker of Dask was lost, or has no allanite
                what = plain(f"{type(error).__name__}: {error}", 200)
                yield Answer.failed(path, f"the workers of Dask failed ({what})")


def _answer_in_child(setup: Setup, path: str) -> Answer:
    """`Answer` of a log, from a new child process that ends afterwards."""
    with closing(LogProcess(setup)) as process:
        return process.answer(path)


def _write_sorted(rows: list[dict[str, Any]], target: Path) -> list[dict[str, Any]]:
    """List of the rows sorted by file and column. Side effect: writes this list to the file `target`."""
    rows = sorted(rows, key=lambda row: (row["file"], row["column"]))
    write_table(rows, target)
    return rows


def write_table(rows: list[dict[str, Any]], target: Path) -> None:
    """Write rows (dicts) to the file `target`: CSV if its name ends with ``.csv``, else Parquet.

    In a CSV, a text that a spreadsheet would evaluate as a formula gets an apostrophe in front; `without_quote` removes it.
    """
    names = list(dict.fromkeys(name for row in rows for name in row))
    table = {name: [row.get(name) for row in rows] for name in names}
    with whole_file(target) as draft:
        if target.suffix.lower() == ".csv":
            import csv

            with draft.open("w", newline="", encoding="utf-8") as file:
                writer = csv.writer(file)
                writer.writerow(names)
                for row in zip(*table.values(), strict=True):
                    cells = (spreadsheet_cell(c) if isinstance(c, str) else c for c in row)
                    writer.writerow(cells)
        else:
            import pyarrow as pa
            from pyarrow import parquet

            parquet.write_table(pa.table(table), draft)


def without_quote(text: str) -> str:
    """Original text of a CSV cell: `text` without the apostrophe that `write_table` put in front, if any."""
    return text[1:] if text.startswith("'") and spreadsheet_cell(text) != text else text
