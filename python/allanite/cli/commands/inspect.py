"""allanite inspect: show how a log is read."""

from __future__ import annotations

from dataclasses import asdict, replace

import click

from allanite.cli import output
from allanite.cli.options import LogCommand, LogOptions, log_options
from allanite.cli.pipe import INPUT_NAME, STANDARD_INPUT, errors_name_input, log_file
from allanite.cli.words import WORDS


@click.command("inspect", cls=LogCommand, epilog="Example: allanite inspect imu.csv --unit deg/s")
@click.argument("log")
@log_options
def command(log: str, options: LogOptions) -> None:
    """Show how LOG is read, before anything is computed.

    Prints the role (sensor, time, temperature, other), unit, sampling rate and first values of each column. A column
    marked – is not used. The column "from" names the source of role and unit: header, file, option or guess. Doubts
    follow with the option that settles them, such as a missing unit or motion. LOG is a file, or - for standard input.
    """
    from allanite.readers.inspection import inspect

    with log_file(log) as file, errors_name_input(file, log):
        found = inspect(file, **asdict(options.reading))
    if log == STANDARD_INPUT:
        found = replace(found, path=INPUT_NAME)
    if options.after_reading and not options.quiet:
        names = ", ".join(options.after_reading)
        click.echo(f"· {names} ignored: inspect shows the whole log as it is read", err=True)
    click.echo(
        output.json_text(found.to_dict())
        if options.as_json
        else output.wrapped_to_terminal(found.worded(WORDS))
    )
