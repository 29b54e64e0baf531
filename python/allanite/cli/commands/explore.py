"""allanite explore: the page."""

from __future__ import annotations

import click


@click.command("explore")
@click.argument("logs", nargs=-1, metavar="LOG...")
@click.option("--rate", type=float, metavar="HZ", help="Sampling rate.")
@click.option("--unit", metavar="UNIT", help="Unit of the samples.")
@click.option(
    "--quantity",
    type=click.Choice(["rate", "increment", "angle"]),
    help="What the samples are (default rate).",
)
@click.option("--time-column", metavar="NAME", help="Column of time stamps.")
@click.option("--output-unit", metavar="UNIT", help="Unit of the results.")
@click.option("--no-browser", is_flag=True, help="Only print the address.")
def command(
    logs: tuple[str, ...],
    rate: float | None,
    unit: str | None,
    quantity: str | None,
    time_column: str | None,
    output_unit: str | None,
    no_browser: bool,
) -> None:
    """Open a local page on LOGs: see the curves, add what is missing, watch the error fall.

    The page is served to this computer only, until Ctrl-C.
    """
    from pathlib import Path

    from allanite.common.errors import InputError
    from allanite.page import open_page
    from allanite.page.source import Reading, Source

    reading = Reading(rate, unit, quantity, time_column, output_unit)
    sources = []
    for log in logs:
        path = Path(log)
        if not path.exists():
            raise InputError(f"{log}: no such file")
        sources.append(Source(path.name, path.absolute(), reading=reading))
    page = open_page(sources)
    click.echo(f"{page.url}\nOpen this address on this computer; Ctrl-C ends.")
    if not no_browser:
        import webbrowser

        webbrowser.open(page.url)
    page.serve()
