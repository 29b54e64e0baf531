"""Result of `characterize`: the models of all axes side by side, and what the axes have in common."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property, partial
from textwrap import wrap
from typing import TYPE_CHECKING, Any

from allanite import _kernels
from allanite.axes.averaging import Averaged, averaged
from allanite.axes.coherence import CrossSpectrum, cross_spectra
from allanite.axes.forms import Form, common_form
from allanite.axes.lines import CommonEvent, CommonLine, common_events, common_lines
from allanite.axes.rows import Row, convention, legend, rows
from allanite.axes.shared import SharedNoise, shared_noise
from allanite.axes.twin import sample_statistics, twin
from allanite.axes.words import common_form_sentences, remarks, shared_effect_sentences
from allanite.axes.words import title as heading
from allanite.common.documents import fields_dict, plain_value
from allanite.common.errors import CALL
from allanite.common.files import write_text
from allanite.common.numbers import with_readable_numbers
from allanite.common.showing import aligned_lines, html_list, html_table
from allanite.common.threads import results_or_raise, side_by_side
from allanite.common.units import ACCELERATION, ANGULAR_RATE, FREQUENCY, MAGNETIC_FIELD
from allanite.recording.axis_names import columns_by_sensor
from allanite.recording.sensor_names import kind_of_sensor

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import ArrayLike

    from allanite.axes.turn_on import TurnOn
    from allanite.axes.working import Working
    from allanite.plots import Figure
    from allanite.recording import Recording
    from allanite.report import Report
    from allanite.study import Study

#: Kind of sensor → name of the sensor.
NAMES = {
    ANGULAR_RATE: "gyroscope",
    ACCELERATION: "accelerometer",
    FREQUENCY: "clock",
    MAGNETIC_FIELD: "magnetometer",
}


@dataclass(frozen=True, slots=True, eq=False)
class Sensor:
    """Columns of one gyroscope, accelerometer, magnetometer or clock, and what they have in common.

    Attributes
    ----------
    name : str
        ``gyroscope``, ``accelerometer``, ``magnetometer`` or ``clock``.
    columns : tuple of str
    form : Form or None
        Model form that holds for all axes; None if there is none, or only one axis.
    cross : tuple of CrossSpectrum
        Cross-spectra of all pairs of these axes.
    """

    name: str
    columns: tuple[str, ...]
    form: Form | None
    cross: tuple[CrossSpectrum, ...]

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON: sensor, columns, form and cross_spectra."""
        return fields_dict(self, name="sensor", cross="cross_spectra")


