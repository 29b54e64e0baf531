"""Ctrl-C is never lost, whenever it comes.

Python turns the signal into an exception in whatever runs at that moment. While modules are imported, in a destructor
or in a callback of foreign code that exception can be swallowed, and the command then runs to its end. Hence the
exception waits for the end of an import, and is raised again until it has arrived.
"""

from __future__ import annotations

import _thread
import signal
import sys
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import FrameType

__all__ = ["heard"]

AGAIN = 0.05  # s until an interrupt that has not arrived is raised again
IMPORT = "<frozen importlib._bootstrap>"


@contextmanager
def heard(*, last: bool) -> Iterator[None]:
    """Let no interrupt be lost inside of the block.

    Does nothing outside of the main thread, which alone hears signals, and where somebody else listens.

    Parameters
    ----------
    last : bool
        Whether the process ends with the block: once interrupted, it is not disturbed at that.

    Raises
    ------
    KeyboardInterrupt
        Once for one Ctrl-C or several, at the end of the block at the latest.
    """
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    listener = _Listener()
    try:
        signal.signal(signal.SIGINT, listener.hear)
    except ValueError:
        yield
        return
    try:
        yield
    finally:
        with listener.lock:
            listener.ended = True
        # Handles what is pending before it gives the signal back.
        asked = listener.asked and last
        signal.signal(signal.SIGINT, signal.SIG_IGN if asked else signal.default_int_handler)
    if listener.asked:
        raise KeyboardInterrupt


class _Listener:
    def __init__(self) -> None:
        self.asked = self.ended = False
        self.lock = _thread.allocate_lock()

    def hear(self, _signal: int, frame: FrameType | None) -> None:
        if _underway(sys.exc_info()[1]):
            return  # what cleans up behind it is not disturbed
        if not self.asked:
            self.asked = True
            _thread.start_new_thread(self._repeat, ())
        if not self.ended and not _importing(frame):
            raise KeyboardInterrupt

    def _repeat(self) -> None:
        while True:
            time.sleep(AGAIN)
            with self.lock:
                if self.ended:
                    return
                _thread.interrupt_main()


def _underway(error: BaseException | None) -> bool:
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__context__
    return error is not None


def _importing(frame: FrameType | None) -> bool:
    while frame is not None and frame.f_code.co_filename != IMPORT:
        frame = frame.f_back
    return frame is not None
