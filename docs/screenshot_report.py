"""Photograph a report in both themes: python docs/screenshot_report.py (a minute; needs chromium)."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from pictures import small
from PIL import Image  # comes with matplotlib

import allanite as al

FOLDER = Path(__file__).parent / "figures"
#: As in `make_figures`: a MEMS gyroscope, deg/s, in which two effects hide.
MODEL = "N(N=0.005)+B(B=8.333333e-4)+GM(correlation_time=60,q_c=6.944444e-4)+SIN(frequency=12.5,amplitude=0.002)"
#: Pixels; the height shows the page down to the table of the model.
WIDTH, HEIGHT = 1100, 1850
#: Chromium's numbers of the preferred colour scheme.
THEMES = {"dark": 0, "light": 1}


def main() -> None:
    """Simulate a record, write its report, and photograph the report in both themes."""
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    if chromium is None:
        sys.exit("no chromium: apt-get install chromium")
    samples = al.parse_model(MODEL).simulate(duration=7200, rate=100, seed=1, unit="deg/s").samples
    recording = al.Recording(samples, rate=100, unit="deg/s", columns=["gyro_x"])
    report = al.make_report(recording.with_path("gyroscope.npz"))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        page = report.save(folder / "report.html")
        for theme, number in THEMES.items():
            raw = folder / f"{theme}.png"
            subprocess.run(
                [chromium, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars",
                 f"--blink-settings=preferredColorScheme={number}", f"--user-data-dir={folder / 'profile'}",
                 f"--window-size={WIDTH},{HEIGHT}", f"--screenshot={raw}", page.as_uri()],
                check=True, capture_output=True,
            )  # fmt: skip
            small(Image.open(raw)).save(FOLDER / f"report-{theme}.png", optimize=True)


if __name__ == "__main__":
    main()
