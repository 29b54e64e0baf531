"""Colors of effects: told apart from each other and from their background."""

from itertools import combinations

import numpy as np
import pytest

from allanite.plots.themes import COMPONENTS, theme_of

#: Distance in the color space OKLab, in %, below which two thin lines look alike. The two blues that were
#: mistaken for each other had 10.7.
MIN_DISTANCE = 11.0
#: Contrast of graphical objects with their background (WCAG 2.2, success criterion 1.4.11).
MIN_CONTRAST = 3.0

LMS = np.array(
    [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ]
)
OKLAB = np.array(
    [
        [0.2104542553, 0.7936177850, -0.0040720468],
        [1.9779984951, -2.4285922050, 0.4505937099],
        [0.0259040371, 0.7827717662, -0.8086757660],
    ]
)


def linear(color):
    """Linear red, green and blue (0 to 1) of a hexadecimal color."""
    c = np.array([int(color[i : i + 2], 16) for i in (1, 3, 5)]) / 255.0
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def distance(one, other):
    """Distance of two colors in OKLab (Ottosson 2020), %."""
    a, b = (OKLAB @ np.cbrt(LMS @ linear(c)) for c in (one, other))
    return 100.0 * np.linalg.norm(a - b)


def contrast(one, other):
    """Contrast ratio of two colors by WCAG 2.2."""
    low, high = sorted(np.array([0.2126, 0.7152, 0.0722]) @ linear(c) for c in (one, other))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("name", ["light", "dark"])
def test_effects_model_and_measurement_differ_in_color(name):
    theme = theme_of(name)
    roles = (*COMPONENTS, "model", "measured")
    near = {
        (a, b): found
        for a, b in combinations(roles, 2)
        if (found := distance(theme.color(a), theme.color(b))) < MIN_DISTANCE
    }
    assert near == {}
    assert all(contrast(theme.color(role), theme.panel) >= MIN_CONTRAST for role in roles)
