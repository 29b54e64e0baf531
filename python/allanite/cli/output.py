"""What leaves a command: JSON without NaN, tables, notes, figures, files whole or absent."""

from __future__ import annotations

import json
import math
import os
import re
import sys
import tempfile
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any

import click

from allanite.cli.words import WORDS
from allanite.common.errors import InputError
from allanite.common.plain import file_name

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from allanite.cli.options import LogOptions
    from allanite.cli.stream import Stream
    from allanite.fit import Fit
    from allanite.recording import Recording
    from allanite.report import Report

__all__ = [
    "check_target",
    "check_targets",
    "dumps",
    "notes",
    "plot",
    "progress",
    "progress_of_axes",
    "save_fits",
    "show",
    "whole_file",
    "write_report",
]


def dumps(document: Any) -> str:
    """JSON text; NaN and infinities become null, NumPy numbers plain ones."""
    return json.dumps(_plain(document), indent=1, ensure_ascii=False, allow_nan=False)


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    return value


def show(results: Sequence[Any], options: LogOptions) -> None:
    """Print results, one a column: JSON documents or tables under headings."""
    if options.as_json:
        documents = [result.to_dict() for result in results]
        one = len(documents) == 1
        click.echo(
            dumps(documents[0] if one else {"schema": documents[0]["schema"], "columns": documents})
        )
        return
    for i, result in enumerate(results):
        if len(results) > 1 and i:
            click.echo()
        click.echo(str(result))


def notes(columns: Sequence[Recording | Stream], options: LogOptions) -> None:
    """Print what the audit found, each remark once; JSON carries it in the document instead."""
    if options.as_json or options.quiet:
        return
    said: set[str] = set()
    for column in columns:
        for finding in column.audit:
            words = finding.worded(WORDS)
            if words not in said:
                said.add(words)
                click.echo(f"{'!' if finding.severity == 'warning' else '·'} {words}")
    if said:
        click.echo()


def check_target(path: str | Path) -> None:
    """Refuse a file that cannot be written before anything long is computed for it."""
    target = Path(path)
    if not target.parent.is_dir():
        raise InputError(f"{target}: the directory {target.parent} does not exist")
    if target.is_dir():
        raise InputError(f"{target} is a directory: give the name of a file")


def check_targets(plot: str | None = None, save: str | None = None) -> None:
    """Refuse --plot and --save targets early."""
    if plot is not None:
        if Path(plot).suffix.lower() not in (".svg", ".png", ".pdf"):
            raise InputError(f"--plot {plot}: the name must end in .svg, .png or .pdf")
        check_target(plot)
    if save is not None:
        check_target(save)


def save_fits(fits: Sequence[Fit], path: str) -> None:
    """Write fitted models as one file: a document, or one a column."""
    documents = [fit.to_dict() for fit in fits]
    one = {"schema": documents[0]["schema"], "columns": documents}
    with whole_file(path) as draft:
        draft.write_text(dumps(one if len(fits) > 1 else documents[0]) + "\n", encoding="utf-8")


@contextmanager
def whole_file(path: str | Path) -> Iterator[Path]:
    """Give a temporary path that takes the place of `path` when the block ends well."""
    target = Path(path)
    check_target(target)
    _sweep(target)
    try:
        descriptor, name = tempfile.mkstemp(
            suffix=target.suffix, prefix=f".{target.stem}-{os.getpid()}-", dir=target.parent
        )
    except OSError as error:
        raise InputError(f"{target}: cannot be written: {error.strerror or error}") from None
    os.close(descriptor)
    draft = Path(name)
    try:
        yield draft
        # mkstemp makes the file private; a result is as readable as any other new file.
        mask = os.umask(0)
        os.umask(mask)
        draft.chmod(0o666 & ~mask)
        draft.replace(target)
    except OSError as error:
        # Of a full disk the system does not say which file.
        raise InputError(f"{target}: cannot be written: {error.strerror or error}") from None
    finally:
        draft.unlink(missing_ok=True)


def _sweep(target: Path) -> None:
    """Remove the drafts of processes that were killed before they could."""
    pattern = re.compile(rf"\.{re.escape(target.stem)}-(\d+)-\w+{re.escape(target.suffix)}")
    with suppress(OSError):
        for path in target.parent.iterdir():
            match = pattern.fullmatch(path.name)
            if match and not _alive(int(match[1])):
                path.unlink(missing_ok=True)


def _alive(process: int) -> bool:
    if os.name != "posix":
        return True  # there a signal 0 would end it
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True
    return True


def plot(results: Sequence[Any], names: Sequence[str], path: str | None) -> None:
    """Write the figure of each result; several columns get their name into the file's."""
    if path is None:
        return
    for result, name in zip(results, names, strict=True):
        target = Path(path)
        if len(results) > 1:
            target = target.with_name(f"{target.stem}-{file_name(name)}{target.suffix}")
        with whole_file(target) as draft:
            result.plot(draft)


@contextmanager
def progress(label: str, options: LogOptions) -> Iterator[Callable[[int, int], None] | None]:
    """Give a callback (steps done, steps in all) drawing on stderr, if a terminal."""
    if options.quiet or not sys.stderr.isatty():
        yield None
        return
    with click.progressbar(length=1, label=label, file=sys.stderr) as bar:

        def report(done: int, total: int) -> None:
            bar.length = total
            bar.update(done - bar.pos)

        yield report


def write_report(report: Report, target: Path, interactive: bool = False) -> None:
    """Write a report whole, as HTML or as Markdown with its figures beside it."""
    from allanite.report.document import kind_of
    from allanite.report.markdown import write_figures

    folder = target.with_name(f"{target.stem}_figures")
    with whole_file(target) as draft:
        if kind_of(target) == "html":
            draft.write_text(report.to_html(interactive), encoding="utf-8")
        else:
            write_figures(report, folder)
            draft.write_text(report.to_markdown(folder.name), encoding="utf-8")


@contextmanager
def progress_of_axes(
    columns: int, options: LogOptions
) -> Iterator[Callable[[str, int, int], None] | None]:
    """Give a callback that shows what each axis is at, on a terminal."""
    if options.quiet or not sys.stderr.isatty():
        yield None
        return
    at: dict[str, int] = {}
    lock = Lock()

    def shown(_item: object) -> str:
        return " · ".join(f"{name} step {done}" for name, done in at.items())

    with click.progressbar(
        length=columns, label="axes", file=sys.stderr, item_show_func=shown
    ) as bar:

        def report(column: str, done: int, total: int) -> None:
            with lock:
                ended = done == total
                at[column] = done
                if ended:
                    del at[column]
                bar.update(int(ended), at)

        yield report
