"""allanite accept: test a sensor against its data sheet."""

from __future__ import annotations

import csv
import io
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from allanite.cli import output
from allanite.cli.options import LogCommand, LogOptions, log_options, percent, read_columns
from allanite.common.errors import InputError
from allanite.common.files import check_target, write_text
from allanite.common.plain import spreadsheet_cell
from allanite.common.units import parse_unit

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.comparison.acceptance import Acceptance

#: Exit code of each verdict; 3 stands for a record that is too short to tell.
EXIT_CODES = {"meets": 0, "does not meet": 1, "undecided": 3}


@click.command(
    "accept",
    cls=LogCommand,
    epilog="Example: allanite accept gyro-0042.csv --sheet sheet.toml --margin 10% --report gyro-0042.html",
)
@click.argument("log")
@click.option(
    "--sheet",
    required=True,
    metavar="FILE",
    help="Data sheet as a TOML or JSON file. allanite compare --help shows the format.",
)
@click.option(
    "--margin",
    type=percent,
    metavar="PERCENT",
    default=0.0,
    help="Raise every limit of the sheet by this percentage, e.g. 10%. Default: 0.",
)
@click.option("--serial", default="", metavar="TEXT", help="Serial number, for the report and CSV.")
@click.option(
    "--date", default="", metavar="TEXT", help="Date of the test, for the report and CSV."
)
@click.option("--report", metavar="FILE", help="Write a one-page report (.html).")
@click.option(
    "--csv", "as_csv", is_flag=True, help="Print CSV instead of a table: one row per figure."
)
@log_options
@click.pass_context
def command(
    ctx: click.Context,
    log: str,
    sheet: str,
    margin: float,
    serial: str,
    date: str,
    report: str | None,
    as_csv: bool,
    options: LogOptions,
) -> None:
    """Test the sensor in LOG against the limits of its data sheet.

    LOG is a file, or - for standard input. Each figure (limit) of the sheet is measured with a 95 % interval. The verdict
    is "meets" if the upper end of the interval is at or below the limit, and "does not meet" if the lower end is above it.
    Otherwise the figure is undecided. The table then shows the record length that would probably decide, unless it
    exceeds 30 days or the model has no such coefficient.

    Coefficients, such as N, B and K, come from a model of the log. The model is built as in allanite improve, so lines,
    outliers and a logged temperature do not count as noise. in_run_bias_stability is the measured Allan deviation at
    the averaging time where the curve of the fitted model is lowest. Lines, outliers and temperature do raise this value.

    Prints a table for each tested axis, with one row per figure. An axis is tested if the sheet has figures for its kind
    of sensor. The exit code is that of the worst axis: 0 if every figure meets the sheet, and 1 if one does not meet. It
    is 3 if no figure fails, but at least one is undecided. It is also 3 if the log is too short to test, and 2 if the
    log or an option is wrong.

    For several units, run the command for each log. allanite fleet does not compare with a sheet.
    """
    from allanite.comparison.acceptance import accept
    from allanite.report.acceptance import acceptance_page, overall_verdict
    from allanite.sources.datasheet import read_datasheet

    part = read_datasheet(sheet)
    if as_csv and options.as_json:
        raise InputError("--csv and --json both use standard output: give only one of them")
    if report is not None:
        if Path(report).suffix.lower() not in (".html", ".htm"):
            raise InputError(f"--report {report}: the name must end in .html")
        check_target(report)
    columns = read_columns(log, options)
    tested = [c for c in columns if part.of_kind(parse_unit(c.unit).kind).figures]
    if not tested:
        kinds = ", ".join(dict.fromkeys(parse_unit(c.unit).kind for c in columns))
        raise InputError(f"{sheet} has no figure for {kinds}, the kind of sensor in {log}")
    skipped = [c.columns[0] for c in columns if c not in tested]
    if skipped and not options.quiet and not options.as_json:
        click.echo(f"· not tested (no figure in the sheet): {', '.join(skipped)}", err=True)
    found = []
    for column in tested:
        with output.progress(column.columns[0], options) as on_progress:
            found.append(accept(column, part, margin / 100.0, on_progress))
    if report is not None:
        write_text(report, acceptance_page(found, serial, date))
    if as_csv:
        click.echo(_csv_text(found, log, serial, date), nl=False)
    else:
        output.print_findings(tested, options)
        output.print_results(found, options)
    ctx.exit(EXIT_CODES[overall_verdict(found)])


def _csv_text(found: Sequence[Acceptance], log: str, serial: str, date: str) -> str:
    """CSV text with a header and one row per axis and figure of the data sheet; a missing number is an empty cell."""
    stream = io.StringIO()
    stream.write("log,serial,date,axis,figure,unit,limit,measured,low,high,verdict,needs_s\n")
    writer = csv.writer(stream, lineterminator="\n")
    for one in found:
        for f in one.figures:
            texts = [log, serial, date, one.recording.columns[0], f.figure.name, f.unit]
            numbers: list[Any] = [f.limit, f.measured, f.low, f.high]
            cells = ["" if v is None else f"{v:.6g}" for v in numbers]
            needs = "" if f.needs is None else f"{f.needs:.4g}"
            writer.writerow([*map(spreadsheet_cell, texts), *cells, f.verdict, needs])
    return stream.getvalue()
