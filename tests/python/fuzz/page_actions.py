"""Random valid and damaged requests to a running page, and whether the page still answers afterwards.

An input is the seed of one request, which depends on the seed and on what the tab shows.
"""

import http.client
import json
import time
from collections import deque
from urllib.parse import quote, urlsplit

import numpy as np

import allanite as al

#: Longest answer, s; longest wait for work of which a next request needs the end, s.
PATIENCE, PAUSE = 20.0, 3.0
EFFECTS = [*(effect.short for effect in al.CATALOG), "COV(column=t)", "NOTHING"]
MODELS = [
    "N", "N+B+K", "N+GM", "N(N=[,0.5])+K", "N+GM(T=[0.1,1],q_c=[1e-9,1e9])", "N+SIN(f=7,A=0.1!)", "N+SIN(f=[1,9])",
    "N+B+K+GM+SIN", "N(N=[2,1])", "ZZ", "N+BW(order=2)", "N+BW(design=digital,order=3)", "N+X", "", "N" * 3000,
]  # fmt: skip
VALUES = [
    None, "", 0, 1, -1, 3, 0.02, 1e-300, 1e300, 1e400, -1e400, 10**400, float("nan"), "nan", "inf", "1e999", "x", True,
    [], {}, [[1]], "\ud800", "\u202e", "\x00", "é" * 3000, "0x10", "½", 2**63, 1.5, "7",
]  # fmt: skip
NAMES = [
    "N",
    "B",
    "K",
    "q_c",
    "correlation_time",
    "frequency",
    "amplitude",
    "phase",
    "order",
    "hold",
    "",
    None,
    3,
]
VIEWS = [
    "allan",
    "psd",
    "map",
    "samples",
    "compare",
    "axes",
    "error",
    "nis",
    "thermal",
    "average",
    "nothing",
]
PARTS = [
    "catalogue",
    "strip",
    "saved",
    "undecided",
    "common",
    "inspect",
    "table-allan",
    "table-nis",
    "table-x",
    "nothing",
]
FILES = [
    "study.json", "report.html", "kalibr.yaml", "parameters.json", "matlab.m", "ros.yaml", "gtsam_parameters.py", "noise.h",
    "allan.csv", "allan.svg", "psd.csv", "map.csv", "samples.csv", "error.csv", "nis.csv", "compare.csv", "../x", "x",
]  # fmt: skip
OPTIONS = {
    "theme": ["light", "dark", "red"], "from": VALUES, "to": VALUES, "kind": ["tdev", "mdev", "hdev", "x"],
    "grid": ["octave", "decade", "fine", "x"], "aided": VALUES, "until": VALUES, "unit": ["deg/s", "x"], "x": VALUES,
}  # fmt: skip


