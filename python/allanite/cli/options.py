"""Options shared by the commands that read a log, and functions that read the log as the options say."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields
from functools import wraps
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from allanite.cli.pipe import (
    INPUT_NAME,
    STANDARD_INPUT,
    errors_name_input,
    log_file,
    shown_path,
)
from allanite.cli.words import words_of
from allanite.common.choices import CLOCK_START, QUANTITIES, SENSOR_START
from allanite.common.errors import InputError, TooShortError, about
from allanite.common.printing import REQUESTED_UNITS, sample_unit
from allanite.common.read_options import ReadOptions
from allanite.common.units import units_by_kind
from allanite.common.validation import SEEDS

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from allanite.recording import Recording
    from allanite.recording.findings import Finding

#: Minimum number of samples of a recording, for every command. Chosen by judgment; not measured.
MIN_SAMPLES = 16

model_option = click.option(
    "--model",
    metavar="MODEL",
    help="Model to fit or to start from: a sum of effects, e.g. N+B+K, or a model file; allanite --help names common"
    " effects. T is the correlation time of a"
    " Gauss-Markov process GM: GM(T=30) starts the search at 30 s, T=30! holds T (as for any value),"
    " T=[10,100] limits T. Default:"
    f" {SENSOR_START}; for a clock {CLOCK_START}, where Q is white and F flicker phase noise.",
)
#: Type of every --seed option: the range that the random number generators accept.
SEED = click.IntRange(0, SEEDS)
#: Options of the commands that write a parameter file: the keyword arguments of `allanite.export` with the same names.
_EXPORT_OPTIONS = (
    click.option(
        "--overbound",
        is_flag=True,
        help="Parameter file: write the smallest N and K whose Allan curve covers the upper 95 % limits of the model"
        " and of its alternatives at all τ, for a conservative filter. Not together with --as-fitted.",
    ),
    click.option(
        "--as-fitted",
        is_flag=True,
        help="Parameter file: write the fitted N and K alone; one that was not detected gets its 95 % limit. By default, N"
        " and K also cover other slow noise, such as B. Not together with --overbound.",
    ),
    click.option(
        "--horizon",
        "--until",
        type=float,
        metavar="SECONDS",
        help="Parameter file: longest time that the filter runs without measurements of other sensors (aiding). Default:"
        " 100 s, or a tenth of the log if that is shorter.",
    ),
    click.option(
        "--inflate",
        type=click.FloatRange(0.0, 1e6, min_open=True),
        default=1.0,
        metavar="FACTOR",
        help="Parameter file: multiply all noise deviations; the file records the factor.",
    ),
)


def noise_model_option(use: str) -> Callable[[Any], Any]:
    """Decorator that adds the option --model, by default N+B+K, to a command; `use` is the first sentence of its help."""
    return click.option(
        "--model",
        default=SENSOR_START,
        show_default=True,
        metavar="MODEL",
        help=f"{use} GM(T=30): T starts at 30 s. T=[10,100] limits T. A value followed by ! is held: T=30!, N(N=0.005!).",
    )


json_option = click.option(
    "--json", "as_json", is_flag=True, help="Print JSON on standard output instead of a table."
)
#: Key of the style of figures in `click.Context.meta`. Every command with --plot sets this key.
STYLE = "allanite.style"


class LogCommand(click.Command):
    """A click command whose help lists its own options first, and the options of `log_options` below them."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options in two sections: those of the command, then those for reading the log."""
        own: list[tuple[str, str]] = []
        shared: list[tuple[str, str]] = []
        for parameter in self.get_params(ctx):
            record = parameter.get_help_record(ctx)
            if record is not None and isinstance(parameter, click.Option):
                (shared if parameter.name in READING_OPTIONS else own).append(record)
        for heading, records in (("Options", own), ("Options for reading the log", shared)):
            if records:
                with formatter.section(heading):
                    formatter.write_dl(records)


