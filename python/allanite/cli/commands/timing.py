"""allanite timing: a clock or time server."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from allanite.cli.options import LogOptions, log_options

if TYPE_CHECKING:
    from allanite.recording import Recording


@click.command("timing")
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@click.option(
    "--mask",
    multiple=True,
    metavar="NAME",
    help="Limits to test: G.811 G.812-I G.812-II G.8262-1 G.8262-2 G.8272-A G.8272-B G.8273.2-A -B -C; repeatable.",
)
@click.option(
    "--after",
    multiple=True,
    metavar="TIME",
    help="Time after the last sample for which holdover is predicted; repeatable. Default: 1h and 24h.",
)
@click.option(
    "--as-logged",
    is_flag=True,
    help="Predict the steered clock of a servo's log, not the free clock.",
)
@click.option(
    "--hat",
    is_flag=True,
    help="Allan deviation of each of three or more clocks whose phases against one reference are columns of LOG.",
)
@log_options
def command(
    logs: tuple[str, ...],
    mask: tuple[str, ...],
    after: tuple[str, ...],
    as_logged: bool,
    hat: bool,
    options: LogOptions,
) -> None:
    """Time error, MTIE and TDEV against ITU-T masks, jumps, frequency, drift, noise and holdover of clocks.

    Reads logs of ptp4l, phc2sys, ts2phc, chrony, ntpd and PPS captures, and phases of any other log. The log of a servo has
    its frequency: without it, noise and holdover are those of the free clock.
    """
    from allanite.cli import output
    from allanite.clocks import AFTER, mask_named, timing
    from allanite.common.errors import about
    from allanite.trends.design import seconds_of

    if hat:
        _hat(logs, options)
        return
    masks = [mask_named(name) for name in mask]
    times = [seconds_of(text, None) for text in after] or AFTER
    found = []
    columns: list[Recording] = []
    for log in logs:
        recording, steering = _read(log, options, as_logged=as_logged)
        with about(log):
            for column in recording:
                output.phase(f"{column.columns[0]}: noise models", options)
                found.append(timing(column, masks=masks, after=times, steering=steering))
        columns.append(recording)
    output.notes(columns, options)
    if options.as_json:
        documents = [one.to_dict() for one in found]
        one = documents[0] if len(documents) == 1 else None
        click.echo(output.dumps(one or {"schema": "allanite/timing/1", "columns": documents}))
    else:
        click.echo(output.wrapped("\n\n".join(map(str, found))))


def _read(
    log: str, options: LogOptions, *, as_logged: bool
) -> tuple[Recording, tuple[str, float] | None]:
    """Return the phase of a log, and its column of the servo's frequency with what 1 of it does to the phase in 1 s."""
    from dataclasses import replace

    from allanite.cli.options import recording_of

    first = recording_of(log, options, for_fit=False)
    names = frozenset(column.name for column in first.log_columns)
    if as_logged or names not in SERVOS:
        return first, None
    covariates = (*options.covariate, "frequency")
    again = replace(options, covariate=covariates, quiet=True)
    return recording_of(log, again, for_fit=False), ("frequency", SERVOS[names])


def _hat(logs: tuple[str, ...], options: LogOptions) -> None:
    """Print the Allan deviation of each clock of one log."""
    from allanite.cli import output
    from allanite.cli.options import recording_of
    from allanite.clocks import three_cornered_hat
    from allanite.common.errors import InputError, about

    if len(logs) > 1:
        raise InputError("--hat: give one log, with a column for each clock")
    recording = recording_of(logs[0], options, for_fit=False)
    output.notes([recording], options)
    with about(logs[0]):
        found = three_cornered_hat(recording)
    click.echo(output.dumps(found.to_dict()) if options.as_json else str(found))


#: Columns of a servo's log → phase that 1 of its frequency adds in 1 s. linuxptp (ppb) prints by how much it speeds the
#: clock up; chronyd (ppm) by how much the clock would gain, and sets the opposite; the offset of ntpd's loopstats is of
#: the opposite sign.
SERVOS: dict[frozenset[str], float] = {
    frozenset({"offset", "frequency", "delay"}): 1e-9,
    frozenset({"offset", "frequency", "skew"}): -1e-6,
    frozenset({"offset", "frequency"}): -1e-6,
}
