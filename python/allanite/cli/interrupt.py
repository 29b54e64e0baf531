"""Make sure that no Ctrl-C is lost.

Python turns the signal into an exception in the code that runs at that moment. During an import, in a destructor or in
a callback from foreign code, this exception can be swallowed. The command would then run to its end. Therefore the
exception is delayed until an import has ended, and raised again until it takes effect.
"""

from __future__ import annotations

import _thread
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

#: Time until an interrupt that had no effect is raised again, s. Chosen by judgment; not measured.
REPEAT_SECONDS = 0.05
#: File name of the frames of Python's import system.
IMPORT_FILE = "<frozen importlib._bootstrap>"


@contextmanager
def keep_interrupts(*, process_ends: bool) -> Iterator[None]:
    """Context in which no interrupt (Ctrl-C) is lost, even during imports.

    Only the main thread gets signals. If the process ends after the block, further interrupts are ignored. Raises
    `KeyboardInterrupt` once for one Ctrl-C or several, at the end of the block at the latest.
    """
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    listener = _Listener()
    try:
        signal.signal(signal.SIGINT, listener.handle)
    except ValueError:
        yield
        return
    try:
        yield
    except BaseException as error:
        # What an interrupt broke, such as an import of the core, may raise another error than KeyboardInterrupt. A panic of
        # the core is no Exception.
        broken = isinstance(error, Exception) or type(error).__name__ == "PanicException"
        if listener.interrupted and broken:
            raise KeyboardInterrupt from error
        raise
    finally:
        with listener.lock:
            listener.ended = True
        # `signal.signal` runs the handlers of pending signals before it replaces the handler.
        ignored = listener.interrupted and process_ends
        signal.signal(signal.SIGINT, signal.SIG_IGN if ignored else signal.default_int_handler)
    if listener.interrupted:
        raise KeyboardInterrupt


class _Listener:
    """Handler of SIGINT that raises `KeyboardInterrupt` again and again until the block has ended."""

    def __init__(self) -> None:
        self.interrupted = self.ended = False
        self.lock = _thread.allocate_lock()

    def handle(self, _signal: int, frame: FrameType | None) -> None:
        """Signal handler: raise `KeyboardInterrupt`; at the first signal, also start a thread that repeats the signal.

        Nothing is raised after the block has ended, during an import, or while an earlier interrupt is handled.
        """
        if _is_interrupt(sys.exc_info()[1]):
            return  # cleanup code that runs because of the first interrupt must finish
        if not self.interrupted:
            self.interrupted = True
            _thread.start_new_thread(self._repeat_interrupt, ())
        if not self.ended and not _is_importing(frame):
            raise KeyboardInterrupt

    def _repeat_interrupt(self) -> None:
        """Raise an interrupt in the main thread every 50 ms, until the ``with`` block of `keep_interrupts` has ended."""
        while True:
            time.sleep(REPEAT_SECONDS)
            with self.lock:
                if self.ended:
                    return
                _thread.interrupt_main()


def _is_interrupt(error: BaseException | None) -> bool:
    """True if an error is a `KeyboardInterrupt`, or was raised while one was handled; False for None."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__context__
    return error is not None


def _is_importing(frame: FrameType | None) -> bool:
    """True if code of Python's import system is running in `frame` or in one of its callers; False for None."""
    while frame is not None and frame.f_code.co_filename != IMPORT_FILE:
        frame = frame.f_back
    return frame is not None
