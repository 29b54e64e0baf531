"""A watch of a log that rotates, killed again and again, loses no row and counts none twice.

``ALLANITE_FULL=1`` takes all 10⁷ samples, some minutes of a processor.
"""

import json
import os
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

import allanite as al
from command_line import started, until
from counts import records

#: Samples of a block, and blocks in all; the log rotates after so many blocks, and the watch is killed after so many.
BLOCK, BLOCKS, ROTATE, KILL = records(10_000, 100_000), records(30, 100), 7, 4
#: The watch writes its state after so many samples.
EVERY = 2000
#: Largest memory of a process, KiB: Python, NumPy and SciPy take 120 MB.
LARGEST = 250_000
MODEL = "N(N=0.1)"


class Soak:
    """A log that grows, and an uninterrupted watch for comparison."""

    def __init__(self, folder):
        self.log, self.state, self.folder = folder / "log.csv", folder / "state", folder
        self.alone, self.rng = al.Watch(al.parse_model(MODEL), 100.0), np.random.default_rng(5)
        self.written = self.blocks = self.largest = 0
        self.log.write_text("gx\n")

    def write(self):
        """Append a block in two parts with a random cut, as a buffered writer does."""
        rows = [f"{x:.6f}\n" for x in self.rng.standard_normal(BLOCK)]
        self.alone.update(np.array([float(row) for row in rows]))
        text, at = "".join(rows), int(self.rng.integers(1, 8 * BLOCK))
        for part in (text[:at], text[at:]):
            with self.log.open("a") as file:
                file.write(part)
        self.written += BLOCK
        self.blocks += 1

    def rotate(self, process):
        """Rename the log once the watch has it open, because a rotation while nobody reads may lose rows."""
        handles = Path(f"/proc/{process.pid}/fd")
        if handles.is_dir():
            until(lambda: any(one.resolve() == self.log for one in handles.iterdir()))
        self.log.rename(self.folder / "log.csv.1")
        self.log.write_text("gx\n")

    def wait(self, process, behind=EVERY):
        """Wait until the state has all but the last rows."""

        def told():
            time.sleep(0.1)  # a state is large
            assert process.poll() is None, (self.folder / "err").read_text()
            return self.state.is_file() and (
                json.loads(self.state.read_text())["taken"] > self.written - behind
            )

        until(told, 300.0)
        status = Path(f"/proc/{process.pid}/status")
        if status.is_file():
            most = next(line for line in status.read_text().splitlines() if "VmHWM" in line)
            self.largest = max(self.largest, int(most.split()[1]))


@pytest.mark.long
@pytest.mark.timeout(0)
@pytest.mark.skipif(os.name != "posix", reason="processes are killed the POSIX way")
def test_a_watch_that_is_killed_ends_as_one_that_ran_alone(tmp_path):
    soak = Soak(tmp_path)
    options = ("--model", MODEL, "--rate", 100, "--every", EVERY / 100, "--state", soak.state)
    with (tmp_path / "err").open("wb") as errors:
        while soak.blocks < BLOCKS:
            with started(
                "watch", soak.log, "--follow", *options, stdout=subprocess.DEVNULL, stderr=errors
            ) as process:
                for _ in range(min(KILL, BLOCKS - soak.blocks)):
                    if soak.blocks and soak.blocks % ROTATE == 0:
                        soak.wait(process)
                        soak.rotate(process)
                    soak.write()
                if soak.blocks < BLOCKS:
                    # The state is of the new file before the kill: of a log that rotates while nobody reads, rows are lost.
                    soak.wait(process, behind=BLOCK)
                    process.send_signal(signal.SIGKILL)
                    process.wait(60)
                else:
                    soak.wait(process)
                    process.send_signal(signal.SIGTERM)
                    assert process.wait(60) == 143
    again = al.Watch(al.parse_model(MODEL), 100.0)
    again.restore(soak.state)
    assert again.taken == again.summary.n == soak.written
    assert (again.segments, again.e_value) == (soak.alone.segments, soak.alone.e_value)
    assert again.alarm is None
    np.testing.assert_allclose(
        again.summary.oadev().deviation, soak.alone.summary.oadev().deviation
    )
    assert soak.largest < LARGEST
