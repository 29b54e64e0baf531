"""What a consumer's file declares, and the table of all of them; installed packages add theirs by an entry point."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from threading import RLock
from typing import TYPE_CHECKING, Protocol

from allanite.common.errors import InputError
from allanite.common.extensions import add_installed, declared_in

if TYPE_CHECKING:
    from collections.abc import Sequence

    from allanite.export._axis import Axis

__all__ = ["ENTRY_POINTS", "Render", "Target", "Targets"]

#: Group of entry points under which an installed package names its targets.
ENTRY_POINTS = "allanite.exports"


class Render(Protocol):
    """Text of a parameter file for some axes, at the rate of the target."""

    def __call__(self, axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
        """Text of the file."""


@dataclass(frozen=True, slots=True)
class Target:
    """One format of parameter files.

    Attributes
    ----------
    name : str
        On the command line: ``kalibr``.
    title : str
        On the page: ``Kalibr``.
    file_name : str
        Name of the file in a folder of all formats, and on the page.
    render : callable
        ``render(axes, rate, overbound=False)`` returns the text of the file.
    any_sensor : bool
        Whether it takes any sensor; else gyroscopes and accelerometers of one IMU.
    own_rate : bool
        Whether its numbers hold for the rate of the filter, not of the sensor.
    whole_record : bool
        Whether its numbers are right over a tenth of the recording unless a horizon is given: simulators do not coast.
    alternatives : bool
        Whether it names alternative explanations, whose search takes longer than all else.
    """

    name: str
    title: str
    file_name: str
    render: Render
    any_sensor: bool = False
    own_rate: bool = False
    whole_record: bool = False
    alternatives: bool = False


class Targets(Mapping[str, Target]):
    """Targets by name: those of the modules of some packages, and those of installed packages, which are loaded once."""

    def __init__(self, *packages: str) -> None:
        own = [one for targets in declared_in("TARGETS", *packages) for one in targets]
        self._targets: dict[str, Target] = {t.name: t for t in sorted(own, key=lambda t: t.name)}
        self._complete = False
        self._lock = RLock()

    def __getitem__(self, name: str) -> Target:
        self._load()
        return self._targets[name]

    def __iter__(self) -> Iterator[str]:
        self._load()
        return iter(tuple(self._targets))

    def __len__(self) -> int:
        self._load()
        return len(self._targets)

    def _load(self) -> None:
        with self._lock:
            if self._complete:
                return
            self._complete = True
            add_installed(ENTRY_POINTS, "export", self._add)

    def _add(self, target: object) -> None:
        if not isinstance(target, Target):
            raise InputError(f"{target!r} is not an allanite.export.Target")
        for other in self._targets.values():
            if target.name == other.name or target.file_name == other.file_name:
                raise InputError(
                    f"its name {target.name!r} or its file name {target.file_name!r} is that of {other.title}"
                )
        self._targets[target.name] = target
