"""What a person waits for on the page: the first view of a long log, and the new curve after Add.

Asked through the page's own API, in one process, as the browser asks. Seconds of the wall and, in brackets, of the processor.
"""

import tempfile
import time
import warnings
from pathlib import Path

import numpy as np

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


def until(client, tab, holds):
    """Ask for the state, as the page does, until it `holds`."""
    while True:
        state = client.get(f"tabs/{tab}").json()
        if state["job"]["error"] or state["problem"]:
            raise SystemExit(state["job"]["error"] or state["problem"])
        if holds(state):
            return state
        time.sleep(0.02)


def idle(state):
    return not state["job"]["busy"]


def report(what, passed):
    print(f"  {what:44s} {passed[0]:7.2f} s  ({passed[1]:.2f} s)")


def loop(name, path):
    """Open a log, look at each view, add the first suggestion."""
    print(name)
    desk = Desk([Source("log.npz", path)])
    client = TestClient(
        make_app(desk, "token", frozenset({HOST})), base_url=f"http://{HOST}/token/"
    )
    watch = Watch()
    tab = client.post("tabs").json()["tab"]
    until(client, tab, lambda s: s["recording"])
    report("read", watch.lap())
    first = Watch()
    client.get(f"tabs/{tab}/view/allan").raise_for_status()
    report("first view after that", first.lap())
    until(client, tab, lambda s: s["ladder"])
    client.get(f"tabs/{tab}/view/allan").raise_for_status()
    report("model and its curve, since it was read", watch.lap())
    state = until(client, tab, idle)
    report("what is missing", watch.lap())
    for view in ("allan", "psd", "map", "samples", "compare"):
        watch.lap()
        answer = client.get(f"tabs/{tab}/view/{view}")
        assert answer.status_code == 200, answer.text
        assert len(answer.content) <= MOST
        report(f"view {view}, {len(answer.content) / 1000:.0f} kB", watch.lap())
    client.post(f"tabs/{tab}/act", json={"do": "add", "number": state["cards"][0]["number"]})
    until(client, tab, lambda s: len(s["ladder"]) > 1)
    client.get(f"tabs/{tab}/view/allan").raise_for_status()
    report(f"Add {state['cards'][0]['name']}: the new curve", watch.lap())
    state = until(client, tab, idle)
    report("what is missing now", watch.lap())


def main():
    with tempfile.TemporaryDirectory() as folder:
        for n in (1_000_000, 10_000_000):
            path = Path(folder) / f"{n}.npz"
            samples = parse_model(HIDDEN).simulate(n=n, rate=100.0, seed=1, unit="rad/s").samples
            np.savez(path, data=samples, rate_hz=100.0, unit="rad/s")
            loop(f"{n // 1_000_000} M samples", path)


if __name__ == "__main__":
    main()