def plot_option(command: Any) -> Any:
    """Decorator that adds the options --plot and --style to a command; `output.save_figure` uses the style."""

    def keep(ctx: click.Context, _param: click.Parameter, value: str) -> None:
        """Store the value of --style in the context, for `output.save_figure`."""
        ctx.meta[STYLE] = value

    style = click.option(
        "--style",
        type=click.Choice(("screen", "paper", "slides")),
        default="screen",
        show_default=True,
        expose_value=False,
        callback=keep,
        help="Style of the figure. paper: one column of 88 mm, 8 pt, no title. slides: large letters.",
    )
    return click.option(
        "--plot", metavar="FILE", help="Write the figure to FILE (.svg, .png or .pdf)."
    )(style(command))


def seconds(value: object) -> float:
    """Option type: positive time in s from a text such as ``60``, ``60s``, ``10min`` or ``2h``."""
    text, factor = str(value).strip(), 1.0
    for unit, size in (("min", 60.0), ("h", 3600.0), ("s", 1.0)):
        if text.endswith(unit):
            text, factor = text.removesuffix(unit), size
            break
    found = factor * _float_or_nan(text)
    if not 0.0 < found < math.inf:
        raise click.BadParameter(f"{value!r} is not a time: write 60s, 10min or 2h")
    return found


def _float_or_nan(text: str) -> float:
    """Number in a text as a float; NaN if the text is no number."""
    try:
        return float(text)
    except ValueError:
        return math.nan


time_option = click.option(
    "--time",
    "seconds",
    type=seconds,
    metavar="TIME",
    help="Limit of the elapsed time for all axes together, e.g. 60s or 10min; no further step starts after it. Every axis"
    " gets at least a first model. Without --time, each axis may use 1 min of processor time plus 10 s per million"
    " samples.",
)


def percent(value: object) -> float:
    """Option type: percentage of 0 or more: 5.0 for ``5%`` or ``5``."""
    found = _float_or_nan(str(value).strip().removesuffix("%"))
    if not 0.0 <= found < math.inf:
        raise click.BadParameter(f"{value!r} is not a percentage of 0 or more: write 5%")
    return found


def positive_percent(value: object) -> float:
    """Option type: positive percentage: 5.0 for ``5%`` or ``5``."""
    found = percent(value)
    if found == 0.0:
        raise click.BadParameter(f"{value!r} is not a positive percentage: write 5%")
    return found


tolerance_option = click.option(
    "--tolerance",
    type=positive_percent,
    metavar="PERCENT",
    help="Stop once the model discrepancy δ is below this, e.g. 5%. δ is the typical error of the square root"
    " of the model's spectrum, in %.",
)


def rate_type(value: object) -> float | str:
    """Option type: rate in Hz; a number with an exclamation mark, such as ``100!``, is returned as a string."""
    text = str(value).strip()
    found = text.removesuffix("!")
    try:
        number = float(found)
    except ValueError:
        raise click.BadParameter(f"{value!r} is not a rate in Hz: write 100 or 100!") from None
    return number if found == text else text


def scale_type(value: object) -> tuple[str, float]:
    """Option type: pair (name of a column, factor) from a text such as ``gx=1/131`` or ``gx=0.00763``."""
    name, equals, factor = str(value).rpartition("=")
    top, slash, bottom = factor.partition("/")
    divisor = _float_or_nan(bottom) if slash else 1.0
    number = _float_or_nan(top) / divisor if divisor else math.nan
    if not (equals and name.strip() and number and math.isfinite(number)):
        raise click.BadParameter(f"{value!r} is not a scale: write NAME=FACTOR, e.g. gx=1/131")
    return name.strip(), number


