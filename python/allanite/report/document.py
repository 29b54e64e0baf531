"""The report object: for each column its deviation, the check of the first model, and the stepwise model building."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from allanite import _kernels
from allanite.common.errors import InputError
from allanite.common.files import check_target, whole_file
from allanite.common.validation import require_recording
from allanite.recording import Recording

if TYPE_CHECKING:
    from allanite.axes import Characterization
    from allanite.deviation.result import Deviation
    from allanite.effects import Effect, Model
    from allanite.study import Study
    from allanite.suggestion import Check

#: Suffix of a file → format of the report.
SUFFIXES = {".html": "html", ".htm": "html", ".md": "markdown", ".markdown": "markdown"}


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Entry:
    """Analysis of one column in a report.

    `study` has the check of the last model, `first` is that of the first model. The intervals of `deviation`
    (overlapping Allan deviation) do not depend on a model.
    """

    study: Study
    first: Check
    deviation: Deviation

    @property
    def recording(self) -> Recording:
        """`Recording` of the column."""
        return self.study.recording.recording()

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON, schema ``allanite/report/1``, which combines the documents of adev, check, improve and fit.

        ``adev`` is the document of ``adev --json``. ``check`` is that of the first model, ``improve`` that of the stepwise
        model building, and ``fit`` that of the last model. ``left`` holds the findings of the last check.
        """
        last = self.study.check
        return {
            "schema": "allanite/report/1",
            "version": _kernels.version(),
            "recording": self.recording.describe(),
            "adev": self.deviation.to_dict(),
            "check": _without_shared_fields(self.first.to_dict()),
            "improve": _without_shared_fields(self.study.to_dict()),
            "fit": _without_shared_fields(self.study.fit.to_dict()),
            "left": {
                "adequate": last.verdict == "adequate",
                "where": last.where.to_dict(),
                "suggestions": [s.to_dict() for s in last.suggestions],
            },
        }

    def __repr__(self) -> str:
        return f"Entry({self.recording!r}, {len(self.study.ladder)} steps)"


