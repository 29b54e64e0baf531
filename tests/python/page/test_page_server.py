"""What the page's server survives: damaged logs, nonsense, tabs that are left."""

import gc
import json
import threading
import time
import weakref

import numpy as np
import pytest

import allanite as al
from allanite.common import child_process
from allanite.common.read_options import ReadOptions
from allanite.deviation import ESTIMATORS
from allanite.page import child
from allanite.page import sessions as sessions_module
from allanite.page.sessions import MAX_SILENCE_S
from allanite.page.shown.deviations import KINDS, deviation_figure
from allanite.page.work import Work
from page_sessions import act, opened, send, until, wait

DEEP = "[" * 100_000 + "]" * 100_000


@pytest.mark.parametrize(
    "body",
    [
        DEEP,
        '{"do": "study", "study": ' + "[" * 900 + "]" * 900 + "}",
        '{"do": "\\ud800"}',
        '{"do": "model", "model": "\\udfff"}',
        '{"do": "put", "effect": "N+B"}',
        '{"do": "put", "effect": "\\u0000"}',
        '{"do": "back", "place": 0}',
        '{"do": "take", "from": 5, "to": 5}',
        '{"do": "take", "from": 1e400, "to": 1}',
        '{"do": "rate", "rate": 1}',
        '{"do": "read", "columns": [1]}',
        '{"do": "read", "units": {"gyro": "parsec"}}',
        '{"do": "what-if", "place": 0, "name": "N", "value": 1' + "0" * 400 + "}",
        "\xff\xfe",
        "nul",
    ],
)
def test_nonsense_is_400(looked, body):
    client, _, tab, _ = looked
    answer = client.post(f"tabs/{tab}/act", content=body)
    assert answer.status_code == 400
    assert "\n" not in answer.json()["error"]


def test_views_and_parts_refuse_nonsense(looked):
    client, _, tab, _ = looked
    for path in (
        "view/samples?from=x",
        "view/samples?from=9&to=2",
        "view/error?aided=-1",
        "view/error?aided=nan",
        "view/nothing",
        "view/allan?theme=pink",
        "view/allan?kind=theo1",
        "view/allan?grid=all",
        "part/table-allan?kind=boom",
        "part/nothing",
        "part/table-nothing",
        "part/inspect",
        "file/..%2Fx",
    ):
        answer = client.get(f"tabs/{tab}/{path}")
        assert answer.status_code in (400, 404), path


def test_a_reader_that_dies_takes_nothing_with_it(client, sessions, monkeypatch, tmp_path):
    """A process that aborts while it reads a file prints nothing; the page reports it."""
    tab, before = opened(client, checked=False)
    # A stand-in for the interpreter, which dies as a crash in a C library would.
    stand_in = tmp_path / "python"
    stand_in.write_text("#!/bin/sh\nkill -SEGV $$\n")
    stand_in.chmod(0o755)
    monkeypatch.setattr(child_process.sys, "executable", str(stand_in))
    answer = send(client, tab, "crash.mat", b"MATLAB 5.0")
    assert answer.status_code == 400
    assert "crash.mat" in answer.json()["error"]
    assert "damaged" in answer.json()["error"]
    assert sessions.uploads.files() == []
    assert client.get(f"tabs/{tab}").json()["log"] == before["log"]


@pytest.mark.slow
def test_a_damaged_matlab_file_is_one_line(looked):
    client, sessions, tab, _ = looked
    body = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + b"\x0e\x00\x00\x00\xff\xff\xff\x7f"
    answer = send(client, tab, "damaged.mat", body + b"\x00" * 64)
    assert answer.status_code == 400
    assert "damaged.mat" in answer.json()["error"]
    assert sessions.uploads.files() == []


def test_a_reader_can_be_ended(tmp_path):
    path = tmp_path / "a.npz"
    np.savez(path, data=np.zeros((10, 1)), rate_hz=1.0)

    class Enough(Exception):
        pass

    def watch():
        raise Enough

    with pytest.raises(Enough):
        child.read_in_child(path, ReadOptions(), {}, watch)


