"""Response times of the page: first view of a long log, zoom, new curve after Add, first step of a search.

    python benches/python/bench_page.py [axes|tabs]

Uses the API of the page in one process, with the same requests as the browser. Wall-clock seconds; processor seconds in
brackets.
"""

import gc
import sys
import tempfile
import threading
import time
import warnings
from pathlib import Path

import numpy as np
from side_by_side import save

from allanite import parse_model
from allanite.page.server import make_app
from allanite.page.sessions import Sessions
from allanite.page.source import Source

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    from starlette.testclient import TestClient

HOST = "127.0.0.1:4711"
#: Maximum number of bytes sent to the browser per view.
MOST = 300_000
#: Number of tabs opened and closed, and the memory that may remain in use.
TABS, LEFT_MB = 200, 50
HIDDEN = "N(N=0.01)+B(B=0.002)+K(K=2e-5)+GM(correlation_time=8,q_c=6e-3)+SIN(frequency=1.7,amplitude=0.006)"


class Watch:
    """Stopwatch of wall-clock and processor seconds since the last lap."""

    def __init__(self):
        self.lap()

    def lap(self):
        """Return wall-clock and processor seconds since the last lap."""
        wall, cpu = time.perf_counter(), time.process_time()
        passed = (wall - getattr(self, "wall", wall), cpu - getattr(self, "cpu", cpu))
        self.wall, self.cpu = wall, cpu
        return passed


class Bench:
    """A log on its own page, and its response times."""

    def __init__(self, title, path):
        print(title)
        self.title, self.rows = title, []
        hosts = frozenset({HOST})
        app = make_app(Sessions([Source("log.npz", path)]), "token", hosts)
        self.client = TestClient(app, base_url=f"http://{HOST}/token/")
        self.watch = Watch()

    def note(self, what, since=None):
        """Record and print the time since the last lap."""
        wall, cpu = (since or self.watch).lap()
        self.rows.append((f"{self.title}: {what}", "allanite", wall, cpu / wall, ""))
        print(f"  {what:44s} {wall:7.2f} s  ({cpu:.2f} s)")

    def get(self, path, **query):
        """Return the answer to a request of the tab."""
        answer = self.client.get(f"tabs/{self.tab}{path}", params=query)
        assert answer.status_code == 200, answer.text
        assert len(answer.content) <= MOST, (path, len(answer.content))
        return answer

    def view(self, name, **query):
        """Return the number of bytes of a view."""
        return len(self.get(f"/view/{name}", **query).content)

    def until(self, holds):
        """Poll the state as the page does until `holds` is true for it, and return it."""
        while True:
            state = self.get("").json()
            if state["job"]["error"] or state["problem"]:
                raise SystemExit(state["job"]["error"] or state["problem"])
            if holds(state):
                return state
            time.sleep(0.02)

    def first_view(self):
        """Open a tab and wait for the recording, its view and the first model."""
        self.tab = self.client.post("tabs").json()["tab"]
        self.until(lambda s: s["recording"])
        self.note("read and audited")
        read = Watch()
        self.view("allan")
        self.note("first view, since it was read", read)
        self.until(lambda s: s["ladder"])
        self.view("allan")
        self.note("model and its curve, since it was read")

    def the_rest(self):
        """Wait for the check and request all other views."""
        self.until(lambda s: not s["job"]["busy"])
        self.note("check")
        for name in ("allan", "psd", "map", "samples", "compare"):
            self.watch.lap()
            size = self.view(name)
            self.note(f"view {name}, {size / 1000:.0f} kB")

    def add(self):
        """Add the first suggestion and wait for the new curve and check."""
        state = self.until(lambda s: not s["job"]["busy"])
        first, steps = state["cards"][0], len(state["ladder"])
        self.watch.lap()
        order = {"do": "add", "number": first["number"]}
        self.client.post(f"tabs/{self.tab}/act", json=order).raise_for_status()
        self.until(lambda s: len(s["ladder"]) > steps)
        self.view("allan")
        self.note(f"Add {first['name']}: the new curve")
        self.until(lambda s: not s["job"]["busy"])
        self.note("new check")

    def zoom(self):
        """Zoom to one second of the samples in the middle of the record."""
        middle = self.get("").json()["recording"]["duration"] / 2
        self.watch.lap()
        size = self.view("samples", **{"from": middle, "to": middle + 1.0})
        self.note(f"zoom to a second of samples, {size / 1000:.0f} kB")

    def improve(self):
        """Improve all axes, wait for the first step and cancel."""
        self.until(lambda s: not s["job"]["busy"])
        self.watch.lap()
        order = {"do": "improve", "all": True}
        self.client.post(f"tabs/{self.tab}/act", json=order).raise_for_status()
        self.until(lambda s: len(s["ladder"]) > 1)
        self.note("improve: its first step")
        self.client.post(f"tabs/{self.tab}/act", json={"do": "cancel"}).raise_for_status()


