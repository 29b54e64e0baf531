"""Building blocks of a report, which HTML and Markdown writers render in their own way."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from allanite.plots import Figure


@dataclass(frozen=True, slots=True)
class Heading:
    """Heading: level 2 for a column of the recording, 3 and 4 for its sections."""

    text: str
    level: int = 3


@dataclass(frozen=True, slots=True)
class Paragraph:
    """Paragraph; `tone` is plain, good or bad (for a verdict), or quiet (for remarks)."""

    text: str
    tone: str = "plain"


@dataclass(frozen=True, slots=True)
class Bullets:
    """Bulleted list; `tone` as for a paragraph."""

    texts: tuple[str, ...]
    tone: str = "plain"


@dataclass(frozen=True, slots=True)
class Table:
    """Table. Without `head` it is a list of terms; `right` are the indices of right-aligned columns."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    right: tuple[int, ...] = ()
    small: bool = False


@dataclass(frozen=True, slots=True)
class Card:
    """Card of a suggested effect: title, explanation, and terms with their values."""

    title: str
    text: str
    terms: tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class Picture:
    """Figure with a caption instead of title and subtitle, its file's `name`, and its size in inches of 100 pixels."""

    figure: Figure
    caption: str
    name: str
    height: float = 5.4
    width: float = 10.0


#: Element of a report, in the order of the page.
Block = Heading | Paragraph | Bullets | Table | Card | Picture
