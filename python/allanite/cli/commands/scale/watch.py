"""allanite watch: test whether a model still holds, sample by sample."""

from __future__ import annotations

import json
import signal
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from allanite.cli.first_rows import WatchedColumn, watched_column
from allanite.cli.live_source import Stop, is_file_source, samples_of_source
from allanite.cli.models import models_of
from allanite.cli.pipe import shown_path
from allanite.common.choices import QUANTITIES
from allanite.common.errors import InputError, about
from allanite.common.files import check_target, exists, write_text
from allanite.common.plain import plain
from allanite.common.units import rate_unit
from allanite.common.validation import positive

if TYPE_CHECKING:
    from allanite.scale import Watch


@click.command(
    "watch",
    epilog="Example: allanite watch imu.csv --model gyro_x.json --follow --state gyro_x.state",
)
@click.argument("source")
@click.option(
    "--model", required=True, metavar="MODEL", help="Model file, or a sum of effects with values."
)
@click.option(
    "--rate", type=float, metavar="HZ", help="Sampling rate. Default: from the model file."
)
@click.option(
    "--unit",
    metavar="UNIT",
    help="Unit of the samples. Default: from the header, otherwise that of the log to which the model was fitted.",
)
@click.option(
    "--quantity",
    type=click.Choice(QUANTITIES),
    default="rate",
    show_default=True,
    help="Meaning of the samples: rate, increment (its integral over one sample) or angle (its integral from the start;"
    " also a clock phase in s).",
)
@click.option(
    "--column",
    metavar="NAME",
    help="Name of the column, or its number from 0. Default: the column of the model file, otherwise the first sensor"
    " column.",
)
@click.option(
    "--state",
    metavar="FILE",
    help="Save the state of the watch after every printed line, and continue from it at the next start: evidence, alarm,"
    " and position in the source. FILE.summary next to it keeps all samples in summarized form, for a new fit. To start"
    " again, delete both files.",
)
@click.option(
    "--prometheus",
    metavar="FILE",
    help="Write the same numbers as Prometheus metrics (text format) to this file.",
)
@click.option(
    "--every",
    type=float,
    default=60.0,
    show_default=True,
    metavar="SECONDS",
    help="Print a line at least this many seconds of samples apart. Rows are read in blocks, so a line can come later.",
)
@click.option(
    "--follow", is_flag=True, help="At the end of the file, wait for more rows instead of ending."
)
def command(
    source: str,
    model: str,
    rate: float | None,
    unit: str | None,
    quantity: str,
    column: str | None,
    state: str | None,
    prometheus: str | None,
    every: float,
    follow: bool,
) -> None:
    """Watch the samples of a running sensor; raise an alarm when MODEL no longer holds.

    SOURCE is a growing text file, - for standard input, or udp://127.0.0.1:PORT. Each line is one row. One command watches
    one column; start one for each axis, each with its own --state. Prints a JSON
    line every --every seconds of samples, and one with the alarm. At most 1 % of runs raise a false alarm, however
    long they last. This holds if outliers are no more frequent than in a Student t distribution with 4 degrees of
    freedom. After an alarm the watch goes on and prints its lines, but it
    raises no second alarm. The exit code stays 0.

    With --state, rows of a file that an earlier run has read are skipped. Samples of a pipe or of UDP that arrive
    between two runs are lost. A file that is truncated or replaced is read from its first row.
    """
    from allanite.scale import Watch

    every = positive(every, "--every", "s", "write a positive number of seconds")
    for path in (state, prometheus):
        if path is not None:
            check_target(path)
    models = models_of(model)
    known = [one for one in models if one.column == column] or models
    if len(known) > 1:
        names = ", ".join(one.column for one in known)
        raise InputError(f"{model} holds the models of {names}: choose one with --column")
    chosen = known[0]
    rate = rate if rate is not None else chosen.rate
    if rate is None:
        raise InputError("no sampling rate in --model: add --rate HZ")
    with about("--unit"):
        given = None if unit is None else rate_unit(unit, quantity).name
    # The unit in a model file is that of the rate, whatever --quantity is. The samples are converted to it.
    own = chosen.unit or given or "1"
    watch = Watch(chosen.model, rate, own, quantity=quantity)
    if state is not None and exists(state):
        watch.restore(state)
        if not is_file_source(source):
            # Samples that arrived since the state was saved are lost.
            watch.interrupt()
    name = shown_path(source)

    def column_of(first: list[str]) -> WatchedColumn:
        """`WatchedColumn` from the first lines of the source; errors name the source."""
        with about(name):
            return watched_column(first, column, chosen, unit, quantity, name)

    motion = _MotionWarning(name, rate, own, watch.taken)
    lines = _WatchOutput(watch, state, prometheus, every * rate)
    stop = Stop()
    with stop.listening():
        rows = samples_of_source(source, column_of, stop, position=watch.position, follow=follow)
        try:
            for some in rows:
                if not some.follows:
                    watch.interrupt()
                raised = watch.update(some.samples)
                motion.add(some.samples)
                watch.position = some.position
                lines.advance(raised=raised is not None)
        finally:
            motion.finish()
            lines.finish()
    _exit_by_signal(stop)


