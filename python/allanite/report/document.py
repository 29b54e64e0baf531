"""What a report is about: of each column its deviation, the criticism of the first model, and the ladder."""

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

if TYPE_CHECKING:
    from allanite.axes import Characterization
    from allanite.deviation.result import Deviation
    from allanite.effects import Effect, Model
    from allanite.recording import Recording
    from allanite.study import Study
    from allanite.suggestion import Check

__all__ = ["Entry", "Report", "kind_of", "make_report", "report_of"]

SUFFIXES = {".html": "html", ".htm": "html", ".md": "markdown", ".markdown": "markdown"}


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Entry:
    """One column of a report.

    Attributes
    ----------
    study : Study
        The ladder; its last check says what is left.
    first : Check
        Criticism of the model at the foot of the ladder.
    deviation : Deviation
        Overlapping Allan deviation with the intervals that need no model.
    """

    study: Study
    first: Check
    deviation: Deviation

    @property
    def recording(self) -> Recording:
        """The column."""
        return self.study.recording

    def to_dict(self) -> dict[str, Any]:
        """``allanite/report/1``: the documents of adev, check, improve and fit, in one.

        ``adev`` is that of ``adev --json``; ``check`` that of the first model; ``improve`` the ladder; ``fit`` the
        last model; ``left`` what its own check still finds.
        """
        last = self.study.check
        return {
            "schema": "allanite/report/1",
            "version": _kernels.version(),
            "recording": self.recording.describe(),
            "adev": self.deviation.to_dict(),
            "check": _bare(self.first.to_dict()),
            "improve": _bare(self.study.to_dict()),
            "fit": _bare(self.study.fit.to_dict()),
            "left": {
                "adequate": last.verdict == "adequate",
                "where": last.where.to_dict(),
                "suggestions": [s.to_dict() for s in last.suggestions],
            },
        }

    def __repr__(self) -> str:
        return f"Entry({self.recording!r}, {len(self.study.ladder)} rungs)"


def _bare(document: dict[str, Any]) -> dict[str, Any]:
    """A document without the head that the report says once."""
    return {k: v for k, v in document.items() if k not in ("version", "recording")}


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Report:
    """The analysis of one or more columns, ready to be handed on.

    Attributes
    ----------
    entries : tuple of Entry
        One a column.
    options : mapping of str to str
        What was asked for, as it is printed under "how it was computed".
    axes : Characterization, optional
        All columns at once: told first, if there are several.

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
        """``allanite/report/1``, or its columns in a list if there are several."""
        documents = [{**e.to_dict(), "options": dict(self.options)} for e in self.entries]
        if len(documents) == 1:
            return documents[0]
        common = {} if self.axes is None else {"common": self.axes.common.to_dict()}
        return {"schema": "allanite/report/1", "columns": documents, **common}

    def to_html(self, interactive: bool = False) -> str:
        """One page with everything inside: figures as SVG, light and dark, nothing fetched.

        Parameters
        ----------
        interactive : bool
            Embed plotly once and let figures be zoomed and read off; needs plotly.
        """
        from allanite.report.html import page

        return page(self, interactive)

    def to_markdown(self, figures: str | None = None) -> str:
        """The same words and tables in Markdown.

        Parameters
        ----------
        figures : str, optional
            Folder, as a link from the file, in which `save` puts the figures; none are shown without it.
        """
        from allanite.report.markdown import text

        return text(self, figures)

    def save(self, path: str | Path, interactive: bool = False) -> Path:
        """Write HTML or Markdown, by the suffix of `path`; `interactive` as of `to_html`.

        The figures of a Markdown file are put beside it, in a folder of its name ending in ``_figures``.

        Raises
        ------
        InputError
            Another suffix, a folder that does not exist, matplotlib (or plotly) not installed.
        """
        target = Path(path)
        kind = kind_of(target)
        check_target(target)
        if interactive and kind != "html":
            raise InputError(f"{target}: only HTML can be interactive: end the name in .html")
        if kind == "html":
            with whole_file(target) as draft:
                draft.write_text(self.to_html(interactive), encoding="utf-8")
            return target
        from allanite.report.markdown import write_figures

        folder = target.with_name(f"{target.stem}_figures")
        with whole_file(target) as draft:
            draft.write_text(self.to_markdown(folder.name), encoding="utf-8")
            write_figures(self, folder)
        return target

    def _repr_html_(self) -> str:
        from allanite.report.html import body

        return body(self)

    def __repr__(self) -> str:
        names = ", ".join(e.recording.columns[0] for e in self.entries)
        return f"Report({names})"


def kind_of(path: Path) -> str:
    """``html`` or ``markdown``, by the suffix.

    Raises
    ------
    InputError
        Another suffix.
    """
    kind = SUFFIXES.get(path.suffix.lower())
    if kind is None:
        raise InputError(f"{path}: a report's name must end in .html or .md")
    return kind


def make_report(
    recording: Recording,
    model: Model | Effect | str = "N+B+K",
    on_progress: Callable[[int, int], None] | None = None,
    options: Mapping[str, str] | None = None,
) -> Report:
    """Measure, fit, criticise and improve every column of a recording.

    Parameters
    ----------
    recording : Recording
        One or more columns.
    model : Model, Effect or str
        Where the ladder starts.
    on_progress : callable, optional
        Called with (rungs done, most rungs) of each column, several at a time.
    options : mapping of str to str, optional
        What was asked for, to be printed.

    Returns
    -------
    Report

    Raises
    ------
    InputError
        Samples that cannot be fitted.
    TooShortError
        Too few of them.

    Examples
    --------
    >>> log = al.AngleRandomWalk(N=0.1).simulate(duration=300, rate=10, seed=1)
    >>> len(al.make_report(log, "N").entries)
    1
    """
    from allanite.study import improve

    require_recording(recording)
    asked = {"model": str(getattr(model, "name", model)), **(options or {})}
    if len(recording.columns) > 1:
        from allanite.axes import characterize

        said = None if on_progress is None else lambda _name, k, n: on_progress(k, n)
        return report_of(characterize(recording, model, said), asked)
    study = improve(recording, model, on_progress=on_progress)
    return Report((_entry(study),), MappingProxyType(asked))


def report_of(found: Characterization, options: Mapping[str, str] | None = None) -> Report:
    """The report on a characterised sensor: all axes at once, then each by itself."""
    from allanite.common.threads import results_or_raise, side_by_side

    tasks = [partial(_entry, study) for study in found.studies.values()]
    return Report(
        tuple(results_or_raise(side_by_side(tasks))), MappingProxyType(dict(options or {})), found
    )


def _entry(study: Study) -> Entry:
    from allanite.deviation import oadev

    # Of a ladder of one rung the last check is the first.
    alone = len(study.ladder) == 1
    first = study.check if alone else study.ladder[0].fit.check()
    return Entry(study, first, oadev(study.recording))
