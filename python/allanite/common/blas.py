"""Threads of the linear algebra library, which small matrices pay for and do not use.

On a busy machine a product of a tall matrix with a narrow one waits longer for its threads than it computes.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from typing import Any

__all__ = ["one_thread"]


class _Users:
    """How many computations want one thread now, and how to give the others back."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.number = 0
        self.limit: Any = None

    def come(self) -> None:
        with self.lock:
            self.number += 1
            if self.number == 1:
                self.limit = _controller().limit(limits=1, user_api="blas")

    def go(self) -> None:
        with self.lock:
            self.number -= 1
            if self.number == 0:
                self.limit.restore_original_limits()


_users = _Users()
# A lock that another thread held does not open in a forked process; Windows has none.
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=lambda: setattr(_users, "lock", threading.Lock()))


@lru_cache(maxsize=1)
def _controller() -> Any:
    # SciPy has a library of its own, which is found only where it is loaded.
    import scipy.linalg  # noqa: F401
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


@contextmanager
def one_thread() -> Iterator[None]:
    """Small linear algebra: one thread until the last of those who want that is done; also a decorator."""
    _users.come()
    try:
        yield
    finally:
        _users.go()
