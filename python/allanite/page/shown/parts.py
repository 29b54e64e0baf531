"""Data that the page requests in addition to its state and views: once, or for a dialog."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.common.errors import AllaniteError, InputError
from allanite.common.numbers import duration_text
from allanite.common.read_options import ReadOptions
from allanite.common.units import parse_unit
from allanite.comparison import accept_study
from allanite.exports import verdict_in
from allanite.page.edits import deviation_unit
from allanite.page.shown import documents
from allanite.page.shown.catalogue import catalogue
from allanite.page.shown.figures import VIEWS, displayed_fit, figure_of
from allanite.page.shown.tables import tables_of
from allanite.page.source import Reading
from allanite.page.state import UNITS
from allanite.page.studies import study_document
from allanite.recording.sensor_names import sensor_kind

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from allanite.axes import Common
    from allanite.comparison.acceptance import Acceptance
    from allanite.fit import Fit
    from allanite.page.tab import Tab
    from allanite.page.work import Work
    from allanite.recording import Recording

#: Kinds of sensors whose columns can get a common unit.
KINDS = ("angular rate", "acceleration")
#: Number of points of a small curve.
POINTS = 24


def page_data(tab: Tab, name: str, options: Mapping[str, str] | None = None) -> Any:
    """Data for JSON that the page requests by `name`: a key of `_PARTS`, or ``table-VIEW`` for the values of a view.

    Raises `InputError` if the name is unknown, or if something that the data need is missing.
    """
    if name.startswith("table-"):
        view = name.removeprefix("table-")
        if view not in VIEWS:
            raise InputError(f"No view {view[:40]!r}")
        unit = deviation_unit(tab.log.unit, tab.unit)
        return tables_of(figure_of(tab, view, options), displayed_fit(tab), unit)
    if name not in _PARTS:
        raise InputError(f"Nothing is called {name[:40]!r}")
    return _PARTS[name](tab, options or {})


def _small_curves(tab: Tab, _: Mapping[str, str]) -> dict[str, Any]:
    """Dict from the digest of each opened log (a text that identifies its samples) to the list of `_column_paths`."""
    return {work.digest: _column_paths(work) for work in list(tab.works.values())}


def _column_paths(work: Work) -> list[str | None]:
    """One SVG path or None per column: its Allan deviation, 100 × 40 pixels, logarithmic; equal units share a scale."""
    if work.paths is not None:
        return work.paths
    curves = [_log_curve(work.log(i)) for i in range(len(work.recording.columns))]
    units = work.recording.units
    out: list[str | None] = []
    for curve, unit in zip(curves, units, strict=True):
        alike = [c for c, u in zip(curves, units, strict=True) if u == unit and c is not None]
        out.append(None if curve is None else _svg_path(curve, alike))
    work.paths = out
    return out


def _log_curve(column: Recording) -> Any:
    """Pair (log10 τ, log10 deviation) of up to `POINTS` points of a column's Allan deviation; None below three points."""
    try:
        found = column.oadev()
    except AllaniteError:
        return None
    tau, deviation = np.asarray(found.tau), np.asarray(found.deviation)
    good = np.isfinite(deviation) & (deviation > 0)
    if np.count_nonzero(good) < 3:
        return None
    tau, deviation = np.log10(tau[good]), np.log10(deviation[good])
    at = np.unique(np.linspace(0, tau.size - 1, POINTS).round().astype(int))
    return tau[at], deviation[at]


def _svg_path(curve: Any, alike: list[Any]) -> str:
    """SVG path of one Allan deviation (log10 τ, log10 deviation), 100 × 40 pixels; the axes cover all curves in `alike`."""
    left, right = min(c[0][0] for c in alike), max(c[0][-1] for c in alike)
    low, high = min(c[1].min() for c in alike), max(c[1].max() for c in alike)
    across = 100.0 * (curve[0] - left) / max(right - left, 1e-9)
    down = 37.0 - 34.0 * (curve[1] - low) / max(high - low, 1e-9)
    return "M" + "L".join(f"{a:.1f},{b:.1f}" for a, b in zip(across, down, strict=True))


def _all_effects(tab: Tab, _: Mapping[str, str]) -> list[dict[str, Any]]:
    """List of one dict per effect of the catalog, see `catalogue`; names are those for the sensor of the current column."""
    kind = "" if tab.open_work is None else parse_unit(tab.log.unit).kind
    return catalogue(kind)


