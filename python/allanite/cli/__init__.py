"""The command line: `main` turns every error into one line and an exit code.

Exit codes: 0 done · 1 ``check --strict`` found the model inadequate · 2 input or options wrong ·
3 input usable but too short or too broken · 70 an error of allanite itself · 130 interrupted. Each
command is one file of this package, imported when it is asked for.
"""

from __future__ import annotations

import os
import sys
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any

import click

from allanite.cli.interrupt import heard
from allanite.cli.words import WORDS
from allanite.common.errors import AllaniteError, InputError, TooShortError
from allanite.common.memory import address_space
from allanite.common.plain import plain

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

__all__ = ["main"]

# Command → what `--help` says of it, kept here so that help imports no command.
COMMANDS = {
    "inspect": "What is understood of a log, column by column, before anything is computed.",
    "adev": "Allan deviation of a log: tau, deviation, interval.",
    "fit": "Coefficients of a noise model, with intervals.",
    "check": "Where a model fails to describe a log, and which effects are missing.",
    "improve": "Add the missing effects one by one until nothing helps; prints the ladder.",
    "characterize": "Every axis at once: one table, what the axes share, figure, report, exports.",
    "report": "One file to hand on: record, model, where it fails, the ladder, what is left.",
    "accept": "Acceptance test: each figure of a data sheet against the measured interval.",
    "compare": "Logs, models and data sheets in one table and one figure.",
    "explore": "A local page: see the curves, add what is missing, watch the error fall.",
    "export": "Parameters of a model for a filter or simulator.",
    "predict": "Growth of the error of angle, velocity, position or phase since the last fix.",
    "thermal": "Law of temperature of every axis, with a band; parameters for PX4, ArduPilot, C.",
    "trend": "Rate of a series (heights, sea level, gravity, phase) with its uncertainty under the fitted noise.",
    "timing": "Clocks and time servers: time error, ITU-T masks, jumps, noise and holdover.",
    "combine": "What averaging several units of one axis gains, with which weights; which unit deviates.",
    "plan": "How long to record, and how fast, to find an effect or to know a coefficient.",
    "simulate": "Samples of a model, seeded, of any length.",
    "fleet": "Every axis of every log of a folder: one table, and which units deviate.",
    "watch": "Samples as they come: an alarm when a model does not hold any more.",
    "demo": "The whole loop on a generated recording with hidden effects.",
}


#: The last line where a file that is mapped into memory becomes shorter.
CUT = "allanite: a log became shorter while it was read, or its disk failed\n"
#: Bytes of address space below which libraries cannot be loaded, and end the process as they like: measured with two
#: threads, reports need 450 MB.
MIN_ADDRESS_SPACE = 500e6


class _ReaderGoneError(Exception):
    """The reader of standard output ended, as in ``allanite simulate … | head``."""


@contextmanager
def _reader_gone() -> Iterator[None]:
    """Raise `_ReaderGoneError` for a broken pipe before click sees it.

    Versions of click differ in what they make of a broken pipe: an exit with code 1, in different places.
    """
    try:
        yield
    except BrokenPipeError as error:
        raise _ReaderGoneError from error


