"""allanite characterize: build a model of every axis of a sensor."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from allanite.cli import output as out
from allanite.cli.options import (
    LogCommand,
    LogOptions,
    export_options,
    log_options,
    model_option,
    plot_option,
    read_recordings,
    time_option,
    tolerance_option,
)
from allanite.cli.run_folder import RunFolder
from allanite.cli.words import words_of
from allanite.common.errors import InputError, about
from allanite.common.files import check_target, write_text
from allanite.common.plain import plain
from allanite.common.units import FREQUENCY, parse_unit
from allanite.exports import TARGETS, axes_of, export_files
from allanite.study import MAX_ADDED_EFFECTS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.axes import Characterization
    from allanite.recording import Recording


@click.command(
    "characterize",
    cls=LogCommand,
    epilog="Example: allanite characterize imu.csv --report imu.html --save imu.json --export kalibr --output imu.yaml",
)
@click.argument("logs", nargs=-1, required=True, metavar="LOG...")
@model_option
@tolerance_option
@click.option(
    "--steps",
    type=click.IntRange(1),
    default=MAX_ADDED_EFFECTS,
    show_default=True,
    help="Maximum number of effects to add per axis.",
)
@time_option
@plot_option
@click.option("--report", metavar="FILE", help="Write a report on all axes (.html or .md).")
@click.option(
    "--save",
    metavar="FILE",
    help="Write the models of all axes as JSON, for allanite export, simulate, predict, watch.",
)
@click.option(
    "--export",
    "target",
    type=click.Choice((*TARGETS, "all")),
    help="Write the parameters of all axes for this filter or simulator; needs --output. all: one"
    " file for each target, in a folder.",
)
@click.option(
    "--output",
    metavar="PATH",
    help="File for --export, or a folder (with / at its end). A folder gets the files with all axes, models.json, a"
    " report and a figure, and a subfolder with the files of each axis.",
)
@click.option(
    "--working",
    metavar="LOG",
    help="Log of the same sensor with motors running. Parameter files for filters then hold the noise of this log instead"
    " of that at rest.",
)
@export_options
@log_options
def command(
    logs: tuple[str, ...],
    model: str | None,
    tolerance: float | None,
    steps: int,
    seconds: float | None,
    plot: str | None,
    report: str | None,
    save: str | None,
    target: str | None,
    output: str | None,
    working: str | None,
    how: dict[str, Any],
    options: LogOptions,
) -> None:
    """Build a noise model for every axis of the sensor in the first LOG.

    The model of each axis starts at MODEL and gets missing effects step by step, as in allanite improve. Prints one table
    of all axes, with the effects that axes share and the correlation of their residuals. Two axes are computed at a time.
    LOG is a file, or - for standard input.

    Further LOGs show the same sensor, each recorded after another switch-on. The models are fitted to the first LOG only.
    The spread of the bias between all LOGs becomes the initial covariance of the bias in filter files. allanite fit
    tests whether the noise of several logs agrees.

    With --output FOLDER/ the files of each axis are written as soon as the axis is finished. After an interrupt, or with
    more --steps or --time, the same command continues from the saved models.
    """
    from allanite.axes import characterize
    from allanite.axes.turn_on import turn_on_biases
    from allanite.effects.files import parse_model
    from allanite.readers.starts import start_model

    in_folder = _is_folder(target, output)
    _check_output_options(plot, report, save, target, output, in_folder=in_folder)
    check_columns = None if target is None else partial(_check_columns, target)
    recordings = read_recordings(logs[0], options, check_columns)
    parsed = parse_model(model or start_model(recordings[0]))
    further = [read_recordings(log, options) for log in logs[1:]]
    at_work = _working_recordings(working, options, recordings)
    folder, starts = None, {}
    if in_folder:
        assert output is not None
        turn_on = turn_on_biases(recordings, further)
        targets = TARGETS if target == "all" else (target,) if target is not None else ()
        folder = RunFolder(Path(output), targets, how, f"{tolerance}", at_work, turn_on)
        starts = {
            c.columns[0]: folder.start_model(c, parsed) for r in recordings for c in r.measured
        }
    count = sum(len(recording.columns) for recording in recordings)
    with (
        nullcontext() if folder is None else folder.finished_axes_named(),
        out.progress_of_axes(count, options) as on_progress,
    ):
        found = characterize(
            recordings,
            starts or parsed,
            on_progress,
            limit=steps,
            tolerance=tolerance,
            seconds=seconds,
            on_study=None if folder is None else folder.write,
            working=at_work,
            further=further,
        )
    written = _write_documents(found, plot, report, save, options)
    if target is not None:
        _print_warnings(found)
    if folder is not None:
        out.print_phase("writing the files of all axes", options)
        written += folder.finish(found)
    elif target is not None and output is not None:
        for path, text in export_files(axes_of(found), target, Path(output), **how).items():
            write_text(path, text)
            written.append(str(path))
    if options.as_json:
        click.echo(out.json_text(found.to_dict()))
        return
    click.echo(found.table(out.terminal_width(), words_of(options.trim)))
    if written and not options.quiet:
        click.echo(f"\nwritten: {plain(', '.join(written))}")


def _write_documents(
    found: Characterization,
    plot: str | None,
    report: str | None,
    save: str | None,
    options: LogOptions,
) -> list[str]:
    """Write the figure, the report and the JSON file of all axes whose paths are given; returns these paths."""
    if plot is not None:
        out.print_phase("writing the figure", options)
        out.save_figure(found.plot(), plot)
    if report is not None:
        out.print_phase("writing the report", options)
        found.report().save(report)
    if save is not None:
        write_text(save, out.json_text(found.to_dict()) + "\n")
    return [path for path in (plot, report, save) if path is not None]


def _working_recordings(
    working: str | None, options: LogOptions, at_rest: Sequence[Recording]
) -> list[Recording]:
    """Recordings of the --working log (motors running), one for each sampling rate; not trimmed, motion allowed.

    Empty without --working. Raises `InputError` or `TooShortError` if the columns cannot be compared with those of
    `at_rest`.
    """
    from allanite.axes.working import check_working

    if working is None:
        return []
    found = read_recordings(working, replace(options, anyway=True, trim=None, quiet=True))
    with about(working):
        check_working(at_rest, found)
    return found


def _is_folder(target: str | None, output: str | None) -> bool:
    """True if --output is given and names a folder: it ends in a slash, is a folder, or --export is ``all``."""
    return output is not None and (
        target == "all" or output.endswith(("/", "\\")) or Path(output).is_dir()
    )


def _check_output_options(
    plot: str | None,
    report: str | None,
    save: str | None,
    target: str | None,
    output: str | None,
    *,
    in_folder: bool,
) -> None:
    """Raise `InputError` if an output file cannot be written, or if --export and --output do not fit together."""
    from allanite.report.document import checked_format

    out.check_targets(plot, save)
    if report is not None:
        checked_format(Path(report))
    if target is not None and output is None:
        raise InputError("--export needs --output: a file, or a folder with / at its end")
    if output is not None and not in_folder:
        if target is None:
            raise InputError(
                f"--output {output} needs --export TARGET, or a / at its end to name a folder"
            )
        check_target(output)


def _check_columns(target: str, recordings: Sequence[Recording]) -> None:
    """Raise `InputError` if a file of the target cannot hold these columns, for instance because they have no unit.

    This is tested by exporting a simple model. For the target ``all``, only the units are tested.
    """
    from allanite.effects.files import model_to_dict, parse_model
    from allanite.readers.unit_names import unit_remedy
    from allanite.recording.findings import names_text
    from allanite.recording.sensor_names import sensor_kind

    pairs = [pair for r in recordings for pair in zip(r.columns, r.units, strict=True)]
    unitless = [c for c, unit in pairs if sensor_kind(c) and parse_unit(unit).kind == FREQUENCY]
    if unitless and (target == "all" or not TARGETS[target].any_sensor):
        raise InputError(
            f"{names_text(unitless)} {'have' if len(unitless) > 1 else 'has'} no unit, but {target} needs one",
            missing="unit",
            remedy=": " + unit_remedy(unitless),
        )
    if target == "all":
        return
    # A target that accepts these columns with a simple model accepts them with every model.
    model = model_to_dict(parse_model("N(N=1)+K(K=1)"))
    tried = [
        {**model, "recording": {"column": c, "unit": unit, "rate_hz": r.rate}}
        for r in recordings
        for c, unit in zip(r.columns, r.units, strict=True)
    ]
    export_files(axes_of(tried), target, Path(target))


def _print_warnings(found: Characterization) -> None:
    """Print a warning on standard error for each axis whose fit is not adequate."""
    from allanite.exports import warning_of

    for name, study in found.studies.items():
        warning = warning_of(study.fit.body(searched=False))
        if warning:
            click.echo(plain(f"! {name}: {warning}"), err=True)
