"""Rows of a source that grows: a text file, standard input, or datagrams.

A file may be truncated in place or replaced by another (log rotation) while it is read. The rows of the new content are
then read from the first. Standard input and datagrams are read by a thread, so that a signal never interrupts a read.
"""

from __future__ import annotations

import errno
import math
import os
import queue
import signal
import stat
import sys
import threading
import time
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import click
import numpy as np

from allanite.cli.first_rows import (
    FIRST_ROWS,
    cells_of,
    first_lines_of,
    has_numbers,
    number_of_cell,
)
from allanite.cli.pipe import STANDARD_INPUT, shown_path
from allanite.common.errors import MAX_MESSAGE_LENGTH, InputError, about
from allanite.common.plain import plain

if TYPE_CHECKING:
    import socket
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from allanite.cli.first_rows import WatchedColumn

#: Number of bytes per read.
BLOCK = 1 << 16
#: Maximum length of a line, bytes. Rows of known loggers are a thousand times shorter.
MAX_LINE = 1 << 20
#: Maximum size of the first lines, which are kept until the columns are known, bytes.
MAX_FIRST_LINES = 16 * MAX_LINE
#: Samples are passed on once there are this many, or after this time in s. Chosen by judgment; not measured.
MAX_ROWS, FLUSH_S = 4096, 0.2
#: Time between two checks of a file that does not grow, s. Chosen by judgment; not measured.
POLL_S = 0.2
#: Number of bytes before a position that are compared to recognize a file.
COMPARED_BYTES = 64
#: Time for which standard input and datagrams are still read after a signal, s. Rows that have arrived are not lost.
DRAIN_S = 0.1
#: Maximum number of blocks that wait for the main thread.
MAX_QUEUED_BLOCKS = 64


