"""The API under the page, without a browser; and everything that it refuses."""

import io
import json
import pickle
import time
import warnings

import numpy as np
import pytest

from allanite.page.server import Desk, make_app
from allanite.page.source import Source

with warnings.catch_warnings():
    # Newer versions of starlette would rather have the successor of httpx.
    warnings.simplefilter("ignore")
    from starlette.testclient import TestClient

TOKEN, HOST = "secret-token", "127.0.0.1:4711"
BASE = f"http://{HOST}/{TOKEN}/"


@pytest.fixture
def desk(hidden):
    desk = Desk([Source("hidden.npz", recording=hidden)], most_bytes=1_000_000)
    yield desk
    desk.uploads.close()


@pytest.fixture
def client(desk):
    return TestClient(make_app(desk, TOKEN, frozenset({HOST})), base_url=BASE)


def wait(client, tab, seconds=60.0):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        state = client.get(f"tabs/{tab}").json()
        if state["job"] and not state["job"]["busy"]:
            assert state["job"]["error"] is None
            return state
        time.sleep(0.05)
    raise AssertionError("the job does not end")


def opened(client):
    tab = client.post("tabs").json()["tab"]
    return tab, wait(client, tab)


def act(client, tab, **order):
    answer = client.post(f"tabs/{tab}/act", json=order)
    assert answer.status_code == 200, answer.text
    return wait(client, tab)


def test_the_loop(client):
    tab, state = opened(client)
    assert state["recording"]["unit"] == "rad/s"
    assert [c["kind"] for c in state["chips"]] == [
        "angle_random_walk",
        "bias_instability",
        "rate_random_walk",
    ]
    assert state["adequate"] is False
    assert state["where"]
    first = state["cards"][0]
    assert first["significant"]
    assert first["sentence"]
    added = act(client, tab, do="add", number=first["number"])
    assert [r["label"] for r in added["ladder"]][1] == f"+ {first['name']}"
    assert added["ladder"][1]["chi2"] < added["ladder"][0]["chi2"]
    second = act(client, tab, do="add", number=added["cards"][0]["number"])
    assert {"gauss_markov", "sinusoid"} <= {c["kind"] for c in second["chips"]}
    assert second["adequate"] is True
    assert second["ladder"][2]["held_out"] < second["ladder"][0]["held_out"]
    assert len(act(client, tab, do="undo")["ladder"]) == 2
    assert len(act(client, tab, do="redo")["ladder"]) == 3
    back = act(client, tab, do="go", rung=0)
    assert back["at"] == 0
    assert len(back["chips"]) == 3


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_views_are_small_and_plain(client, theme):
    tab, _ = opened(client)
    for name in ("allan", "psd", "map", "samples", "compare"):
        answer = client.get(f"tabs/{tab}/view/{name}?theme={theme}")
        assert answer.status_code == 200, answer.text
        assert len(answer.content) <= 300_000
        assert "NaN" not in answer.text
        assert answer.json()["data"]
    effects = [t.get("meta") for t in client.get(f"tabs/{tab}/view/allan").json()["data"]]
    assert {"effect-0", "effect-1", "effect-2"} <= set(effects)


def test_improve_runs_rung_by_rung(client):
    tab, _ = opened(client)
    state = act(client, tab, do="improve")
    assert state["adequate"] is True
    assert len(state["ladder"]) >= 3
    assert all(r["label"].startswith("+ ") for r in state["ladder"][1:])


def test_a_tried_value_changes_the_misfit_and_no_rung(client):
    tab, before = opened(client)
    value = before["chips"][0]["values"][0]
    assert value["name"] == "N"
    tried = act(client, tab, do="what-if", place=0, name="N", value=3 * value["number"])
    assert tried["preview"]["chi2"] > tried["preview"]["before"]
    assert len(tried["ladder"]) == 1
    assert tried["chips"][0]["values"][0]["number"] == pytest.approx(3 * value["number"], rel=1e-5)
    fitted = act(client, tab, do="fit-tried")
    # Fitted from a wrong start the likelihood ends where it did: its maximum is one.
    assert fitted["chips"][0]["values"][0]["number"] == pytest.approx(value["number"], rel=1e-3)


def test_a_held_value_stays(client):
    tab, _ = opened(client)
    state = act(client, tab, do="hold", place=0, name="N", value=0.02)
    held = state["chips"][0]["values"][0]
    assert (held["held"], held["number"]) == (True, 0.02)
    assert state["ladder"][1]["chi2"] > state["ladder"][0]["chi2"]
    free = act(client, tab, do="hold", place=0, name="N", value=None)
    assert free["chips"][0]["values"][0]["held"] is False


def test_tabs_do_not_disturb_each_other(client):
    (one, _), (two, _) = opened(client), opened(client)
    act(client, one, do="remove", place=2)
    assert len(client.get(f"tabs/{one}").json()["chips"]) == 2
    assert len(client.get(f"tabs/{two}").json()["chips"]) == 3


def test_a_study_is_saved_and_opened(client):
    tab, state = opened(client)
    act(client, tab, do="add", number=state["cards"][0]["number"])
    saved = client.get(f"tabs/{tab}/file/study.json").json()
    other, _ = opened(client)
    again = act(client, other, do="study", study=saved)
    assert [r["label"] for r in again["ladder"]] == [r["label"] for r in saved["ladder"]]
    assert again["ladder"][1]["chi2"] == pytest.approx(
        saved["ladder"][1]["misfit"]["reduced"], rel=1e-2
    )


