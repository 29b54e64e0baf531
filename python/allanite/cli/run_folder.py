"""The folder of a run: the files of each axis as soon as it is finished, from which a repeated run continues."""

from __future__ import annotations

import hashlib
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from allanite.common.errors import AllaniteError, InputError
from allanite.common.files import whole_file
from allanite.common.plain import file_name, plain
from allanite.export import TARGETS, export_files

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from allanite.axes import Characterization
    from allanite.axes.turn_on import TurnOn
    from allanite.effects import Model
    from allanite.recording import Recording
    from allanite.study import Study

__all__ = ["RunFolder"]

MODEL, TABLE, MODELS = "model.json", "table.txt", "models.json"
#: Digest of what an axis was computed from: only the same samples and options continue from its model.
INPUT = "input.sha256"


class RunFolder:
    """Writes the files of a run.

    Parameters
    ----------
    path : Path
        Made if it is missing.
    targets : iterable of str
        Parameter files that are written, for each axis and for all axes.
    how : mapping
        Options of `allanite.export.export`.
    options : str
        Whatever else the models depend on.
    working : sequence of Recording
        Logs at work, which the parameter files follow.
    turn_on : mapping of str to TurnOn
        Bias at switch-on of each column, where further logs tell it.
    """

    def __init__(
        self,
        path: Path,
        targets: Iterable[str],
        how: Mapping[str, Any],
        options: str,
        working: Sequence[Recording] = (),
        turn_on: Mapping[str, TurnOn] | None = None,
    ) -> None:
        self.path, self.targets, self.how, self.options = path, tuple(targets), how, options
        self.working, self.turn_on = tuple(working), turn_on or {}
        self.finished: list[str] = []
        self._digests: dict[str, str] = {}
        self._lock = Lock()
        try:
            path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"{path}: cannot be made: {error.strerror or error}") from None

    def start_of(self, column: Recording, model: Model) -> Model:
        """The model that an earlier run saved of the same samples and options; else the one given."""
        from allanite.effects.files import model_from_dict
        from allanite.sources import documents_of

        name = column.columns[0]
        self._digests[name] = _digest(column, f"{self.options} {model}")
        folder = self.path / file_name(name)
        try:
            if (folder / INPUT).read_text(encoding="ascii").strip() != self._digests[name]:
                return model
            (document,) = documents_of(str(folder / MODEL))
            saved = model_from_dict(document, str(folder / MODEL))
        except (AllaniteError, OSError, ValueError):
            return model  # nothing saved, or damaged: the axis is done again
        click.echo(plain(f"· {name}: continues from {folder / MODEL}"), err=True)
        return saved

    def write(self, study: Study) -> None:
        """Model, table and parameter files of one axis."""
        from allanite.axes.twin import samples_of
        from allanite.axes.working import working_states
        from allanite.cli.output import dumps
        from allanite.export import export
        from allanite.export._axis import axes_of

        name = study.recording.columns[0]
        document = study.to_dict()
        texts = {MODEL: dumps(document) + "\n", TABLE: f"{study}\n"}
        own = {"recording": document["recording"], **document["ladder"][-1]}
        own["samples"] = samples_of(study)
        if self.working:
            states = working_states({name: study}, self.working)
            own["working"] = states[name].to_dict() if name in states else None
        own["turn_on"] = self.turn_on[name].to_dict() if name in self.turn_on else None
        axes = axes_of([own])
        for target in self.targets:
            try:
                texts[TARGETS[target].file_name] = export(axes, target, **self.how)
            except InputError:
                continue  # needs several axes: the file of all axes says why
        texts[INPUT] = self._digests[name] + "\n"
        folder = self.path / file_name(name)
        folder.mkdir(exist_ok=True)
        for file, text in texts.items():
            _write(folder / file, text)
        with self._lock:
            self.finished.append(name)

    def finish(self, found: Characterization) -> list[str]:
        """Models, figure, report and parameter files of all axes; paths of the files written."""
        from allanite.cli.output import dumps

        texts = {self.path / MODELS: dumps(found.to_dict()) + "\n"}
        axes = found.export_axes() if self.targets else []
        for target in self.targets:
            path = self.path / TARGETS[target].file_name
            try:
                texts |= export_files(axes, target, path, **self.how)
            except InputError as error:
                click.echo(plain(f"! {target}: {error}"), err=True)
        for file, text in texts.items():
            _write(file, text)
        written = [str(file) for file in texts]
        for path, make in (
            (self.path / "axes.svg", found.plot),
            (self.path / "report.html", lambda path: found.report().save(path)),
        ):
            try:
                make(path)
            except InputError as error:  # matplotlib is missing
                click.echo(plain(f"! {path.name}: {error}"), err=True)
            else:
                written.append(str(path))
        return written


def _write(path: Path, text: str) -> None:
    with whole_file(path) as draft:
        draft.write_text(text, encoding="utf-8")


def _digest(column: Recording, options: str) -> str:
    """Digest of the samples, covariates, rate and unit of a column, and of options."""
    digest = hashlib.sha256(f"{column.rate!r} {column.unit} {options}".encode())
    for values in (column.samples, *column.covariates.values()):
        digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()
