"""allanite predict: error growth without aiding."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import click

from allanite.cli.models import model_for_column, models_of
from allanite.cli.options import LogCommand, LogOptions, log_options, read_columns
from allanite.cli.output import json_text
from allanite.common.errors import InputError, about
from allanite.common.units import ACCELERATION, ANGULAR_RATE, parse_unit
from allanite.common.validation import positive

if TYPE_CHECKING:
    from collections.abc import Iterator

    from allanite.recording import Recording


@click.command(
    "predict",
    cls=LogCommand,
    epilog="Example: allanite predict --model imu.json --aided 60 --until 600",
)
@click.argument("log", required=False, metavar="[LOG]")
@click.option(
    "--model",
    required=True,
    metavar="MODEL",
    help="Model file, or a sum of effects with values. With LOG, values may be missing: all values are then"
    " fitted, except those held with !, as in GM(T=30!). Without LOG, add --rate if MODEL is a sum of effects, and --unit"
    " if its values have no units.",
)
@click.option(
    "--aided",
    type=float,
    required=True,
    metavar="SECONDS",
    help="Time before the last fix over which the bias was averaged.",
)
@click.option(
    "--until",
    type=float,
    metavar="SECONDS",
    help="Longest time since the last fix. Default: ten times --aided.",
)
@click.option(
    "--overbound",
    is_flag=True,
    help="Use the upper 95 % limit of each effect, over the model and its alternative explanations.",
)
@log_options
def command(
    log: str | None,
    model: str,
    aided: float,
    until: float | None,
    overbound: bool,
    options: LogOptions,
) -> None:
    """Predict how errors grow after aiding ends: angle, velocity, position or clock phase.

    The last fix is the last measurement from another sensor, such as GNSS. The state is known until then. The bias is
    known as the mean over the last --aided seconds before the last fix. Afterwards the filter integrates the sensor
    alone. Prints the standard deviation of each error over time, and the contribution of each effect. An
    effect that was not detected counts with its expected size, 0.64 times its 95 % limit. The head of each table states
    the unit.

    With LOG, a record at rest (a file, or - for standard input), the growth is also measured on segments of the log. With
    models of gyroscopes and accelerometers, a budget of horizontal velocity and position follows, with gravity and the
    Schuler oscillation. A gyroscope alone gives velocity and position by tilt: the error of its angle since the fix times
    gravity, integrated.
    """
    from allanite.statespace.budget import Axis, six_axis_budget
    from allanite.statespace.growth import error_growth, measured_growth

    aided = positive(aided, "--aided", "s", "write the seconds of aiding before the fix")
    last = (
        10.0 * aided
        if until is None
        else positive(until, "--until", "s", "write a positive number of seconds")
    )
    documents, tables, axes = [], [], []
    for name, whole, unit, rate, recording in _models_to_predict(
        log, model, options, overbound=overbound
    ):
        axes.append(Axis(name, whole, unit, rate))
        duration = None if recording is None else recording.duration
        found = error_growth(
            whole,
            aided=aided,
            unit=unit,
            rate=rate,
            tau=_prediction_times(last, rate),
            duration=duration,
        )
        rows = []
        for growth in found:
            measured = None if recording is None else measured_growth(recording, growth)
            tables.append(f"{name}: {growth.table(measured)}")
            rows.append(
                {**growth.to_dict(), "measured": None if measured is None else measured.to_dict()}
            )
        documents.append(
            {
                "schema": "allanite/predict/1",
                "recording": None if recording is None else recording.describe(),
                "model": str(whole),
                "quantities": rows,
            }
        )
    together = []
    if {ANGULAR_RATE, ACCELERATION} <= {parse_unit(axis.unit).kind for axis in axes}:
        found = six_axis_budget(
            axes, aided=aided, tau=_prediction_times(last, min(a.rate for a in axes))
        )
        tables += [f"all axes: {growth.table()}" for growth in found]
        together = [{**growth.to_dict(), "measured": None} for growth in found]
    if options.as_json:
        one = documents[0] if len(documents) == 1 else None
        several: dict[str, Any] = {"schema": "allanite/predict/1", "columns": documents}
        if together:
            several["six_axes"] = together
        click.echo(json_text(one or several))
    else:
        click.echo("\n\n".join(tables))


def _models_to_predict(
    log: str | None, text: str, options: LogOptions, *, overbound: bool
) -> Iterator[tuple[str, Any, str, float, Recording | None]]:
    """Yield (name, model, unit, rate in Hz, recording or None) for each column whose error growth is predicted.

    With a log, the columns are those of the log, and a model without values is first fitted to each. A coefficient that
    was not detected gets 0.64 times its 95 % limit. With `overbound`, every noise coefficient gets its upper limit.
    Without a log, raises `InputError` if unit or rate is missing.
    """
    from allanite.exports import model_of_expected_size
    from allanite.recording.samples import find_column

    models = models_of(text)
    if log is None:
        if options.reading.columns and any(m.column for m in models):
            with about(text):
                names = [m.column for m in models]
                models = [models[find_column(column, names)] for column in options.reading.columns]
        for m in models:
            unit, rate = options.reading.unit or m.unit, options.reading.rate_hz or m.rate
            if unit is None or rate is None:
                raise InputError(
                    f"{m.name}: the unit or the rate of the samples is missing: add --unit UNIT and --rate HZ"
                )
            with about(text):
                own = model_of_expected_size(m.document, m.model, overbound=overbound)
            yield m.name, own, unit, rate, None
        return
    for column in read_columns(log, options):
        m = model_for_column(models, column.columns[0], text)
        own, document = m.model, m.document
        if any(getattr(e, e.coefficient) is None for e in own.stochastic):
            fit = own.fit(column)
            own, document = fit.model, fit.to_dict()
        with about(text):
            own = model_of_expected_size(document, own, overbound=overbound)
        # The values of a model file are in the unit of its own recording.
        here = column if m.unit is None else column.to(m.unit)
        yield column.columns[0], own, here.unit, here.rate, here


def _prediction_times(last: float, rate: float) -> list[float]:
    """Times in s at 1, 2 and 5 of each decade from `last`/1000 or one sample on; the last one is exactly `last`."""
    first = max(last / 1000.0, 1.0 / rate)
    decades = range(math.floor(math.log10(first)), math.ceil(math.log10(last)) + 1)
    times = [step * 10.0**decade for decade in decades for step in (1.0, 2.0, 5.0)]
    return [t for t in times if first <= t < 0.999 * last] + [last]