class Stop(threading.Event):
    """Event that is set by SIGINT or SIGTERM; `signal` is the number of the first signal, or None."""

    signal: int | None = None

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Context in which SIGINT and SIGTERM set this event; outside of the main thread it does nothing."""
        before: dict[int, Any] = {}
        try:
            for number in map(int, (signal.SIGINT, signal.SIGTERM)):
                before[number] = signal.signal(number, self._store_signal)
        except ValueError:  # not the main thread
            pass
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    def _store_signal(self, number: int, _frame: object) -> None:
        """Signal handler: store the number of the first signal in `signal`, and set this event."""
        self.signal = self.signal or number
        self.set()


@dataclass(frozen=True, slots=True)
class Rows:
    """Samples of consecutive rows.

    `position` is that in the file after these rows, None for other sources. `follows` is True if the first sample
    directly follows the last sample of the previous rows.
    """

    samples: NDArray[np.float64]
    position: dict[str, Any] | None
    follows: bool


@dataclass(frozen=True, slots=True)
class _Block:
    """Bytes of a source; none if no bytes have arrived since the last block.

    `begins_at` is the position in the file at which reading begins anew; None if the block continues the previous one.
    `follows` is as in `Rows`. `head` are the first lines of the file, if reading begins behind them.
    """

    data: bytes
    begins_at: int | None = None
    follows: bool = True
    head: bytes = b""


def is_file_source(source: str) -> bool:
    """True if a source is neither standard input nor an address."""
    return source != STANDARD_INPUT and "://" not in source


def samples_of_source(
    source: str,
    column_of: Callable[[list[str]], WatchedColumn],
    stop: Stop,
    *,
    position: dict[str, Any] | None = None,
    follow: bool = False,
) -> Iterator[Rows]:
    """Iterator over `Rows` with the samples of a source as they arrive, until its end or the event `stop`.

    `source` is a path, ``-`` (standard input), or ``udp://127.0.0.1:PORT``. `column_of` returns the column to watch
    from the first lines. A file is read from `position`, a value of `Rows.position`; with `follow`, the iterator waits
    for more rows at its end. Rows that arrived before `stop` are still yielded. Raises `InputError`, also while
    iterating, if the source cannot be used, a line is too long, or a row lacks the column.
    """
    if source == STANDARD_INPUT:
        if sys.stdin is None:
            raise InputError("standard input is closed: there is no log to read")
        descriptor = sys.stdin.fileno()
        blocks = _blocks_of_thread(lambda: os.read(descriptor, BLOCK), stop)
    elif is_file_source(source):
        blocks = _blocks_of_file(Path(source), position, stop, follow=follow)
    else:
        blocks = _blocks_of_datagrams(source, stop)
    reader = _Lines(
        shown_path(source),
        column_of,
        keeps_position=is_file_source(source),
    )
    return reader.rows(blocks, stop)


class _Lines:
    """Splits blocks of bytes into lines, and collects the sample of each row."""

    def __init__(
        self,
        name: str,
        column_of: Callable[[list[str]], WatchedColumn],
        *,
        keeps_position: bool,
    ) -> None:
        self.name, self.column_of, self.keeps_position = name, column_of, keeps_position
        self.offset, self.tail = 0, b""
        self.rest = b""
        self.first: list[bytes] = []
        self.first_rows = self.first_bytes = 0
        self.column: WatchedColumn | None = None
        self.samples: list[float] = []
        self.follows = True

    def rows(self, blocks: Iterator[_Block], stop: Stop) -> Iterator[Rows]:
        """Yield the samples of the blocks in batches: after 4096 samples or 0.2 s, when the source pauses, and at the end.

        Before an `InputError` of a bad row, the samples before this row are yielded.
        """
        passed_on = time.monotonic()
        try:
            for block in blocks:
                if block.begins_at is not None:
                    self._choose_column()
                    yield from self._flush()
                    self._restart(block)
                self._add_bytes(block.data)
                idle = not block.data or stop.is_set()
                if len(self.samples) >= MAX_ROWS or (
                    time.monotonic() - passed_on >= (0.0 if idle else FLUSH_S)
                ):
                    yield from self._flush()
                    passed_on = time.monotonic()
            # At the end of the source, the last line may lack its line break. After a signal, it may be incomplete.
            if self.rest and not stop.is_set():
                last, self.rest = self.rest, b""
                self._add_line(last)
            self._choose_column()
        except InputError:
            # The rows before a bad row count.
            if self.column is not None:
                yield from self._flush()
            raise
        yield from self._flush()

    def _restart(self, block: _Block) -> None:
        """Prepare for reading from a new position: forget the unfinished line (with a note) and the watched column."""
        if self.rest:
            _print_note(f"{self.name}: the last row is incomplete and is skipped")
        self.offset, self.tail, self.rest = block.begins_at or 0, b"", b""
        self.first, self.first_rows, self.first_bytes = [], 0, 0
        self.column = None
        if block.head:
            self.column = self.column_of(block.head.decode("utf-8", "replace").splitlines())
        self.follows = self.follows and block.follows

    def _flush(self) -> Iterator[Rows]:
        """Yield the collected samples, if any, as one `Rows`, and empty the collection."""
        if not self.samples:
            return
        position = None
        if self.keeps_position:
            position = {"offset": self.offset, "tail": self.tail.hex()}
        rows = Rows(np.array(self.samples), position, self.follows)
        self.samples, self.follows = [], True
        yield rows

    def _add_bytes(self, data: bytes) -> None:
        """Split bytes of the source into lines, collect the samples of complete lines, and keep an incomplete last line.

        Raises `InputError` if the incomplete line is longer than 1 MiB.
        """
        text = self.rest + data
        # A carriage return also ends a line.
        end = max(text.rfind(b"\n"), text.rfind(b"\r")) + 1
        self.rest = text[end:]
        if len(self.rest) > MAX_LINE:
            raise InputError(
                f"{self.name}: a line is longer than {MAX_LINE} bytes; the source must be text with one row per line"
            )
        for line in text[:end].splitlines(keepends=True):
            self._add_line(line)

    def _add_line(self, line: bytes) -> None:
        """Collect the sample in a line of the source; keep the line while the column to watch is not yet known.

        The column is chosen once 100 rows of numbers have arrived. Raises `InputError` if fewer have arrived after 16
        MiB.
        """
        if self.column is not None:
            self._add_sample(line)
            return
        self.first.append(line)
        self.first_rows += has_numbers(_text_of(line))
        self.first_bytes += len(line)
        if self.first_rows >= FIRST_ROWS:
            self._choose_column()
        elif self.first_bytes > MAX_FIRST_LINES:
            raise InputError(
                f"{self.name}: fewer than {FIRST_ROWS} rows of numbers in the first {MAX_FIRST_LINES} bytes; the source"
                " must be text with one row per line"
            )

    def _choose_column(self) -> None:
        """Choose the column from the first lines unless it is chosen, and collect the samples of these lines."""
        if self.column is None:
            self.column = self.column_of([text for line in self.first if (text := _text_of(line))])
            lines, self.first = self.first, []
            for line in lines:
                self._add_sample(line)

    def _add_sample(self, line: bytes) -> None:
        """Append the number in the watched column of a line, if it has one, and then move the position behind the line.

        Raises `InputError` if the row has no such column, or if the number is infinite; the position then stays before
        the line.
        """
        assert self.column is not None
        with about(self.name):
            value = sample_of(_text_of(line), self.column.index, self.column.delimiter)
        if value is not None:
            self.samples.append(self.column.factor * value)
        self.offset += len(line)
        self.tail = (self.tail + line)[-COMPARED_BYTES:]


def _text_of(line: bytes) -> str:
    """Text of a line without its line end; bytes that are not UTF-8 become replacement characters."""
    return line.decode("utf-8", "replace").rstrip("\r\n")


def sample_of(line: str, place: int, delimiter: str | None = None) -> float | None:
    """Number in the column with index `place` of a row; `delimiter` as in `cells_of`.

    NaN for an empty cell; None for a blank line, a comment, or a cell with text. Raises `InputError` if the row has
    fewer columns, or the number is infinite.
    """
    if not line.strip() or line.lstrip().startswith("#"):
        return None
    cells = cells_of(line, delimiter)
    if place >= len(cells):
        raise InputError(f"a row has only {len(cells)} columns, but column {place} is watched")
    value = number_of_cell(cells[place])
    if value is not None and math.isinf(value):
        raise InputError(
            f"a sample is infinite ({plain(cells[place], 20)}): mark missing samples with NaN"
        )
    return value


# -- files -----------------------------------------------------------------------------------------


def _blocks_of_file(
    path: Path, position: dict[str, Any] | None, stop: Stop, *, follow: bool
) -> Iterator[_Block]:
    """Yield the bytes of a file from `position` on, or from its beginning; the first block only says where reading begins.

    Reading starts again at the first row, with a note, if the file is truncated or replaced, or is not the file of
    `position`. With `follow`, the iterator waits at the end of the file and yields empty blocks, until a signal
    arrives.
    """
    file = _open_file(path)
    try:
        at, tail = 0, b""
        if position is not None:
            at, tail = int(position["offset"]), bytes.fromhex(position["tail"])
            if not _is_continued(file.fileno(), at, tail):
                _print_note(
                    f"{path}: not the file from which the state was saved; reading from the first row"
                )
                at, tail = 0, b""
        head = first_lines_of(file, at)
        file.seek(at)
        yield _Block(b"", at, follows=position is None or at > 0, head=head)
        while not stop.is_set():
            data = file.read(BLOCK)
            if data:
                at, tail = at + len(data), (tail + data)[-COMPARED_BYTES:]
                yield _Block(data)
                continue
            if not follow:
                return
            yield _Block(b"")
            stop.wait(POLL_S)
            if _is_replaced(path, file.fileno()):
                # The writer may still finish the old file. Its last rows come before the rows of the new file.
                stop.wait(POLL_S)
                while data := file.read(BLOCK):
                    yield _Block(data)
                file.close()
                file = _open_file(path)
                _print_note(
                    f"{path}: replaced by another file; reading the new file from the first row"
                )
                at, tail = 0, b""
                yield _Block(b"", 0)
            elif not _is_continued(file.fileno(), at, tail):
                _print_note(f"{path}: truncated; reading from the first row, rows may be missing")
                at, tail = 0, b""
                file.seek(0)
                yield _Block(b"", 0, follows=False)
    finally:
        file.close()


def _open_file(path: Path) -> BinaryIO:
    """File object opened for reading bytes; raises `InputError` for a missing file, a folder, a pipe or a device."""
    # The opening of a pipe would wait for a writer.
    flags = getattr(os, "O_NONBLOCK", 0)
    try:
        file = open(path, "rb", opener=lambda name, mode: os.open(name, mode | flags))  # noqa: SIM115
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except IsADirectoryError:
        raise InputError(f"{path}: a folder, not a file") from None
    if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
        file.close()
        raise InputError(f"{path}: not a regular file: pipe it to allanite watch -")
    return file


def _is_continued(descriptor: int, at: int, tail: bytes) -> bool:
    """True if the bytes `tail` still precede the position `at` of an open file, so that reading can continue there."""
    if os.fstat(descriptor).st_size < at:
        return False
    here = os.lseek(descriptor, 0, os.SEEK_CUR)
    try:
        os.lseek(descriptor, at - len(tail), os.SEEK_SET)
        return os.read(descriptor, len(tail)) == tail
    finally:
        os.lseek(descriptor, here, os.SEEK_SET)


def _is_replaced(path: Path, descriptor: int) -> bool:
    """True if the path names another file than the open one; False if the path names no file."""
    try:
        now, before = path.stat(), os.fstat(descriptor)
    except OSError:
        return False
    return (now.st_dev, now.st_ino) != (before.st_dev, before.st_ino)


# -- standard input and datagrams ------------------------------------------------------------------


def _blocks_of_thread(read: Callable[[], bytes], stop: Stop) -> Iterator[_Block]:
    """Yield blocks with the bytes that `read` returns in a thread, until there are none, and empty ones every 0.05 s.

    After a signal, reading ends within about 0.1 s. An `OSError` of `read` ends the iterator, too.
    """
    blocks: queue.Queue[bytes] = queue.Queue(MAX_QUEUED_BLOCKS)

    def run() -> None:
        """Put the bytes that `read` returns into the queue; the last entry is empty, also if the source is closed."""
        data = b"-"
        while data:
            try:
                data = read()
            except OSError:  # closed
                data = b""
            blocks.put(data)

    threading.Thread(target=run, daemon=True).start()
    ends: float | None = None
    while ends is None or time.monotonic() < ends:
        if ends is None and stop.is_set():
            ends = time.monotonic() + DRAIN_S
        try:
            data = blocks.get(timeout=0.05)
        except queue.Empty:
            yield _Block(b"")
            continue
        if not data:
            return
        yield _Block(data)


def _blocks_of_datagrams(source: str, stop: Stop) -> Iterator[_Block]:
    """Yield the datagrams that arrive at an address of this machine as blocks, until one is ``end`` or a signal arrives."""
    listener = _bound_socket(source)
    with listener:

        def read() -> bytes:
            """Bytes of the next datagram with a line end; empty for the datagram ``end``."""
            data = listener.recv(BLOCK)
            if data.strip() == b"end":
                return b""
            # A row never continues in the next datagram.
            return data + b"\n"

        yield from _blocks_of_thread(read, stop)


def _bound_socket(source: str) -> socket.socket:
    """UDP socket bound to the address ``udp://127.0.0.1:PORT`` (or localhost) in `source`.

    Raises `InputError` if the address is not local, the port is not 1 to 65535, or it cannot be bound, as when in use.
    """
    import socket

    host, _, port = source.removeprefix("udp://").rpartition(":")
    if not source.startswith("udp://") or host not in ("127.0.0.1", "localhost"):
        raise InputError(f"{source}: not an address of this machine: write udp://127.0.0.1:PORT")
    if not (port.isascii() and port.isdecimal() and 1 <= int(port[:9]) <= 65535):
        raise InputError(f"{source}: the port must be a whole number from 1 to 65535")
    listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        listener.bind(("127.0.0.1", int(port)))
    except OSError as error:
        listener.close()
        if error.errno == errno.EADDRINUSE:
            raise InputError(
                f"{source}: the address is in use by another program: choose another port"
            ) from None
        raise InputError(f"{source}: cannot listen: {error.strerror or error}") from None
    return listener


def _print_note(text: str) -> None:
    """Print a note on standard error, cut to `MAX_MESSAGE_LENGTH` characters."""
    click.echo(plain(f"· {text}", MAX_MESSAGE_LENGTH), err=True)
