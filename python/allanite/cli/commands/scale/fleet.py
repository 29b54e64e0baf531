"""allanite fleet: build models for many logs."""

from __future__ import annotations

import sys

import click

from allanite.cli.options import json_option, noise_model_option, rate_type
from allanite.cli.output import json_text
from allanite.common.plain import plain


@click.command(
    "fleet",
    epilog="Example: allanite fleet logs/ --out fleet.csv --unit deg/s,m/s^2 --deadline 600",
)
@click.argument("logs")
@click.option(
    "--out",
    required=True,
    metavar="FILE",
    help="Table to write (.parquet or .csv): one row per axis.",
)
@noise_model_option("Model with which the search starts on every axis.")
@click.option(
    "--rate",
    type=rate_type,
    metavar="HZ",
    help="Sampling rate of all logs. Default: from their time stamps.",
)
@click.option("--unit", metavar="UNIT", help="Unit of the samples, for logs that do not state it.")
@click.option(
    "--anyway",
    is_flag=True,
    help="Do not refuse logs that are mostly motion, or whose unit contradicts gravity.",
)
@click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Compute on the Dask cluster with this scheduler, e.g. tcp://host:8786.",
)
@click.option(
    "--deadline",
    type=float,
    metavar="SECONDS",
    help="Abandon a log after this time; its row then holds the reason. The program first reads the bytes of each log to"
    " see whether an earlier run has processed the log; this time does not count. The next run tries the log again."
    "  [default: 3600]",
)
@json_option
@click.option("--quiet", is_flag=True, help="Print no progress.")
def command(
    logs: str,
    out: str,
    model: str,
    rate: float | str | None,
    unit: str | None,
    anyway: bool,
    scheduler: str | None,
    deadline: float | None,
    as_json: bool,
    quiet: bool,
) -> None:
    """Build a noise model for every axis of many logs.

    LOGS is a folder, a quoted pattern such as "logs/*.csv", or a text file with one path per line. Writes one table with
    the coefficients of every axis. Prints the typical values of the fleet and the sensors that deviate from them.

    Finished logs (recognized by content and options) are skipped; run the same command again to resume. A log that cannot
    be read, or that crashes the process, gets a row with the reason, and the next run tries it again. Exit codes: 0, also
    if logs failed; 3 if no axis could be characterized.
    """
    from allanite.effects.files import parse_model
    from allanite.scale import fleet, run_fleet
    from allanite.scale.logs import DEADLINE

    parse_model(model)

    shown = not quiet and sys.stderr.isatty()

    def on_done(done: int, total: int, path: str) -> None:
        """Print the progress on a terminal: `done` of `total` logs; nothing with --quiet."""
        if shown:
            click.echo(f"{done}/{total} {plain(path)}", err=True)

    def on_note(note: str) -> None:
        """Print a note about the journal as one line on standard error, after ``allanite:``."""
        click.echo(f"allanite: {plain(note)}", err=True)

    rows = run_fleet(
        logs,
        out,
        model=model,
        rate=rate,
        unit=unit,
        anyway=anyway,
        scheduler=scheduler,
        deadline=DEADLINE if deadline is None else deadline,
        on_done=on_done,
        on_note=on_note,
    )
    found = fleet(rows)
    click.echo(json_text(found.to_dict()) if as_json else str(found))
