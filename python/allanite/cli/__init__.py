"""The command line: `main` runs a command and turns every error into one line and an exit code.

Add a command as a module of `allanite.cli.commands`, and its line of help in `COMMANDS`.

Exit codes: 0 success; 1 ``check --strict`` found the model inadequate, or ``accept`` found a figure that does not meet
the sheet; 2 wrong input or options; 3 usable input that is too short or too damaged, or ``accept`` is undecided; 70 an
internal error of allanite; 130 interrupted. A command is imported only when it runs.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib import import_module
from typing import Any

import click

from allanite.cli.interrupt import keep_interrupts
from allanite.cli.words import WORDS
from allanite.common.errors import AllaniteError, InputError, TooShortError
from allanite.common.memory import address_space
from allanite.common.plain import plain

__all__ = ["main"]

# Command → its line in `allanite --help`. The lines are kept here so that help imports no command.
COMMANDS = {
    "inspect": "Show how a log is read: role, unit and rate of each column. Start here.",
    "adev": "Compute the Allan deviation of a log.",
    "fit": "Fit a noise model to a log: coefficients with 95 % intervals.",
    "check": "Show where a model does not fit a log, and which effects are missing.",
    "improve": "Build a noise model step by step: add missing effects until none is left.",
    "characterize": "Build a model of every axis of an IMU: table, report, parameter files.",
    "report": "Write an HTML or Markdown report on a log and its model.",
    "accept": "Test a sensor against the limits of its data sheet.",
    "compare": "Compare logs, models and data sheets in one table and one figure.",
    "explore": "Open a local web page to look at logs and improve models by hand.",
    "export": "Write the parameters of a model for a filter or simulator.",
    "predict": "Predict how the error of angle, velocity, position or phase grows without aiding.",
    "thermal": "Fit the bias of every axis as a function of temperature.",
    "trend": "Estimate the rate of a time series, with an uncertainty that counts colored noise.",
    "timing": "Test clocks and time servers: time error, ITU-T masks, noise, holdover.",
    "combine": "Weight several sensors of one axis: gain of averaging, and which sensor deviates.",
    "plan": "Compute how long and at what rate to record.",
    "simulate": "Simulate samples of a model.",
    "fleet": "Build models for a folder of logs: one table, and which sensors deviate.",
    "watch": "Watch a running sensor: raise an alarm when the model no longer holds.",
    "demo": "Simulate a gyroscope with two hidden effects, and find them.",
}
#: Commands whose modules are in `allanite.cli.commands.scale`.
SCALE_COMMANDS = ("fleet", "watch")

#: Last line of a process that ends because a memory-mapped file became shorter.
FILE_TRUNCATED = "allanite: a log became shorter while it was read, or its disk failed\n"
#: Minimum address space of the process, bytes. With less, libraries fail to load in unpredictable ways: reports need
#: 450 MB (measured with two threads).
MIN_ADDRESS_SPACE = 500e6


class _OutputClosedError(Exception):
    """The reader of standard output ended, as in ``allanite simulate … | head``."""


@contextmanager
def _broken_pipe_as_closed_output() -> Iterator[None]:
    """Context that raises `_OutputClosedError` instead of `BrokenPipeError`, which versions of click handle differently."""
    try:
        yield
    except BrokenPipeError as error:
        raise _OutputClosedError from error


class _Commands(click.Group):
    """A group that imports a command's module when the command runs."""

    def make_context(self, *arguments: Any, **options: Any) -> click.Context:
        """`click.Context` of the parsed command line; a broken pipe raises `_OutputClosedError`."""
        with _broken_pipe_as_closed_output():  # --help and --version are written here
            return super().make_context(*arguments, **options)

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command and return what click returns; a broken pipe raises `_OutputClosedError`."""
        with _broken_pipe_as_closed_output():
            return super().invoke(ctx)

    def list_commands(self, _ctx: click.Context) -> list[str]:
        """List of the names of all commands, in the order of the help text."""
        return list(COMMANDS)

    def get_command(self, _ctx: click.Context, cmd_name: str) -> click.Command | None:
        """`click.Command` with this name, imported from its module; None if there is no such command."""
        if cmd_name not in COMMANDS:
            return None
        package = "commands.scale" if cmd_name in SCALE_COMMANDS else "commands"
        command: click.Command = import_module(f"allanite.cli.{package}.{cmd_name}").command
        return command

    def format_commands(self, _ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the names of all commands with their short descriptions."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


def _print_version(ctx: click.Context, _parameter: click.Parameter, value: bool) -> None:
    """Callback of --version: print the version and end the program; does nothing if `value` is false."""
    if value:
        from allanite._kernels import version

        click.echo(f"allanite {version()}")
        ctx.exit()


@click.group(
    cls=_Commands,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="Example: allanite inspect imu.csv, then allanite characterize imu.csv --report imu.html."
    " Help on one command: allanite COMMAND --help.",
)
@click.option(
    "--version",
    is_flag=True,
    expose_value=False,
    is_eager=True,
    callback=_print_version,
    help="Show the version and exit.",
)
def cli() -> None:
    """Measure and model the noise of inertial sensors and clocks.

    Most commands read a LOG of a sensor at rest (CSV, NumPy, MATLAB, HDF5, Parquet, ROS bag, ULog and others). They print
    a table, or JSON with --json. Figures, models and parameter files are written where an option names a file.

    The exit code is 0 if the command has done its work. It is 2 if the log or an option is wrong, and 3 if the log is too
    short or damaged, or if accept cannot decide. Code 1 means "not adequate" for check --strict, and "does not meet" for
    accept.

    A MODEL is a sum of noise effects, or a file written with --save. N+B+K is angle random walk N, bias instability B and
    rate random walk K. N+GM(T=30) has a Gauss-Markov process with a correlation time of 30 s instead. Other effects
    are, for example, Q quantization, R a rate ramp, SIN a line, RES a vibration band, and STEP a step of the bias. The
    page docs/contract.md of the source code lists all effects.
    """


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit the process with its exit code; never returns."""
    code = _run(arguments)
    threads = sys.modules.get("allanite.common.threads")
    if arguments is None and threads is not None and threads.has_running_jobs():
        with suppress(OSError, ValueError):
            sys.stdout.flush()
        os._exit(code)
    sys.exit(code)