class _Commands(click.Group):
    """A group that imports a command's module when the command runs."""

    def make_context(self, *arguments: Any, **options: Any) -> click.Context:
        with _reader_gone():  # --help and --version are written here
            return super().make_context(*arguments, **options)

    def invoke(self, ctx: click.Context) -> Any:
        with _reader_gone():
            return super().invoke(ctx)

    def list_commands(self, _ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, _ctx: click.Context, cmd_name: str) -> click.Command | None:
        return _command(cmd_name)

    def format_commands(self, _ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


def _command(name: str) -> click.Command | None:
    """Import a command, and none of the others."""
    match name:
        case "adev":
            from allanite.cli.commands.adev import command
        case "fit":
            from allanite.cli.commands.fit import command
        case "check":
            from allanite.cli.commands.check import command
        case "improve":
            from allanite.cli.commands.improve import command
        case "characterize":
            from allanite.cli.commands.characterize import command
        case "report":
            from allanite.cli.commands.report import command
        case "accept":
            from allanite.cli.commands.accept import command
        case "compare":
            from allanite.cli.commands.compare import command
        case "explore":
            from allanite.cli.commands.explore import command
        case "export":
            from allanite.cli.commands.export import command
        case "combine":
            from allanite.cli.commands.combine import command
        case "thermal":
            from allanite.cli.commands.thermal import command
        case "plan":
            from allanite.cli.commands.plan import command
        case "simulate":
            from allanite.cli.commands.simulate import command
        case "demo":
            from allanite.cli.commands.demo import command
        case "timing":
            from allanite.cli.commands.timing import command
        case "trend":
            from allanite.cli.commands.trend import command
        case "predict":
            from allanite.cli.commands.predict import command
        case "fleet":
            from allanite.cli.commands.scale.fleet import command
        case "watch":
            from allanite.cli.commands.scale.watch import command
        case "inspect":
            from allanite.cli.commands.inspect import command
        case _:
            return None
    return command


def _version(ctx: click.Context, _parameter: click.Parameter, value: bool) -> None:
    if value:
        from allanite._kernels import version

        click.echo(f"allanite {version()}")
        ctx.exit()


@click.group(
    cls=_Commands,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog="A model is a sum such as N+B+K or N+GM(T=30), or a file written by fit --save.",
)
@click.option("--version", is_flag=True, expose_value=False, is_eager=True, callback=_version)
def cli() -> None:
    """Noise models of inertial sensors: measure, fit, criticise, improve."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit with its code; never shows a traceback for a user's mistake."""
    code = _run(arguments)
    threads = sys.modules.get("allanite.common.threads")
    if arguments is None and threads is not None and threads.computing():
        with suppress(OSError, ValueError):
            sys.stdout.flush()
        os._exit(code)
    sys.exit(code)


def _check_address_space() -> None:
    found = address_space()
    if found < MIN_ADDRESS_SPACE:
        raise InputError(
            f"the address space is limited to {found / 1e6:.0f} MB (ulimit -v):"
            f" {MIN_ADDRESS_SPACE / 1e6:.0f} MB are needed"
        )


def _run(arguments: Sequence[str] | None) -> int:
    if sys.stdout is None:
        return _fail("standard output is closed: give it a place to go", 2)
    try:
        with heard(last=arguments is None):
            _check_address_space()
            if arguments is None:
                from allanite import _kernels

                _kernels.end_with_line(CUT, 2)
                _kernels.few_arenas()
            code = cli.main(args=arguments, prog_name="allanite", standalone_mode=False)
            with _reader_gone():
                sys.stdout.flush()
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.ctx.get_help() if error.ctx else str(error))
        return 0
    except click.ClickException as error:
        return _fail(error.format_message(), 2)
    except TooShortError as error:
        return _fail(error.worded(WORDS), 3)
    except AllaniteError as error:
        return _fail(error.worded(WORDS), 2)
    except (KeyboardInterrupt, click.Abort):
        return _fail("interrupted", 130)
    except _ReaderGoneError:
        _abandon_output()
        return 0
    except MemoryError:
        return _fail("not enough memory for this log: --decimate averages it down", 3)
    except OSError as error:
        if error.filename is None:
            # Files name themselves (`whole_file`): what could not be written is the output.
            _abandon_output()
        return _fail(f"{error.filename or 'standard output'}: {error.strerror or error}", 2)
    except BaseException as error:
        # A panic of the core outside of its watched calls is no Exception.
        if not isinstance(error, Exception) and type(error).__name__ != "PanicException":
            raise
        if isinstance(error, ModuleNotFoundError) and not (error.name or "allanite").startswith(
            "allanite"
        ):
            return _fail(f"{error.name} is not installed: pip install 'allanite[all]'", 2)
        from allanite.cli.unexpected import told

        return _fail(told(error), 70)
    return code if isinstance(code, int) else 0


def _abandon_output() -> None:
    """Let what was not written go nowhere: it cannot be flushed at exit either."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _fail(message: str, code: int) -> int:
    with suppress(OSError):
        click.echo(plain(f"allanite: {' '.join(message.split())}", 300), err=True)
    return code
