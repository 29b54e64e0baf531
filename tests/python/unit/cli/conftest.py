"""A log to run commands on."""

import numpy as np
import pytest


@pytest.fixture
def log(tmp_path):
    """A gyroscope log with a temperature column, as CSV."""
    path = tmp_path / "gyro.csv"
    x = np.random.default_rng(7).standard_normal(4000) * 0.1
    rows = "".join(f"{k / 100:.2f},{v:.9f},{20 + k * 1e-3:.3f}\n" for k, v in enumerate(x))
    path.write_text("time [s],gyro_x [deg/s],temperature\n" + rows)
    return path
