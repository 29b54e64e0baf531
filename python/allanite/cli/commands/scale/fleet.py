"""allanite fleet: every log, every axis, one table."""

from __future__ import annotations

import click

from allanite.cli.options import DEFAULT_MODEL, RateType, json_option
from allanite.common.plain import plain


@click.command("fleet")
@click.argument("logs")
@click.option("--out", required=True, metavar="FILE", help="Table: Parquet, or CSV by its name.")
@click.option(
    "--model",
    default=DEFAULT_MODEL,
    show_default=True,
    metavar="MODEL",
    help="Where every ladder starts.",
)
@click.option("--rate", type=RateType(), metavar="HZ", help="Sampling rate.")
@click.option("--unit", metavar="UNIT", help="Unit of the samples.")
@click.option(
    "--anyway", is_flag=True, help="Use logs in motion, or whose unit contradicts gravity."
)
@click.option("--scheduler", metavar="ADDRESS", help="Scheduler of Dask, e.g. tcp://host:8786.")
@click.option(
    "--deadline",
    type=float,
    metavar="SECONDS",
    help="Longest time for one log.  [default: 3600]",
)
@json_option
@click.option("--quiet", is_flag=True, help="No progress.")
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
    """Improve a model of every axis of LOGS, a folder, a pattern or a list of paths in a file.

    Finished logs (recognized by content and options) are skipped; rerun to resume. A log that cannot be read or that
    crashes gets a row with the reason. Prints what the fleet has in common and which units deviate.
    """
    import sys

    from allanite.cli.output import dumps
    from allanite.effects.files import parse_model
    from allanite.scale import fleet, run_fleet
    from allanite.scale.logs import DEADLINE

    parse_model(model)

    shown = not quiet and sys.stderr.isatty()

    def on_done(done: int, total: int, path: str) -> None:
        if shown:
            click.echo(f"{done}/{total} {plain(path)}", err=True)

    def on_note(note: str) -> None:
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
    click.echo(dumps(found.to_dict()) if as_json else str(found))
