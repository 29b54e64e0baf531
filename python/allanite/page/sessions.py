"""All tabs and uploads of a server, and their expiry."""

from __future__ import annotations

import gc
import secrets
import threading
import time
from typing import TYPE_CHECKING

from allanite import _kernels
from allanite.common.errors import InputError
from allanite.page.source import MAX_UPLOAD_BYTES, Source, Uploads
from allanite.page.tab import Tab

if TYPE_CHECKING:
    from collections.abc import Sequence

    from starlette.requests import Request

    from allanite.page.jobs import Job

MAX_TABS = 32
#: Seconds for which a closed tab is kept, so that a reloaded page can continue.
GRACE_S = 15.0
#: Seconds without a request after which a tab is deleted.
MAX_SILENCE_S = 900.0


class Sessions:
    """All tabs and uploads of a server; `max_bytes` is the maximum size of an upload."""

    def __init__(self, sources: Sequence[Source], most_bytes: int = MAX_UPLOAD_BYTES) -> None:
        self.sources = tuple(sources)
        self.max_bytes = most_bytes
        self.uploads = Uploads()
        self.tabs: dict[str, Tab] = {}
        self.lock = threading.Lock()

    def open(self) -> str:
        """Key of a new tab that opens the first log, if there is one; silent tabs and the oldest above 32 are deleted."""
        self.delete_silent_tabs()
        with self.lock:
            key = secrets.token_urlsafe(9)
            tab = self.tabs[key] = Tab(self.sources)
            # Delete the oldest tabs, which were most likely closed long ago.
            old = list(self.tabs)[:-MAX_TABS]
        for other in old:
            self.close(other)
        if self.sources:
            tab.open(0)
        return key

    def copy(self, key: str) -> str:
        """Key of a new tab that starts with a copy of another tab and resumes its canceled job.

        Raises `InputError` if the other tab no longer exists or has no open log.
        """
        other = self.tabs.get(key)
        if other is None or other.open_work is None:
            raise InputError("This tab no longer exists and cannot be copied")
        with self.lock:
            new = secrets.token_urlsafe(9)
            tab = self.tabs[new] = Tab(self.sources)
        tab.copy_state_from(other)
        tab.resume()
        return new

    def leave(self, key: str) -> None:
        """Cancel the job of a page that was closed or reloaded; the tab expires after 15 s unless it is resumed."""
        tab = self.tabs.get(key)
        if tab is not None:
            tab.last_request = time.monotonic() - MAX_SILENCE_S + GRACE_S
            tab.has_left = True
            tab.cancel()

    def resume(self, key: str) -> None:
        """Connect a reloaded page with its tab again, and restart canceled reading, the first fit or a check.

        Other canceled jobs, such as an improvement, are not restarted.
        Raises `InputError` if the tab no longer exists, or if no page has left it.
        """
        tab = self.tabs.get(key)
        if tab is None or not tab.has_left:
            raise InputError("This tab no longer exists and cannot be resumed")
        tab.has_left, tab.last_request = False, time.monotonic()
        tab.resume()

    def close(self, key: str) -> None:
        """Delete a tab: cancel its job, wait for it up to 2 s and free its samples. An unknown key is ignored."""
        with self.lock:
            tab = self.tabs.pop(key, None)
        if tab is not None:
            tab.cancel()
            job = tab.job
            del tab
            if job is not None:
                job.wait(2.0)
                if job.is_running:
                    # The core is busy with a long step; free its memory when the step ends.
                    threading.Thread(target=_free_memory_after, args=(job,), daemon=True).start()
            del job
            _free_memory()

    def delete_silent_tabs(self) -> None:
        """Delete all tabs without a request in the last 900 s, and those that a page left more than 15 s ago."""
        now = time.monotonic()
        for key in [
            k for k, tab in list(self.tabs.items()) if now - tab.last_request > MAX_SILENCE_S
        ]:
            self.close(key)

    def tab(self, request: Request) -> Tab:
        """`Tab` of a request, whose time of the last request is set to now; raises `InputError` if it no longer exists."""
        found = self.tabs.get(request.path_params["tab"])
        if found is None:
            raise InputError("This session has ended: reload the page")
        found.last_request = time.monotonic()
        return found


def _free_memory_after(job: Job) -> None:
    """Wait until a job has ended, then free its memory (`_free_memory`)."""
    job.wait()
    del job
    _free_memory()


def _free_memory() -> None:
    """Collect garbage; in a process that runs the command `allanite`, also return freed memory to the system."""
    gc.collect()
    _kernels.trim()
