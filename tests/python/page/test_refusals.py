"""Everything that the API under the page refuses: with a clear message, and nothing written."""

import io
import json
import pickle

import numpy as np
import pytest

from allanite.page.sessions import Sessions
from allanite.page.source import Source
from moving_records import hand
from page_sessions import BASE, HOST, TOKEN, act, client_of, opened, send


@pytest.mark.parametrize(
    ("path", "headers", "words"),
    [
        (BASE, {"host": "evil.example"}, "host"),
        (BASE, {"host": "127.0.0.1:80"}, "host"),
        (BASE, {"origin": "https://evil.example"}, "origin"),
        (BASE, {"origin": "null"}, "origin"),
        (f"http://{HOST}/", {}, "token"),
        (f"http://{HOST}/wrong-token/", {}, "token"),
        (f"http://{HOST}/{TOKEN}x/tabs", {}, "token"),
    ],
)
def test_strangers_are_refused(client, sessions, path, headers, words):
    for method in (client.get, client.post):
        answer = method(path, headers=headers)
        assert answer.status_code == 403
        assert words in answer.text
        assert "\n" not in answer.text.strip()
    assert sessions.tabs == {}


def test_the_page_forbids_everything_from_outside(client):
    answer = client.get("")
    assert "default-src 'none'" in answer.headers["content-security-policy"]
    assert answer.headers["referrer-policy"] == "same-origin"
    assert "http" not in answer.text.replace("http-equiv", "")


def test_five_gigabytes_are_refused_before_they_are_read(looked):
    client, sessions, tab, _ = looked
    answer = send(client, tab, "huge.csv", b"1\n", headers={"content-length": "5000000000"})
    assert answer.status_code == 413
    assert "allanite explore huge.csv" in answer.json()["error"]
    assert sessions.uploads.files() == []


def test_an_endless_stream_is_cut_off(client, sessions):
    tab = client.post("tabs").json()["tab"]
    sent = 0

    def endless():
        nonlocal sent
        while sent < 5_000_000_000:
            sent += 65536
            yield b"1.0\n" * 16384

    limit = 20_000_000
    sessions.max_bytes = limit

    def bounded():
        for piece in endless():
            yield piece
            if sent > 2 * limit:
                return

    answer = send(client, tab, "endless.csv", bounded())
    assert answer.status_code == 413
    assert sessions.uploads.files() == []


class Bomb:
    def __reduce__(self):
        raise AssertionError("unpickled")


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["npy", "npz"])
def test_a_pickle_is_refused(looked, suffix):
    client, sessions, tab, before = looked
    file = io.BytesIO()
    objects = np.array([{"a": 1}, None], dtype=object)
    if suffix == "npy":
        np.save(file, objects, allow_pickle=True)
    else:
        np.savez(file, data=objects)
    answer = send(client, tab, f"bomb.{suffix}", file.getvalue())
    assert answer.status_code == 400
    assert "pickled objects" in answer.json()["error"]
    assert f"bomb.{suffix}" in answer.json()["error"]
    assert sessions.uploads.files() == []
    assert client.get(f"tabs/{tab}").json()["logs"] == before["logs"]


@pytest.mark.slow
def test_a_bare_pickle_is_refused(looked):
    client, sessions, tab, _ = looked
    answer = send(client, tab, "bomb.npy", pickle.dumps({"a": 1}))
    assert answer.status_code == 400
    assert sessions.uploads.files() == []


@pytest.mark.parametrize(
    "name",
    ["../../etc/passwd", "/etc/passwd", "a\\b.csv", "C:x.csv", ".hidden", "", "a\x00b.csv", ".."],
)
def test_a_path_in_a_file_name_is_refused(looked, name):
    client, sessions, tab, _ = looked
    answer = send(client, tab, name, b"1\n2\n")
    assert answer.status_code == 400
    assert "file name" in answer.json()["error"]
    assert sessions.uploads.files() == []


@pytest.mark.parametrize(
    "order",
    [
        [],
        {"do": "boom"},
        {"do": "add", "number": 99},
        {"do": "add", "number": "0"},
        {"do": "remove", "place": -1},
        {"do": "model", "model": "/etc/passwd"},
        {"do": "model", "model": ""},
        {"do": "column", "column": 7},
        {"do": "go", "rung": 5},
        {"do": "what-if", "place": 0, "name": "hold", "value": 1},
        {"do": "what-if", "place": 0, "name": "N", "value": "x"},
        {"do": "limits", "place": 0, "name": "N", "low": 2, "high": 1},
        {"do": "limits", "place": 0, "name": "N", "low": 1, "high": 1},
        {"do": "limits", "place": 0, "name": "N", "low": "nan"},
        {"do": "limits", "place": 0, "name": "hold", "low": 1},
        {"do": "limits", "place": 9, "name": "N", "low": 1},
        {"do": "study", "study": {"schema": "allanite/page-study/1", "ladder": [3]}},
        {"do": "study", "study": 5},
        {"do": "undo"},
        {"do": "unit", "unit": "m/s^2"},
        {"do": "unit", "unit": 3},
        {"do": "open", "log": 5},
        {"do": "compare", "log": -1},
        {"do": "beside", "rung": 9},
        {"do": "beside", "rung": "0"},
        {"do": "study", "study": {"schema": "allanite/page-study/2", "axes": [], "span": "x"}},
    ],
)
def test_nonsense_is_one_line(looked, order):
    client, _, tab, _ = looked
    answer = client.post(f"tabs/{tab}/act", content=json.dumps(order))
    assert answer.status_code == 400
    assert "\n" not in answer.json()["error"]


def test_unknown_tab(client):
    assert "reload" in client.get("tabs/nobody").json()["error"]


def test_a_log_in_motion_is_not_fitted_until_it_is_asked_for():
    moving = hand(3, rate=50, seconds=120, only=("gyro_x", "gyro_y", "gyro_z"))
    x = np.array(moving.samples)
    x[:1500] = np.random.default_rng(1).standard_normal((1500, 3)) * 0.05
    log = type(moving)(x, moving.rate, unit=moving.units, columns=moving.columns, path="moving.npz")
    sessions = Sessions([Source("moving.npz", recording=log)])
    client = client_of(sessions)
    tab, state = opened(client)
    assert state["moving"]
    assert "not at rest" in state["problem"]
    assert "longest quiet segment" in state["problem"]
    assert state["ladder"] == []
    quiet = act(client, tab, checked=False, do="motion", how="quiet")
    assert (quiet["problem"], quiet["moving"]) == (None, False)
    assert 20 < sessions.tabs[tab].log.duration < 31
    whole = act(client, tab, checked=False, do="motion", how="anyway")
    assert whole["problem"] is None
    assert whole["ladder"]
    answer = client.post(f"tabs/{tab}/act", json={"do": "motion", "how": "so"})
    assert answer.status_code != 200
