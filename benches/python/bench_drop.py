"""Seconds from a log of 10⁶ samples × 6 axes to its curve and verdict on the page, in real browsers, and to its report.

The report of finished models is measured apart from the search for the models, which is most of the time.

    python benches/python/bench_drop.py [chromium|firefox|report]

Needs Playwright and a browser (CONTRIBUTING.md). Wall-clock seconds; processor seconds of page, reader and browser in
brackets. The processor seconds count all children, so that they tell a slow page from a busy machine.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from playwright.sync_api import sync_playwright
from side_by_side import save

import allanite as al

N, RATE = 1_000_000, 100.0
HIDDEN = "N(N=0.01)+B(B=0.002)+K(K=2e-5)+GM(correlation_time=8,q_c=6e-3)+SIN(frequency=1.7,amplitude=0.006)"
NAMES = ("gyro_x", "gyro_y", "gyro_z", "acc_x", "acc_y", "acc_z")
UNITS = ("rad/s",) * 3 + ("m/s^2",) * 3
#: Seconds within which each part is promised: after the drop, or after the search for the models.
BARS = {"measured curve": 5.0, "first verdict": 8.0, "report of finished models": 5.0}
#: Bytes within which the report is promised.
MAX_REPORT_BYTES = 600_000
BROWSERS = {"chromium": ("chromium", "chromium-browser"), "firefox": ("firefox-esr", "firefox")}

#: Drops the file of the hidden input, and stores the seconds after which each part is seen.
DROP = """() => {
  const files = new DataTransfer(), start = performance.now(), seen = window.seen = {};
  files.items.add(document.getElementById("bench").files[0]);
  for (const kind of ["dragenter", "dragover", "drop"])
    dispatchEvent(new DragEvent(kind, { dataTransfer: files, bubbles: true, cancelable: true }));
  const parts = {
    "measured curve": () => document.querySelectorAll("#plot .scatterlayer .points path.point").length >= 5,
    "model": () => document.querySelectorAll(".chip").length > 0,
    "first verdict": () => document.querySelector("body[data-drawn] #verdict b"),
  };
  const look = () => {
    for (const [name, there] of Object.entries(parts))
      if (!(name in seen) && there()) seen[name] = (performance.now() - start) / 1000;
    // A timer, because requests for animation frames would draw 60 frames a second.
    if (Object.keys(seen).length < 3) setTimeout(look, 30);
  };
  look();
}"""


def processor_seconds(roots):
    """Return the processor seconds of these processes and all their descendants, ended children included."""
    tick, parents, used = os.sysconf("SC_CLK_TCK"), {}, {}
    for entry in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = entry.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        parents[int(entry.parent.name)] = int(fields[1])
        used[int(entry.parent.name)] = sum(map(int, fields[11:15])) / tick
    found, more = set(), set(roots)
    while more:
        found |= more
        more = {pid for pid, parent in parents.items() if parent in more} - found
    return sum(used.get(pid, 0.0) for pid in found)


def logs(folder):
    """Return the paths of the same log of six axes as NPZ and as CSV."""
    made = al.parse_model(HIDDEN).simulate(n=N, rate=RATE, seed=1, unit="rad/s").samples
    # Shifted copies give six different columns from one simulation.
    data = np.column_stack([np.roll(made, i * N // 7) for i in range(6)])
    binary, text = Path(folder) / "six.npz", Path(folder) / "six.csv"
    np.savez(binary, data=data, rate_hz=RATE, unit=UNITS, channels=NAMES)
    head = ",".join(["time [s]", *(f"{n} [{u}]" for n, u in zip(NAMES, UNITS, strict=True))])
    rows = np.column_stack([np.arange(N) / RATE, data])
    np.savetxt(text, rows, delimiter=",", header=head, comments="", fmt="%.8g")
    return binary, text


def drop(play, name, path):
    """Drop a log on the page in a browser and return the rows of its times."""
    command = [Path(sys.executable).with_name("allanite"), "explore", "--no-browser"]
    page = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    browser = None
    try:
        url = next(word for line in page.stdout for word in line.split() if word.startswith("http"))
        program = next((p for one in BROWSERS[name] if (p := shutil.which(one))), None)
        if program is None:
            raise SystemExit(f"no {name}: apt-get install {BROWSERS[name][0]}")
        more = {"channel": "moz-firefox"} if name == "firefox" else {}
        browser = getattr(play, name).launch(executable_path=program, **more)
        tab = browser.new_page(viewport={"width": 1280, "height": 720})
        tab.goto(url)
        tab.wait_for_selector(".welcome")
        tab.evaluate(
            "() => { const input = document.createElement('input');"
            "input.type = 'file'; input.id = 'bench'; input.hidden = true; document.body.append(input); }"
        )
        tab.set_input_files("#bench", path)
        title = f"{name}, {path.stat().st_size / 1e6:.0f} MB {path.suffix[1:].upper()} dropped"
        roots, rows = (os.getpid(), page.pid), []
        before = processor_seconds(roots)
        tab.evaluate(DROP)
        for what in ("measured curve", "model", "first verdict"):
            tab.wait_for_function(
                "what => what in window.seen", arg=what, timeout=300_000, polling=100
            )
            seconds = tab.evaluate("what => window.seen[what]", what)
            cpu = processor_seconds(roots) - before
            rows.append(
                (
                    f"page, 1 M samples × 6 axes: {title}: {what}",
                    "allanite",
                    seconds,
                    cpu / seconds,
                    "",
                )
            )
            said = told(seconds, BARS.get(what), "s")
            print(f"  {title + ': ' + what:48s} {seconds:7.2f} s  ({cpu:.2f} s){said}", flush=True)
        return rows
    finally:
        if browser is not None:
            browser.close()
        page.terminate()
        page.wait()


def report(path):
    """Write a report on a log, and return the rows of the times of its six searches and of the report alone."""
    target, rows = path.with_suffix(".html"), []

    def timed(what, work):
        """Return the result of the work, and add its time to the rows."""
        start, before = time.perf_counter(), processor_seconds((os.getpid(),))
        result = work()
        seconds = time.perf_counter() - start
        cpu = processor_seconds((os.getpid(),)) - before
        rows.append((f"1 M samples × 6 axes: {what}", "allanite", seconds, cpu / seconds, ""))
        print(f"  {what:48s} {seconds:7.2f} s  ({cpu:.2f} s){told(seconds, BARS.get(what), 's')}")
        return result

    recording = al.read(path)
    found = timed("models of all axes", lambda: al.characterize(recording))
    timed("report of finished models", lambda: found.report().save(target))
    size, most = target.stat().st_size / 1e3, MAX_REPORT_BYTES / 1e3
    print(f"  {'size of the report':48s} {size:7.0f} kB{told(size, most, 'kB')}", flush=True)
    return rows


def told(value, most, unit):
    """Return the text that says whether a value is within its limit; empty without a limit."""
    if most is None:
        return ""
    return f"  {'holds' if value <= most else 'MISSED'}: at most {most:g} {unit}"


def main():
    """Drop each log in each browser, or in the one named on the command line, write a report, and save the times."""
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as play:
        print(f"load of the machine before: {os.getloadavg()[0]:.1f}")
        rows = []
        paths = logs(folder)
        for name in sys.argv[1:] or (*BROWSERS, "report"):
            if name == "report":
                rows += report(paths[0])
                continue
            for path in paths:
                rows += drop(play, name, path)
        print(f"load of the machine after: {os.getloadavg()[0]:.1f}")
        if not sys.argv[1:]:
            save(rows, "drop")


if __name__ == "__main__":
    main()
