"""Options shared by the commands that read a log, and the recording they lead to."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from functools import wraps
from typing import TYPE_CHECKING, Any

import click

from allanite.cli.pipe import NAME, PIPE, log_file, named
from allanite.cli.words import words_of
from allanite.common.errors import InputError, TooShortError, about
from allanite.common.printing import ASKED, sample_unit
from allanite.common.units import units_by_kind
from allanite.common.validation import SEEDS

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from allanite.recording import Recording
    from allanite.recording.findings import Finding

__all__ = [
    "DEFAULT_MODEL",
    "INFLATE",
    "SEED",
    "LogOptions",
    "RateType",
    "columns_of",
    "is_number",
    "json_option",
    "log_options",
    "model_option",
    "recording_of",
    "recordings_of",
    "said_early",
    "time_option",
]

DEFAULT_MODEL = "N+B+K"
SHORTEST = 16  # samples below which no command has anything to say

model_option = click.option(
    "--model",
    default=DEFAULT_MODEL,
    show_default=True,
    metavar="MODEL",
    help="Sum of effects, e.g. N+B+K or N+GM(T=30), or a model file.",
)
#: What every generator of random numbers takes.
SEED = click.IntRange(0, SEEDS)
#: Factor on the deviations of a parameter file.
INFLATE = click.option(
    "--inflate",
    type=click.FloatRange(0.0, 1e6, min_open=True),
    default=1.0,
    metavar="FACTOR",
    help="Multiply all deviations in the file, which records this as your choice.",
)
json_option = click.option("--json", "as_json", is_flag=True, help="JSON on stdout, nothing else.")
#: Where the style of figures is kept while a command runs: every command that has --plot has it.
STYLE = "allanite.style"


def plot_option(command: Any) -> Any:
    """Add --plot, and --style, which `output.plot` reads."""

    def keep(ctx: click.Context, _param: click.Parameter, value: str) -> None:
        ctx.meta[STYLE] = value

    style = click.option(
        "--style",
        type=click.Choice(("screen", "paper", "slides")),
        default="screen",
        show_default=True,
        expose_value=False,
        callback=keep,
        help="Of the figure: paper is one column of 88 mm in 8 pt without title, slides has large letters.",
    )
    return click.option("--plot", metavar="FILE", help="Figure: SVG, PNG or PDF.")(style(command))


class Seconds(click.types.FloatParamType):
    """A positive time: 60, 60s, 10min or 2h."""

    name = "seconds"
    units = (("min", 60.0), ("h", 3600.0), ("s", 1.0))

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Seconds; a float is one already."""
        text, factor = str(value).strip(), 1.0
        for unit, size in self.units:
            if text.endswith(unit):
                text, factor = text.removesuffix(unit).strip(), size
                break
        try:
            number = factor * float(text)
        except ValueError:
            number = -1.0
        if not 0.0 < number < float("inf"):
            self.fail(f"{value!r} is not a time, as 60s, 10min or 2h is", param, ctx)
        return number


time_option = click.option(
    "--time",
    "seconds",
    type=Seconds(),
    metavar="TIME",
    help="Look for no further effect after this time, e.g. 60s or 10min; each axis gets a first model."
    " Default: a minute of processor time, and 10 s for every million samples.",
)


class RateType(click.ParamType[float | str]):
    """A rate in Hz, kept as text where it ends in an exclamation mark."""

    name = "rate"

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> float | str:
        """Return a float, or the text of a rate that is insisted on."""
        text = str(value).strip()
        try:
            number = float(text.removesuffix("!"))
        except ValueError:
            self.fail(f"{value!r} is not a number of Hz, as 100 or 100! is", param, ctx)
        return text if text.endswith("!") else number


