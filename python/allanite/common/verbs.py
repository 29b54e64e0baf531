"""The verbs of results: methods that spare a user an import, attached here and nowhere else.

A result is data of its room and imports no later one. Its class takes a verb from here; this module alone reaches
forward, when a verb is called.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from allanite.axes import Characterization
    from allanite.common.several import Several
    from allanite.deviation import Deviation, DynamicDeviation
    from allanite.deviation.columns import Deviations
    from allanite.effects import Model
    from allanite.fit import Fit
    from allanite.fit.several.columns import Fits
    from allanite.plots import Figure
    from allanite.recording import Recording
    from allanite.report import Report
    from allanite.spectrum import Spectrum
    from allanite.statespace import StateSpace
    from allanite.study import Study
    from allanite.suggestion import Check


def recording_oadev(self: Recording, **options: Any) -> Deviation | Any:
    """Overlapping Allan deviation, of several columns `Deviations`; `options` as of `allanite.oadev`."""
    from allanite.deviation import oadev

    return oadev(self, **options)


def recording_psd(self: Recording, **options: Any) -> Spectrum:
    """Power spectral density; `options` as of `allanite.psd`."""
    from allanite.spectrum import psd

    return psd(self, **options)


def recording_plot(self: Recording, path: str | Path | None = None, theme: str = "light") -> Figure:
    """Samples over time, a panel a column; `path` and `theme` as of `allanite.plots.plot_recording`."""
    from allanite.plots import plot_recording

    return plot_recording(self, path, theme)


def deviation_plot(self: Deviation, path: str | Path | None = None, theme: str = "light") -> Figure:
    """Figure of the deviation with its interval; `path` and `theme` as of `allanite.plots.plot_deviation`."""
    from allanite.plots import plot_deviation

    return plot_deviation(self, path, theme)


def deviations_plot(
    self: Deviations, path: str | Path | None = None, theme: str = "light"
) -> Figure:
    """The curves of all columns in one figure, a panel a kind of sensor; `path` and `theme` as of `Deviation.plot`."""
    from allanite.comparison.curves import of_deviations
    from allanite.plots import plot_compare

    return plot_compare(of_deviations(self), path, theme, "Columns")


def dynamic_plot(
    self: DynamicDeviation, path: str | Path | None = None, theme: str = "light"
) -> Figure:
    """Figure of the deviations over time; `path` and `theme` as of `allanite.plots.plot_dynamic`."""
    from allanite.plots import plot_dynamic

    return plot_dynamic(self, path, theme)


def model_fit(self: Model, recording: Recording, **options: Any) -> Fit | Any:
    """Fit the model to a recording, of several columns `Fits`; `options` (``method=``) as of `allanite.fit_model`."""
    from allanite.fit import fit_model

    return fit_model(recording, self, **options)


def model_save(self: Model, path: str) -> None:
    """Write the model to `path` as JSON (schema ``allanite/model/1``)."""
    from allanite.effects.files import save_model

    save_model(self, path)


def model_simulate(self: Model, **options: Any) -> Recording:
    """Samples of the model.

    `options` as of `allanite.simulate.simulate`: ``duration=`` s or ``n=``, ``rate=`` Hz, ``seed=``, ``unit=``,
    ``covariates=``.
    """
    from allanite.simulate import simulate

    return simulate(self, **options)


def model_simulate_chunks(self: Model, **options: Any) -> Iterator[Recording]:
    """The same samples in consecutive pieces of ``size=``; `options` as of `allanite.simulate.simulate_chunks`."""
    from allanite.simulate import simulate_chunks

    return simulate_chunks(self, **options)


def model_state_space(self: Model, rate: float, **options: Any) -> StateSpace:
    """F, Q, H, R, P0 of the random part at `rate` Hz.

    `options` as of `allanite.statespace.state_space`: ``states=8`` reduces it, ``duration=`` s is how long it has to
    be right.
    """
    from allanite.statespace import state_space

    return state_space(self, rate, **options)


def fits_check(self: Fits, **options: Any) -> Several[Check]:
    """The criticism of each column's fit; `options` as of `allanite.suggestion.check_fit`."""
    from allanite.common.several import Several
    from allanite.suggestion import check_fit

    return Several({name: check_fit(fit, **options) for name, fit in self.items()})


