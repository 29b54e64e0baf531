"""Files that the page hands out and takes in."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from allanite.errors import AllaniteError, InputError
from allanite.page.source import Reading
from allanite.page.views import VIEWS, figure_of

if TYPE_CHECKING:
    from allanite.page.source import Source
    from allanite.page.tab import Tab

__all__ = ["accept", "make"]

KINDS = {".svg": "image/svg+xml", ".png": "image/png"}
TARGETS = {
    "parameters.json": "json",
    "kalibr.yaml": "kalibr",
    "matlab.m": "matlab",
    "ros.yaml": "ros",
    "vins.yaml": "vins",
    "gtsam.txt": "gtsam",
}


def accept(tab: Tab, source: Source, role: str) -> None:
    """Take an uploaded log: to work on (``log``), or only to compare with (``compare``).

    Raises
    ------
    InputError
        A log that cannot be read whatever its rate and unit (pickled objects, damaged); nothing is kept of it.
    """
    if role == "compare":
        own = tab.log
        other = source.read(Reading(None, None, None))
        if other.rate <= 0:
            raise InputError(f"{source.name}: no sampling rate")
        tab.others += [(f"{source.name} {c.columns[0]}", c) for c in other][: 8 - len(tab.others)]
        tab.version += 1
        _ = own
        return
    if tab.busy:
        tab.cancel()
        assert tab.job is not None
        tab.job.wait(30)
    try:
        source.read(Reading())
    except AllaniteError as error:
        # What only lacks a rate or a unit is asked for; anything else is refused.
        if "--rate" not in str(error) and "--quantity" not in str(error):
            raise
    tab.sources.append(source)
    tab.open(source)


def make(tab: Tab, name: str, theme: str) -> tuple[bytes, str]:
    """Bytes and media type of a file by its name: a figure, the study, parameters, the report.

    Raises
    ------
    InputError
        An unknown name, or nothing to write yet.
    """
    path = Path(name)
    if path.suffix in KINDS and path.stem in VIEWS:
        with tempfile.TemporaryDirectory(prefix="allanite-page-") as folder:
            target = Path(folder) / f"figure{path.suffix}"
            figure_of(tab, path.stem).save(target, theme)
            return target.read_bytes(), KINDS[path.suffix]
    if name == "study.json":
        return json.dumps(tab.study(), indent=1, ensure_ascii=False).encode(), "application/json"
    if name == "report.html":
        return _report(tab).encode(), "text/html; charset=utf-8"
    if name in TARGETS:
        from allanite.export import export
        from allanite.export._axis import axes_of

        axes = axes_of([tab.step.fit.to_dict()])
        return export(axes, TARGETS[name]).encode(), "text/plain; charset=utf-8"
    known = [*(f"{v}.svg" for v in VIEWS), "study.json", "report.html", *TARGETS]
    raise InputError(f"no file {name[:60]!r}: one of {', '.join(known)}")


def _report(tab: Tab) -> str:
    """The ladder up to the rung that is looked at, as a report."""
    from allanite.report import Entry, Report
    from allanite.study import Study

    steps = tab.ladder.steps[: tab.ladder.at + 1]
    last = tab.step.check
    first = steps[0].check if steps else None
    if last is None or first is None:
        raise InputError("the model is still being checked: a report needs the check")
    ending = "adequate" if last.adequate else "stopped by hand"
    study = Study(tab.log, tuple(s.rung for s in steps), last, ending)
    return Report((Entry(study, first, tab.log.oadev()),)).to_html()
