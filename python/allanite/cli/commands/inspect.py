"""allanite inspect: what was understood of a log, before anything is computed."""

from __future__ import annotations

import click

from allanite.cli.options import LogOptions, log_options
from allanite.cli.pipe import NAME, PIPE, log_file, named
from allanite.cli.words import WORDS

__all__ = ["command"]


@click.command("inspect")
@click.argument("log")
@log_options
def command(log: str, options: LogOptions) -> None:
    """What is understood of LOG: role, unit, rate and first values of every column, and doubts."""
    from dataclasses import replace

    from allanite.cli import output
    from allanite.readers.inspection import inspect

    with log_file(log) as file, named(file, log):
        found = inspect(file, **options.reading())
    if log == PIPE:
        found = replace(found, path=NAME)
    if options.later and not options.quiet:
        names = ", ".join(options.later)
        click.echo(f"· this is of the whole log: {names} is for what computes", err=True)
    click.echo(
        output.dumps(found.to_dict()) if options.as_json else output.wrapped(found.worded(WORDS))
    )
