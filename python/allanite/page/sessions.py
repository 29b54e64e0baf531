"""All tabs and uploads of one server, and when they are forgotten."""

from __future__ import annotations

import ctypes
import gc
import os
import secrets
import threading
import time
from typing import TYPE_CHECKING

from allanite import _kernels
from allanite.common.errors import InputError
from allanite.page.source import MOST_BYTES, Source, Uploads
from allanite.page.tab import Tab

if TYPE_CHECKING:
    from collections.abc import Sequence

    from starlette.requests import Request

    from allanite.page.jobs import Job

__all__ = ["GRACE", "Sessions"]

MOST_TABS = 32
#: Seconds for which a tab that was left is kept: a page that is loaded again takes it up where it was.
GRACE = 15.0
#: Seconds after which a tab of which nothing was heard is forgotten.
SILENT = 900.0
#: M_ARENA_MAX of <malloc.h>.
ARENA_MAX = -8


class Sessions:
    """All tabs and uploads of one server; `most_bytes` is the largest upload."""

    def __init__(self, sources: Sequence[Source], most_bytes: int = MOST_BYTES) -> None:
        _few_arenas()
        self.sources = tuple(sources)
        self.most_bytes = most_bytes
        self.uploads = Uploads()
        self.tabs: dict[str, Tab] = {}
        self.lock = threading.Lock()

    def open(self) -> str:
        """A new tab, at work on the first log."""
        self.sweep()
        with self.lock:
            key = secrets.token_urlsafe(9)
            tab = self.tabs[key] = Tab(self.sources, len(self.tabs) + 1)
            # The oldest are most likely those that were closed long ago.
            old = list(self.tabs)[:-MOST_TABS]
        for other in old:
            self.close(other)
        if self.sources:
            tab.open(0)
        return key

    def copy(self, key: str) -> str:
        """A new tab that begins with what another one holds: a second tab of the browser opens the same study.

        Raises
        ------
        InputError
            The other tab is forgotten.
        """
        other = self.tabs.get(key)
        if other is None or other.now is None:
            raise InputError("This tab is not there to be copied")
        with self.lock:
            new = secrets.token_urlsafe(9)
            tab = self.tabs[new] = Tab(self.sources, len(self.tabs) + 1)
        tab.take_over(other)
        tab.resume()
        return new

    def leave(self, key: str) -> None:
        """A page was closed or is loaded again: its work ends at once; unless it is taken up again, it is forgotten."""
        tab = self.tabs.get(key)
        if tab is not None:
            tab.heard = time.monotonic() - SILENT + GRACE
            tab.left = True
            tab.cancel()

    def resume(self, key: str) -> None:
        """The page was loaded again: it goes on where it was.

        Raises
        ------
        InputError
            The tab is forgotten, or another page is at work on it.
        """
        tab = self.tabs.get(key)
        if tab is None or not tab.left:
            raise InputError("This tab is not there to be taken up")
        tab.left, tab.heard = False, time.monotonic()
        tab.resume()

    def close(self, key: str) -> None:
        """Forget a tab: its work ends, its samples go."""
        with self.lock:
            tab = self.tabs.pop(key, None)
        if tab is not None:
            tab.cancel()
            job = tab.job
            del tab
            if job is not None:
                job.wait(2.0)
                if job.at_work:
                    # The core is at a long step: what it holds is given back once that is done.
                    threading.Thread(target=_give_back_after, args=(job,), daemon=True).start()
            del job
            _give_back()

    def sweep(self) -> None:
        """Forget the tabs of which nothing is heard any more."""
        now = time.monotonic()
        for key in [k for k, tab in list(self.tabs.items()) if now - tab.heard > SILENT]:
            self.close(key)

    def tab(self, request: Request) -> Tab:
        """The tab that a request speaks of."""
        found = self.tabs.get(request.path_params["tab"])
        if found is None:
            raise InputError("This session has ended: reload the page")
        found.heard = time.monotonic()
        return found


def _few_arenas() -> None:
    """Let threads share their memory: what one of many threads frees is otherwise kept for it."""
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None) if os.name == "posix" else None
    if mallopt is not None:
        mallopt(ARENA_MAX, 2)


def _give_back_after(job: Job) -> None:
    job.wait()
    del job
    _give_back()


def _give_back() -> None:
    """Give freed memory back to the system, where the C library would keep it."""
    gc.collect()
    _kernels.trim()
