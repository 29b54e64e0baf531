"""allanite trend: rate of a time series."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import click

from allanite.cli import output
from allanite.cli.options import LogCommand, LogOptions, log_options, read_recording
from allanite.cli.pipe import log_file
from allanite.common.errors import InputError, about


@click.command(
    "trend",
    cls=LogCommand,
    epilog="Example: allanite trend station.tenv3 --unit m --output-unit mm --step 2012-03-04",
)
@click.argument("log")
@click.option(
    "--per",
    type=click.Choice(["year", "day", "hour", "second"]),
    default="year",
    show_default=True,
    help="Unit of time of the rate.",
)
@click.option(
    "--step",
    multiple=True,
    metavar="TIME",
    help="Known time of a step: a date (2012-03-04), a decimal year (2012.17), or a time after the first sample (120d,"
    " 3.5yr); repeatable.",
)
@click.option("--find-steps", is_flag=True, help="Also search for steps at unknown times.")
@click.option(
    "--period",
    multiple=True,
    metavar="TIME",
    help="Period of a sinusoid to fit, e.g. 14.77d; repeatable. Replaces the default, 365.25d and 182.625d for a record of"
    " a year or more: repeat these to keep them.",
)
@click.option(
    "--noise",
    metavar="MODEL",
    help="Noise model: N, B, K, PL, N+B, N+K, N+PL or N+B+K. Default: the one with the largest evidence.",
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
    """Estimate the rate of a time series: a GNSS height, a tide gauge, a gravimeter or a clock phase.

    An offset, a rate, steps, and annual and semi-annual sinusoids are fitted by generalized least squares. The sinusoids
    need a record of a year or more. The noise is estimated together with them: white noise, flicker noise, random walk, a
    power law, or a sum of these. Therefore the uncertainty of the rate includes the effect of colored noise.

    LOG is a tenv, tenv3 or mom file or any other log; - is standard input. "# offset" lines of a mom file count as known
    steps. --unit is the unit of the series, as any text (m, mm, nm/s^2). It is needed unless the header states it. Prints
    the rate, the offset, the steps, the sinusoids, the noise, and the standard error for other record lengths.
    """
    from allanite.readers.texts.hector import offsets_of
    from allanite.trends import trend_columns
    from allanite.trends.design import seconds_of

    with log_file(log) as file:
        reading = replace(options.reading, quantity="rate")
        own = replace(options, reading=reading, output_unit=None)
        # The unit of a series may be any text, which `read` does not know.
        unitless = replace(own, reading=replace(reading, unit="1"))
        try:
            recording = read_recording(log, unitless, for_fit=False, copy=file)
        except InputError as error:
            if error.missing != "unit":
                raise
            # The log states a unit that `read` knows.
            recording = read_recording(log, own, for_fit=False, copy=file)
    stated = {c.unit for c in recording.log_columns if c.name in recording.columns}
    unit = options.reading.unit or (stated.pop() if len(stated) == 1 else None)
    if unit is None or (unit == "1" and options.reading.unit is None):
        raise InputError(
            f"{log}: the unit of the series is missing: add --unit, e.g. m, mm, nm/s^2 or s"
        )
    unit, factor = _output_unit_and_factor(unit, options.output_unit)
    if factor != 1.0:
        recording = recording.with_samples(recording.samples * factor)
    with about(log), output.progress("noise models", options) as bar:
        trends = trend_columns(
            recording,
            unit=unit,
            per=per,
            steps=(*step, *offsets_of(Path(log))),
            find_steps=find_steps,
            periods=[seconds_of(text, None) for text in period] or None,
            model=noise,
            progress=None if bar is None else lambda _column, done, total: bar(done, total),
        )
    output.print_findings([recording], options)
    output.print_results([trends], options)


def _output_unit_and_factor(unit: str, requested: str | None) -> tuple[str, float]:
    """(unit of the results, factor by which the samples are multiplied to get this unit).

    Lengths (m, cm, mm, um, nm) can be converted to each other, as can times (s, ms, us, ns). Without `requested`, the
    unit stays and the factor is 1. Raises `InputError` for any other pair of different units.
    """
    if requested is None or requested == unit:
        return unit, 1.0
    one, other = _unit_size(unit), _unit_size(requested)
    if one is None or other is None or unit[-1] != requested[-1]:
        raise InputError(
            f"--output-unit {requested}: cannot convert from {unit}; conversions exist between m, cm, mm, um, nm, and"
            " between s, ms, us, ns"
        )
    return requested, one / other


def _unit_size(unit: str) -> float | None:
    """Size in meters of m, cm, mm, um (µm) or nm, or in seconds of s, cs, ms, us (µs) or ns; None for any other unit."""
    prefixes = {"": 1.0, "c": 1e-2, "m": 1e-3, "u": 1e-6, "µ": 1e-6, "n": 1e-9}
    return prefixes.get(unit[:-1]) if unit[-1:] in ("m", "s") else None
