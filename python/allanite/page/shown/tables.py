"""The numbers behind a figure, as a table."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.plots.spec import Band, HeatMap, Line, Points

if TYPE_CHECKING:
    from allanite.plots.spec import Figure, Panel

__all__ = ["csv_of", "table_of"]

#: Rows of one table.
MOST = 4000


def table_of(figure: Figure) -> list[dict[str, Any]]:
    """Tables with a title, a head and rows; marks over the same places share one.

    Parameters
    ----------
    figure : Figure
    """
    tables: list[dict[str, Any]] = []
    for panel in figure.panels:
        known: dict[bytes, dict[str, Any]] = {}
        for mark in panel.marks:
            if isinstance(mark, HeatMap):
                tables.append(_map(panel, mark))
            elif isinstance(mark, Points | Line | Band):
                table = known.get(mark.x.tobytes())
                if table is None:
                    table = _new(panel, mark)
                    known[mark.x.tobytes()] = table
                    tables.append(table)
                for name, values in _columns(panel, mark):
                    table["head"].append(name)
                    for row, value in zip(table["rows"], values, strict=False):
                        row.append(value)
    return [t for t in tables if len(t["head"]) > 1]


def csv_of(figure: Figure) -> str:
    """The same as text: tables one below the other, numbers in full."""
    import csv
    import io

    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    for i, table in enumerate(table_of(figure)):
        if i:
            out.write("\n")
        writer.writerow(table["head"])
        writer.writerows(["" if v is None else repr(v) for v in row] for row in table["rows"])
    return out.getvalue()


def _new(panel: Panel, mark: Line | Points | Band) -> dict[str, Any]:
    rows = [[_plain(v)] for v in mark.x[:MOST]]
    return {"title": panel.title or panel.y.label, "head": [panel.x.label], "rows": rows}


def _columns(panel: Panel, mark: Line | Points | Band) -> list[tuple[str, list[Any]]]:
    name = mark.label or panel.y.label
    if isinstance(mark, Band):
        found = [(f"{name}, from", mark.low), (f"{name}, to", mark.high)]
    else:
        found = [(name.removesuffix(" ± 95 %"), mark.y)]
        if isinstance(mark, Points) and mark.low is not None and mark.high is not None:
            found += [("95 % from", mark.low), ("95 % to", mark.high)]
    return [(n, [_plain(v) for v in values[:MOST]]) for n, values in found]


def _map(panel: Panel, mark: HeatMap) -> dict[str, Any]:
    head = [f"{panel.x.label}, from", "to", f"{panel.y.label}, from", "to", mark.label]
    rows = [
        [*(_plain(v) for v in (mark.x_edges[j], mark.x_edges[j + 1])),
         *(_plain(v) for v in (mark.y_edges[i], mark.y_edges[i + 1])),
         _plain(mark.values[i, j])]
        for i, j in np.ndindex(mark.values.shape)
    ]  # fmt: skip
    return {"title": panel.title or "map", "head": head, "rows": rows[:MOST]}


def _plain(value: Any) -> float | None:
    number = float(value)
    return number if math.isfinite(number) else None
