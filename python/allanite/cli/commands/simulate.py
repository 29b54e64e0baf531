"""allanite simulate: simulate samples of a model."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click
import numpy as np

from allanite.cli.models import models_of
from allanite.cli.options import SEED
from allanite.cli.output import json_text, write_csv
from allanite.common.documents import json_of
from allanite.common.errors import InputError, about
from allanite.common.files import check_target, whole_file
from allanite.common.plain import plain
from allanite.common.validation import positive, positive_rate, whole

if TYPE_CHECKING:
    from allanite.recording import Recording


@click.command(
    "simulate",
    epilog='Example: allanite simulate "N(N=0.01)+K(K=1e-4)" --rate 100 --duration 3600 --unit deg/s -o sim.csv',
)
@click.argument("model")
@click.option(
    "--rate", type=float, metavar="HZ", help="Sampling rate. Default: from the model file."
)
@click.option("--duration", type=float, metavar="SECONDS", help="Length of the record.")
@click.option(
    "-n",
    "--samples",
    type=int,
    metavar="COUNT",
    help="Length of the record in samples, instead of --duration.",
)
@click.option(
    "--unit",
    metavar="UNIT",
    help="Unit of the samples. Default: from the model file, otherwise 1 (no unit).",
)
@click.option(
    "--seed",
    type=SEED,
    default=0,
    show_default=True,
    metavar="N",
    help="Seed of the random numbers. The same seed gives the same samples.",
)
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    help="File to write. .csv and .npz state the unit and the rate; .npy states neither, so give --unit and --rate when you"
    " read it. Default: CSV on standard output.",
)
@click.option(
    "--all-axes",
    is_flag=True,
    help="Simulate every axis of a sensor. MODEL is a file of allanite characterize --save.",
)
@click.option(
    "--covariates",
    metavar="LOG",
    help="With --all-axes: log whose temperature and other columns drive the simulated axes.",
)
@click.option(
    "--json",
    "as_json",
    is_flag=True,
    help="With --output: print a description of the written file as JSON.",
)
def command(
    model: str,
    rate: float | None,
    duration: float | None,
    samples: int | None,
    unit: str | None,
    seed: int,
    output: str | None,
    all_axes: bool,
    covariates: str | None,
    as_json: bool,
) -> None:
    """Simulate samples of MODEL and write them as a log.

    MODEL is a sum of effects with values, e.g. "N(N=0.01)+K(K=1e-4)", or a model file. Values without a unit are in
    --unit: N(N=0.01) with --unit deg/s is 0.01 deg/s/sqrt(Hz), a two-sided density. The noise density in a data sheet is
    one-sided: divide it by sqrt(2). N(N=0.3 deg/sqrt(h)) states its unit. docs/contract.md
    lists the effects and their parameters. Effects of a logged column, such as the temperature (COV), need --all-axes
    and --covariates. Give the length with --duration or --samples. With --all-axes, the default length is that of the
    measured log.
    """
    from allanite.simulate import SAMPLES

    if covariates is not None and not all_axes:
        raise InputError("--covariates needs --all-axes")
    if (duration is None) == (samples is None) and not (all_axes and duration is None):
        raise InputError("give the length with either --duration SECONDS or --samples N")
    if as_json and output is None:
        raise InputError("--json describes the written file: name the file with --output FILE")
    if duration is not None:
        positive(duration, "--duration", "s", "the length must be a positive number of seconds")
    elif samples is not None:
        whole(samples, "--samples", 1, SAMPLES)
    if output is not None:
        _check_format(output)
        check_target(output)
    if all_axes:
        recording = _simulate_all_axes(model, rate, duration, samples, seed, covariates)
        _write_and_describe(
            recording if unit is None else recording.to(unit), model, seed, output, as_json
        )
        return
    models = models_of(model)
    if len(models) > 1:
        raise InputError(
            f"{model} holds the models of {len(models)} columns: add --all-axes, or save a file with one model"
        )
    rate = models[0].rate if rate is None else rate
    if rate is None:
        raise InputError("no sampling rate", missing="rate", remedy=": give {rate}")
    with about("--rate"):
        rate = positive_rate(rate)
    length = {"duration": duration} if samples is None else {"n": samples}
    own = models[0].unit or unit or "1"
    try:
        recording = models[0].model.simulate(**length, rate=rate, seed=seed, unit=own)
    except InputError as error:
        if error.missing != "quantity":
            raise
        raise InputError(
            f"--unit {own}: the samples are rates, such as deg/s or m/s^2; for a clock use --unit 1 (fractional frequency)"
        ) from None
    if unit is not None:
        recording = recording.to(unit)
    _write_and_describe(recording, model, seed, output, as_json)


def _simulate_all_axes(
    path: str,
    rate: float | None,
    duration: float | None,
    samples: int | None,
    seed: int,
    log: str | None,
) -> Recording:
    """Simulated `Recording` of every axis in a file of `allanite characterize --save`; prints the effects it omits.

    The logged columns of `log`, such as a temperature, drive the effects that depend on them. If neither `duration` nor
    `samples` is given, the length, and the rate unless given, are those of this log. Raises `InputError` if `path` is
    another kind of file, or if `log` has no logged column.
    """
    from allanite.axes.twin import twin
    from allanite.readers import read

    with about(path):
        document = json_of(path, "a file of allanite characterize --save")
        if not isinstance(document, dict):
            raise InputError("not a file of allanite characterize --save: it holds no JSON object")
    given = None
    if log is not None:
        source = read(log)
        given = dict(source.covariates)
        if not given:
            raise InputError(
                f"--covariates {log}: the log has no temperature or other logged column"
            )
        if duration is None and samples is None:
            samples, rate = source.n, rate or source.rate
    with about(path):
        found = twin(document, duration=duration, n=samples, rate=rate, seed=seed, covariates=given)
    for property_ in found.left_out:
        click.echo(f"· not simulated: {property_}", err=True)
    return found.recording


def _write_and_describe(
    recording: Recording, model: str, seed: int, output: str | None, as_json: bool
) -> None:
    """Write a recording to `output` and print a line or JSON about this file; without `output`, print it as CSV."""
    if output is None:
        write_csv(recording, None)
        return
    with whole_file(output) as draft:
        _write_log(recording, draft)
    if as_json:
        description = {**recording.describe(), "path": output}
        click.echo(
            json_text(
                {
                    "schema": "allanite/simulate/1",
                    "model": model,
                    "seed": seed,
                    "recording": description,
                }
            )
        )
    else:
        unit = "without a unit" if recording.unit == "1" else f"in {recording.unit}"
        click.echo(f"{plain(output)}: {recording.n} samples at {recording.rate:g} Hz {unit}")


def _check_format(path: str) -> None:
    """Raise `InputError` unless the file name ends in .npy, .npz, .csv or .txt (upper or lower case)."""
    suffix = Path(path).suffix.lower()
    if suffix not in (".npy", ".npz", ".csv", ".txt"):
        found = f"unknown format {suffix}" if suffix else "the name has no suffix"
        raise InputError(f"--output {path}: {found}; use .npz, .npy or .csv")


def _write_log(recording: Recording, path: Path) -> None:
    """Write a recording as .npy, .npz, .csv or .txt, as the suffix says; `allanite.read` can read the file."""
    suffix = path.suffix.lower()
    if suffix == ".npy":
        np.save(path, recording.samples)
    elif suffix == ".npz":
        np.savez_compressed(
            path,
            data=recording.samples,
            rate_hz=recording.rate,
            channels=np.array(recording.columns),
            unit=np.array(recording.units),
        )
    else:
        write_csv(recording, path)