class _MotionWarning:
    """Collects the first minute of a watch, and prints a warning if the sensor moves in it.

    A fit refuses a moving sensor, a watch does not: motion is one of the changes that a watch must report.
    """

    #: Length of the first part of the samples that is tested for motion, s.
    TESTED_SECONDS = 60.0

    def __init__(self, name: str, rate: float, unit: str, taken: int) -> None:
        self.name, self.rate, self.unit = name, rate, unit
        #: Samples of the first minute that have not arrived yet.
        self.left = max(round(self.TESTED_SECONDS * rate) - taken, 0)
        self.samples: list[Any] = []

    def add(self, samples: Any) -> None:
        """Add samples of the first minute; once it is complete, test it for motion."""
        if self.left:
            self.samples.append(samples[: self.left])
            self.left -= len(self.samples[-1])
            if not self.left:
                self.finish()

    def finish(self) -> None:
        """Test the samples collected so far for motion, print a warning if there is any, and collect no more."""
        from allanite.recording import Recording
        from allanite.recording.at_rest import motion_findings

        samples, self.samples, self.left = self.samples, [], 0
        if samples:
            recording = Recording(np.concatenate(samples), self.rate, unit=self.unit)
            for finding in motion_findings(recording):
                warning = (
                    f"! {plain(self.name)}: {finding.found}; an alarm may be due to the motion"
                )
                click.echo(warning, err=True)


class _WatchOutput:
    """Prints the JSON lines of a watch, and writes the files of --state and --prometheus with each line."""

    def __init__(
        self, watch: Watch, state: str | None, prometheus: str | None, samples: float
    ) -> None:
        self.watch, self.state, self.prometheus, self.samples = watch, state, prometheus, samples
        self.shown = watch.taken

    def advance(self, *, raised: bool) -> None:
        """Print the state of the test as a JSON line every --every seconds of samples, and if an alarm was `raised`."""
        if raised or self.watch.taken - self.shown >= self.samples:
            self._print()

    def finish(self) -> None:
        """Print a last line if samples have arrived since the previous line."""
        if self.watch.taken > self.shown:
            self._print()

    def _print(self) -> None:
        """Write the state file and the metrics file if they are wanted, and print the state of the test as a JSON line."""
        self.shown = self.watch.taken
        # The files come first, as printing fails if the reader of the output has ended.
        if self.state is not None:
            self.watch.save(self.state)
        if self.prometheus is not None:
            write_text(self.prometheus, self.watch.prometheus())
        click.echo(json.dumps(self.watch.to_dict(), allow_nan=False))


def _exit_by_signal(stop: Stop) -> None:
    """Raise `KeyboardInterrupt` after SIGINT and `SystemExit` (128 + signal) after SIGTERM; return without a signal."""
    if stop.signal == signal.SIGINT:
        raise KeyboardInterrupt
    if stop.signal is not None:
        # Shells report a command that ended by a signal with this code.
        raise SystemExit(128 + stop.signal)
