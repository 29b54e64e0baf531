"""allanite explore: the local web page."""

from __future__ import annotations

from pathlib import Path

import click

from allanite.common.choices import QUANTITIES
from allanite.common.errors import InputError
from allanite.common.read_options import ReadOptions


@click.command("explore", epilog="Example: allanite explore imu.csv")
@click.argument("logs", nargs=-1, metavar="LOG...")
@click.option(
    "--rate",
    type=float,
    metavar="HZ",
    help="Sampling rate. Default: from the time stamps or the file.",
)
@click.option(
    "--unit",
    metavar="UNIT",
    help="Unit of the samples, if the log does not state it, e.g. deg/s; for two kinds of sensor deg/s,m/s^2.",
)
@click.option(
    "--quantity",
    type=click.Choice(QUANTITIES),
    help="Meaning of the samples: rate (default), increment (its integral over one sample) or angle (its integral from"
    " the start; also velocity or clock phase).",
)
@click.option("--time-column", metavar="NAME", help="Column of time stamps.")
@click.option("--output-unit", metavar="UNIT", help="Unit of the results, e.g. deg/h.")
@click.option("--no-browser", is_flag=True, help="Print the address but open no browser.")
def command(
    logs: tuple[str, ...],
    rate: float | None,
    unit: str | None,
    quantity: str | None,
    time_column: str | None,
    output_unit: str | None,
    no_browser: bool,
) -> None:
    """Open a local web page with the Allan curves of the LOGs.

    The page shows where a model fails and suggests missing effects. Each effect that you add is fitted, and the page shows
    by how much the error falls. Logs can also be opened on the page, and a segment of the log can be chosen there. Only
    this computer can reach the page. Press Ctrl-C to end.
    """
    from allanite.page import open_page
    from allanite.page.source import Reading, Source

    options = ReadOptions(rate, unit, quantity, time_column=time_column)
    reading = Reading(options, output_unit)
    sources = []
    for log in logs:
        path = Path(log)
        if not path.exists():
            raise InputError(f"{log}: no such file")
        sources.append(Source(path.name, path.absolute(), reading=reading))
    page = open_page(sources)
    click.echo(f"{page.url}\nOpen this address in a browser on this computer; Ctrl-C ends.")
    if not no_browser:
        import webbrowser

        webbrowser.open(page.url)
    page.serve()
