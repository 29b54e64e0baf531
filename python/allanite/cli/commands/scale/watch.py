"""allanite watch: does the model still hold?"""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from allanite.cli.pipe import NAME, PIPE

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    import numpy as np
    from numpy.typing import NDArray

#: Rows taken at a time, at most.
ROWS = 4096


@click.command("watch")
@click.argument("source")
@click.option("--model", required=True, metavar="MODEL", help="Model with values, or a file.")
@click.option("--rate", type=float, metavar="HZ", help="Sampling rate; default the model file's.")
@click.option("--unit", metavar="UNIT", help="Unit of the samples; default the model file's.")
@click.option(
    "--column",
    metavar="NAME",
    help="Column, or its number from 0; default the model file's, else the first that is no time.",
)
@click.option("--state", metavar="FILE", help="State to go on from, written as it changes.")
@click.option("--prometheus", metavar="FILE", help="Numbers in the text format of Prometheus.")
@click.option(
    "--every", type=float, default=60.0, show_default=True, metavar="S", help="Seconds to a line."
)
@click.option("--follow", is_flag=True, help="Wait for more at the end of a file.")
def command(
    source: str,
    model: str,
    rate: float | None,
    unit: str | None,
    column: str | None,
    state: str | None,
    prometheus: str | None,
    every: float,
    follow: bool,
) -> None:
    """Watch SOURCE, a growing text file, - for standard input, or udp://127.0.0.1:PORT.

    Prints a JSON line now and then, and when the model does not hold any more: a false alarm comes in one run of a hundred,
    however long they are. A row is a line of numbers; of a file, rows that a state has seen are passed over.
    """
    import json
    from pathlib import Path

    from allanite.cli.first_rows import place_of
    from allanite.cli.models import models_of
    from allanite.common.errors import InputError, about
    from allanite.common.files import whole_file
    from allanite.common.units import rate_unit
    from allanite.scale import Watch

    models = models_of(model)
    known = [one for one in models if one.column == column] or models
    if len(known) > 1:
        names = ", ".join(one.column for one in known)
        raise InputError(f"{model} holds the models of {names}: name one of them with --column")
    of = known[0]
    rate = rate if rate is not None else of.rate
    if rate is None:
        raise InputError("no sampling rate: give --rate HZ beside --model")
    with about("--unit"):
        unit = rate_unit(unit or of.unit or "1", "rate").name
    watch = Watch(of.model, rate, unit)
    if state is not None and Path(state).is_file():
        watch.restore(state)
    file = source != PIPE and "://" not in source
    shown = watch.taken

    def tell() -> None:
        click.echo(json.dumps(watch.to_dict()))
        if state is not None:
            watch.save(state)
        if prometheus is not None:
            with whole_file(prometheus) as draft:
                draft.write_text(watch.prometheus(), encoding="utf-8")

    name = NAME if source == PIPE else source

    def place(first: list[str]) -> int:
        with about(name):
            return place_of(first, column, of.column, name)

    for rows in _rows(source, place, watch.taken if file else 0, follow):
        raised = watch.update(rows)
        if raised is not None or watch.taken - shown >= every * rate:
            tell()
            shown = watch.taken
    if watch.taken > shown:
        tell()


def _rows(
    source: str, place: Callable[[list[str]], int], passed: int, follow: bool
) -> Iterator[NDArray[np.float64]]:
    """Samples of a source as they come, without the first `passed`; its first lines tell the place of their column."""
    import itertools

    import numpy as np

    waiting: list[float] = []
    lines = _lines(source, follow)
    first = _first(lines)
    at = place(first)
    for line in itertools.chain(first, lines):
        if line is not None:
            value = _value(line, at)
            if value is None:
                continue
            if passed > 0:
                passed -= 1
                continue
            waiting.append(value)
        if len(waiting) >= ROWS or (line is None and waiting):
            yield np.array(waiting)
            waiting = []
    if waiting:
        yield np.array(waiting)


def _first(lines: Iterator[str | None]) -> list[str]:
    """Lines with enough rows of numbers to tell the columns by, or all there are."""
    from allanite.cli.first_rows import ROWS as ENOUGH
    from allanite.cli.first_rows import has_numbers

    found: list[str] = []
    rows = 0
    for line in lines:
        if line is not None:
            found.append(line)
            rows += has_numbers(line)
            if rows >= ENOUGH:
                break
    return found


def _value(line: str, place: int) -> float | None:
    """The number at a place of a row; NaN for an empty cell, None for a line of words."""
    from allanite.cli.first_rows import cells_of
    from allanite.common.errors import InputError

    if not line.strip() or line.lstrip().startswith("#"):
        return None
    cells = cells_of(line)
    if place >= len(cells):
        raise InputError(f"a row has {len(cells)} columns: --column {place} is none of them")
    cell = cells[place]
    try:
        return float(cell.replace(",", ".") if cell else "nan")
    except ValueError:
        return None


def _lines(source: str, follow: bool) -> Iterator[str | None]:
    """Lines of a source; None where nothing more is there yet."""
    import sys
    import time
    from pathlib import Path

    from allanite.common.errors import InputError

    if source == PIPE:
        yield from sys.stdin
    elif source.startswith("udp://"):
        yield from _datagrams(source.removeprefix("udp://"))
    elif not Path(source).is_file():
        raise InputError(f"{source}: no such file")
    else:
        with Path(source).open(encoding="utf-8", errors="replace") as file:
            begun = ""
            while True:
                line = begun + file.readline()
                if line.endswith("\n") or (line and not follow):
                    begun = ""
                    yield line
                elif not follow:
                    return
                else:
                    # A row that is still being written waits for its end.
                    begun = line
                    yield None
                    time.sleep(0.2)


def _datagrams(address: str) -> Iterator[str]:
    """Lines of datagrams that come to an address of this machine."""
    import socket

    from allanite.common.errors import InputError

    host, _, port = address.rpartition(":")
    if host not in ("127.0.0.1", "localhost") or not port.isdecimal():
        raise InputError(
            f"udp://{address}: an address of this machine is needed, udp://127.0.0.1:PORT"
        )
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.bind(("127.0.0.1", int(port)))
        while True:
            text = listener.recv(65536).decode("utf-8", "replace")
            if text.strip() == "end":
                return
            yield from text.splitlines()
