"""Logs whose clocks go wrong, each read in a process of its own: rate and gaps, or one line, within 2 s and 500 MB."""

import gzip
import json
import subprocess
import sys

import numpy as np
import pytest

N = 20_000

CHILD = """
import json, resource, sys, time
import numpy as np
import allanite as al
from allanite import readers
from allanite.common.errors import AllaniteError
before, start = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.process_time()
out = {}
try:
    r = al.read(sys.argv[1])
    out = {"rate": r.rate, "n": r.n, "gaps": [[int(a), int(b)] for a, b in (r.stamps.gaps if r.stamps else ())]}
    out["said"] = [str(f.message) for f in r.audit]
except AllaniteError as error:
    out["refused"] = str(error)
out["cpu"] = time.process_time() - start
out["megabytes"] = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
print(json.dumps(out))
"""


def _holes():
    rng = np.random.default_rng(0)
    t = np.flatnonzero(rng.random(3 * N) > 0.07).astype(float)
    t[5000:] += 7000.0
    return t


def _late(t, after, by):
    return np.where(np.arange(t.size) > after, t + by, t)


PLAIN = np.arange(N) / 100.0

#: Stamps as text would hold them, name of their column, and the rate in Hz (None: refused) and a row after which is a gap.
CASES = {
    "thousands of holes at 1 Hz": (_holes(), "time [s]", 1.0, 4999),
    "one hole of 295 s at 5 Hz": (_late(np.arange(N) // 5, 1580, 295), "time [s]", 5.0, 1580),
    "two logs joined": (np.concatenate((PLAIN, PLAIN)), "time [s]", 100.0, N - 1),
    "a 16-bit counter of ms that wraps": (np.arange(N) * 10 % 2**16, "time [ms]", 100.0, None),
    "whole ms of a 1 kHz log": (np.arange(N) + 123_456, "time", None, None),
    "whole ms with their unit": (np.arange(N) + 123_456, "time [ms]", 1000.0, None),
    "a clock set by GPS": (_late(PLAIN, 599, 1.7e9), "time [s]", 100.0, None),
    "a month without power": (_late(PLAIN, N // 2, 2.6e6), "time [s]", 100.0, None),
    "a last stamp of 1e308": (np.append(PLAIN[:-1], 1e308), "time [s]", 100.0, None),
}


def _read(path):
    done = subprocess.run(
        [sys.executable, "-c", CHILD, str(path)], capture_output=True, text=True, check=True
    )
    out = json.loads(done.stdout)
    # CPU time: the machine may be busy with other tests.
    assert out["cpu"] < 2.0, out
    assert out["megabytes"] < 500.0, out
    return out


def _rows(stamps, name):
    noise = np.random.default_rng(1).standard_normal(len(stamps))
    lines = [f"{name},gyro_x [deg/s]"]
    return "\n".join(lines + [f"{t},{x:.6f}" for t, x in zip(stamps, noise, strict=True)]) + "\n"


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_the_rate_and_the_gaps_or_one_line(case, tmp_path):
    stamps, name, rate, gap = CASES[case]
    path = tmp_path / "log.csv"
    path.write_text(_rows([f"{t:.12g}" for t in stamps], name))
    out = _read(path)
    if rate is None:
        assert "\n" not in out["refused"]
        assert "1000 Hz" in out["refused"]
        return
    assert out["rate"] == pytest.approx(rate, rel=1e-3)
    if gap is not None:
        assert gap in {row for row, _ in out["gaps"]}


START = np.datetime64("2026-01-31T12:00:00.000")
DATES = START + np.arange(2000) * np.timedelta64(10, "ms")


@pytest.mark.slow
@pytest.mark.parametrize("packed", [False, True])
def test_date_times_behind_a_preamble(packed, tmp_path):
    text = "# logger 7\n# serial 12\n" + _rows(DATES.astype(str), "time")
    path = tmp_path / ("log.csv.gz" if packed else "log.csv")
    path.write_bytes(gzip.compress(text.encode()) if packed else text.encode())
    assert _read(path)["rate"] == pytest.approx(100.0)


@pytest.mark.slow
def test_dates_that_begin_with_the_day(tmp_path):
    """31.01.2026 12:00:00.010: read, or refused in one line."""
    path = tmp_path / "log.csv"
    days = [f"{d[8:10]}.{d[5:7]}.{d[:4]} {d[11:]}" for d in DATES.astype(str)]
    path.write_text(_rows(days, "time"))
    out = _read(path)
    assert "\n" not in out.get("refused", "")
    assert out.get("rate", 100.0) == pytest.approx(100.0)
