"""A page on a recording with two hidden effects."""

import numpy as np
import pytest

from allanite import Recording
from allanite.page.sessions import Sessions
from allanite.page.source import Source
from generators import gauss_markov, sinusoid, walk, white
from page_browser import BROWSERS, READY, launched
from page_sessions import client_of, opened

RATE, N = 20.0, 20_000


@pytest.fixture(scope="session")
def hidden():
    """N and K with a Gauss-Markov process and a line."""
    rng = np.random.default_rng(7)
    x = white(rng, N, RATE, 0.01) + walk(rng, N, RATE, 2e-5)
    x += gauss_markov(rng, N, RATE, 6e-3, 8.0) + sinusoid(N, RATE, 1.7, 0.006)
    return Recording(x, RATE, unit="rad/s", columns=["gyro"], path="hidden.npz")


@pytest.fixture
def sessions(hidden):
    sessions = Sessions([Source("hidden.npz", recording=hidden)], most_bytes=1_000_000)
    yield sessions
    sessions.uploads.close()


@pytest.fixture
def client(sessions):
    return client_of(sessions)


@pytest.fixture(scope="session")
def looked(hidden):
    """(client, sessions, tab, state) with a tab whose work is done, for tests that change nothing."""
    sessions = Sessions([Source("hidden.npz", recording=hidden)], most_bytes=1_000_000)
    client = client_of(sessions)
    yield client, sessions, *opened(client)
    sessions.uploads.close()


@pytest.fixture(scope="module", params=BROWSERS)
def browser(request):
    with launched(request.param) as browser:
        yield browser


@pytest.fixture
def context(browser):
    """A browser with its own storage."""
    context = browser.new_context(viewport={"width": 1280, "height": 720})
    context.set_default_timeout(60_000)
    yield context
    context.close()


@pytest.fixture
def tab(context, server):
    """The page of `server` in the browser, after the first fit and check."""
    tab = context.new_page()
    tab.goto(server.url)
    tab.wait_for_selector(READY)
    return tab