class Hand:
    """A user of a page who sends random requests: its server, open tabs and closed tabs."""

    def __init__(self):
        from allanite.page import open_page  # noqa: F401  # starlette is there
        from allanite.page.server import Page
        from allanite.page.source import Source

        rng = np.random.default_rng(1)
        log = al.Recording(
            rng.standard_normal((600, 3)).cumsum(axis=0) * [0, 0, 0.1] + rng.standard_normal((600, 3)),
            rate=100,
            unit=["deg/s", "deg/s", "m/s^2"],
            columns=["gx", "gy", "ax"],
            covariates={"t": np.linspace(20.0, 21.0, 600)},
            path="x.npz",
        )  # fmt: skip
        self.page = Page([Source("x.npz", recording=log), Source("y.npz", recording=log)]).start()
        self.url = urlsplit(self.page.url)
        self.tabs, self.gone = [], ["nobody", "%F0%9F%98%80"]
        self.said = deque(maxlen=12)
        self.study = None

    def ask(self, method, path, body=None):
        """Answer to one request: no server error, in time, and one visible line if the request is refused."""
        what = (method, path[:200], None if body is None else body[:300])
        if what not in list(self.said)[-1:]:
            self.said.append(what)
        line = http.client.HTTPConnection(self.url.hostname, self.url.port, timeout=PATIENCE)
        try:
            line.request(method, self.url.path + path, body)
            answer = line.getresponse()
            text = answer.read()
        except TimeoutError:
            raise AssertionError(f"no answer in {PATIENCE} s: {self.said}") from None
        finally:
            line.close()
        assert answer.status < 500, (answer.status, text[:300], self.said)
        if answer.status == 400:
            said = json.loads(text)["error"]
            assert said.isprintable(), (said, self.said)
            assert len(said) <= 400, (said, self.said)
            assert "cannot be done with what was sent" not in said, (said, self.said)
        return answer.status, text

    def state(self, tab):
        """State of a tab, which must not contain an internal error."""
        status, text = self.ask("GET", f"tabs/{tab}")
        assert status == 200, (text, self.said)
        state = json.loads(text)
        error = (state.get("job") or {}).get("error") or ""
        assert "went wrong inside" not in error, (error, self.said)
        return state

    def at_rest(self, tab):
        """State of a tab after its job is done, or after a time limit."""
        end = time.monotonic() + PAUSE
        while True:
            state = self.state(tab)
            job = state.get("job") or {}
            if not job.get("busy") or job.get("gives_way") or time.monotonic() > end:
                return state
            time.sleep(0.02)

    def one(self, rng):
        """Send one request of a random kind."""
        if not self.tabs:
            self.tabs.append(json.loads(self.ask("POST", "tabs")[1])["tab"])
            self.at_rest(self.tabs[-1])
        tab = self.tabs[rng.integers(len(self.tabs))]
        kind = rng.random()
        if kind < 0.55:
            self.act(rng, tab, order(rng, self.at_rest(tab), self.study))
        elif kind < 0.7:
            self.act(rng, tab, damaged_order(rng, order(rng, self.state(tab), self.study)))
        elif kind < 0.78:
            self.ask("POST", f"tabs/{tab}/act", broken(rng))
        elif kind < 0.9:
            folder, names = [("view", VIEWS), ("part", PARTS), ("file", FILES)][rng.integers(3)]
            status, text = self.ask(
                "GET", f"tabs/{tab}/{folder}/{quote(pick(rng, names), safe='')}?{asked(rng)}"
            )
            if status == 200 and text[:30].startswith(b'{\n "schema": "allanite/page-st'):
                self.study = json.loads(text)
        else:
            self.tabs_come_and_go(rng, tab)
        if tab in self.tabs and rng.random() < 0.05:
            self.act(rng, tab, {"do": "cancel"})

    def act(self, rng, tab, what):
        self.ask("POST", f"tabs/{tab}/act", json.dumps(what).encode("utf-8", "surrogatepass"))
        if rng.random() < 0.5:
            self.state(tab)

    def tabs_come_and_go(self, rng, tab):
        match int(rng.integers(7)):
            case 0 if len(self.tabs) < 4:
                self.tabs.append(json.loads(self.ask("POST", "tabs")[1])["tab"])
            case 1:
                self.ask("POST", f"tabs/{tab}/close")
                self.tabs.remove(tab)
                self.gone.append(tab)
            case 2:
                self.ask("POST", f"tabs/{tab}/leave")
                self.ask("POST", f"tabs/{tab}/resume")
            case 3:
                self.ask("POST", f"tabs/{tab}/resume")
            case 4:
                name = pick(rng, ["z.csv", "z.npz", "../z", "", "z.json", "\u202e.csv"])
                role = pick(rng, ["log", "compare", "sheet", "x"])
                rows = b"t,gx [deg/s]\n" + b"".join(
                    b"%g,%g\n" % (k / 100, v) for k, v in enumerate(rng.standard_normal(64))
                )
                self.ask(
                    "POST",
                    f"tabs/{tab}/upload?name={quote(name)}&as={role}",
                    pick(rng, [rows, b"", b"\x00\xff", rows[: rng.integers(200)]]),
                )
            case _:
                gone = pick(rng, self.gone)
                way = pick(
                    rng,
                    [
                        "",
                        "/act",
                        "/close",
                        "/leave",
                        "/resume",
                        "/view/allan",
                        "/part/axes",
                        "/file/study.json",
                    ],
                )
                self.ask(
                    "POST" if way in {"/act", "/close", "/leave", "/resume"} else "GET",
                    f"tabs/{gone}{way}",
                    b"{}" if way == "/act" else None,
                )


def pick(rng, some):
    return some[int(rng.integers(len(some)))]


def asked(rng):
    """Random options of a view, a part or a file."""
    some = [pick(rng, list(OPTIONS)) for _ in range(rng.integers(4))]
    return "&".join(
        f"{k}={quote(str(pick(rng, OPTIONS[k])).encode('utf-8', 'replace'))}" for k in some
    )