_LOG_OPTIONS = (
    click.option(
        "--rate",
        type=rate_type,
        metavar="HZ",
        help="Sampling rate. Default: from the file or its time stamps. 100! overrides a log that states another rate.",
    ),
    click.option(
        "--unit",
        metavar="UNIT",
        help="Unit of the samples, if the log does not state it: rad/s deg/s deg/h m/s^2 g mg ug uT, or 1 for none."
        " For gyroscopes and accelerometers together: deg/s,m/s^2; the names of the columns must then show which is which."
        " Phase of a clock: s, ms, us, ns.",
    ),
    click.option(
        "--quantity",
        type=click.Choice(QUANTITIES),
        help="Meaning of the samples: rate (default), increment (its integral over one sample) or angle (its integral"
        " from the start; also velocity or clock phase). A unit of s, ms, us or ns implies angle. The unit may be that of"
        " the samples (deg, rad, m/s) or that of the rate: deg and deg/s then mean the same.",
    ),
    click.option(
        "--column",
        multiple=True,
        metavar="NAME",
        help="Column to use as a sensor, by name, or by number from 0; repeatable. Columns without a header are named"
        " x0, x1, …. Default: all columns of gyroscopes, accelerometers and clocks.",
    ),
    click.option(
        "--covariate",
        multiple=True,
        metavar="NAME",
        help="Logged column that the sensor may depend on, such as a voltage; repeatable. Columns that are recognized as"
        " temperatures, by name or unit, are always tried as a cause.",
    ),
    click.option(
        "--time-column",
        metavar="NAME",
        help="Column of time stamps, by name or by number from 0. Default: found by its name or its values. none: ignore"
        " time stamps, and give --rate.",
    ),
    click.option(
        "--piece",
        type=int,
        metavar="INDEX",
        help="Segment to use if long pauses split the log, counted from 1. Pauses count as missing"
        " samples. If more than 80 % of the samples would be missing, the longest pauses split the log instead. Default:"
        " the segment with the most samples.",
    ),
    click.option(
        "--topic",
        multiple=True,
        metavar="NAME",
        help="Topic of a ROS bag, ULog or ArduPilot log; repeatable. Default: the first topic of an inertial sensor. For a"
        " log of chrony, ntpd or linuxptp: the time source to read.",
    ),
    click.option(
        "--output-unit",
        metavar="UNIT",
        help="Unit of the results, e.g. deg/h: N is then in deg/sqrt(h), B in deg/h. The unit of one coefficient gives the"
        " same: deg/sqrt(h) also means deg/h. For gyroscopes and accelerometers together: deg/h,ug.",
    ),
    click.option(
        "--trim",
        metavar="START:END|quiet",
        help="Use only this segment, in seconds from the start of the log, e.g. 600: or 60:3600. "
        "quiet: the longest segment without motion.",
    ),
    click.option(
        "--scale",
        multiple=True,
        type=scale_type,
        metavar="NAME=FACTOR",
        help="Multiply a column by a factor, e.g. gx=1/131 for raw counts; repeatable. --unit is then the unit after"
        " the multiplication.",
    ),
    click.option(
        "--anyway",
        is_flag=True,
        help="Do not refuse a log that is mostly motion, or whose unit contradicts gravity.",
    ),
    click.option(
        "--decimate",
        type=int,
        metavar="COUNT",
        help="Replace each COUNT consecutive samples by their mean. N, B, K and slower effects keep their values.",
    ),
    click.option(
        "--seed",
        type=SEED,
        hidden=True,  # accepted because scripts may give it; the results do not depend on a seed
    ),
    json_option,
    click.option("--quiet", is_flag=True, help="Print no notes and no progress."),
)


@dataclass(frozen=True, slots=True)
class LogOptions:
    """Values of the shared options: those of `allanite.read`, and those for the samples and the output."""

    reading: ReadOptions
    output_unit: str | None
    trim: str | None
    anyway: bool
    decimate: int | None
    seed: int | None
    as_json: bool
    quiet: bool

    @property
    def after_reading(self) -> tuple[str, ...]:
        """Names of the given options that change the samples after the log was read."""
        given = {
            "--trim": self.trim,
            "--decimate": self.decimate,
            "--output-unit": self.output_unit,
        }
        return tuple(name for name, value in given.items() if value is not None)

    @property
    def output_units(self) -> dict[str, str]:
        """Kind of sensor → unit into which --output-unit converts its samples; empty without this option.

        For a unit of a coefficient, such as ug/sqrt(Hz), it is the unit of the samples, ug.
        """
        if self.output_unit is None:
            return {}
        return units_by_kind(",".join(map(sample_unit, self.output_unit.split(","))))


