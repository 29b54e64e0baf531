"""allanite trend: the rate of a series."""

from __future__ import annotations

import click

from allanite.cli.options import LogOptions, log_options


@click.command("trend")
@click.argument("log")
@click.option(
    "--per",
    type=click.Choice(["year", "day", "hour", "second"]),
    default="year",
    show_default=True,
    help="Time to which the rate refers.",
)
@click.option(
    "--step",
    multiple=True,
    metavar="TIME",
    help="Time of a step: 2012-03-04, 2012.17, or since the first sample: 120d, 3.5yr; repeatable.",
)
@click.option("--find-steps", is_flag=True, help="Look for steps at other times, too.")
@click.option(
    "--period",
    multiple=True,
    metavar="TIME",
    help="Period of a periodic term, e.g. 14.77d; repeatable. Default: 365.25d and 182.625d.",
)
@click.option(
    "--noise",
    metavar="MODEL",
    help="Noise model to use: N B K PL N+B N+K N+PL N+B+K. Default: chosen by evidence.",
)
@log_options
def command(
    log: str,
    per: str,
    step: tuple[str, ...],
    find_steps: bool,
    period: tuple[str, ...],
    noise: str | None,
    options: LogOptions,
) -> None:
    """Rate of a series with its uncertainty: heights of a GNSS station, a tide gauge, a gravimeter, the phase of a clock.

    An offset, a rate, steps, annual and semi-annual terms are fitted by generalized least squares. The noise (white,
    flicker, random walk, a power law) is fitted with them and chosen by evidence. --unit is the unit of the series, any
    text (m, mm, nm/s^2). Reads tenv, tenv3 and mom files, whose "# offset" lines count as steps, and every other log.
    """
    from dataclasses import replace
    from pathlib import Path

    from allanite.cli import output
    from allanite.cli.options import recording_of
    from allanite.common.errors import InputError, about
    from allanite.readers.texts.hector import offsets_of
    from allanite.trends import Trends, trend
    from allanite.trends.design import seconds_of

    if options.unit is None:
        raise InputError(f"{log}: give --unit, the unit of the series (m, mm, nm/s^2, s)")
    unit = options.unit
    # The series need not be one of a sensor: its unit is a name.
    recording = recording_of(
        log, replace(options, unit="1", quantity="rate", output_unit=None), for_fit=False
    )
    unit, factor = _shown(unit, options.output_unit)
    if factor != 1.0:
        recording = recording.with_samples(recording.samples * factor)
    with about(log), output.progress("noise models", options) as bar:

        def report(_column: str, done: int, total: int) -> None:
            if bar is not None:
                bar(done, total)

        found = trend(
            recording,
            unit=unit,
            per=per,
            steps=(*step, *offsets_of(Path(log))),
            find_steps=find_steps,
            periods=[seconds_of(text, None) for text in period] or None,
            model=noise,
            progress=report,
        )
    trends = found if isinstance(found, Trends) else Trends([found], recording.path)
    output.notes([recording], options)
    if options.as_json:
        click.echo(output.dumps(trends.to_dict()))
    else:
        click.echo(output.wrapped(str(trends)))


def _shown(unit: str, asked: str | None) -> tuple[str, float]:
    """Return the unit of the results, and by what the samples are multiplied for it."""
    from allanite.common.errors import InputError

    if asked is None or asked == unit:
        return unit, 1.0
    one, other = _scale(unit), _scale(asked)
    if one is None or other is None or unit[-1] != asked[-1]:
        raise InputError(
            f"--output-unit {asked}: results of a series in {unit} can be in m, cm, mm, um, nm, or in s, ms, us, ns"
        )
    return asked, one / other


def _scale(unit: str) -> float | None:
    """Return how many m or s a unit of length or time is, None of another unit."""
    prefixes = {"": 1.0, "c": 1e-2, "m": 1e-3, "u": 1e-6, "µ": 1e-6, "n": 1e-9}
    return prefixes.get(unit[:-1]) if unit[-1:] in ("m", "s") else None
