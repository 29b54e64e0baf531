"""What leaves a command: JSON without NaN, tables, notes, figures."""

from __future__ import annotations

import json
import math
import re
import sys
from contextlib import contextmanager, nullcontext
from pathlib import Path
from shutil import get_terminal_size
from textwrap import wrap
from threading import Lock
from time import monotonic
from typing import TYPE_CHECKING, Any

import click

from allanite.cli.words import words_of
from allanite.common.errors import InputError
from allanite.common.files import check_target, whole_file
from allanite.common.plain import file_name

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from allanite.cli.options import LogOptions
    from allanite.cli.stream import Stream
    from allanite.fit import Fit
    from allanite.plots.spec import Figure
    from allanite.recording import Recording

__all__ = [
    "check_targets",
    "dumps",
    "notes",
    "phase",
    "plot",
    "progress",
    "progress_of_axes",
    "save_figure",
    "save_fits",
    "show",
    "width",
    "wrapped",
    "write_csv",
]

#: Time of a whole study over that of its first step: measured 1 without additions, 2.5 after two; 5 after five.
STEPS = 5.0


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
        click.echo(wrapped(str(result)))


def width() -> int:
    """Letters of a line: the terminal's, or COLUMNS; 100 where there is none."""
    return max(get_terminal_size((100, 24)).columns, 60)


def wrapped(text: str) -> str:
    """Sentences broken at the terminal's width, below where they begin; rows of a table stay whole.

    What another program reads keeps its lines.
    """
    if not sys.stdout.isatty():
        return text
    limit = width()
    out = []
    for line in text.splitlines():
        indent = line[: len(line) - len(line.lstrip())]
        # Cells of a table are at least two spaces apart.
        if len(line) <= limit or "  " in line.strip():
            out.append(line)
            continue
        below = indent + ("   " if re.match(r"\d+\. ", line.strip()) else "  ")
        out += wrap(
            line, limit, subsequent_indent=below, break_long_words=False, break_on_hyphens=False
        )
    return "\n".join(out)


def notes(columns: Sequence[Recording | Stream], options: LogOptions) -> None:
    """Print what the audit found, each remark once; JSON carries it in the document instead."""
    if options.as_json or options.quiet:
        return
    from allanite.cli.options import said_early
    from allanite.recording.findings import merged

    found = (f for column in columns for f in column.audit if not said_early(f))
    said = merged(found)
    for finding in said:
        mark = "!" if finding.severity == "warning" else "·"
        click.echo(wrapped(f"{mark} {finding.worded(words_of(options.trim))}"))
    if said:
        click.echo()


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


def plot(results: Sequence[Any], names: Sequence[str], path: str | None) -> None:
    """Write the figure of each result; several columns get their name into the file's."""
    if path is None:
        return
    for result, name in zip(results, names, strict=True):
        target = Path(path)
        if len(results) > 1:
            target = target.with_name(f"{target.stem}-{file_name(name)}{target.suffix}")
        save_figure(result.plot(), target)


def save_figure(figure: Figure, path: str | Path) -> None:
    """Write a figure in the style that was asked for."""
    from allanite.cli.options import STYLE

    context = click.get_current_context(silent=True)
    figure.save(path, style="screen" if context is None else context.meta.get(STYLE, "screen"))


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


def phase(name: str, options: LogOptions) -> None:
    """Say on a terminal what is done now."""
    if not options.quiet and sys.stderr.isatty():
        click.echo(f"· {name}", err=True)


@contextmanager
def progress_of_axes(
    columns: int, options: LogOptions
) -> Iterator[Callable[[str, int, int], None] | None]:
    """Give a callback that shows what each axis is at, on a terminal, and how long all will take once one step is done."""
    if options.quiet or not sys.stderr.isatty():
        yield None
        return
    from allanite.common.threads import at_once

    at: dict[str, int] = {}
    lock = Lock()
    begin = monotonic()
    turns = -(-columns // at_once())
    phase(f"{columns} axes, {at_once()} at a time", options)

    def shown(_item: object) -> str:
        return " · ".join(f"{name} step {done}" for name, done in at.items())

    with click.progressbar(
        length=columns, label="axes", file=sys.stderr, item_show_func=shown
    ) as bar:

        def report(column: str, done: int, total: int) -> None:
            with lock:
                if not at and not bar.pos:
                    first = turns * (monotonic() - begin)
                    low, high = (_time(share * first) for share in (1.0, STEPS))
                    click.echo(f"\r· about {low} to {high}, by the first step", err=True)
                ended = done == total
                at[column] = done
                if ended:
                    del at[column]
                bar.update(int(ended), at)

        yield report


def _time(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 120 else f"{seconds / 60:.0f} min"


def write_csv(recording: Recording, path: Path | None) -> None:
    """Write time stamps and samples with a header, to the last digit; to standard output without a path."""
    import numpy as np

    with nullcontext(sys.stdout) if path is None else path.open("w", encoding="utf-8") as stream:
        header = [
            f"{name} [{unit}]"
            for name, unit in zip(recording.columns, recording.units, strict=True)
        ]
        stream.write(",".join(["time [s]", *header]) + "\n")
        samples = recording.samples.reshape(recording.n, -1)
        for start in range(0, recording.n, 65536):
            rows = samples[start : start + 65536]
            stamps = np.arange(start, start + len(rows)) / recording.rate
            stream.writelines(
                f"{stamp:.9g}," + ",".join(map(repr, row)) + "\n"
                for stamp, row in zip(stamps.tolist(), rows.tolist(), strict=True)
            )
