"""Text of results for consoles (one line, arrays summarized) and small HTML tables for notebooks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from html import escape
from typing import Any

import numpy as np

#: Maximum length of a nested value that is shown in full, characters.
MAX_VALUE_LENGTH = 60

_CELL = "text-align: {}; vertical-align: top"


def brief(thing: Any) -> str:
    """One-line text of a dataclass: arrays are shown by size and range, long sequences by their length.

    Use this function as ``__repr__`` of a class.
    """
    inside = [f"{f.name}={_short(getattr(thing, f.name))}" for f in fields(thing) if f.repr]
    return f"{type(thing).__name__}({', '.join(inside)})"


def _short(value: Any) -> str:
    """Short text of a value: arrays by size and range, mappings by their keys, long values by length and type."""
    if isinstance(value, np.ndarray):
        return numbers(value)
    if isinstance(value, Mapping):
        return f"<{len(value)}: {', '.join(map(str, value))}>" if value else "<none>"
    text = repr(value) if not (isinstance(value, Sequence) and len(value) > 8) else ""
    if not text or len(text) > MAX_VALUE_LENGTH:
        count = f"{len(value)} × " if isinstance(value, Sequence) and len(value) else ""
        kind = type(value[0] if count else value).__name__
        return f"<{count}{kind}>"
    return text


def numbers(array: np.ndarray[Any, Any]) -> str:
    """Text with the size (or shape) and range of an array: ``<38 from 0.01 to 2400>``."""
    shape = "×".join(map(str, array.shape)) or "1"
    if array.dtype.kind == "b":
        return f"<{shape} flags, {int(array.sum())} set>"
    known = array[np.isfinite(array)] if array.dtype.kind in "fiu" else array[:0]
    if not known.size:
        return f"<{shape}>"
    return f"<{shape} from {known.min():.4g} to {known.max():.4g}>"


def html_table(
    title: str, head: Sequence[str], rows: Sequence[Sequence[str]], right: Sequence[int] = ()
) -> str:
    """HTML table with a caption. Texts are escaped; the columns with indices `right` are aligned to the right."""

    def cell(tag: str, i: int, text: str) -> str:
        """HTML of one cell in column i."""
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


def html_list(items: Sequence[str]) -> str:
    """HTML list (``<ul>``) of sentences; an empty text without sentences."""
    return f"<ul>{''.join(f'<li>{escape(i)}</li>' for i in items)}</ul>" if items else ""


def recording_html(recording: Any) -> str:
    """HTML table of the columns of a recording with mean and standard deviation, and the findings of the audit."""
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