@dataclass(frozen=True, slots=True, eq=False)
class Common:
    """Model forms, lines, events and noise that the axes share.

    Attributes
    ----------
    sensors : tuple of Sensor
    lines : tuple of CommonLine
        Lines and resonances that several axes of any sensor have.
    events : tuple of CommonEvent
        Changes of the bias of several axes at one time.
    cross : tuple of CrossSpectrum
        Cross-spectra of all pairs of axes of different sensors.
    shared : tuple of SharedNoise
        Significant coherent noise, each source once.
    """

    sensors: tuple[Sensor, ...]
    lines: tuple[CommonLine, ...]
    events: tuple[CommonEvent, ...]
    cross: tuple[CrossSpectrum, ...]
    shared: tuple[SharedNoise, ...]

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON (entry ``common``): sensors, lines, events, cross_spectra and shared_noise."""
        return fields_dict(self, cross="cross_spectra", shared="shared_noise")


@dataclass(frozen=True, eq=False)
class Characterization:
    """Result of `characterize`: a study of every axis of a device, and what the axes have in common.

    Attributes
    ----------
    recordings : tuple of Recording
        One recording of all columns, or one for each sensor if their rates differ.
    studies : mapping of str to Study
        Study of each column, by its name.
    failed : mapping of str to str
        Reason for each column that has no study: too short, or constant.
    common : Common
    working : mapping of str to Working
        Noise at work of each column, if a working log was given; exported files use it.
    turn_on : mapping of str to TurnOn
        Bias at switch-on of each column, if further logs were given.

    Examples
    --------
    >>> x = np.random.default_rng(1).normal(0, 0.1, (4000, 2))
    >>> found = al.characterize(al.Recording(x, rate=10, unit="deg/s", columns=["gx", "gy"]), "N+K")
    >>> print(found["gx"].fit.model.name, found.table().splitlines()[0])
    N+K recording · 2 columns of 4000 samples at 10 Hz (400 s)
    >>> found.export("kalibr").count("gyroscope_noise_density"), found.to_dict()["schema"]
    (1, 'allanite/characterize/1')
    >>> found.save("sensor.json")
    >>> found.simulate(duration=10.0, seed=1).columns, found.report().to_markdown()[0]
    (('gx', 'gy'), '#')
    >>> figure = found.plot("axes.svg")
    """

    recordings: tuple[Recording, ...]
    studies: Mapping[str, Study]
    failed: Mapping[str, str]
    common: Common
    working: Mapping[str, Working] = field(default_factory=dict)
    turn_on: Mapping[str, TurnOn] = field(default_factory=dict)

    @property
    def recording(self) -> Recording:
        """`Recording` that was characterized; the first one if the sensors of the device have several rates."""
        return self.recordings[0]

    def __getitem__(self, column: str) -> Study:
        return self.studies[column]

    @cached_property
    def averages(self) -> tuple[Averaged, ...]:
        """Tuple of `Averaged`, one for each axis (such as x) that several sensors of the device measured; often empty.

        Each has the weights of the optimal mean for white noise, and its gain in Allan deviation. Cached.
        """
        return averaged(self.recordings, self.studies)

    @property
    def adequate(self) -> bool:
        """True if every column was characterized and every model is adequate."""
        return not self.failed and all(study.adequate for study in self.studies.values())

    def to_dict(self) -> dict[str, Any]:
        """Dict for JSON, schema ``allanite/characterize/1``; its JSON Schema is in ``allanite/schemas``.

        The entries ``working``, ``turn_on`` and ``averages`` are only there if they have content.
        """
        optional = {"working": self.working, "turn_on": self.turn_on, "averages": self.averages}
        return {
            "schema": "allanite/characterize/1",
            "version": _kernels.version(),
            "columns": plain_value(list(self.studies.values())),
            "samples": {name: sample_statistics(study) for name, study in self.studies.items()},
            "failed": dict(self.failed),
            "common": self.common.to_dict(),
            **{key: plain_value(value) for key, value in optional.items() if value},
        }

    def save(self, path: str | Path) -> None:
        """Write `to_dict` as JSON to `path`, which `allanite simulate`, `export`, `compare` and `predict` read back.

        An existing file is replaced.
        """
        import json

        text = json.dumps(self.to_dict(), indent=1, ensure_ascii=False)
        write_text(path, text + "\n")

    def simulate(
        self,
        *,
        duration: float | None = None,
        n: int | None = None,
        rate: float | None = None,
        seed: int = 0,
        covariates: Mapping[str, ArrayLike] | None = None,
    ) -> Recording:
        """Simulated `Recording` of the same axes.

        Parameters
        ----------
        duration, n : float, int, optional
            Length in s, or number of samples; by default that of the measured record.
        rate : float, optional
            Sampling rate, Hz; by default that of the measured record.
        seed : int
        covariates : mapping of str to array_like of shape (n,), optional
            Columns that the models follow. Effects of columns that are not given are omitted; `allanite.axes.twin` lists
            them.
        """
        return twin(
            self.to_dict(), duration=duration, n=n, rate=rate, seed=seed, covariates=covariates
        ).recording

    def plot(self, path: str | Path | None = None, theme: str = "light") -> Figure:
        """Figure of the measured and modeled Allan deviation of every axis, one panel for each kind of sensor.

        Parameters
        ----------
        path : str or Path, optional
            SVG, PNG or PDF, written if given.
        theme : {"light", "dark"}
        """
        import allanite as al

        curves = al.comparison.curves_of_studies(self.studies)
        title = f"All axes of {al.plots.words.recording_text(self.recording)}"
        return al.plots.plot_compare(curves, path, theme, title)

    def report(self) -> Report:
        """Report on all axes: the table, what they have in common, then each axis by itself."""
        import allanite as al

        return al.report.report_of(self)

    def export(
        self,
        target: str,
        rate: float | None = None,
        *,
        overbound: bool = False,
        as_fitted: bool = False,
        horizon: float | None = None,
        until: float | None = None,
        inflate: float = 1.0,
    ) -> str:
        """Text of a parameter file for a filter or simulator, with every axis in it.

        Parameters
        ----------
        target, rate, overbound, as_fitted, horizon, inflate
            As for `allanite.export`.
        until : float, optional
            Former name of `horizon`.

        Raises
        ------
        InputError
            Unknown target, or a sensor that the target has no place for.
        """
        import allanite as al

        return al.export(
            self,
            target,
            rate,
            overbound=overbound,
            as_fitted=as_fitted,
            horizon=until if horizon is None else horizon,
            inflate=inflate,
        )

    def table(self, width: int = 100, words: Mapping[str, str] = CALL) -> str:
        """Text: a table for each sensor, what the axes have in common, and remarks, as ``print`` shows them.

        Sections without sentences are left out.

        Parameters
        ----------
        width : int
            Longest line, characters. Axes that do not fit side by side follow below.
        words : mapping of str to str
            Names of parameters in remedies, see `allanite.common.errors`.
        """
        lines = [*wrap(heading(self), width)]
        for sensor in self.common.sensors:
            studies = {name: self.studies[name] for name in sensor.columns}
            lines += ["", *_sensor_lines(sensor, studies, width)]
        compared = convention(study.fit for study in self.studies.values())
        if compared:
            lines += ["", *wrap(compared, width)]
        for head, sentences in _sentences_by_section(self, words).items():
            if sentences:
                lines += ["", head]
                for sentence in sentences:
                    lines += _wrapped_lines(sentence, width)
        return "\n".join(lines)

    def __str__(self) -> str:
        return self.table()

    def __repr__(self) -> str:
        models = [f"{name}: {s.fit.model.name}" for name, s in self.studies.items()]
        return f"Characterization({', '.join([*models, *(f'{n}: failed' for n in self.failed)])})"

    def _repr_html_(self) -> str:
        """HTML text, which Jupyter shows: a table for each sensor, and sentences below."""
        out = [html_list([heading(self)])]
        for sensor in self.common.sensors:
            studies = {name: self.studies[name] for name in sensor.columns}
            body = [(row.label, *row.cells) for row in rows(studies)]
            out.append(html_table(sensor.name, ("", *sensor.columns), body))
            out.append(html_list([legend(studies), *common_form_sentences(sensor)]))
        out.append(
            html_list([text for texts in _sentences_by_section(self).values() for text in texts])
        )
        return "".join(out)


def common_of(studies: Mapping[str, Study]) -> Common:
    """`Common`: effects, lines, events and noise that the characterized columns of one recording share."""
    fits = {name: study.fit for name, study in studies.items()}
    groups = columns_by_sensor(fit.recording for fit in fits.values())
    cross = cross_spectra(fits)

    def sensor(names: tuple[str, ...]) -> Sensor:
        """`Sensor` of the named columns."""
        own = {name: fits[name] for name in names}
        kind = kind_of_sensor(names[0], own[names[0]].recording.unit)
        within = tuple(c for c in cross if own.keys() >= {*c.columns})
        return Sensor(NAMES[kind], names, common_form(own), within)

    sensors = results_or_raise(side_by_side([partial(sensor, names) for names in groups]))
    within = {c for one in sensors for c in one.cross}
    between = tuple(c for c in cross if c not in within)
    lines = common_lines(fits)
    shared = shared_noise(cross, lines, fits)
    return Common(tuple(sensors), lines, common_events(fits), between, shared)


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
    """Lines of `text` wrapped at `width` characters, the first indented by 2 blanks, all others by 4."""
    return wrap(text, width, initial_indent="  ", subsequent_indent="    ")


def _sensor_lines(sensor: Sensor, studies: Mapping[str, Study], width: int) -> list[str]:
    """Lines of the table of one sensor, its legend, and the sentences on what its axes have in common.

    Axes that do not fit into `width` characters side by side are in further tables.
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
