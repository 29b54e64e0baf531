"""The temperature law of an axis, the average of several units, and the date of a log on the page."""

import numpy as np
import pytest

from allanite import Recording, read
from allanite.page.sessions import Sessions
from allanite.page.source import Reading, Source
from generators import white
from page_browser import READY, launched, serious_violations
from page_sessions import act, client_of, opened

pytestmark = pytest.mark.slow

N = 4000


def warmed(seed, unit="deg/s"):
    """A gyroscope whose bias follows its temperature."""
    t = 25 + 20 * (1 - np.exp(-np.arange(N) / 800))
    x = 0.01 * t + white(np.random.default_rng(seed), N, 1.0, 0.05)
    return Recording(
        x,
        1.0,
        unit=unit,
        columns=["gyro"],
        covariates={"temperature": t},
        covariate_units={"temperature": "degC"},
        path=f"unit{seed}.npz",
    )


@pytest.fixture(scope="module")
def sessions():
    logs = [Source(f"unit{k}.npz", recording=warmed(k)) for k in (1, 2)]
    sessions = Sessions([*logs, Source("acc.npz", recording=warmed(3, "m/s^2"))])
    yield sessions
    sessions.uploads.close()


@pytest.fixture(scope="module")
def client(sessions):
    return client_of(sessions)


@pytest.fixture(scope="module")
def tab(client):
    return opened(client)[0]


def test_the_law_is_shown_and_saved_for_its_consumers(client, tab):
    view = client.get(f"tabs/{tab}/view/thermal").json()
    assert view["headline"].startswith("linear")
    assert "Temperature (°C)" in [
        a["title"]["text"] for k, a in view["layout"].items() if k == "xaxis"
    ]
    words = {"params": "TC_G", "parm": "INS_TCAL", "h": "gyro", "csv": "gyro", "json": "gyro"}
    for suffix, word in words.items():
        answer = client.get(f"tabs/{tab}/file/temperature-law.{suffix}")
        assert answer.status_code == 200
        assert word in answer.text


def test_averaging_needs_the_same_kind_of_sensor(client, tab):
    refused = client.get(f"tabs/{tab}/view/average")
    assert refused.status_code == 400
    assert "another log" in refused.json()["error"]
    act(client, tab, do="compare", log=2)
    refused = client.get(f"tabs/{tab}/view/average")
    assert refused.status_code == 400
    act(client, tab, do="compare", log=1)
    view = client.get(f"tabs/{tab}/view/average").json()
    assert view["headline"].startswith("2 units: averaging divides")


def test_the_date_and_uneven_times_of_a_log_reach_the_page(tmp_path):
    rng = np.random.default_rng(4)
    year = 2010.0 + (np.arange(600) + rng.uniform(-0.2, 0.2, 600)) / 365.25
    rows = "\n".join(f"{t:.6f},{x:.6f}" for t, x in zip(year, rng.normal(size=600), strict=True))
    path = tmp_path / "station.csv"
    path.write_text(f"decimal_year,east (m/s^2)\n{rows}\n")
    found, own = Source("station.csv", path).read(Reading()), read(path)
    assert own.epoch is not None
    assert own.times is not None
    assert found.epoch == own.epoch
    assert np.array_equal(found.times, own.times)


@pytest.mark.browser
@pytest.mark.long
@pytest.mark.parametrize("name", ["chromium", "firefox"])
def test_tabs_of_jobs_appear_where_they_apply(name):
    from allanite.page import open_page

    page = open_page([Source(f"unit{k}.npz", recording=warmed(k)) for k in (1, 2)]).start()
    with launched(name) as browser:
        tab = browser.new_page(viewport={"width": 1280, "height": 720})
        tab.goto(page.url)
        tab.wait_for_selector(READY)
        assert not tab.locator("[data-tab=average]").is_visible()
        tab.locator("[data-tab=thermal]").click()
        tab.wait_for_selector("body[data-drawn*=' thermal ']")
        assert tab.locator("#headline").inner_text().startswith("Linear")
        # On a phone the two panels are below each other.
        tab.set_viewport_size({"width": 390, "height": 844})
        tab.wait_for_function(
            "(l => l.xaxis._offset === l.xaxis2._offset)(document.getElementById('plot')._fullLayout)"
        )
        tab.set_viewport_size({"width": 1280, "height": 720})
        assert tab.get_by_role("button", name="ArduPilot").is_visible()
        tab.locator("[data-tab=compare]").click()
        tab.get_by_role("button", name="+ unit2.npz").click()
        tab.locator("[data-tab=average]").click()
        tab.wait_for_selector("body[data-drawn*=' average ']")
        assert "2 units" in tab.locator("#headline").inner_text()
    page.close()


@pytest.mark.browser
@pytest.mark.long
@pytest.mark.parametrize("name", ["chromium", "firefox"])
def test_axe_finds_nothing_serious_in_tabs_of_jobs(name):
    from allanite.page import open_page

    page = open_page([Source(f"unit{k}.npz", recording=warmed(k)) for k in (1, 2)]).start()
    wrong = []
    with launched(name) as browser:
        tab = browser.new_page()
        tab.goto(page.url)
        tab.wait_for_selector(READY)
        tab.locator("[data-tab=compare]").click()
        tab.get_by_role("button", name="+ unit2.npz").click()
        for view in ("thermal", "average"):
            tab.locator(f"[data-tab={view}]").click()
            tab.wait_for_selector(f"body[data-drawn*=' {view} ']")
            for scheme in ("light", "dark"):
                tab.emulate_media(color_scheme=scheme)
                for width, height in ((390, 844), (820, 1180), (1280, 720), (1920, 1080)):
                    tab.set_viewport_size({"width": width, "height": height})
                    tab.wait_for_timeout(300)
                    wrong += serious_violations(tab, view, scheme, width)
    page.close()
    assert wrong == []