#: Names of the options of `allanite.read`, and of the other shared options.
_READ_NAMES = [field.name for field in fields(ReadOptions)]
_OTHER_NAMES = [field.name for field in fields(LogOptions) if field.name != "reading"]
#: Names of the options that `LogCommand` lists in the section about reading the log.
READING_OPTIONS = {*_READ_NAMES, *_OTHER_NAMES} - {"as_json", "quiet"}


def export_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Decorator that adds the options of parameter files to a command, which gets them in the dict ``how``."""

    @wraps(command)
    def wrapped(**arguments: Any) -> Any:
        """Call the command with the options of parameter files in the argument ``how``."""
        names = ("overbound", "as_fitted", "horizon", "inflate")
        return command(how={name: arguments.pop(name) for name in names}, **arguments)

    for option in reversed(_EXPORT_OPTIONS):
        wrapped = option(wrapped)
    return wrapped


def log_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Decorator that adds the options of all commands that read a log, such as --rate and --unit.

    The command gets their values as one `LogOptions` in its argument ``options``.
    """

    @wraps(command)
    def wrapped(**arguments: Any) -> Any:
        """Call the command with the options for reading a log in the argument ``options``."""
        read = {name: arguments.pop(name) for name in _READ_NAMES}
        scales = dict(read["scale"])
        if len(scales) < len(read["scale"]):
            raise InputError("--scale: a column is named twice: give one factor for each column")
        reading = ReadOptions(**{**read, "scale": scales})
        others = {name: arguments.pop(name) for name in _OTHER_NAMES}
        return command(options=LogOptions(reading, **others), **arguments)

    for option in reversed(_LOG_OPTIONS):
        wrapped = option(wrapped)
    return wrapped


def read_columns(
    path: str, options: LogOptions, *, for_fit: bool = True, copy: Path | None = None
) -> list[Recording]:
    """One `Recording` per sensor column of a log, read as the options say and checked as by `read_recording`.

    Also raises `InputError` if the samples of a column (for an angle: its rate) never change. With `for_fit`, columns
    with one quantization code in 95 % of the samples or more are left out, with a note, or raise `TooShortError` if no
    other is left.
    """
    columns = list(read_recording(path, options, for_fit=for_fit, copy=copy))
    for column in columns:
        if not rate_varies(column):
            raise _constant_column_error(path, column)
    return _without_locked(path, columns) if for_fit else columns


def _without_locked(path: str, columns: list[Recording]) -> list[Recording]:
    """The columns without those for which `locked_error` finds that one code makes up 95 % of the samples or more.

    Prints a line on standard error for each omitted column. Raises `TooShortError` if no column is left.
    """
    from allanite.fit.locked import locked_error

    errors = [locked_error(column) for column in columns]
    if all(errors):
        with about(path):
            raise next(filter(None, errors))
    for error in filter(None, errors):
        click.echo(f"! {error.worded(words_of(None))}", err=True)
    return [column for column, error in zip(columns, errors, strict=True) if error is None]


def _constant_column_error(path: str, column: Recording) -> InputError:
    """`InputError` (not raised) for a column whose samples are all equal or all NaN."""
    return InputError(
        f"{shown_path(path)}: column {column.columns[0]} is constant or all NaN: the sensor is stuck, or --column names the"
        " wrong column"
    )


def read_recording(
    path: str,
    options: LogOptions,
    *,
    for_fit: bool = True,
    copy: Path | None = None,
) -> Recording:
    """`Recording` of the sensor columns in a log file: read, cut, averaged and converted as the command-line options say.

    `path` is the file, or ``-`` for standard input; `copy` is then a file with its content, if it was already read.
    Raises `InputError` if no column changes, the unit contradicts gravity, or, with `for_fit`, the log is mostly motion
    and the options do not allow motion. Raises `TooShortError` below 16 samples.
    """
    from allanite.readers import read

    with log_file(str(copy or path)) as file, errors_name_input(file, path):
        recording = read(file, **asdict(options.reading))
    return _prepared_recording(recording, path, options, for_fit=for_fit)