def test_files(client):
    tab, _ = opened(client)
    assert client.get(f"tabs/{tab}/file/allan.svg").content.lstrip().startswith(b"<?xml")
    assert client.get(f"tabs/{tab}/file/psd.png?theme=dark").content.startswith(b"\x89PNG")
    assert "N" in client.get(f"tabs/{tab}/file/parameters.json").text
    report = client.get(f"tabs/{tab}/file/report.html")
    assert report.text.lstrip().lower().startswith("<!doctype html")
    refused = client.get(f"tabs/{tab}/file/passwd")
    assert refused.status_code == 400


def test_cancel_ends_the_work(client):
    tab = client.post("tabs").json()["tab"]
    client.post(f"tabs/{tab}/act", json={"do": "cancel"})
    state = wait(client, tab)
    assert state["ladder"] == [] or state["checked"] is False


# -- refusals


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
def test_strangers_are_refused(client, desk, path, headers, words):
    for method in (client.get, client.post):
        answer = method(path, headers=headers)
        assert answer.status_code == 403
        assert words in answer.text
        assert "\n" not in answer.text.strip()
    assert desk.tabs == {}


def test_the_page_forbids_everything_from_outside(client):
    answer = client.get("")
    assert "default-src 'none'" in answer.headers["content-security-policy"]
    assert answer.headers["referrer-policy"] == "no-referrer"
    assert "http" not in answer.text.replace("http-equiv", "")


def send(client, tab, name, content, **more):
    return client.post(f"tabs/{tab}/upload", params={"name": name}, content=content, **more)


def test_a_log_is_uploaded(client, hidden):
    tab, _ = opened(client)
    file = io.BytesIO()
    np.savez(file, data=np.asarray(hidden.samples[:20_000]), rate_hz=20.0, unit="rad/s")
    answer = send(client, tab, "mine.npz", file.getvalue())
    assert answer.status_code == 200, answer.text
    state = wait(client, tab)
    assert state["log"] == "mine.npz"
    assert state["recording"]["n"] == 20_000


def test_a_rate_that_is_missing_is_asked_for(client, hidden):
    tab, _ = opened(client)
    file = io.BytesIO()
    np.save(file, np.asarray(hidden.samples[:20_000]))
    assert send(client, tab, "bare.npy", file.getvalue()).status_code == 200
    state = wait(client, tab)
    assert "rate" in state["problem"]
    assert "allanite-page" not in state["problem"]
    state = act(client, tab, do="read", rate="20", unit="rad/s", quantity="rate")
    assert state["problem"] is None
    assert state["recording"]["rate"] == 20.0


def test_five_gigabytes_are_refused_before_they_are_read(client, desk):
    tab, _ = opened(client)
    answer = send(client, tab, "huge.csv", b"1\n", headers={"content-length": "5000000000"})
    assert answer.status_code == 413
    assert "allanite explore huge.csv" in answer.json()["error"]
    assert desk.uploads.files() == []


def test_an_endless_stream_is_cut_off(client, desk):
    tab, _ = opened(client)
    sent = 0

    def endless():
        nonlocal sent
        while sent < 5_000_000_000:
            sent += 65536
            yield b"1.0\n" * 16384

    limit = 20_000_000
    desk.most_bytes = limit

    def bounded():
        for piece in endless():
            yield piece
            if sent > 2 * limit:
                return

    answer = send(client, tab, "endless.csv", bounded())
    assert answer.status_code == 413
    assert desk.uploads.files() == []


class Bomb:
    def __reduce__(self):
        raise AssertionError("unpickled")


@pytest.mark.parametrize("suffix", ["npy", "npz"])
def test_a_pickle_is_refused(client, desk, suffix):
    tab, before = opened(client)
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
    assert desk.uploads.files() == []
    assert client.get(f"tabs/{tab}").json()["logs"] == before["logs"]


def test_a_bare_pickle_is_refused(client, desk):
    tab, _ = opened(client)
    answer = send(client, tab, "bomb.npy", pickle.dumps({"a": 1}))
    assert answer.status_code == 400
    assert desk.uploads.files() == []


@pytest.mark.parametrize(
    "name",
    ["../../etc/passwd", "/etc/passwd", "a\\b.csv", "C:x.csv", ".hidden", "", "a\x00b.csv", ".."],
)
def test_a_path_in_a_file_name_is_refused(client, desk, name):
    tab, _ = opened(client)
    answer = send(client, tab, name, b"1\n2\n")
    assert answer.status_code == 400
    assert "file name" in answer.json()["error"]
    assert desk.uploads.files() == []


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
        {"do": "study", "study": {"schema": "allanite/page-study/1", "ladder": [3]}},
        {"do": "study", "study": 5},
        {"do": "undo"},
    ],
)
def test_nonsense_is_one_line(client, order):
    tab, _ = opened(client)
    answer = client.post(f"tabs/{tab}/act", content=json.dumps(order))
    assert answer.status_code == 400
    assert "\n" not in answer.json()["error"]


def test_unknown_tab(client):
    assert "reload" in client.get("tabs/nobody").json()["error"]