_LOG_OPTIONS = (
    click.option(
        "--rate",
        type=RateType(),
        metavar="HZ",
        help="Sampling rate; 100! insists where the log says otherwise.",
    ),
    click.option(
        "--unit",
        metavar="UNIT",
        help="Unit of the samples: rad/s deg/s deg/h m/s^2 g mg ug 1; of two kinds of sensor: deg/s,m/s^2.",
    ),
    click.option(
        "--quantity",
        type=click.Choice(["rate", "increment", "angle"]),
        help="What the samples are (default rate).",
    ),
    click.option("--column", multiple=True, metavar="NAME", help="Column to use; repeatable."),
    click.option(
        "--covariate",
        multiple=True,
        metavar="NAME",
        help="Column offered as an explanation; repeatable.",
    ),
    click.option("--time-column", metavar="NAME", help="Column of time stamps; none for none."),
    click.option("--piece", type=int, metavar="N", help="Piece of a log parted by jumps of time."),
    click.option("--topic", multiple=True, metavar="NAME", help="Topic of a bag; repeatable."),
    click.option(
        "--output-unit",
        metavar="UNIT",
        help="Unit of the results: of samples or of a coefficient; of two kinds of sensor: deg/h,ug.",
    ),
    click.option(
        "--trim",
        metavar="START:END|quiet",
        help="Use only these seconds of the log, or its longest quiet stretch.",
    ),
    click.option(
        "--scale",
        multiple=True,
        metavar="NAME=FACTOR",
        help="Multiply a column, e.g. raw counts: gx=1/131; repeatable.",
    ),
    click.option(
        "--anyway",
        is_flag=True,
        help="Use a log that is mostly motion, or whose unit contradicts gravity.",
    ),
    click.option("--decimate", type=int, metavar="K", help="Average K samples into one."),
    click.option("--seed", type=SEED, metavar="N", help="Seed of everything random."),
    json_option,
    click.option("--quiet", is_flag=True, help="No notes, no progress."),
)


@dataclass(frozen=True, slots=True)
class LogOptions:
    """The shared options as given."""

    rate: float | str | None
    unit: str | None
    quantity: str | None
    column: tuple[str, ...]
    covariate: tuple[str, ...]
    time_column: str | None
    piece: int | None
    topic: tuple[str, ...]
    output_unit: str | None
    trim: str | None
    scale: tuple[str, ...]
    anyway: bool
    decimate: int | None
    seed: int | None
    as_json: bool
    quiet: bool

    @property
    def rate_hz(self) -> float | None:
        """The rate as a number of Hz."""
        return float(self.rate.removesuffix("!")) if isinstance(self.rate, str) else self.rate

    @property
    def later(self) -> tuple[str, ...]:
        """Names of those given that say what is done with the samples once they are read."""
        given = {
            "--trim": self.trim,
            "--decimate": self.decimate,
            "--output-unit": self.output_unit,
        }
        return tuple(name for name, value in given.items() if value is not None)

    @property
    def output_units(self) -> dict[str, str]:
        """Units of samples that ``--output-unit`` means, by kind of sensor."""
        if self.output_unit is None:
            return {}
        return units_by_kind(",".join(map(sample_unit, self.output_unit.split(","))))

    def reading(self) -> dict[str, Any]:
        """Return the options of `allanite.read`."""
        from allanite.readers.scaling import parse_scales

        return {
            "rate": self.rate,
            "unit": self.unit,
            "quantity": self.quantity,
            "column": self.column or None,
            "covariate": self.covariate or None,
            "time_column": self.time_column,
            "piece": self.piece,
            "topic": self.topic or None,
            "scale": parse_scales(self.scale) or None,
        }