def _check_address_space() -> None:
    """Raise `InputError` if the address space of the process is limited to less than 500 MB."""
    found = address_space()
    if found < MIN_ADDRESS_SPACE:
        raise InputError(
            f"the address space is limited to {found / 1e6:.0f} MB, at least {MIN_ADDRESS_SPACE / 1e6:.0f} MB are"
            " needed: raise the limit (ulimit -v)"
        )


def _run(arguments: Sequence[str] | None) -> int:
    """Run a command line and return its exit code; every error is printed as one line on standard error."""
    if sys.stdout is None:
        return _print_error(
            "standard output is closed: redirect it to a file, a pipe or /dev/null", 2
        )
    try:
        with keep_interrupts(process_ends=arguments is None):
            _check_address_space()
            if arguments is None:
                from allanite import _kernels

                _kernels.end_with_line(FILE_TRUNCATED, 2)
                _kernels.own_process()
            code = cli.main(args=arguments, prog_name="allanite", standalone_mode=False)
            with _broken_pipe_as_closed_output():
                sys.stdout.flush()
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.ctx.get_help() if error.ctx else str(error))
        return 0
    except click.ClickException as error:
        return _print_error(error.format_message(), 2)
    except TooShortError as error:
        return _print_error(error.worded(WORDS), 3)
    except AllaniteError as error:
        return _print_error(error.worded(WORDS), 2)
    except (KeyboardInterrupt, click.Abort):
        return _print_error("interrupted", 130)
    except _OutputClosedError:
        _discard_output()
        return 0
    except MemoryError:
        return _print_error(
            "not enough memory: average the samples of a long log with --decimate COUNT", 3
        )
    except OSError as error:
        if error.filename is None:
            # `whole_file` names its file, so an error without a name concerns standard output.
            _discard_output()
        return _print_error(f"{error.filename or 'standard output'}: {error.strerror or error}", 2)
    except BaseException as error:
        # A panic of the Rust core is no Exception, only a BaseException.
        if not isinstance(error, Exception) and type(error).__name__ != "PanicException":
            raise
        if isinstance(error, ModuleNotFoundError) and not (error.name or "allanite").startswith(
            "allanite"
        ):
            return _print_error(f"{error.name} is not installed: pip install 'allanite[all]'", 2)
        from allanite.cli.unexpected import internal_error_message

        return _print_error(internal_error_message(error), 70)
    return code if isinstance(code, int) else 0


def _discard_output() -> None:
    """Redirect standard output to the null device, so that the flush at exit cannot fail again."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _print_error(message: str, code: int) -> int:
    """Print a message as one line of at most 300 characters on standard error, if that is open, and return `code`."""
    with suppress(OSError):
        click.echo(plain(f"allanite: {' '.join(message.split())}", 300), err=True)
    return code