def six_axes(folder, n=10_000_000):
    """Return the rows of a long log of six axes."""
    path = Path(folder) / "six.npz"
    made = parse_model(HIDDEN).simulate(n=n, rate=100.0, seed=1, unit="rad/s").samples
    # Shifted copies give six different columns from one simulation.
    data = np.column_stack([np.roll(made, i * n // 7) for i in range(6)])
    np.savez(path, data=data, rate_hz=100.0, unit="rad/s")
    del made, data
    bench = Bench(f"page, {n // 1_000_000} M samples × 6 axes", path)
    bench.first_view()
    bench.zoom()
    bench.until(lambda s: not s["job"]["busy"])
    bench.note("check")
    bench.get("/part/strip")
    bench.note("strip of all axes")
    bench.improve()
    bench.client.post(f"tabs/{bench.tab}/close").raise_for_status()
    return bench.rows


def resident_mb():
    """Return the resident memory in MB."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096 / 1e6


def many_tabs(folder):
    """Return the rows of many tabs on a log of a million samples; assert that closed tabs leave no memory or thread."""
    path = Path(folder) / "1.npz"
    made = parse_model(HIDDEN).simulate(n=1_000_000, rate=100.0, seed=1, unit="rad/s").samples
    np.savez(path, data=made, rate_hz=100.0, unit="rad/s")
    bench = Bench("page, tabs", path)
    bench.first_view()
    bench.until(lambda s: not s["job"]["busy"])
    at_work = [bench.client.post("tabs").json()["tab"] for _ in range(10)]
    time.sleep(3.0)
    bench.watch.lap()
    bench.first_view()
    for tab in [*at_work, bench.tab]:
        bench.client.post(f"tabs/{tab}/close").raise_for_status()
    gc.collect()
    before, threads = resident_mb(), threading.active_count()
    bench.watch.lap()
    opened, most = [], 0
    for _ in range(TABS):
        opened.append(bench.client.post("tabs").json()["tab"])
        most = max(most, threading.active_count())
        if len(opened) > 8:
            bench.client.post(f"tabs/{opened.pop(0)}/close").raise_for_status()
    for tab in opened:
        bench.client.post(f"tabs/{tab}/close").raise_for_status()
    bench.note(f"{TABS} tabs opened and closed")
    time.sleep(2.0)
    gc.collect()
    left, more = resident_mb() - before, threading.active_count() - threads
    print(f"  left: {left:.0f} MB (limit {LEFT_MB}), {more} threads of at most {most - threads}")
    assert left <= LEFT_MB
    assert more <= 0
    return bench.rows


def main():
    """Run all parts, or the one named on the command line, and save the times."""
    with tempfile.TemporaryDirectory() as folder:
        rows = []
        if sys.argv[1:]:
            {"axes": six_axes, "tabs": many_tabs}[sys.argv[1]](folder)
            return
        for n in (1_000_000, 10_000_000):
            path = Path(folder) / f"{n}.npz"
            samples = parse_model(HIDDEN).simulate(n=n, rate=100.0, seed=1, unit="rad/s").samples
            np.savez(path, data=samples, rate_hz=100.0, unit="rad/s")
            bench = Bench(f"page, {n // 1_000_000} M samples", path)
            bench.first_view()
            if n == 1_000_000:
                bench.the_rest()
                bench.add()
                bench.add()
            rows += bench.rows
        rows += six_axes(folder) + many_tabs(folder)
        save(rows, "page")


if __name__ == "__main__":
    main()
