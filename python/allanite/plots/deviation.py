"""A deviation with its interval."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from allanite.deviation import estimator_named
from allanite.plots.axes import log_axis
from allanite.plots.curves import TAU
from allanite.plots.spec import Figure, Line, Panel, Points
from allanite.plots.words import in_unit, recording_text

if TYPE_CHECKING:
    from pathlib import Path

    from allanite.deviation.result import Deviation
    from allanite.recording import Recording

__all__ = ["plot_deviation"]


def plot_deviation(
    deviation: Deviation,
    path: str | Path | None = None,
    theme: str = "light",
    recording: Recording | None = None,
) -> Figure:
    """A deviation over averaging time with its 95 % interval where one is known, on logarithmic axes.

    Parameters
    ----------
    deviation : Deviation
    path : str or Path, optional
        SVG, PNG or PDF, written if given.
    theme : {"light", "dark"}
    recording : Recording, optional
        Named in the title.

    Raises
    ------
    InputError
        Another suffix, a folder that does not exist, matplotlib not installed.
    """
    tau, values = np.asarray(deviation.tau), np.asarray(deviation.deviation)
    low, high = np.asarray(deviation.low), np.asarray(deviation.high)
    kept = np.isfinite(values) & (values > 0)
    words = estimator_named(deviation.kind).title
    known = bool(np.isfinite(low[kept]).any())
    label = "estimate ± 95 %" if known else "estimate"
    ends = (low[kept], high[kept]) if known else (None, None)
    marks = (
        Line(tau[kept], values[kept], "c1", width=1.4),
        Points(tau[kept], values[kept], "measured", label, *ends),
    )
    y = log_axis(in_unit(words, deviation.deviation_unit), values, low, high)
    panel = Panel(log_axis(TAU, tau[kept]), y, marks)
    title = words[0].upper() + words[1:]
    figure = Figure(
        title,
        f"{int(kept.sum())} averaging times" if recording is None else recording_text(recording),
        (panel,),
        kind="deviation",
    )
    if path is not None:
        figure.save(path, theme)
    return figure
