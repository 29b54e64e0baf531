"""HTML tables of all axes for a notebook."""

from __future__ import annotations

from typing import TYPE_CHECKING

from allanite.axes.rows import legend, rows
from allanite.axes.words import (
    at_work,
    in_common,
    remarks,
    seen_by_several,
    title,
    turn_on_sentences,
)
from allanite.common.showing import html_list, html_table

if TYPE_CHECKING:
    from allanite.axes.characterization import Characterization


def html(found: Characterization) -> str:
    """HTML of a characterization: a table for each sensor, and sentences below."""
    out = [html_list([title(found)])]
    for sensor in found.common.sensors:
        studies = {name: found.studies[name] for name in sensor.columns}
        body = [(row.label, *row.cells) for row in rows(studies)]
        out.append(html_table(sensor.name, ("", *sensor.columns), body))
        out.append(html_list([legend(studies), *in_common(sensor)]))
    out.append(
        html_list(
            [
                *at_work(found),
                *turn_on_sentences(found),
                *seen_by_several(found.common),
                *remarks(found),
            ]
        )
    )
    return "".join(out)
