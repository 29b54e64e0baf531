"""Output of the commands: JSON, tables, notes, progress and figures."""

from __future__ import annotations

import json
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
import numpy as np

from allanite.cli.options import STYLE, finding_line, is_shown_early
from allanite.common.documents import jsonable
from allanite.common.errors import InputError
from allanite.common.files import check_target, write_text
from allanite.common.numbers import duration_text
from allanite.common.plain import file_name, plain
from allanite.common.threads import max_parallel_columns

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from allanite.cli.options import LogOptions
    from allanite.fit import Fit
    from allanite.plots.spec import Figure
    from allanite.recording import Recording
    from allanite.recording.record import Record

#: Time of a whole stepwise search divided by the time of its first step. Measured: 1 without additions, 2.5 after two
#: additions, 5 after five.
MAX_TIME_RATIO = 5.0


def json_text(document: Any) -> str:
    """JSON text of a document. NaN and infinities become null, NumPy arrays become lists."""
    return json.dumps(jsonable(document), indent=1, ensure_ascii=False, allow_nan=False)


def print_results(results: Sequence[Any], options: LogOptions) -> None:
    """Print results, one per column, as tables separated by blank lines, or with --json as one JSON document."""
    if options.as_json:
        click.echo(json_text(document_of(results)))
    else:
        click.echo("\n\n".join(wrapped_to_terminal(str(result)) for result in results))


def document_of(results: Sequence[Any]) -> dict[str, Any]:
    """Dict of a single result; several results are in the list ``columns``, with the schema of the first."""
    documents: list[dict[str, Any]] = [result.to_dict() for result in results]
    if len(documents) == 1:
        return documents[0]
    return {"schema": documents[0]["schema"], "columns": documents}


def terminal_width() -> int:
    """Characters per line, at least 60: COLUMNS if set, otherwise the width of the terminal, otherwise 100."""
    return max(get_terminal_size((100, 24)).columns, 60)


def wrapped_to_terminal(text: str) -> str:
    """Text with long sentences wrapped at the terminal's width; rows of tables stay on one line.

    A line with two blanks in a row counts as a row of a table. Without a terminal, the text is unchanged.
    """
    if not sys.stdout.isatty():
        return text
    limit = terminal_width()
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


def print_findings(columns: Sequence[Record], options: LogOptions, log: str = "") -> None:
    """Print the findings that were not shown before the computation, below the name of the log if it is given."""
    if options.as_json or options.quiet:
        return
    from allanite.recording.findings import merged

    findings = merged(f for column in columns for f in column.audit if not is_shown_early(f))
    if findings and log:
        click.echo(f"{plain(log)}:")
    for finding in findings:
        click.echo(wrapped_to_terminal(finding_line(finding, options)))
    if findings:
        click.echo()


def check_targets(plot: str | None = None, save: str | None = None) -> None:
    """Raise `InputError` if --plot or --save names no possible file; nothing is written.

    --plot must end in .svg, .png or .pdf.
    """
    if plot is not None:
        if Path(plot).suffix.lower() not in (".svg", ".png", ".pdf"):
            raise InputError(f"--plot {plot}: the name must end in .svg, .png or .pdf")
        check_target(plot)
    if save is not None:
        check_target(save)


def save_fits(fits: Sequence[Fit], path: str) -> None:
    """Write fitted models to one JSON file: one document, or for several fits an object with the list ``columns``."""
    write_text(path, json_text(document_of(fits)) + "\n")


def save_figures(figures: Iterable[Figure], names: Sequence[str], path: str | None) -> None:
    """Write each figure to `path`, or several to ``plot-gyro_x.svg`` and so on; draws nothing if `path` is None."""
    if path is None:
        return
    for figure, name in zip(figures, names, strict=True):
        target = Path(path)
        if len(names) > 1:
            target = target.with_name(f"{target.stem}-{file_name(name)}{target.suffix}")
        save_figure(figure, target)


def save_figure(figure: Figure, path: str | Path) -> None:
    """Write a figure to a file, in the style of the option --style."""
    context = click.get_current_context(silent=True)
    figure.save(path, style="screen" if context is None else context.meta.get(STYLE, "screen"))


@contextmanager
def progress(label: str, options: LogOptions) -> Iterator[Callable[[int, int], None] | None]:
    """Context with a callback (steps done, all steps) that draws a progress bar.

    The callback is None with --quiet, or if standard error is no terminal.
    """
    if options.quiet or not sys.stderr.isatty():
        yield None
        return
    with click.progressbar(length=1, label=label, file=sys.stderr) as bar:

        def report(done: int, total: int) -> None:
            """Draw the progress bar at `done` of `total` steps."""
            bar.length = total
            bar.update(done - bar.pos)

        yield report


def print_phase(name: str, options: LogOptions) -> None:
    """Print on standard error what the command does at the moment; nothing with --quiet or without a terminal."""
    if not options.quiet and sys.stderr.isatty():
        click.echo(f"· {name}", err=True)


@contextmanager
def progress_of_axes(
    columns: int, options: LogOptions
) -> Iterator[Callable[[str, int, int], None] | None]:
    """Context with a callback (column, steps done, all steps) that draws the progress of all axes.

    After the first step, the callback also prints a range of the total time. Its lower end is the time of this step
    times the number of axes per thread; its upper end is five times as long. The callback is None with --quiet, or if
    standard error is no terminal.
    """
    if options.quiet or not sys.stderr.isatty():
        yield None
        return

    at: dict[str, int] = {}
    lock = Lock()
    begin = monotonic()
    turns = -(-columns // max_parallel_columns())
    print_phase(f"{columns} axes, {max_parallel_columns()} at a time", options)

    def steps_shown(_item: object) -> str:
        """Text with the number of steps done on each running axis: ``gyro_x step 3 · gyro_y step 1``."""
        return " · ".join(f"{name} step {done}" for name, done in at.items())

    with click.progressbar(
        length=columns, label="axes", file=sys.stderr, item_show_func=steps_shown
    ) as bar:

        def report(column: str, done: int, total: int) -> None:
            """Draw the progress bar after step `done` of `total` on one axis; the axis is finished when both are equal.

            The first call also prints a lower and an upper estimate of the total time.
            """
            with lock:
                if not at and not bar.pos:
                    first = turns * (monotonic() - begin)
                    ends = (float(f"{ratio * first:.2g}") for ratio in (1.0, MAX_TIME_RATIO))
                    low, high = map(duration_text, ends)
                    click.echo(f"\r· about {low} to {high} in total", err=True)
                ended = done == total
                at[column] = done
                if ended:
                    del at[column]
                bar.update(int(ended), at)

        yield report


def write_csv(recording: Recording, path: Path | None) -> None:
    """Write seconds since the first sample and all columns as CSV with a header; without a path, to standard output."""
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
