"""What a person waits for on the page: the first view of a long log, a zoom, the new curve after Add, the first step.

    python benches/python/bench_page.py [axes|tabs]

Asked through the page's own API, in one process, as the browser asks. Seconds of the wall; in brackets, of the processor.
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
from allanite.page.server import Sessions, make_app
from allanite.page.source import Source

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    from starlette.testclient import TestClient

HOST = "127.0.0.1:4711"
#: What a browser may be sent per view.
MOST = 300_000
#: Tabs that are opened and closed, and what may be left of them.
TABS, LEFT_MB = 200, 50
HIDDEN = "N(N=0.01)+B(B=0.002)+K(K=2e-5)+GM(correlation_time=8,q_c=6e-3)+SIN(frequency=1.7,amplitude=0.006)"


class Watch:
    """Seconds since the last lap."""

    def __init__(self):
        self.lap()

    def lap(self):
        wall, cpu = time.perf_counter(), time.process_time()
        passed = (wall - getattr(self, "wall", wall), cpu - getattr(self, "cpu", cpu))
        self.wall, self.cpu = wall, cpu
        return passed


class Bench:
    """A log on a page of its own, and what was waited for."""

    def __init__(self, title, path):
        print(title)
        self.title, self.rows = title, []
        hosts = frozenset({HOST})
        app = make_app(Sessions([Source("log.npz", path)]), "token", hosts)
        self.client = TestClient(app, base_url=f"http://{HOST}/token/")
        self.watch = Watch()

    def note(self, what, since=None):
        wall, cpu = (since or self.watch).lap()
        self.rows.append((f"{self.title}: {what}", "allanite", wall, cpu / wall, ""))
        print(f"  {what:44s} {wall:7.2f} s  ({cpu:.2f} s)")

    def get(self, path, **query):
        answer = self.client.get(f"tabs/{self.tab}{path}", params=query)
        assert answer.status_code == 200, answer.text
        assert len(answer.content) <= MOST, (path, len(answer.content))
        return answer

    def view(self, name, **query):
        return len(self.get(f"/view/{name}", **query).content)

    def until(self, holds):
        """The state, asked for as the page does, once it `holds`."""
        while True:
            state = self.get("").json()
            if state["job"]["error"] or state["problem"]:
                raise SystemExit(state["job"]["error"] or state["problem"])
            if holds(state):
                return state
            time.sleep(0.02)

    def first_view(self):
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
        self.until(lambda s: not s["job"]["busy"])
        self.note("what is missing")
        for name in ("allan", "psd", "map", "samples", "compare"):
            self.watch.lap()
            size = self.view(name)
            self.note(f"view {name}, {size / 1000:.0f} kB")

    def add(self):
        state = self.until(lambda s: not s["job"]["busy"])
        first, rungs = state["cards"][0], len(state["ladder"])
        self.watch.lap()
        order = {"do": "add", "number": first["number"]}
        self.client.post(f"tabs/{self.tab}/act", json=order).raise_for_status()
        self.until(lambda s: len(s["ladder"]) > rungs)
        self.view("allan")
        self.note(f"Add {first['name']}: the new curve")
        self.until(lambda s: not s["job"]["busy"])
        self.note("what is missing now")

    def zoom(self):
        """To a second of the samples, in the middle of the record."""
        middle = self.get("").json()["recording"]["duration"] / 2
        self.watch.lap()
        size = self.view("samples", **{"from": middle, "to": middle + 1.0})
        self.note(f"zoom to a second of samples, {size / 1000:.0f} kB")

    def improve(self):
        """Every axis; the first step that is shown."""
        self.until(lambda s: not s["job"]["busy"])
        self.watch.lap()
        order = {"do": "improve", "all": True}
        self.client.post(f"tabs/{self.tab}/act", json=order).raise_for_status()
        self.until(lambda s: len(s["ladder"]) > 1)
        self.note("improve: its first step")
        self.client.post(f"tabs/{self.tab}/act", json={"do": "cancel"}).raise_for_status()


def six_axes(folder, n=10_000_000):
    """A long log of six axes."""
    path = Path(folder) / "six.npz"
    made = parse_model(HIDDEN).simulate(n=n, rate=100.0, seed=1, unit="rad/s").samples
    # Shifted copies: other samples at each place, and one simulation instead of six.
    data = np.column_stack([np.roll(made, i * n // 7) for i in range(6)])
    np.savez(path, data=data, rate_hz=100.0, unit="rad/s")
    del made, data
    bench = Bench(f"page, {n // 1_000_000} M samples × 6 axes", path)
    bench.first_view()
    bench.zoom()
    bench.until(lambda s: not s["job"]["busy"])
    bench.note("what is missing")
    bench.get("/part/strip")
    bench.note("strip of all axes")
    bench.improve()
    bench.client.post(f"tabs/{bench.tab}/close").raise_for_status()
    return bench.rows


def resident_mb():
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096 / 1e6


def many_tabs(folder):
    """Tabs opened on a log of a million samples, looked at while ten others work, and closed."""
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
    print(f"  left: {left:.0f} MB (bar {LEFT_MB}), {more} threads of at most {most - threads}")
    assert left <= LEFT_MB
    assert more <= 0
    return bench.rows


def main():
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
