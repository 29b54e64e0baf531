"""allanite accept: does a part meet its data sheet?"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from allanite.cli.commands.improve import Percent
from allanite.cli.options import LogOptions, log_options

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.comparison.acceptance import Acceptance

#: Exit code of each verdict; 3 stands for a record that is too short to tell.
EXIT = {"meets": 0, "does not meet": 1, "undecided": 3}


class Margin(Percent):
    """Per cent of zero or more."""

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """The number of per cent."""
        if str(value).strip().removesuffix("%").strip() in ("0", "0.0"):
            return 0.0
        return super().convert(value, param, ctx)


@click.command("accept")
@click.argument("log")
@click.option(
    "--sheet",
    required=True,
    metavar="FILE",
    help="Data sheet (TOML, JSON); the format stands in allanite compare --help.",
)
@click.option(
    "--margin",
    type=Margin(),
    default=0.0,
    help="Allowance above the printed figures, e.g. 10%. Default 0.",
)
@click.option("--serial", default="", metavar="TEXT", help="Serial number of the part.")
@click.option("--date", default="", metavar="TEXT", help="Date of the test, for the report.")
@click.option("--report", metavar="FILE", help="One-page report (HTML).")
@click.option(
    "--csv", "as_csv", is_flag=True, help="One row for each figure, for production lines."
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
    """Compare every figure of a data sheet with the measured 95 % interval of LOG.

    A figure meets the sheet if its whole interval is at most the limit, and does not meet it if its whole interval is
    above. Otherwise it is undecided, with the record length that would probably decide. Exit codes: 0 all figures meet
    the sheet, 1 one does not, 3 undecided.
    """
    from pathlib import Path

    from allanite.cli import output
    from allanite.cli.options import columns_of
    from allanite.common.errors import InputError
    from allanite.common.files import check_target
    from allanite.common.units import parse_unit
    from allanite.comparison.acceptance import accept
    from allanite.report.acceptance import overall, save_acceptance
    from allanite.sources.datasheet import read_datasheet

    part = read_datasheet(sheet)
    if as_csv and options.as_json:
        raise InputError("--csv and --json both print to standard output: give one of them")
    if report is not None:
        if Path(report).suffix.lower() not in (".html", ".htm"):
            raise InputError(f"--report {report}: the name must end in .html")
        check_target(report)
    columns = columns_of(log, options)
    tested = [c for c in columns if part.of_kind(parse_unit(c.unit).kind).figures]
    if not tested:
        kinds = ", ".join(dict.fromkeys(parse_unit(c.unit).kind for c in columns))
        raise InputError(f"{sheet}: no figure for {kinds}, which is what {log} holds")
    skipped = [c.columns[0] for c in columns if c not in tested]
    if skipped and not options.quiet and not options.as_json:
        click.echo(f"· not tested, the sheet has no figure: {', '.join(skipped)}", err=True)
    found = []
    for column in tested:
        with output.progress(column.columns[0], options) as on_progress:
            found.append(accept(column, part, margin / 100.0, on_progress))
    if report is not None:
        save_acceptance(found, report, serial, date)
    if as_csv:
        click.echo(_csv(found, log, serial, date), nl=False)
    else:
        output.notes(tested, options)
        output.show(found, options)
    ctx.exit(EXIT[overall(found)])


def _csv(found: Sequence[Acceptance], log: str, serial: str, date: str) -> str:
    """Rows for a spreadsheet; a text that begins like a formula gets an apostrophe."""
    import csv
    import io

    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(
        [
            "log",
            "serial",
            "date",
            "axis",
            "figure",
            "unit",
            "limit",
            "measured",
            "low",
            "high",
            "verdict",
            "needs_s",
        ]
    )
    for one in found:
        for f in one.figures:
            texts = [log, serial, date, one.recording.columns[0], f.figure.name, f.unit]
            numbers: list[Any] = [f.limit, f.measured, f.low, f.high]
            cells = ["" if v is None else f"{v:.6g}" for v in numbers]
            needs = "" if f.needs is None else f"{f.needs:.4g}"
            writer.writerow([*map(_text, texts), *cells, f.verdict, needs])
    return stream.getvalue()


def _text(cell: str) -> str:
    return f"'{cell}" if cell[:1] in ("=", "+", "-", "@", "\t", "\r") else cell
