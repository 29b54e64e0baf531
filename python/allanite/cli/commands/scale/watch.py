"""allanite watch: does the model still hold?"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from allanite.cli.live_source import Stop
    from allanite.scale import Watch


@click.command("watch")
@click.argument("source")
@click.option("--model", required=True, metavar="MODEL", help="Model with values, or a file.")
@click.option("--rate", type=float, metavar="HZ", help="Sampling rate; default the model file's.")
@click.option("--unit", metavar="UNIT", help="Unit of the samples; default the model file's.")
@click.option(
    "--quantity",
    type=click.Choice(["rate", "increment", "angle"]),
    default="rate",
    show_default=True,
    help="What the samples are; angle is also the phase of a clock, in s.",
)
@click.option(
    "--column",
    metavar="NAME",
    help="Column, or its number from 0; default the model file's, else the first that is no time.",
)
@click.option(
    "--state", metavar="FILE", help="State to continue from; it is saved with every line."
)
@click.option("--prometheus", metavar="FILE", help="Write the numbers for Prometheus to this file.")
@click.option(
    "--every",
    type=float,
    default=60.0,
    show_default=True,
    metavar="S",
    help="Seconds of samples between two lines.",
)
@click.option("--follow", is_flag=True, help="Wait for more rows at the end of a file.")
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
    """Watch SOURCE: a growing text file, - for standard input, or udp://127.0.0.1:PORT.

    Prints a JSON line from time to time, and an alarm when the model no longer holds. At most one run in a hundred raises a
    false alarm, however long the runs are. Each line of the source is one row. Rows of a file that --state has seen are
    skipped. A file that is truncated or replaced is read from its first row.
    """
    from pathlib import Path

    from allanite.cli.first_rows import place_of
    from allanite.cli.live_source import Stop, is_file, rows_of
    from allanite.cli.models import models_of
    from allanite.cli.pipe import NAME, PIPE
    from allanite.common.errors import InputError, about
    from allanite.common.units import rate_unit
    from allanite.scale import Watch

    models = models_of(model)
    known = [one for one in models if one.column == column] or models
    if len(known) > 1:
        names = ", ".join(one.column for one in known)
        raise InputError(f"{model} holds the models of {names}: name one of them with --column")
    chosen = known[0]
    rate = rate if rate is not None else chosen.rate
    if rate is None:
        raise InputError("no sampling rate: give --rate HZ beside --model")
    with about("--unit"):
        # A model file has the unit of the rate.
        unit = (
            rate_unit(chosen.unit or "1", "rate") if unit is None else rate_unit(unit, quantity)
        ).name
    watch = Watch(chosen.model, rate, unit, quantity=quantity)
    if state is not None and Path(state).is_file():
        watch.restore(state)
        if not is_file(source):
            # What came while nobody listened is not known.
            watch.interrupt()
    name = NAME if source == PIPE else source

    def column_of(first: list[str]) -> int:
        with about(name):
            return place_of(first, column, chosen.column, name)

    start = _Start(name, rate, unit, watch.taken)
    report = _Report(watch, state, prometheus, every * rate)
    stop = Stop()
    with stop.listening():
        rows = rows_of(source, column_of, stop, position=watch.position, follow=follow)
        try:
            for some in rows:
                if not some.follows:
                    watch.interrupt()
                raised = watch.update(some.samples)
                start.take(some.samples)
                watch.position = some.position
                report.advance(raised=raised is not None)
        finally:
            start.finish()
            report.finish()
    _end(stop)


class _Start:
    """Says once that the sensor moves in the first minute of a watch: an alarm is then of its motion.

    A watch is not refused, as a fit is: a sensor that is watched may be carried away later as well.
    """

    SECONDS = 60.0

    def __init__(self, name: str, rate: float, unit: str, taken: int) -> None:
        self.name, self.rate, self.unit = name, rate, unit
        #: Samples that are still to come.
        self.left = max(round(self.SECONDS * rate) - taken, 0)
        self.samples: list[Any] = []

    def take(self, samples: Any) -> None:
        """Take samples, and judge the first minute once it is complete."""
        if self.left:
            self.samples.append(samples[: self.left])
            self.left -= len(self.samples[-1])
            if not self.left:
                self.finish()

    def finish(self) -> None:
        """Judge what there is."""
        import numpy as np

        from allanite.common.plain import plain
        from allanite.recording import Recording
        from allanite.recording.at_rest import finding_of

        samples, self.samples, self.left = self.samples, [], 0
        if samples:
            recording = Recording(np.concatenate(samples), self.rate, unit=self.unit)
            for finding in finding_of(recording):
                said = f"! {plain(self.name)}: {finding.found}; an alarm may be of the motion"
                click.echo(said, err=True)


class _Report:
    """Prints the lines of a watch, and writes its files with each line."""

    def __init__(
        self, watch: Watch, state: str | None, prometheus: str | None, samples: float
    ) -> None:
        self.watch, self.state, self.prometheus, self.samples = watch, state, prometheus, samples
        self.shown = watch.taken

    def advance(self, *, raised: bool) -> None:
        """Print a line after enough samples, or after an alarm."""
        if raised or self.watch.taken - self.shown >= self.samples:
            self._print()

    def finish(self) -> None:
        """Print the last line, unless there are no samples since the one before."""
        if self.watch.taken > self.shown:
            self._print()

    def _print(self) -> None:
        import json

        from allanite.common.files import whole_file

        self.shown = self.watch.taken
        # The files first: nobody may read the output.
        if self.state is not None:
            self.watch.save(self.state)
        if self.prometheus is not None:
            with whole_file(self.prometheus) as draft:
                draft.write_text(self.watch.prometheus(), encoding="utf-8")
        click.echo(json.dumps(self.watch.to_dict(), allow_nan=False))


def _end(stop: Stop) -> None:
    """End as the signal asks for, now that nothing is lost."""
    import signal

    if stop.signal == signal.SIGINT:
        raise KeyboardInterrupt
    if stop.signal is not None:
        # As a shell tells of a command that a signal has ended.
        raise SystemExit(128 + stop.signal)