def _inspected_columns(tab: Tab, _: Mapping[str, str]) -> dict[str, Any]:
    """What the reader finds in the open log without the user's choices, and units to choose for each kind of sensor.

    Raises `InputError` if no log is open, or for a recording without a file.
    """
    source = tab.source
    if source is None:
        raise InputError("No log is open: drop a file or choose one")
    # Without the chosen columns and units, which the form shows on top.
    given = source.reading.options
    options = ReadOptions(rate=given.rate, time_column=given.time_column)
    found = source.inspect(Reading(options))
    for column in found["columns"]:
        column["kind"] = sensor_kind(column["name"] or "")
    units = {kind: [u for u in UNITS if parse_unit(u).kind == kind] for kind in KINDS}
    return {**found, "kinds": units}


def _common_properties(tab: Tab, _: Mapping[str, str]) -> dict[str, Any]:
    """Dict of the common properties of the axes: agreement of models, shared noise, and lines found on several axes.

    Raises `InputError` for fewer than two fitted axes.
    """
    from allanite.axes.words import common_form_sentences, shared_effect_sentences

    names = tab.work.recording.columns
    steps = [(n, one.step) for n, one in zip(names, tab.board.columns, strict=True)]
    fits = tuple((n, s.fit) for n, s in steps if s is not None)
    if len(fits) < 2:
        raise InputError("Fit at least two axes before comparing them")
    found = _common_of_fits(fits)
    return {
        "sensors": [
            {"name": s.name, "columns": list(s.columns), "sentences": common_form_sentences(s)}
            for s in found.sensors
        ],
        "lines": shared_effect_sentences(found),
    }


@lru_cache(maxsize=2)
def _common_of_fits(fits: tuple[tuple[str, Fit], ...]) -> Common:
    """`Common` properties of several axes, each given as (name, fit); cached."""
    from allanite.axes.characterization import common_of
    from allanite.study import Rung, Study
    from allanite.suggestion import Check

    # `common_of` uses only the last fit of a study, so the check may be empty.
    studies = {
        name: Study(fit.recording, (Rung(fit),), Check(fit, None, ()), "limit")  # type: ignore[arg-type]
        for name, fit in fits
    }
    return common_of(studies)


def _export_verdict(tab: Tab, options: Mapping[str, str]) -> dict[str, Any]:
    """``verdict`` of an export file before it is saved, and ``missing``, a note on axes that are not in the file."""
    made = documents.generated_file(tab, options.get("target", ""), "light")
    return {"verdict": verdict_in(made.body.decode()), "missing": made.note}


def _acceptance_results(tab: Tab, _: Mapping[str, str]) -> dict[str, Any] | None:
    """Acceptance test: name of the sheet, `_axis_acceptance` of every checked axis, and remarks; None without a sheet.

    Raises `InputError` if the sheet has no values for the checked axes.
    """
    if tab.sheet is None:
        return None
    axes, remarks = [], dict[str, None]()
    for name, column_steps in zip(tab.work.recording.columns, tab.board.columns, strict=True):
        study = None if column_steps.step is None else column_steps.step.study
        if study is None:
            continue
        own = tab.sheet.of_kind(parse_unit(study.recording.unit).kind)
        if own.figures:
            found = accept_study(study, own)
            axes.append(_axis_acceptance(name, found))
            remarks |= dict.fromkeys(found.remarks)
    if not axes:
        raise InputError("The data sheet has no values for the checked axes")
    return {"sheet": tab.sheet.name, "axes": axes, "remarks": list(remarks)}


def _axis_acceptance(name: str, found: Acceptance) -> dict[str, Any]:
    """Dict of the acceptance test of one axis, as texts: name, verdict, ``figures`` and ``needs``.

    ``needs`` is the record duration that would settle the verdict; empty if it is not known or not needed.
    """
    return {
        "name": name,
        "verdict": found.verdict,
        "needs": "" if found.needs is None else duration_text(found.needs),
        "figures": [
            {
                "name": f.figure.name.replace("_", " "),
                **dict(zip(("limit", "measured", "interval"), f.texts, strict=True)),
                "verdict": f.verdict,
                "remark": f.remark,
            }
            for f in found.figures
        ],
    }


_PARTS: dict[str, Callable[[Any, Mapping[str, str]], Any]] = {
    "strip": _small_curves,
    "common": _common_properties,
    "catalogue": _all_effects,
    "inspect": _inspected_columns,
    "saved": lambda tab, _: study_document(tab),
    "export": _export_verdict,
    "acceptance": _acceptance_results,
}