def read_recordings(
    path: str,
    options: LogOptions,
    check_columns: Callable[[Sequence[Recording]], None] | None = None,
) -> list[Recording]:
    """One `Recording` for each sampling rate of a log, as `read_recording`; `check_columns` gets them as they were read."""
    from allanite.readers import read_sensors

    with log_file(path) as file, errors_name_input(file, path):
        recordings = read_sensors(file, **asdict(options.reading))
    if check_columns is not None:
        check_columns(recordings)
    return [_prepared_recording(recording, path, options) for recording in recordings]


def _prepared_recording(
    recording: Recording, path: str, options: LogOptions, *, for_fit: bool = True
) -> Recording:
    """Recording after --trim, the test for motion and gravity, --decimate and --output-unit, in this order.

    Prints findings about motion, and sets the units in which results are printed (--output-unit). Raises
    `TooShortError` below 16 samples, and `InputError` if no column varies or the recording is implausible (`checked`).
    """
    from allanite.readers.plausibility import checked

    if path == STANDARD_INPUT:
        path = INPUT_NAME
        recording = recording.with_path(INPUT_NAME)
    if options.trim == "quiet":
        recording = recording.quiet()
    elif options.trim is not None:
        span = _trim_bounds(options.trim)
        with about(f"{path}, --trim {options.trim}"):
            recording = recording.trim(*span)
    with about(path):
        recording = checked(recording, for_fit=for_fit, anyway=options.anyway)
    _show_early_findings(recording, options)
    if options.decimate is not None:
        with about(f"{path}, --decimate"):
            recording = recording.decimate(options.decimate)
    if options.output_unit is not None:
        samples = options.output_units
        with about(f"{path}, --output-unit"):
            recording = recording.to(",".join(samples.values()))
        each = zip(samples, options.output_unit.split(","), strict=True)
        token = REQUESTED_UNITS.set({kind: one.strip() for kind, one in each})
        if (context := click.get_current_context(silent=True)) is not None:
            context.call_on_close(lambda: REQUESTED_UNITS.reset(token))
    if recording.n < MIN_SAMPLES:
        raise TooShortError(
            f"{path}: {recording.n} samples are too few: at least {MIN_SAMPLES} are needed, and a fit needs some"
            " thousands"
        )
    if not any(rate_varies(column) for column in recording):
        raise _constant_column_error(path, recording.column(0))
    return recording


def is_shown_early(finding: Finding) -> bool:
    """True if a finding is printed before the computation: unused columns, other rate, raw counts, motion, missing unit.

    A missing unit counts only if it is a warning: a column that may belong to a clock only gets a later remark.
    """
    kinds = ("not_used", "other_rate", "raw_counts", "quiet_stretch", "motion")
    return finding.kind in kinds or (finding.kind, finding.severity) == ("no_unit", "warning")


def finding_line(finding: Finding, options: LogOptions) -> str:
    """Text of a finding as a line of output, which begins with ``!`` for a warning and with ``·`` otherwise."""
    mark = "!" if finding.severity == "warning" else "·"
    return f"{mark} {finding.worded(words_of(options.trim))}"


def _show_early_findings(recording: Recording, options: LogOptions) -> None:
    """Print findings on standard error after which a user may call the command differently; not with --quiet or --json."""
    from allanite.recording.at_rest import motion_findings

    if not (options.quiet or options.as_json):
        early = filter(is_shown_early, recording.added_findings)
        for finding in (*early, *motion_findings(recording)):
            click.echo(finding_line(finding, options), err=True)


def rate_varies(column: Recording) -> bool:
    """True if at least two samples differ; for the phase of a clock or an angle, if its rate of change differs."""
    x = column.rate_samples()
    x = x[~np.isnan(x)] if x.dtype.kind == "f" else x
    return x.size > 1 and bool(x.max() > x.min())


def _trim_bounds(text: str) -> tuple[float | None, float | None]:
    """Tuple (start, end) in s from a text ``START:END``; None for an open end. Raises `InputError` for any other text."""
    start, colon, end = text.partition(":")
    try:
        bounds = (float(start) if start else None), (float(end) if end else None)
    except ValueError:
        colon = ""
    if not colon or not all(b is None or math.isfinite(b) for b in bounds):
        raise InputError(f"--trim {text!r}: write START:END in seconds, e.g. 600: or 60:3600")
    return bounds
