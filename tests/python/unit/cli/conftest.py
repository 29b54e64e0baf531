"""A command line to run, and a log to run it on."""

import numpy as np
import pytest

from allanite.cli import main


@pytest.fixture
def run(capsys):
    """Run a command line; return exit code, stdout, stderr."""

    def call(*arguments):
        with pytest.raises(SystemExit) as caught:
            main([str(argument) for argument in arguments])
        out, err = capsys.readouterr()
        return caught.value.code, out, err

    return call


@pytest.fixture
def log(tmp_path):
    """A gyroscope log with a temperature column, as CSV."""
    path = tmp_path / "gyro.csv"
    x = np.random.default_rng(7).standard_normal(4000) * 0.1
    rows = "".join(f"{k / 100:.2f},{v:.9f},{20 + k * 1e-3:.3f}\n" for k, v in enumerate(x))
    path.write_text("time [s],gyro_x [deg/s],temperature\n" + rows)
    return path