def order(rng, state, study):
    """A random action that is possible with what the tab shows."""
    chips = state.get("chips") or []
    place = int(rng.integers(len(chips))) if chips else 0
    values = [v for v in chips[place]["values"] if v["free"]] if chips else []
    value = pick(rng, values) if values else {"name": "N", "number": 1.0}
    one = {"place": place, "name": value["name"]}
    about = value["number"] * float(10.0 ** rng.normal(0.0, 0.5))
    logs, columns = state.get("logs") or [""], (state.get("recording") or {}).get("columns") or [""]
    rungs = len(state.get("ladder") or [])
    times = sorted(float(t) for t in rng.uniform(0.0, 6.0, 2))
    orders = [
        {"do": "add", "number": int(rng.integers(4))},
        {"do": "remove", "place": place},
        {"do": "back", "place": int(rng.integers(2))},
        {"do": "put", "effect": pick(rng, EFFECTS)},
        {"do": "hold", **one, "value": pick(rng, [None, value["number"], about])},
        {"do": "limits", **one, "low": pick(rng, [None, about / 2, about]), "high": pick(rng, [None, about, 2 * about])},
        {"do": "what-if", **one, "value": about},
        {"do": "fit-tried"}, {"do": "drop"},
        {"do": "model", "model": pick(rng, MODELS)},
        {"do": "improve"}, {"do": "improve", "all": True}, {"do": "cancel"}, {"do": "check"},
        {"do": "undo"}, {"do": "redo"}, {"do": "undo"}, {"do": "go", "rung": int(rng.integers(max(1, rungs)))},
        {"do": "beside", "rung": pick(rng, [None, 0, 1])},
        {"do": "column", "column": int(rng.integers(len(columns)))},
        {"do": "unit", "unit": pick(rng, [None, "deg/h", "data sheet", "mg"])},
        {"do": "tolerance", "percent": pick(rng, [None, 5, 1])},
        {"do": "take", "from": times[0], "to": times[1]}, {"do": "take"},
        {"do": "leave-out", "from": times[0], "to": times[1]}, {"do": "put-back", "number": 0},
        {"do": "open", "log": int(rng.integers(len(logs)))},
        {"do": "read", "rate": pick(rng, [100, 50]), "columns": ["gx"], "units": {"gx": "deg/s"}},
        {"do": "rate", "rate": 100.0}, {"do": "compare", "log": int(rng.integers(len(logs)))},
        {"do": "alone", "name": pick(rng, [None, "y.npz gx"])}, {"do": "study", "study": study},
    ]  # fmt: skip
    return pick(rng, orders)


def damaged_order(rng, what):
    """An action with a value, a name or a part of its study that does not belong there."""
    what = json.loads(json.dumps(what))
    spots, inside = [], deque([what])
    while inside:
        node = inside.popleft()
        keys = list(node) if isinstance(node, dict) else range(len(node))
        for key in keys:
            # What is to be done is left alone for the most part: else nothing else would be looked at.
            if key != "do" or rng.random() < 0.1:
                spots.append((node, key))
            if isinstance(node[key], dict | list):
                inside.append(node[key])
    for _ in range(int(rng.integers(1, 3)) if spots else 0):
        node, key = pick(rng, spots)
        if rng.random() < 0.2 and isinstance(node, dict):
            node.pop(key, None)
        else:
            node[key] = pick(rng, NAMES) if key == "name" else pick(rng, VALUES)
    return what


def broken(rng):
    """A body that is no action."""
    deep = int(rng.choice([50, 500, 100_000]))
    return pick(rng, [
        b"", b"{", b"[]", b"null", b"3", b"\xff\xfe", b'{"do":"undo"', b"[" * deep + b"]" * deep,
        b'{"a":' * deep + b"1" + b"}" * deep,
        b'{"do":"\\ud800"}', b'{"do":"put","effect":"\\ud83d"}', b'{"do":"hold","place":NaN,"name":"N"}',
        b'{"do":"hold","place":0,"name":"N","value":-Infinity}', b'{"do":"go","rung":' + b"9" * 5000 + b"}",
        b'{"do":"model","model":"N(N=' + b"9" * 1900 + b')"}', b'{"do":"study","study":' + b"[" * deep + b"]" * deep + b"}",
        b'{"do":["undo"]}', b'{"do":{"undo":1}}', b'{"do":"limits","place":1e99,"name":"N","low":1}', b" " * 1_000_000,
    ])  # fmt: skip
