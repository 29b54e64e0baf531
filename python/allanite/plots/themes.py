"""Colors of roles for light and dark backgrounds, after Okabe and Ito (2008), *Color universal design*."""

from __future__ import annotations

from dataclasses import dataclass

from allanite.common.errors import InputError

#: Color roles of the effects of a model, in their order.
COMPONENTS = ("c1", "c2", "c3", "c4", "c5", "c6")
#: Color roles of compared logs; their colors differ from those of effects.
LOGS = ("measured", "l2", "l3", "l4", "l5", "l6")


@dataclass(frozen=True, slots=True)
class Theme:
    """Palette for a light or a dark background: hexadecimal color of each role."""

    name: str
    ground: str
    panel: str
    text: str
    faint: str
    grid: str
    roles: dict[str, str]
    #: Colors for values below, at and above the expectation.
    diverging: tuple[str, str, str]

    def color(self, role: str) -> str:
        """Hexadecimal color of a role; `KeyError` for an unknown role."""
        if role in ("text", "faint", "grid", "panel"):
            return str(getattr(self, role))
        return self.roles[role]


_LIGHT = Theme(
    "light",
    ground="#ffffff",
    panel="#ffffff",
    text="#1c2230",
    faint="#6b7280",
    grid="#e4e7ec",
    roles={
        "measured": "#1c2230",
        "raw": "#5b6473",
        "model": "#D55E00",
        "before": "#8a93a3",
        "fail": "#E6B800",
        "guide": "#6b7280",
        "c1": "#0072B2",
        "c2": "#009E73",
        "c3": "#CC79A7",
        "c4": "#B58900",
        "c5": "#7B3FF2",
        "c6": "#8A1F5F",
        "l2": "#9E2A2B",
        "l3": "#3D348B",
        "l4": "#5F6B2D",
        "l5": "#00707A",
        "l6": "#7F4F24",
    },
    diverging=("#0072B2", "#f7f7f7", "#D55E00"),
)
_DARK = Theme(
    "dark",
    ground="#12161f",
    panel="#181d28",
    text="#e6e9ef",
    faint="#9aa3b2",
    grid="#2a3140",
    roles={
        "measured": "#e6e9ef",
        "raw": "#aeb8c9",
        "model": "#F28E2B",
        "before": "#8a93a3",
        "fail": "#F0E442",
        "guide": "#8a93a3",
        "c1": "#56B4E9",
        "c2": "#2BC99B",
        "c3": "#E29BC4",
        "c4": "#F0E442",
        "c5": "#C44DFF",
        "c6": "#E8435A",
        "l2": "#FF8A80",
        "l3": "#8E9BFF",
        "l4": "#C5D86D",
        "l5": "#66D9C8",
        "l6": "#E0B080",
    },
    diverging=("#3B9BD9", "#232937", "#F28E2B"),
)


def theme_of(name: str) -> Theme:
    """`Theme` with the name ``"light"`` or ``"dark"``. Raises `InputError` for another name."""
    for theme in (_LIGHT, _DARK):
        if theme.name == name:
            return theme
    raise InputError(f"unknown theme {name!r}: light or dark")
