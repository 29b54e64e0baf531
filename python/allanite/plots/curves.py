"""Several Allan curves on one pair of logarithmic axes."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from allanite.comparison import Curves

__all__ = ["plot_curves"]


def plot_curves(curves: Curves, path: str | Path) -> None:
    """Draw measured curves with their 95 % intervals and models as lines; write SVG, PNG or PDF."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 5.5), layout="constrained")
    axes = figure.subplots()
    for curve in curves.curves:
        (line,) = axes.loglog(
            curve.tau,
            curve.deviation,
            "-" if curve.kind == "model" else ".-",
            label=f"{curve.name} ({curve.unit})",
        )
        if curve.low is not None and curve.high is not None:
            axes.fill_between(
                curve.tau, curve.low, curve.high, color=line.get_color(), alpha=0.2, linewidth=0
            )
    axes.set_xlabel("averaging time τ (s)")
    axes.set_ylabel("Allan deviation")
    axes.grid(visible=True, which="both", alpha=0.25)
    axes.legend()
    figure.savefig(path)
