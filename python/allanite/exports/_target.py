"""Declaration of an export format, and the table of all formats. Installed packages add formats by entry points."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from allanite.common.errors import InputError
from allanite.common.extensions import EntryPoints, values_of_modules
from allanite.exports._axis import Axis

#: Group of the entry points of installed packages.
ENTRY_POINTS = "allanite.exports"


class Render(Protocol):
    """Function that returns the text of a parameter file."""

    def __call__(self, axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
        """Text of a parameter file for these axes.

        `rate` is the sampling rate, Hz, or the rate of the filter for targets with `own_rate`; None is the target's
        default. With `overbound`, the numbers cover the upper limits of the models.
        """


@dataclass(frozen=True, slots=True)
class Target:
    """One format of parameter files.

    Attributes
    ----------
    name : str
        Name on the command line: ``kalibr``.
    title : str
        Name on the page: ``Kalibr``.
    file_name : str
        Name of the file in a folder with all formats, and on the page.
    render : callable
        ``render(axes, rate, overbound=False)`` returns the text of the file.
    any_sensor : bool
        Whether the format accepts any sensor. Otherwise it accepts gyroscopes and accelerometers of one IMU.
    both_sensors : bool
        True if the file must describe a gyroscope and an accelerometer, because its reader needs the values of both.
    own_rate : bool
        True if the numbers depend on the rate of the filter. If False, they depend on the rate of the sensor.
    whole_record : bool
        True if the default horizon is a tenth of the recording. This suits simulators, which do not coast.
    alternatives : bool
        True if the format states alternative explanations. Their search takes longer than everything else.
    """

    name: str
    title: str
    file_name: str
    render: Render
    any_sensor: bool = False
    both_sensors: bool = False
    own_rate: bool = False
    whole_record: bool = False
    alternatives: bool = False


class Targets(Mapping[str, Target]):
    """Mapping of all targets by name: from modules of these packages, and from installed packages, which load once."""

    def __init__(self, *packages: str) -> None:
        own = [one for targets in values_of_modules("TARGETS", *packages) for one in targets]
        self._targets: dict[str, Target] = {t.name: t for t in sorted(own, key=lambda t: t.name)}
        self._installed = EntryPoints(ENTRY_POINTS, "export", self._add)

    def __getitem__(self, name: str) -> Target:
        self._installed.load()
        return self._targets[name]

    def __iter__(self) -> Iterator[str]:
        self._installed.load()
        return iter(tuple(self._targets))

    def __len__(self) -> int:
        self._installed.load()
        return len(self._targets)

    def _add(self, target: object) -> None:
        """Add one target. Raises `InputError` for another type, or if its name or file name is already used."""
        if not isinstance(target, Target):
            raise InputError(f"{target!r} is not an allanite.exports.Target")
        for other in self._targets.values():
            if target.name == other.name or target.file_name == other.file_name:
                raise InputError(
                    f"its name {target.name!r} or its file name {target.file_name!r} is already used by {other.title}"
                )
        self._targets[target.name] = target
