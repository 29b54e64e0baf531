"""allanite export: parameters for a filter or simulator."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from allanite.cli.options import INFLATE
from allanite.common.plain import plain
from allanite.export import TARGETS


@click.command("export")
@click.argument("models", nargs=-1, required=True, metavar="MODEL...")
@click.option(
    "--format",
    "target",
    type=click.Choice(tuple(TARGETS)),
    default="json",
    show_default=True,
    help="Target.",
)
@click.option(
    "--unit",
    metavar="UNIT",
    help="Unit of the samples, for sources that do not state it; of a table, one for each column: rad/s,m/s^2.",
)
@click.option("--rate", type=float, metavar="HZ", help="Sampling rate, where the target needs one.")
@click.option(
    "--overbound",
    is_flag=True,
    help="Smallest N and K that cover the 95 % limits of the model and its alternatives.",
)
@click.option(
    "--as-fitted",
    is_flag=True,
    help="The fitted coefficients alone: B, lags and lines are left out.",
)
@click.option(
    "--horizon",
    "--until",
    type=float,
    metavar="SECONDS",
    help="Longest time without aiding (default: 100 s, or a tenth of the log if shorter).",
)
@INFLATE
@click.option(
    "--record-length",
    type=float,
    metavar="SECONDS",
    help="Length of the record behind a table of Allan deviations.",
)
@click.option(
    "--column", multiple=True, metavar="NAME", help="Axis of a file of several; repeatable."
)
@click.option("-o", "--output", metavar="FILE", help="File to write; default stdout.")
def command(
    models: tuple[str, ...],
    target: str,
    unit: str | None,
    rate: float | None,
    overbound: bool,
    as_fitted: bool,
    horizon: float | None,
    inflate: float,
    record_length: float | None,
    column: tuple[str, ...],
    output: str | None,
) -> None:
    """Write a parameter file for a filter or simulator.

    By default N and K follow the whole model up to the horizon: a bias filter with them is not overconfident.

    MODEL is a saved fit, or a source without a log: a data sheet (TOML, see docs/howto/data-sheet.md), a YAML file of
    Kalibr or imu_utils, a MATLAB script with gyroparams, a table of Allan deviations, or a model string with units such
    as "N(N=0.3 deg/sqrt(h))+B(B=5 deg/h)". Several models are several axes: three of a gyroscope, three of an
    accelerometer.
    """
    from allanite.common.files import whole_file
    from allanite.common.validation import positive
    from allanite.export import export, export_files
    from allanite.export._axis import axes_of
    from allanite.recording.samples import find_column
    from allanite.sources import documents_of

    if record_length is not None:
        positive(
            record_length, "--record-length", "s", "the length must be a positive number of seconds"
        )
    axes = []
    for model, own in zip(models, _units_of(unit, models), strict=True):
        axes += axes_of(documents_of(model, own, rate, record_length), own, model)
    if column:
        names = [axis.name for axis in axes]
        axes = [axes[find_column(name, names)] for name in column]
    how: dict[str, Any] = {"overbound": overbound, "as_fitted": as_fitted}
    how |= {"horizon": horizon, "inflate": inflate}
    # On stdout there is one file: several IMUs are refused there.
    texts = (
        {Path(): export(axes, target, rate, **how)}
        if output is None
        else export_files(axes, target, Path(output), rate, **how)
    )
    for axis in axes:
        if axis.warning:
            click.echo(plain(f"! {axis.name}: {axis.warning}; improve the model first"), err=True)
    if output is None:
        click.echo(texts[Path()], nl=False)
        return
    for path, text in texts.items():
        with whole_file(path) as draft:
            draft.write_text(text, encoding="utf-8")
    files = ", ".join(map(str, texts))
    click.echo(plain(f"{files}: {target} parameters of {', '.join(axis.name for axis in axes)}"))


def _units_of(unit: str | None, models: tuple[str, ...]) -> list[str | None]:
    """The unit of each model: one for all of them, or one for each, separated by commas."""
    from allanite.common.errors import InputError

    units = unit.split(",") if unit else [None]
    if len(units) == 1:
        return [units[0]] * len(models)
    if len(units) != len(models):
        raise InputError(
            f"--unit {unit}: {len(units)} units for {len(models)} models: give one for all, or one for each"
        )
    return [one.strip() for one in units if one is not None]
