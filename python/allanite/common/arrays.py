"""Types of arrays, for annotations."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

#: Array of doubles.
Array: TypeAlias = NDArray[np.float64]