def log_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the shared options; the command gets them as one `LogOptions` called ``options``."""

    @wraps(command)
    def wrapped(**arguments: Any) -> Any:
        shared = {field.name: arguments.pop(field.name) for field in fields(LogOptions)}
        return command(options=LogOptions(**shared), **arguments)

    for option in reversed(_LOG_OPTIONS):
        wrapped = option(wrapped)
    return wrapped


def is_number(taus: str) -> bool:
    """Whether averaging times are given as a number per decade; ² is a digit and no number."""
    return taus.isascii() and taus.isdigit()


def columns_of(path: str, options: LogOptions, *, for_fit: bool = True) -> list[Recording]:
    """Read a log and return one recording a column, as the options ask; a fit needs a sensor at rest.

    Raises
    ------
    InputError
        A column whose samples never change.
    TooShortError
        Fewer samples than any command can use.
    """
    columns = list(recording_of(path, options, for_fit=for_fit))
    for column in columns:
        if not _varies(column):
            raise _stuck(path, column)
    return _without_locked(path, columns) if for_fit else columns


def _without_locked(path: str, columns: list[Recording]) -> list[Recording]:
    """Return the columns without those that are locked to one code, each with a line that says so."""
    from allanite.fit.locked import locked_error

    errors = [locked_error(column) for column in columns]
    if all(errors):
        with about(path):
            raise next(filter(None, errors))
    for error in filter(None, errors):
        click.echo(f"! {error.worded(words_of(None))}", err=True)
    return [column for column, error in zip(columns, errors, strict=True) if error is None]


def _stuck(path: str, column: Recording) -> InputError:
    path = NAME if path == PIPE else path
    return InputError(
        f"{path}: column {column.columns[0]} is constant or all NaN: a stuck sensor, or"
        " the wrong column (--column)"
    )


def recording_of(
    path: str,
    options: LogOptions,
    suits: Callable[[Recording], None] | None = None,
    *,
    for_fit: bool = True,
) -> Recording:
    """Read and check a log with all columns that the options ask for.

    What `suits` refuses is refused before anything is said. A log that is mostly motion is refused if a model is fitted.

    Raises
    ------
    InputError
        No column in it changes, its unit contradicts gravity, or it is mostly motion.
    TooShortError
        Fewer samples than any command can use.
    """
    from allanite.readers import read

    with log_file(path) as file, named(file, path):
        recording = read(file, **options.reading())
    if suits is not None:
        suits(recording)
    return _prepared(recording, path, options, for_fit=for_fit)


def recordings_of(
    path: str, options: LogOptions, suits: Callable[[Sequence[Recording]], None] | None = None
) -> list[Recording]:
    """Read a log as `recording_of` does, and the sensors of the same device that have rates of their own."""
    from allanite.readers import read_sensors

    with log_file(path) as file, named(file, path):
        recordings = read_sensors(file, **options.reading())
    if suits is not None:
        suits(recordings)
    return [_prepared(recording, path, options) for recording in recordings]


def _prepared(
    recording: Recording, path: str, options: LogOptions, *, for_fit: bool = True
) -> Recording:
    """Cut, check, decimate and convert a recording as the options ask."""
    from allanite.readers.plausibility import checked

    if path == PIPE:
        path = NAME
        recording = recording.called(NAME)
    if options.trim == "quiet":
        recording = recording.quiet()
    elif options.trim is not None:
        recording = recording.trim(*_span(options.trim))
    with about(path):
        recording = checked(recording, for_fit=for_fit, anyway=options.anyway)
    _say_motion(recording, options)
    if options.decimate is not None:
        recording = recording.decimate(options.decimate)
    if options.output_unit is not None:
        samples = options.output_units
        recording = recording.to(",".join(samples.values()))
        each = zip(samples, options.output_unit.split(","), strict=True)
        asked = ASKED.set({kind: one.strip() for kind, one in each})
        if (context := click.get_current_context(silent=True)) is not None:
            context.call_on_close(lambda: ASKED.reset(asked))
    if recording.n < SHORTEST:
        raise TooShortError(
            f"{path}: {recording.n} samples are too few: at least {SHORTEST} are needed, and some"
            " thousands for a fit"
        )
    if not any(_varies(column) for column in recording):
        raise _stuck(path, recording.column(0))
    return recording


def said_early(finding: Finding) -> bool:
    """Whether a finding is said before anything is computed: an option is missing, or did something.

    That nothing says the unit of a column which may be a clock's is a remark among others.
    """
    kinds = ("not_used", "other_rate", "quiet_stretch", "motion")
    return finding.kind in kinds or (finding.kind, finding.severity) == ("no_unit", "warning")


def _say_motion(recording: Recording, options: LogOptions) -> None:
    """Say what is left out and that the sensor moves before anything is computed; JSON carries it in the audit."""
    from allanite.recording.at_rest import finding_of

    if not (options.quiet or options.as_json):
        left = filter(said_early, recording.told)
        for finding in (*left, *finding_of(recording)):
            mark = "!" if finding.severity == "warning" else "·"
            click.echo(f"{mark} {finding.worded(words_of(options.trim))}", err=True)


def _varies(column: Recording) -> bool:
    """Whether the rate changes at all; a phase with a constant slope does not."""
    import numpy as np

    x = column.rate_samples()
    x = x[~np.isnan(x)] if x.dtype.kind == "f" else x
    return x.size > 1 and bool(x.max() > x.min())


def _span(text: str) -> tuple[float | None, float | None]:
    start, colon, end = text.partition(":")
    try:
        bounds = (float(start) if start else None), (float(end) if end else None)
    except ValueError:
        colon = ""
    if not colon or not all(b is None or math.isfinite(b) for b in bounds):
        raise InputError(f"--trim {text!r}: give START:END in seconds, e.g. 600: or 60:3600")
    return bounds
