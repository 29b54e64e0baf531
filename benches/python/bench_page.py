"""What a person waits for on the page: the first view of a long log, and the new curve after Add.

Asked through the page's own API, in one process, as the browser asks. Seconds of the wall; in brackets, of the processor.
"""

import tempfile
import time
import warnings
from pathlib import Path

import numpy as np
from side_by_side import save

from allanite import parse_model
from allanite.page.server import Desk, make_app
from allanite.page.source import Source

with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    from starlette.testclient import TestClient

HOST = "127.0.0.1:4711"
#: What a browser may be sent per view.
MOST = 300_000
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
        app = make_app(Desk([Source("log.npz", path)]), "token", hosts)
        self.client = TestClient(app, base_url=f"http://{HOST}/token/")
        self.watch = Watch()

    def note(self, what, since=None):
        wall, cpu = (since or self.watch).lap()
        self.rows.append((f"{self.title}: {what}", "allanite", wall, cpu / wall, ""))
        print(f"  {what:44s} {wall:7.2f} s  ({cpu:.2f} s)")

    def view(self, name):
        answer = self.client.get(f"tabs/{self.tab}/view/{name}")
        assert answer.status_code == 200, answer.text
        assert len(answer.content) <= MOST
        return len(answer.content)

    def until(self, holds):
        """The state, asked for as the page does, once it `holds`."""
        while True:
            state = self.client.get(f"tabs/{self.tab}").json()
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


def main():
    with tempfile.TemporaryDirectory() as folder:
        rows = []
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
        save(rows, "page")


if __name__ == "__main__":
    main()
