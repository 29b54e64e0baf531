"""Limit the linear algebra library (BLAS) to one thread for small matrices.

On a busy machine, the product of a tall and a narrow matrix waits longer for other threads than it computes.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from typing import Any


class _Users:
    """Counts the computations that need one thread, and restores the other threads after the last one."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.number = 0
        self.limit: Any = None

    def enter(self) -> None:
        """Count one more computation; the first one limits the threads."""
        with self.lock:
            self.number += 1
            if self.number == 1:
                self.limit = _controller().limit(limits=1, user_api="blas")
                _let_all_threads_set_limits()

    def leave(self) -> None:
        """Count one computation less.

        After the last, restore the threads, unless other code changed their number meanwhile.
        """
        with self.lock:
            self.number -= 1
            blas = [one for one in _controller().info() if one["user_api"] == "blas"]
            if self.number == 0 and all(one["num_threads"] == 1 for one in blas):
                _let_all_threads_set_limits(force=True)
                self.limit.restore_original_limits()
                _let_all_threads_set_limits()


def _let_all_threads_set_limits(*, force: bool = False) -> None:
    """Let every Python thread set the number of OpenBLAS threads; threadpoolctl 3.8 allows only the first that sets it.

    Without this function, the last computation could not restore the number that the first computation set in another
    thread, and the limits of a user in a third thread would have no effect.
    """
    from threadpoolctl import OpenBLASController

    clear = getattr(OpenBLASController, "clear_controlling_thread", None)
    if clear is not None:
        clear(force=force)


_users = _Users()
# In a forked process, a lock that another thread held would stay locked. Windows has no fork.
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=lambda: setattr(_users, "lock", threading.Lock()))


@lru_cache(maxsize=1)
def _controller() -> Any:
    """`ThreadpoolController` of threadpoolctl for all loaded BLAS libraries; created once."""
    # SciPy brings its own BLAS library, which is only found after it was loaded.
    import scipy.linalg  # noqa: F401
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


@contextmanager
def one_thread() -> Iterator[None]:
    """Context (and decorator) in which BLAS uses one thread. Concurrent contexts share the limit."""
    _users.enter()
    try:
        yield
    finally:
        _users.leave()
