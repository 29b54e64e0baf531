"""Helpers that use the API of the page like a browser, in one process."""

import time
import warnings

from allanite.page.server import make_app

with warnings.catch_warnings():
    # Newer versions of starlette warn about httpx.
    warnings.simplefilter("ignore")
    from starlette.testclient import TestClient

TOKEN, HOST = "secret-token", "127.0.0.1:4711"
BASE = f"http://{HOST}/{TOKEN}/"


def client_of(sessions):
    """Test client of the page for these sessions."""
    return TestClient(make_app(sessions, TOKEN, frozenset({HOST})), base_url=BASE)


def until(client, tab, holds, seconds=60.0):
    """The state of a tab once the condition `holds(state)` is true."""
    end = time.monotonic() + seconds
    while not holds(state := client.get(f"tabs/{tab}").json()):
        assert time.monotonic() < end
        time.sleep(0.02)
    return state


def wait(client, tab, checked=True):
    """The state once the job is done; without `checked` only the first fit must be done."""

    def holds(state):
        return state["job"] and (
            not state["job"]["busy"]
            or (state["job"]["gives_way"] and state["ladder"] and not checked)
        )

    state = until(client, tab, holds)
    assert state["job"]["error"] is None
    return state


def opened(client, checked=True):
    """Key and state of a new tab once its job is done."""
    tab = client.post("tabs").json()["tab"]
    return tab, wait(client, tab, checked)


def act(client, tab, checked=True, **order):
    """The state after an action, once its job is done."""
    answer = client.post(f"tabs/{tab}/act", json=order)
    assert answer.status_code == 200, answer.text
    return wait(client, tab, checked)


def send(client, tab, name, content, **more):
    """Response to an upload."""
    return client.post(f"tabs/{tab}/upload", params={"name": name}, content=content, **more)
