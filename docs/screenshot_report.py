"""Photograph a report in both themes: python docs/screenshot_report.py (a minute; needs chromium)."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image  # comes with matplotlib

import allanite as al

FOLDER = Path(__file__).parent / "figures"
#: As in `make_figures`: a consumer gyroscope, rad/s, in which two effects hide.
MODEL = "N(N=0.0126)+B(B=0.002)+K(K=9.07e-5)+GM(correlation_time=30,q_c=2.5e-3)+SIN(frequency=3.1,amplitude=0.003)"
#: Pixels; the height shows the page down to the table of the model.
WIDTH, HEIGHT = 1100, 1850
#: Chromium's numbers of the preferred colour scheme.
THEMES = {"dark": 0, "light": 1}


def main() -> None:
    """Simulate, report, photograph."""
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    if chromium is None:
        sys.exit("no chromium: apt-get install chromium")
    samples = al.parse_model(MODEL).simulate(duration=7200, rate=100, seed=1, unit="rad/s").samples
    recording = al.Recording(samples, rate=100, unit="rad/s", columns=["gyro_x"])
    report = al.make_report(recording.to("deg/s").called("gyroscope.npz"))
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
            Image.open(raw).convert("RGB").save(FOLDER / f"report-{theme}.png", optimize=True)


if __name__ == "__main__":
    main()
