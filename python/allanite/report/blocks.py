"""A report as a list of blocks, which HTML and Markdown paint each in its own way."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from allanite.plots import Figure

__all__ = ["Block", "Bullets", "Card", "Cell", "Heading", "Number", "Paragraph", "Picture", "Table"]


@dataclass(frozen=True, slots=True)
class Number:
    """A number as it is printed, and the number itself with its place in the JSON document."""

    text: str
    value: float
    place: str


Cell = str | Number | tuple["str | Number", ...]


@dataclass(frozen=True, slots=True)
class Heading:
    """The title of a part; level 2 a column, 3 a section of it."""

    text: str
    level: int = 3


@dataclass(frozen=True, slots=True)
class Paragraph:
    """Running text; `tone` is plain, good, bad (a verdict) or quiet."""

    cell: Cell
    tone: str = "plain"


@dataclass(frozen=True, slots=True)
class Bullets:
    """Short remarks; `tone` as of a paragraph."""

    cells: tuple[Cell, ...]
    tone: str = "plain"


@dataclass(frozen=True, slots=True)
class Table:
    """Rows under a head (empty: a list of terms); `right` are the columns of numbers."""

    head: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    right: tuple[int, ...] = ()
    small: bool = False


@dataclass(frozen=True, slots=True)
class Card:
    """A suggestion: its title, what it is, and terms with what is known of each."""

    title: str
    text: str
    terms: tuple[tuple[str, Cell], ...]
    strong: bool = True


@dataclass(frozen=True, slots=True)
class Picture:
    """A figure with the sentence below it, the `name` of its file, and its size in inches of 100 pixels."""

    figure: Figure
    caption: str
    name: str
    height: float = 5.4
    width: float = 10.0


Block = Heading | Paragraph | Bullets | Table | Card | Picture
