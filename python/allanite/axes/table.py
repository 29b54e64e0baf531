"""Tables of all axes: text for a terminal, HTML for a notebook."""

from __future__ import annotations

from textwrap import wrap
from typing import TYPE_CHECKING

from allanite.axes.rows import Row, convention, legend, rows
from allanite.axes.words import common_form_sentences, remarks, shared_effect_sentences
from allanite.axes.words import title as heading
from allanite.common.errors import CALL
from allanite.common.numbers import with_readable_numbers
from allanite.common.showing import aligned_lines, html_list, html_table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from allanite.axes.characterization import Characterization, Sensor
    from allanite.study import Study


def table(found: Characterization, width: int = 100, words: Mapping[str, str] = CALL) -> str:
    """Text of a characterization: a table for each sensor, what the axes have in common, and remarks.

    Sections without sentences are left out.

    Parameters
    ----------
    found : Characterization
    width : int
        Longest line, characters. Axes that do not fit side by side follow below.
    words : mapping of str to str
        Names of parameters in remedies, see `allanite.common.errors`.
    """
    lines = [*wrap(heading(found), width)]
    for sensor in found.common.sensors:
        studies = {name: found.studies[name] for name in sensor.columns}
        lines += ["", *_sensor_lines(sensor, studies, width)]
    compared = convention(study.fit for study in found.studies.values())
    if compared:
        lines += ["", *wrap(compared, width)]
    for head, sentences in _sentences_by_section(found, words).items():
        if sentences:
            lines += ["", head]
            for sentence in sentences:
                lines += _wrapped_lines(sentence, width)
    return "\n".join(lines)


def _sentences_by_section(
    found: Characterization, words: Mapping[str, str] = CALL
) -> dict[str, list[str]]:
    """Dict from the heading of each section below the table of axes to its list of sentences, which can be empty."""
    sections = {
        "at work": [f"{name}: {'; '.join(w.reasons)}" for name, w in found.working.items()],
        "bias at switch-on": [f"{name}: {bias}" for name, bias in found.turn_on.items()],
        "seen by several axes": shared_effect_sentences(found.common),
        "averaging sensors of one axis": list(map(str, found.averages)),
        "remarks": remarks(found, words),
    }
    return {head: list(map(with_readable_numbers, of)) for head, of in sections.items()}


def _wrapped_lines(text: str, width: int) -> list[str]:
    """List of the lines of `text` wrapped at `width` characters, the first indented by 2 blanks, all others by 4.

    Line breaks in `text` count as blanks.
    """
    return wrap(text, width, initial_indent="  ", subsequent_indent="    ")


def _sensor_lines(sensor: Sensor, studies: Mapping[str, Study], width: int) -> list[str]:
    """List of texts: lines of the table of one sensor, then its legend and the sentences on what its axes have in common.

    If not all axes fit into `width` characters side by side, further tables with the other axes follow.
    """
    lines = []
    names = list(studies)
    while names:
        # The largest number of axes that fits side by side; at least one.
        for count in range(len(names), 0, -1):
            part = {name: studies[name] for name in names[:count]}
            drawn = _table_lines([Row(sensor.name, tuple(part)), *rows(part)])
            if count == 1 or max(map(len, drawn)) <= width:
                break
        lines += [*drawn, ""]
        names = names[count:]
    lines += wrap(legend(studies), width, initial_indent="  ", subsequent_indent="  ")
    for sentence in common_form_sentences(sensor):
        lines += _wrapped_lines(sentence, width)
    return lines


def _table_lines(block: Sequence[Row]) -> list[str]:
    """List of texts: lines of a table with aligned columns, with a rule below the first row."""
    texts = aligned_lines([(row.label, *row.cells) for row in block])
    return [texts[0], "─" * max(map(len, texts)), *texts[1:]]


def html(found: Characterization) -> str:
    """HTML text of a characterization: a table for each sensor, and sentences below."""
    out = [html_list([heading(found)])]
    for sensor in found.common.sensors:
        studies = {name: found.studies[name] for name in sensor.columns}
        body = [(row.label, *row.cells) for row in rows(studies)]
        out.append(html_table(sensor.name, ("", *sensor.columns), body))
        out.append(html_list([legend(studies), *common_form_sentences(sensor)]))
    out.append(
        html_list([text for texts in _sentences_by_section(found).values() for text in texts])
    )
    return "".join(out)