@pytest.mark.slow
def test_a_page_that_is_loaded_again_goes_on(client, sessions):
    tab, state = opened(client)
    act(client, tab, checked=False, do="add", number=state["cards"][0]["number"])
    assert client.post(f"tabs/{tab}/leave").status_code == 200
    assert sessions.tabs[tab].busy is False
    assert client.post(f"tabs/{tab}/resume").status_code == 200
    assert len(client.get(f"tabs/{tab}").json()["ladder"]) == 2
    # Nobody else takes up a tab that is in use.
    assert client.post(f"tabs/{tab}/resume").status_code == 400


@pytest.mark.slow
def test_work_ends_when_the_page_is_left_and_is_taken_up_again(client, sessions):
    tab = client.post("tabs").json()["tab"]
    until(client, tab, lambda s: s["ladder"])
    job = sessions.tabs[tab].job
    client.post(f"tabs/{tab}/leave")
    job.wait(5.0)
    assert not job.busy
    client.post(f"tabs/{tab}/resume")
    assert wait(client, tab)["checked"] is True


@pytest.mark.slow
def test_what_is_left_is_forgotten(client, sessions, monkeypatch):
    tab, _ = opened(client, checked=False)
    client.post(f"tabs/{tab}/leave")
    sessions.tabs[tab].last_request -= MAX_SILENCE_S
    sessions.delete_silent_tabs()
    assert sessions.tabs == {}


@pytest.mark.long
def test_many_tabs_leave_no_threads_behind(client, sessions, monkeypatch):
    """Twice as many tabs as are kept (eight, to be quick): a closed tab ends its thread."""
    most = 8
    monkeypatch.setattr(sessions_module, "MAX_TABS", most)
    before = threading.active_count()
    for _ in range(2 * most):
        client.post("tabs")
    assert len(sessions.tabs) == most
    for key in list(sessions.tabs):
        client.post(f"tabs/{key}/close")
    end = time.monotonic() + 30.0
    while threading.active_count() > before + 4 and time.monotonic() < end:
        time.sleep(0.1)
    assert threading.active_count() <= before + 4


@pytest.mark.slow
def test_progress_moves_and_says_what_is_tried(client):
    tab = client.post("tabs").json()["tab"]
    seen = set()
    end = time.monotonic() + 60.0
    while time.monotonic() < end:
        job = client.get(f"tabs/{tab}?seen=-1").json()["job"]
        seen.add((job["name"], job["done"], job["seconds"]))
        if not job["busy"]:
            break
        time.sleep(0.05)
    names = " ".join(name for name, _, _ in seen)
    assert "N+B+K" in names
    assert len(seen) > 3


def test_a_study_of_another_log_is_refused(client):
    tab, _ = opened(client, checked=False)
    saved = client.get(f"tabs/{tab}/part/saved").json()
    saved["axes"][0]["column"] = "nowhere"
    answer = client.post(f"tabs/{tab}/act", content=json.dumps({"do": "study", "study": saved}))
    assert answer.status_code == 400
    assert "nowhere" in answer.json()["error"]


def test_another_deviation_is_kept_as_long_as_the_log_and_no_longer():
    samples = np.random.default_rng(1).standard_normal(5000)
    work = Work(al.Recording(samples, rate=10.0, unit="rad/s"))
    held = weakref.ref(work.recording.samples)
    options = {"kind": "hdev"}
    figures = [deviation_figure(work.log(0), None, options, work.deviations) for _ in range(2)]
    assert len(work.deviations) == 1
    assert figures[0].panels[0].marks[0].x is not None
    del work, samples, figures
    gc.collect()
    assert held() is None


@pytest.mark.parametrize("kind", list(KINDS)[1:])
def test_every_offered_deviation_is_drawn(kind):
    log = al.Recording(np.random.default_rng(2).standard_normal(500), rate=10.0, unit="rad/s")
    figure = deviation_figure(log, None, {"kind": kind}, {})
    assert figure.title.lower() == ESTIMATORS[kind].title.lower()
    assert np.isfinite(figure.panels[0].marks[0].low).any()