def _without_shared_fields(document: dict[str, Any]) -> dict[str, Any]:
    """Copy of a dict without the keys ``version`` and ``recording``, which the report contains once."""
    return {k: v for k, v in document.items() if k not in ("version", "recording")}


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Report:
    """Report on the analysis of one or more columns.

    Attributes
    ----------
    entries : tuple of Entry
        One per column.
    options : mapping of str to str
        Options of the analysis, as printed in the last section.
    axes : Characterization, optional
        Analysis of all axes together, shown first if there are several columns.

    Examples
    --------
    >>> log = al.AngleRandomWalk(N=0.1).simulate(duration=300, rate=10, seed=1)
    >>> report = al.make_report(log, "N")
    >>> report.save("report.md").name, report.to_dict()["schema"]
    ('report.md', 'allanite/report/1')
    >>> report.to_html()[:15], report.to_markdown()[:1]
    ('<!doctype html>', '#')
    """

    entries: tuple[Entry, ...]
    options: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    axes: Characterization | None = None

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON, schema ``allanite/report/1``; several columns are in the list ``columns``.

        A single column is the document itself. Axes that were characterized together add ``common``.
        """
        documents = [{**e.to_dict(), "options": dict(self.options)} for e in self.entries]
        if len(documents) == 1:
            return documents[0]
        common = {} if self.axes is None else {"common": self.axes.common.to_dict()}
        return {"schema": "allanite/report/1", "columns": documents, **common}

    def to_html(self, interactive: bool = False) -> str:
        """Text of the report as one self-contained HTML page, with figures as SVG in light and dark colors.

        Parameters
        ----------
        interactive : bool
            Embed plotly, so that figures can be zoomed and values read; needs plotly.
        """
        from allanite.report.html import html_page

        return html_page(self, interactive)

    def to_markdown(self, figures: str | None = None) -> str:
        """Text of the report as Markdown, with the same sentences and tables as the HTML page.

        Parameters
        ----------
        figures : str, optional
            Folder of the figures, as a link from the file. Without it the text has no figures. No figure is written.
        """
        from allanite.report.markdown import markdown_text

        return markdown_text(self, figures)

    def save(self, path: str | Path, interactive: bool = False) -> Path:
        """Write HTML or Markdown, according to the suffix of `path`; return the path. `interactive` is as for `to_html`.

        The figures of a Markdown file are written to a folder next to it, whose name ends in ``_figures``.

        Raises
        ------
        InputError
            Another suffix, an interactive Markdown file, a folder that does not exist, or a drawing library not installed.
        """
        target = Path(path)
        if checked_format(target, interactive) == "html":
            with whole_file(target) as draft:
                draft.write_text(self.to_html(interactive), encoding="utf-8")
            return target
        from allanite.report.markdown import save_markdown

        save_markdown(self, target)
        return target

    def _repr_html_(self) -> str:
        """HTML text of the report, for notebooks."""
        from allanite.report.html import html_fragment

        return html_fragment(self)

    def __repr__(self) -> str:
        names = ", ".join(e.recording.columns[0] for e in self.entries)
        return f"Report({names})"


def checked_format(path: Path, interactive: bool = False) -> str:
    """Format of a report, ``"html"`` or ``"markdown"``, from the suffix of its path; also tests if it can be written.

    Raises `InputError` for another suffix, for Markdown if `interactive`, or if the file cannot be written.
    """
    kind = SUFFIXES.get(path.suffix.lower())
    if kind is None:
        raise InputError(f"{path}: a report's name must end in .html or .md")
    check_target(path)
    if interactive and kind != "html":
        raise InputError(f"{path}: only HTML can be interactive: end the name in .html")
    return kind


def make_report(
    recording: Recording,
    model: Model | Effect | str = "N+B+K",
    on_progress: Callable[[int, int], None] | None = None,
    options: Mapping[str, str] | None = None,
) -> Report:
    """`Report` on every column of a recording: deviation, fit, check, and stepwise model building.

    Parameters
    ----------
    recording : Recording
        One or more columns.
    model : Model, Effect or str
        Model of the first step.
    on_progress : callable, optional
        Called with (steps done, maximum number of steps) of each column, for several columns in parallel.
    options : mapping of str to str, optional
        Options to be printed in the report.

    Returns
    -------
    Report

    Raises
    ------
    InputError
        Samples that cannot be fitted.
    TooShortError
        Too few samples.

    Examples
    --------
    >>> log = al.AngleRandomWalk(N=0.1).simulate(duration=300, rate=10, seed=1)
    >>> len(al.make_report(log, "N").entries)
    1
    """
    from allanite.study import improve

    require_recording(recording)
    inputs = {"model": str(getattr(model, "name", model)), **(options or {})}
    if len(recording.columns) > 1:
        from allanite.axes import characterize

        report_progress = None if on_progress is None else lambda _name, k, n: on_progress(k, n)
        return report_of(characterize(recording, model, report_progress), inputs)
    study = improve(recording, model, on_progress=on_progress)
    return Report((_entry(study),), MappingProxyType(inputs))


def report_of(found: Characterization, options: Mapping[str, str] | None = None) -> Report:
    """`Report` on a characterized sensor: all axes together, then each axis; `options` are printed in its last section."""
    from allanite.common.threads import results_or_raise, side_by_side

    tasks = [partial(_entry, study) for study in found.studies.values()]
    return Report(
        tuple(results_or_raise(side_by_side(tasks))), MappingProxyType(dict(options or {})), found
    )


def _entry(study: Study) -> Entry:
    """`Entry` of one column; computes its deviation and, unless the study has it, the check of its first model."""
    # With a single step, the last check is also that of the first model.
    known = study.check if len(study.ladder) == 1 else study.first_check
    return Entry(study, known or study.ladder[0].fit.check(), study.recording.oadev())
