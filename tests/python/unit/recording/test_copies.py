"""The audit names blocks of samples that a log holds twice, and nothing else."""

import numpy as np
import pytest

import allanite as al


def _findings(x):
    return [f for f in al.Recording(x, rate=100.0, unit="deg/s").audit if f.kind == "copies"]


@pytest.mark.parametrize("step", [0.0, 0.3, 1.0, 2.0], ids="{} σ".format)
def test_a_packet_that_was_written_twice(step):
    x = np.random.default_rng(1).standard_normal(120_000)
    x = np.round(x / step) * step if step else x
    assert _findings(x) == []
    x = np.concatenate([x[:70_200], x[70_000:70_200], x[70_200:]])
    (found,) = _findings(x)
    assert found.values["start_s"] == pytest.approx(702.0, abs=0.05)
    assert found.values["count"] == pytest.approx(200, abs=5)
    assert "sample by sample" in found.message


def test_stuck_values_missing_samples_and_coarse_samples_are_no_copies():
    rng = np.random.default_rng(2)
    x = rng.standard_normal(50_000)
    x[1000:1400] = 0.5
    x[3000:3400] = 0.5
    x[8000:9000] = x[20_000:21_000] = np.nan
    assert _findings(x) == []
    assert _findings(np.where(rng.random(50_000) < 0.01, 1.0, 0.0)) == []


@pytest.mark.parametrize(
    ("size", "period", "noise"), [(30.0, 20, 0.2), (50.0, 20, 0.15), (1.0, 40, 0.0)]
)
def test_periods_of_a_rounded_line_are_no_copies(size, period, noise):
    """Most samples equal those of one period before, if the noise is below the resolution."""
    rng = np.random.default_rng(3)
    line = size * np.sin(2.0 * np.pi * np.arange(20_000) / period)
    x = line + noise * rng.standard_normal(line.size)
    assert _findings(np.round(x) if noise else x) == []


def test_packets_that_are_all_written_twice_are_copies():
    packets = np.random.default_rng(4).standard_normal((400, 50))
    (found,) = _findings(np.concatenate([packets, packets], axis=1).ravel())
    assert found.kind == "copies"
