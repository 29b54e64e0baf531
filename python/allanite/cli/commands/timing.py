"""allanite timing: test a clock or time server."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import click

from allanite.cli import output
from allanite.cli.options import LogCommand, LogOptions, log_options, read_recording
from allanite.common.errors import InputError, about

if TYPE_CHECKING:
    from allanite.recording import Recording


@click.command(
    "timing",
    cls=LogCommand,
    epilog="Example: allanite timing ptp4l.log --mask G.8273.2-C --after 1h",
)
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@click.option(
    "--mask",
    multiple=True,
    metavar="NAME",
    help="ITU-T mask to test: G.811 G.8262-1 G.8262-2 G.8272-A G.8272-B G.8273.2-A G.8273.2-B G.8273.2-C; repeatable.",
)
@click.option(
    "--after",
    multiple=True,
    metavar="TIME",
    help="Predict the time error of holdover this long after the last sample; repeatable. Default: 1h and 24h.",
)
@click.option(
    "--as-logged",
    is_flag=True,
    help="For the log of a servo: noise, frequency and holdover of the steered clock, not of the free-running clock.",
)
@click.option(
    "--hat",
    is_flag=True,
    help="Separate the Allan deviations of three or more clocks (three-cornered hat). Each column of LOG is the phase of"
    " one clock against the same reference. A clock much quieter than the others gets an upper limit.",
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
    """Test the phase (time error) of clocks and time servers.

    LOG is a log of ptp4l, phc2sys, ts2phc, chrony or ntpd, a PPS capture, or any log with a phase. A column in s, ms,
    us or ns (header or --unit) is taken for a phase. - reads standard input. Each LOG is tested by itself. Prints
    time error, MTIE and TDEV with the verdict of each --mask, jumps, frequency offset, drift, noise and predicted
    holdover error. MTIE is the maximum time interval error, TDEV the time deviation. The exit code is 0 also if a
    mask fails; the list "masks" of --json has the verdicts for scripts.

    "holdover after 1 h: expected 172 ns ± 1.62 ns (95 %)" describes the time error 1 h after the last sample, without the
    reference. It lies within 170.4 ns to 173.6 ns with 95 % probability. Compare the farther end with your requirement.

    The log of a servo also holds its frequency corrections. The corrections are removed: noise and frequency are
    those of the free-running clock. Holdover is predicted for the free-running clock with the last frequency that the
    servo set.
    """
    from allanite.clocks import AFTER, mask_named, timing
    from allanite.trends.design import seconds_of

    if hat:
        if mask or after or as_logged:
            raise InputError("--hat compares clocks: remove --mask, --after and --as-logged")
        _print_three_cornered_hat(logs, options)
        return
    masks = [mask_named(name) for name in mask]
    times = [seconds_of(text, None) for text in after] or AFTER
    found = []
    columns: list[Recording] = []
    for log in logs:
        recording, steering = _phase_and_corrections(log, options, as_logged=as_logged)
        with about(log):
            for column in recording:
                output.print_phase(f"{column.columns[0]}: noise models", options)
                found.append(timing(column, masks=masks, after=times, steering=steering))
        columns.append(recording)
    output.print_findings(columns, options)
    output.print_results(found, options)


def _phase_and_corrections(
    log: str, options: LogOptions, *, as_logged: bool
) -> tuple[Recording, tuple[str, float] | None]:
    """(`Recording` of the phase in a log, frequency corrections of its servo).

    The corrections are (column name, phase in s that one unit adds per second), or None without a servo or with
    `as_logged`.
    """
    first = read_recording(log, options, for_fit=False)
    names = frozenset(column.name for column in first.log_columns)
    if as_logged or names not in SERVOS:
        return first, None
    covariates = (*options.reading.covariates, "frequency")
    reading = replace(options.reading, covariate=covariates)
    again = replace(options, reading=reading, quiet=True)
    return read_recording(log, again, for_fit=False), ("frequency", SERVOS[names])


def _print_three_cornered_hat(logs: tuple[str, ...], options: LogOptions) -> None:
    """Print the Allan deviation of each clock of one log, whose columns are the clocks.

    Raises `InputError` for several logs.
    """
    from allanite.clocks import three_cornered_hat

    if len(logs) > 1:
        raise InputError("--hat: give one log, with a column for each clock")
    recording = read_recording(logs[0], options, for_fit=False)
    output.print_findings([recording], options)
    with about(logs[0]):
        found = three_cornered_hat(recording)
    output.print_results([found], options)


#: Columns of a servo's log → phase in s that 1 unit of its frequency column adds in 1 s. linuxptp (ppb) prints by how
#: much it speeds up the clock. chronyd (ppm) prints by how much the free clock gains, and corrects by the opposite. The
#: offset in ntpd's loopstats (ppm) has the opposite sign.
SERVOS: dict[frozenset[str], float] = {
    frozenset({"offset", "frequency", "delay"}): 1e-9,
    frozenset({"offset", "frequency", "skew"}): -1e-6,
    frozenset({"offset", "frequency"}): -1e-6,
}
