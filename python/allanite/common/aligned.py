"""Align arrays after unpickling, because a buffer from another process may begin at any byte."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np

C = TypeVar("C", bound=type[Any])


def with_aligned_arrays(value: Any) -> Any:
    """The value with an aligned copy of each misaligned array, also inside of plain lists, tuples and dicts."""
    if isinstance(value, np.ndarray):
        if value.flags.aligned:
            return value
        copy = value.copy("K")
        copy.flags.writeable = value.flags.writeable
        return copy
    if type(value) in (list, tuple):
        return type(value)(with_aligned_arrays(item) for item in value)
    if type(value) is dict:
        return {key: with_aligned_arrays(item) for key, item in value.items()}
    return value


def align_when_unpickled(cls: C) -> C:
    """Class decorator: the arrays of an unpickled instance are aligned, because the core only accepts aligned arrays.

    Pickle protocol 5 stores arrays outside of the pickle, and a receiver such as Dask may place them at odd addresses.
    """
    restore = getattr(cls, "__setstate__", None)

    def set_state(self: Any, state: Any) -> None:
        """Set the attributes from a pickled state with aligned arrays, by the ``__setstate__`` of the class, if any."""
        state = with_aligned_arrays(state)
        if restore is not None:
            restore(self, state)
            return
        # A class without __setstate__ pickles its __dict__, or the pair of its __dict__ and its slots.
        for part in state if isinstance(state, tuple) else (state,):
            for name, item in (part or {}).items():
                object.__setattr__(self, name, item)

    cls.__setstate__ = set_state
    return cls
