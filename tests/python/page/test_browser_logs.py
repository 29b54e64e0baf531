"""Several logs in one strip, how far each axis has come, and what is good enough."""

import numpy as np
import pytest

from allanite import Recording
from allanite.page.server import Page
from allanite.page.source import Source
from generators import gauss_markov, walk, white
from page_browser import READY

RATE, N = 20.0, 24_000
pytestmark = [pytest.mark.browser, pytest.mark.slow]


@pytest.fixture(scope="module")
def server():
    rng = np.random.default_rng(5)
    plain = white(rng, N, RATE, 0.01) + walk(rng, N, RATE, 2e-5)
    lagging = white(rng, N, RATE, 0.02) + gauss_markov(rng, N, RATE, 1e-2, 8.0)
    logs = {"first.npz": [plain, lagging], "second.npz": [lagging, plain]}
    page = Page(
        [
            Source(
                name,
                recording=Recording(
                    np.column_stack(columns), RATE, unit="rad/s", columns=["gyro_x", "gyro_y"]
                ),
            )
            for name, columns in logs.items()
        ]
    ).start()
    yield page
    page.close()


def at(tab, axis):
    tab.wait_for_selector(f"[data-axis='{axis}'][aria-current]:not(.new):not(.fitted)")
    tab.wait_for_selector(READY)


def state(tab, selector):
    return tab.locator(f"{selector} .state > span").inner_text()


@pytest.mark.long
def test_logs_are_grouped_in_the_strip_and_each_axis_keeps_its_ladder(tab):
    assert tab.locator(".group").count() == 0
    tab.locator("[data-axis='1']").click()
    at(tab, 1)
    tab.locator("#improve").click()
    tab.wait_for_selector("#ladder li:nth-child(2)")
    tab.wait_for_selector("#verdict .good")
    tab.locator("#logs").select_option("1", force=True)
    tab.wait_for_selector("[data-other='0-1']")
    at(tab, 0)
    assert tab.locator(".group > .log").all_inner_texts() == ["first.npz", "second.npz"]
    assert tab.locator(".group path").count() == 4
    assert state(tab, "[data-other='0-1']") == "Adequate"
    assert state(tab, "[data-axis='0']") == "Fails"
    assert tab.locator("#ladder li").count() == 1
    # An axis of the other log is one click away, as it was left, with what can be undone there.
    tab.locator("[data-other='0-1']").click()
    at(tab, 1)
    assert tab.locator("#ladder li").count() == 2
    assert state(tab, "[data-other='1-0']") == "Fails"
    tab.keyboard.press("Control+z")
    tab.wait_for_selector("#ladder li:nth-child(2)", state="detached")
    assert tab.locator("#undo").is_disabled()


@pytest.mark.slow
def test_what_is_good_enough_is_said_and_shown(tab):
    tab.locator("[data-axis='1']").click()
    at(tab, 1)
    assert state(tab, "[data-axis='1']") == "Fails"
    tab.locator("#enough").select_option("10", force=True)
    tab.wait_for_selector("[data-axis='1'].within")
    assert state(tab, "[data-axis='1']") == "Within tolerance"
    assert "below 10\xa0%" in tab.inner_text("#verdict .good")
    # Suggestions are shown as before; there is nothing to improve.
    assert tab.locator(".card").count() > 0
    assert tab.locator("#improve").get_attribute("aria-disabled") == "true"
    tab.locator("[data-tab=axes]").click()
    tab.wait_for_selector("#table td.within")
    tab.locator("#enough").select_option("", force=True)
    tab.wait_for_selector("[data-axis='1'].fails")
