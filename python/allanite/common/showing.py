"""Text of results for consoles (one line, arrays summarized) and small HTML tables for notebooks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

#: Maximum length of a nested value that is shown in full, characters.
MAX_VALUE_LENGTH = 60

_CELL = "text-align: {}; vertical-align: top"


def brief(thing: Any) -> str:
    """One-line ``__repr__`` of a dataclass instance, ``Name(field=value, …)``, with shortened values."""
    inside = [f"{f.name}={_value_text(getattr(thing, f.name))}" for f in fields(thing) if f.repr]
    return f"{type(thing).__name__}({', '.join(inside)})"


def heading(recording: Any) -> str:
    """Line above a table of one column: log, column, number of samples, rate, duration and unit.

    The unit is omitted if it is 1.
    """
    r = recording
    unit = "" if r.unit == "1" else f", {r.unit}"
    what = f"{r.n} samples at {r.rate:g} Hz ({r.duration:.6g} s){unit}"
    return f"{Path(r.path).name if r.path else 'recording'} · {r.columns[0]} · {what}"


def _value_text(value: Any) -> str:
    """Short text of a value for a `repr`.

    ``<38 from 0.01 to 2400>`` for an array, ``<2: gx, gy>`` (number and keys) for a mapping, ``<none>`` for an empty
    one, ``<12 × float>`` for a sequence of more than 8 items. Any other value is its `repr` if that has at most 60
    characters. Else a sequence or text is ``<3 × str>`` (number of items, type of the first), and another value ``<Model>``
    (its type).
    """
    if isinstance(value, np.ndarray):
        return array_text(value)
    if isinstance(value, Mapping):
        return f"<{len(value)}: {', '.join(map(str, value))}>" if value else "<none>"
    many = isinstance(value, Sequence) and not isinstance(value, str) and len(value) > 8
    text = "" if many else repr(value)
    if not text or len(text) > MAX_VALUE_LENGTH:
        count = f"{len(value)} × " if isinstance(value, Sequence) and len(value) else ""
        kind = type(value[0] if count else value).__name__
        return f"<{count}{kind}>"
    return text


def array_text(array: np.ndarray[Any, Any]) -> str:
    """Shape and range of an array: ``<38 from 0.01 to 2400>``, or ``<38 flags, 2 set>``; only finite numbers count."""
    shape = "×".join(map(str, array.shape)) or "1"
    if array.dtype.kind == "b":
        return f"<{shape} flags, {int(array.sum())} set>"
    known = array[np.isfinite(array)] if array.dtype.kind in "fiu" else array[:0]
    if not known.size:
        return f"<{shape}>"
    return f"<{shape} from {known.min():.4g} to {known.max():.4g}>"


def aligned_lines(rows: Sequence[Sequence[str]], *, right: bool = False) -> list[str]:
    """Lines of a table: the cells of each row, filled with blanks to the width of their column."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    fill = str.rjust if right else str.ljust
    return ["  ".join(map(fill, row, widths)).rstrip() for row in rows]


def html_table(
    title: str, head: Sequence[str], rows: Sequence[Sequence[str]], right: Sequence[int] = ()
) -> str:
    """HTML table with a caption; without `head`, without a head row. Columns with indices in `right` align right."""

    def cell(tag: str, i: int, text: str) -> str:
        """HTML of one cell (`tag` is ``td`` or ``th``) in column i, with its alignment; the text is escaped."""
        style = _CELL.format("right" if i in right else "left")
        return f'<{tag} style="{style}">{escape(text)}</{tag}>'

    top = "".join(cell("th", i, text) for i, text in enumerate(head))
    body = "".join(
        f"<tr>{''.join(cell('td', i, text) for i, text in enumerate(row))}</tr>" for row in rows
    )
    caption = '<caption style="text-align: left; font-weight: bold">{}</caption>'
    return (
        f"<table>{caption.format(escape(title))}"
        f"{f'<thead><tr>{top}</tr></thead>' if head else ''}<tbody>{body}</tbody></table>"
    )


def text_html(thing: Any) -> str:
    """HTML for notebooks: `str(thing)`, escaped and preformatted. Use this function as ``_repr_html_`` of a class."""
    return f"<pre>{escape(str(thing))}</pre>"


def html_list(items: Sequence[str]) -> str:
    """HTML list (``<ul>``) of sentences, which are escaped; empty for an empty sequence."""
    return f"<ul>{''.join(f'<li>{escape(i)}</li>' for i in items)}</ul>" if items else ""


def recording_html(recording: Any) -> str:
    """HTML table with a row per column of a recording, and a list of the logged columns and the findings of the audit."""
    r = recording
    rows = [
        (
            name,
            unit,
            f"{np.nanmean(x):.6g}",
            f"{np.nanstd(x):.4g}",
            str(int(np.isnan(x).sum()) if x.dtype.kind == "f" else 0),
        )
        for name, unit, x in zip(r.columns, r.units, r.samples.reshape(r.n, -1).T, strict=True)
    ]
    title = f"{r.path or 'recording'}: {r.n} samples at {r.rate:g} Hz ({r.duration:g} s)"
    head = ("column", "unit", "mean", "standard deviation", "missing")
    extra = [f"logged columns: {', '.join(r.covariates)}"] if r.covariates else []
    messages = [finding.message for finding in r.audit]
    return html_table(title, head, rows, (2, 3, 4)) + html_list([*extra, *messages])
