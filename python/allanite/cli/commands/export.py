"""allanite export: write parameters for a filter or simulator."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from allanite.cli.options import export_options
from allanite.common.errors import InputError
from allanite.common.files import write_text
from allanite.common.plain import plain
from allanite.common.validation import positive
from allanite.exports import TARGETS


@click.command("export", epilog="Example: allanite export imu.json --format kalibr -o imu.yaml")
@click.argument("models", nargs=-1, required=True, metavar="MODEL...")
@click.option(
    "--format",
    "target",
    type=click.Choice(tuple(TARGETS)),
    default="json",
    show_default=True,
    help="Filter or simulator that reads the file.",
)
@click.option(
    "--unit",
    metavar="UNIT",
    help="Unit of the samples, if MODEL does not state it, e.g. rad/s. For a table, one unit per column: rad/s,m/s^2.",
)
@click.option(
    "--rate",
    type=float,
    metavar="HZ",
    help="Rate at which the filter takes steps. Default: that of MODEL; PX4 100 Hz, ArduPilot 83.33 Hz, GLIM 10 scans per"
    " second.",
)
@export_options
@click.option(
    "--record-length",
    type=float,
    metavar="SECONDS",
    help="If MODEL is a table of Allan deviations: length of the record from which it was computed.",
)
@click.option(
    "--column",
    multiple=True,
    metavar="NAME",
    help="Axis to export, if MODEL holds several; repeatable. Default: all.",
)
@click.option("-o", "--output", metavar="FILE", help="File to write. Default: standard output.")
def command(
    models: tuple[str, ...],
    target: str,
    unit: str | None,
    rate: float | None,
    record_length: float | None,
    column: tuple[str, ...],
    output: str | None,
    how: dict[str, Any],
) -> None:
    """Write the parameters of a model as the file of a filter or simulator.

    MODEL is a file written with --save by fit, improve or characterize. Give one or more MODELs, each with one or
    several axes. If you have no log, MODEL may also be a data sheet (TOML, see allanite compare --help) or a table of Allan
    deviations. A YAML file of Kalibr or imu_utils, or a MATLAB script with gyroparams, works too. A model string needs
    units, as in "N(N=0.3 deg/sqrt(h))+B(B=5 deg/h)".

    Most filters only know white noise N and a random walk K. By default, N and K also cover other slow noise of the
    sensor, such as B and Gauss-Markov processes. A filter is then not overconfident up to the horizon. A coefficient that
    was not detected counts with its expected size, 0.64 times its 95 % limit. Each file has the units and the convention of
    its reader, such as a two-sided density in continuous time or a standard deviation per step; comments state them. The
    comment "Use:" says whether the file is fit for use. Further comments list what its format cannot state.
    """
    from allanite.exports import axes_named, axes_of, export, export_files

    if record_length is not None:
        positive(
            record_length, "--record-length", "s", "the length must be a positive number of seconds"
        )
    axes = []
    for model, own in zip(models, _units_of(unit, models), strict=True):
        axes += axes_of(model, own, rate=rate, record_length=record_length)
    axes = axes_named(axes, column)
    # Standard output holds one file, so `export` refuses several IMUs.
    texts = (
        {Path(): export(axes, target, rate, **how)}
        if output is None
        else export_files(axes, target, Path(output), rate, **how)
    )
    for axis in axes:
        if axis.warning:
            click.echo(
                plain(f"! {axis.name}: {axis.warning}; run allanite improve first"), err=True
            )
    if output is None:
        click.echo(texts[Path()], nl=False)
        return
    for path, text in texts.items():
        write_text(path, text)
    files = ", ".join(map(str, texts))
    click.echo(plain(f"{files}: {target} parameters of {', '.join(axis.name for axis in axes)}"))


def _units_of(unit: str | None, models: tuple[str, ...]) -> list[str | None]:
    """Unit (or None) of the samples of each model, from the text of --unit: one for all, or one per model.

    Raises `InputError` for any other number of units.
    """
    units = unit.split(",") if unit else [None]
    if len(units) == 1:
        return [units[0]] * len(models)
    if len(units) != len(models):
        raise InputError(
            f"--unit {unit}: {len(units)} units for {len(models)} models; give one unit, or one per model"
        )
    return [one.strip() for one in units if one is not None]
