"""Tables of the values of a figure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.documents import jsonable
from allanite.common.units import conversion
from allanite.plots.curves import component_styles, interval
from allanite.plots.spec import Band, HeatMap, Line, Points
from allanite.plots.words import label_in_unit

if TYPE_CHECKING:
    from allanite.fit import Fit
    from allanite.plots.spec import Figure, Mark, Panel

#: Maximum number of rows of a table.
MOST = 4000


def tables_of(figure: Figure, fit: Fit | None, unit: str) -> list[dict[str, Any]]:
    """Tables of a figure, each a dict with ``title``, ``head`` and ``rows``.

    The Allan curve of the displayed `fit` gives one table with model and residuals, whose deviations are in `unit`. All
    other figures give the tables of `_tables_of_marks`.
    """
    if fit is not None and figure.kind == "fit" and figure.panels[0].title == "Allan deviation":
        return [_curve_table(fit, unit)]
    return _tables_of_marks(figure)


def _curve_table(fit: Fit, unit: str) -> dict[str, Any]:
    """Table (dict) of the Allan curve: τ, measured, low, high, edf, model, residual, and each effect."""
    curve, factor = fit.curve, conversion(fit.recording.unit, unit)
    low, high = interval(curve.measured, curve.edf)
    effects = [part.label.split(":")[0] for part in component_styles(fit)]
    columns = [
        ("τ (s)", curve.tau),
        (label_in_unit("measured", unit), factor * curve.measured),
        ("low (95 %)", factor * low),
        ("high (95 %)", factor * high),
        ("edf", curve.edf),
        (label_in_unit("model", unit), factor * curve.model),
        ("residual (σ)", curve.z),
        *(
            (label_in_unit(name, unit), factor * values)
            for name, values in zip(effects, curve.components.values(), strict=True)
        ),
    ]
    rows = jsonable(np.column_stack([v for _, v in columns]))
    return {"title": "Allan deviation", "head": [name for name, _ in columns], "rows": rows}


def _tables_of_marks(figure: Figure) -> list[dict[str, Any]]:
    """Tables (title, head, at most 4000 rows) of all marks of a figure; marks with equal x in a panel share a table."""
    tables: list[dict[str, Any]] = []
    for panel in figure.panels:
        known: dict[bytes, dict[str, Any]] = {}
        for mark in sorted(panel.marks, key=_mark_rank):
            if isinstance(mark, HeatMap):
                tables.append(_map_table(panel, mark))
            elif isinstance(mark, Points | Line | Band):
                table = known.get(mark.x.tobytes())
                if table is None:
                    title, head = panel.title or panel.y.label, [panel.x.label]
                    rows = jsonable(np.asarray(mark.x[:MOST], dtype=float)[:, np.newaxis])
                    table = known[mark.x.tobytes()] = {"title": title, "head": head, "rows": rows}
                    tables.append(table)
                for name, values in _named_columns(panel, mark):
                    table["head"].append(name)
                    for row, value in zip(table["rows"], values, strict=False):
                        row.append(value)
    return tables


def _mark_rank(mark: Mark) -> int:
    """Sort key of a mark in a table: 0 for points, 2 for bands, 1 for all others."""
    return 0 if isinstance(mark, Points) else 2 if isinstance(mark, Band) else 1


def csv_of(tables: list[dict[str, Any]]) -> str:
    """CSV text of tables (dicts with ``head`` and ``rows`` of floats or None), separated by empty lines, without titles."""
    import csv
    import io

    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    for i, table in enumerate(tables):
        if i:
            out.write("\n")
        writer.writerow(table["head"])
        writer.writerows(["" if v is None else repr(v) for v in row] for row in table["rows"])
    return out.getvalue()


def _named_columns(panel: Panel, mark: Line | Points | Band) -> list[tuple[str, list[Any]]]:
    """Pairs (column name, y values) of a mark, at most 4000 values each; values that are not finite become None."""
    name = mark.label or panel.y.label
    if isinstance(mark, Band):
        found = [(f"{name}, from", mark.low), (f"{name}, to", mark.high)]
    else:
        found = [(name.removesuffix(" ± 95 %"), mark.y)]
        if isinstance(mark, Points) and mark.low is not None and mark.high is not None:
            found += [("low (95 %)", mark.low), ("high (95 %)", mark.high)]
    return [(n, jsonable(np.asarray(values[:MOST], dtype=float))) for n, values in found]


def _map_table(panel: Panel, mark: HeatMap) -> dict[str, Any]:
    """Table (dict) of the cells of a heat map, at most 4000 rows: edges in x and y, and the value."""
    head = [f"{panel.x.label}, from", "to", f"{panel.y.label}, from", "to", mark.label]
    x, y = mark.x_edges, mark.y_edges
    cells = [
        (x[j], x[j + 1], y[i], y[i + 1], mark.values[i, j])
        for i, j in np.ndindex(mark.values.shape)
    ]
    rows = jsonable(np.array(cells[:MOST], dtype=float))
    return {"title": panel.title or "map", "head": head, "rows": rows}
