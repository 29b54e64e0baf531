"""Output folder of a characterization. The files of each axis are written once it is finished; a later run continues."""

from __future__ import annotations

import hashlib
from contextlib import contextmanager
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any

import click
import numpy as np

from allanite.cli.output import json_text
from allanite.common.errors import AllaniteError, InputError
from allanite.common.files import write_text
from allanite.common.plain import file_name, plain
from allanite.exports import TARGETS, axes_of, export_files

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from allanite.axes import Characterization
    from allanite.axes.turn_on import TurnOn
    from allanite.effects import Model
    from allanite.recording import Recording
    from allanite.study import Study

#: Files of an axis, and the file with the models of all axes.
MODEL, TABLE, MODELS = "model.json", "table.txt", "models.json"
#: File with the digest of the samples and options of an axis. A run continues from a saved model only if they are equal.
INPUT = "input.sha256"


class RunFolder:
    """Output folder of a characterization: files of each axis and of all axes, and models of earlier runs.

    `targets` are those of the parameter files, and `how` the options of `allanite.exports.export`. `options` is the
    text of all other options on which the models depend. `working` are logs with motors running, which the parameter
    files follow; `turn_on` has the bias at switch-on of each column, if there are further logs.
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
            raise InputError(
                f"{path}: the folder cannot be created: {error.strerror or error}"
            ) from None

    def start_model(self, column: Recording, model: Model) -> Model:
        """Model that an earlier run saved for the same samples, options and start model `model`; otherwise `model`.

        Prints a line if a saved model is found. Stores the digest of these inputs, which `write` saves.
        """
        from allanite.effects.files import model_from_dict
        from allanite.sources import documents_of

        name = column.columns[0]
        self._digests[name] = _input_digest(column, f"{self.options} {model}")
        folder = self.path / file_name(name)
        try:
            if (folder / INPUT).read_text(encoding="ascii").strip() != self._digests[name]:
                return model
            (document,) = documents_of(str(folder / MODEL))
            saved = model_from_dict(document, str(folder / MODEL))
        except (AllaniteError, OSError, ValueError):
            return model  # no saved model, or a damaged one: the axis is computed again
        click.echo(plain(f"· {name}: continuing from {folder / MODEL}"), err=True)
        return saved

    def write(self, study: Study) -> None:
        """Write the model, table, parameter files and input digest of one axis to its folder, and note it as `finished`."""
        from allanite.axes.twin import sample_statistics
        from allanite.axes.working import working_states
        from allanite.exports import export

        name = study.recording.columns[0]
        document = study.to_dict()
        texts = {MODEL: json_text(document) + "\n", TABLE: f"{study}\n"}
        own = {**document, "samples": {name: sample_statistics(study)}}
        if self.working:
            states = working_states({name: study}, self.working)
            own["working"] = {column: state.to_dict() for column, state in states.items()}
        if name in self.turn_on:
            own["turn_on"] = {name: self.turn_on[name].to_dict()}
        axes = axes_of(own)
        for target in self.targets:
            try:
                texts[TARGETS[target].file_name] = export(axes, target, **self.how)
            except InputError:
                continue  # the target needs several axes: `finish` reports the reason
        texts[INPUT] = self._digests[name] + "\n"
        folder = self.path / file_name(name)
        folder.mkdir(exist_ok=True)
        for file, text in texts.items():
            write_text(folder / file, text)
        with self._lock:
            self.finished.append(name)

    @contextmanager
    def finished_axes_named(self) -> Iterator[None]:
        """Context that, after an interrupt by the user, prints the names of the finished axes, if there are any."""
        try:
            yield
        except KeyboardInterrupt:
            if self.finished:
                done = f"finished axes {', '.join(self.finished)}"
                note = f"{self.path}: {done}; run the same command again to continue"
                click.echo(plain(note), err=True)
            raise

    def finish(self, found: Characterization) -> list[str]:
        """Write the models, figure, report and parameter files of all axes, or warnings; returns the written paths."""
        texts = {self.path / MODELS: json_text(found.to_dict()) + "\n"}
        axes = axes_of(found) if self.targets else []
        for target in self.targets:
            path = self.path / TARGETS[target].file_name
            try:
                texts |= export_files(axes, target, path, **self.how)
            except InputError as error:
                click.echo(plain(f"! {target}: {error}"), err=True)
        for file, text in texts.items():
            write_text(file, text)
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


def _input_digest(column: Recording, options: str) -> str:
    """SHA-256 digest (hexadecimal text) of the samples, logged columns, rate and unit of a column, and of the options."""
    digest = hashlib.sha256(f"{column.rate!r} {column.unit} {options}".encode())
    for values in (column.samples, *column.covariates.values()):
        digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()