def fit_check(self: Fit, **options: Any) -> Check:
    """Where the model fails and what is missing; `options` as of `allanite.suggestion.check_fit`."""
    from allanite.suggestion import check_fit

    return check_fit(self, **options)


def fit_plot(self: Fit, path: str | Path | None = None) -> Figure:
    """Allan curve and spectrum with the model; written to `path` (SVG, PNG, PDF) if given."""
    from allanite.plots import plot_fit

    return plot_fit(self, path)


def check_plot(self: Check, path: str | Path | None = None) -> Figure:
    """As `Fit.plot`, with the failing ranges shaded; written to `path` (SVG, PNG, PDF) if given."""
    from allanite.plots import plot_check

    return plot_check(self, path)


def study_plot(self: Study, path: str | Path | None = None) -> Figure:
    """The ladder as falling error; written to `path` if given."""
    from allanite.plots import plot_study

    return plot_study(self, path)


def characterization_plot(
    self: Characterization, path: str | Path | None = None, theme: str = "light"
) -> Figure:
    """Measured and modelled Allan deviation of every axis in one figure, a panel a kind of sensor.

    Written to `path` (SVG, PNG, PDF) if given, in the `theme` ``light`` or ``dark``.
    """
    from allanite.comparison.curves import of_studies
    from allanite.plots import plot_compare

    return plot_compare(of_studies(self.studies), path, theme, "All axes")


def characterization_report(self: Characterization) -> Report:
    """One report on all axes: the table, what they have in common, then each by itself."""
    from allanite.report.document import report_of

    return report_of(self)


def characterization_export(
    self: Characterization,
    target: str,
    rate: float | None = None,
    *,
    overbound: bool = False,
    as_fitted: bool = False,
    horizon: float | None = None,
    until: float | None = None,
    inflate: float = 1.0,
) -> str:
    """Text of a parameter file for a filter or simulator with every axis in it.

    Parameters
    ----------
    target : str
        ``kalibr``, ``vins``, ``gtsam``, …: a key of `allanite.export.TARGETS`.
    rate : float, optional
        Sampling rate in Hz for targets whose numbers are per sample; else the recording's.
    overbound : bool
        Whether N and K are the smallest that are above the models' upper limits up to the horizon. By default they follow
        the whole model.
    as_fitted : bool
        Whether the coefficients are written as they were fitted, without the other effects.
    horizon : float, optional
        Longest time without aiding, s; else 100 s, or a tenth of the recording if that is shorter.
    until : float, optional
        Former name of `horizon`.
    inflate : float
        Factor on all deviations, which the file records as your choice.

    Raises
    ------
    InputError
        Unknown target, or a sensor that the target has no place for.
    """
    from allanite.export import export
    from allanite.export._axis import axes_of

    documents = (
        {
            "schema": "allanite/fit/1",
            "recording": s.recording.describe(),
            **s.ladder[-1].to_dict(s.misfit_left[-1], over_rivals=s.undecided),
            "working": self.working[name].to_dict() if name in self.working else None,
        }
        for name, s in self.studies.items()
    )
    axes = axes_of(documents, source="recording")
    return export(
        axes,
        target,
        rate,
        overbound=overbound,
        as_fitted=as_fitted,
        horizon=horizon,
        until=until,
        inflate=inflate,
    )


def figure_to_plotly(self: Figure, theme: str = "light") -> dict[str, Any]:
    """The figure as plotly's JSON document: ``{"data": […], "layout": {…}}``."""
    from allanite.plots.plotly_painter import paint

    return paint(self, theme)


def figure_to_matplotlib(
    self: Figure, theme: str = "light", size: tuple[float, float] = (12.8, 7.2)
) -> Any:
    """The figure as a ``matplotlib.figure.Figure`` of `size` inches, to be changed at will."""
    from allanite.plots.matplotlib_painter import draw

    return draw(self, theme, size)


def figure_save(self: Figure, path: Any, theme: str = "light") -> None:
    """Write SVG, PNG or PDF, by the suffix of `path`."""
    from allanite.plots.matplotlib_painter import save

    save(self, path, theme)


def figure_svg(self: Figure) -> str:
    """What a notebook shows."""
    from allanite.plots.matplotlib_painter import render

    return render(self, "svg").decode()
