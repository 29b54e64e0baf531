"""Results of several columns as one mapping from the column's name to its result."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType
from typing import Any, Generic, TypeVar

from allanite.common.errors import InputError

T = TypeVar("T")


class NoColumnError(InputError, KeyError):
    """There is no result with this name."""


class Several(Mapping[str, T], Generic[T]):
    """Mapping from the name of each column to its result.

    Parameters
    ----------
    results : mapping of str to result
        Results by the name of the column, in the order of the recording.

    Examples
    --------
    >>> white = np.random.default_rng(1).standard_normal((1000, 2))
    >>> log = al.Recording(white, rate=100, unit="deg/s", columns=["gyro_x", "gyro_y"])
    >>> found = al.deviations(log)
    >>> len(found), list(found), found["gyro_x"].tau[0]
    (2, ['gyro_x', 'gyro_y'], np.float64(0.01))
    >>> found.to_dict()["schema"], found.document("gyro_y")["recording"]["column"]
    ('allanite/adev/1', 'gyro_y')
    """

    def __init__(self, results: Mapping[str, T]) -> None:
        self._results = MappingProxyType(dict(results))

    def __getitem__(self, column: str) -> T:
        if column not in self._results:
            raise NoColumnError(self._missing(column))
        return self._results[column]

    def _missing(self, name: str) -> str:
        """Message for a column name that does not exist: it repeats the name and lists the columns that exist."""
        return f"no column {name!r}: choose one of {', '.join(self)}"

    def __iter__(self) -> Iterator[str]:
        return iter(self._results)

    def __len__(self) -> int:
        return len(self._results)

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON: ``{"schema": …, "columns": [document, …]}``, with the schema of the first document."""
        documents = [self.document(column) for column in self]
        return {"schema": documents[0]["schema"], "columns": documents}

    def document(self, column: str) -> dict[str, Any]:
        """Dict for JSON of the result of one column (its `to_dict`)."""
        result: Any = self[column]
        found: dict[str, Any] = result.to_dict()
        return found

    def __str__(self) -> str:
        return "\n\n".join(f"{column}\n{'─' * len(column)}\n{self[column]}" for column in self)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(self)})"

    def _repr_html_(self) -> str:
        """HTML text for notebooks: for each column, its name and the HTML (or else the text) of its result."""
        from html import escape

        parts = ((name, getattr(self[name], "_repr_html_", None)) for name in self)
        return "".join(
            f"<h4>{escape(name)}</h4>{f'<pre>{escape(str(self[name]))}</pre>' if html is None else html()}"
            for name, html in parts
        )


def results_by_column(recording: Any, compute: Callable[[Any], T]) -> dict[str, T]:
    """Dict from the name of each column of a recording to ``compute(column)``, where `column` is its `Recording`."""
    return {column.columns[0]: compute(column) for column in recording}
