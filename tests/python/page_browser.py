"""Browsers for tests of the page."""

import json
import shutil
from contextlib import contextmanager
from dataclasses import dataclass
from urllib.parse import unquote

import pytest

#: The page is idle, its figure is drawn, and a verdict is shown.
READY = "body[data-busy=false][data-drawn] #verdict b"
BROWSERS = {"chromium": ("chromium", "chromium-browser"), "firefox": ("firefox-esr", "firefox")}


#: How to install the Python packages of the browser tests.
INSTALL = "pip install --group test"


def serious_violations(tab, *where):
    """Texts of what axe-core calls serious or critical on a tab; the test is skipped without axe-core."""
    found = pytest.importorskip(
        "axe_playwright_python.sync_playwright", reason=f"no axe-playwright-python: {INSTALL}"
    )
    return [
        json.dumps([*where, v["id"], [n["html"][:140] for n in v["nodes"]][:3]])
        for v in found.Axe().run(tab).response["violations"]
        if v["impact"] in ("serious", "critical")
    ]


@contextmanager
def launched(name):
    """Context with a browser of the distribution; the test is skipped without it."""
    found = pytest.importorskip("playwright.sync_api", reason=f"no playwright: {INSTALL}")
    sync_playwright = found.sync_playwright
    path = next((found for one in BROWSERS[name] if (found := shutil.which(one))), None)
    if path is None:
        pytest.skip(f"no {name} (apt-get install {BROWSERS[name][0]})")
    with sync_playwright() as play:
        # A Firefox of the distribution is controlled by the standard protocol WebDriver BiDi.
        more = {"channel": "moz-firefox"} if name == "firefox" else {}
        try:
            browser = getattr(play, name).launch(executable_path=path, **more)
            browser.new_context().close()
        except Exception as error:
            if "unknown command" not in str(error):
                raise
            pytest.skip(
                f"{path} is too old for Playwright: apt-get update, and install 153 or newer"
            )
        yield browser
        browser.close()


def on_allan(tab):
    """Open the view with the Allan curve."""
    tab.locator("[data-tab=allan]").click()
    tab.wait_for_selector("body[data-drawn*=' allan ']")


@dataclass(frozen=True)
class Saved:
    """A file saved from the page: its name and contents."""

    name: str
    body: bytes


def saved(tab, button):
    """The file that a button of the menu saves."""
    tab.locator(".menu summary").click()
    press = tab.locator(f"#files {button}").click
    if button == "#export":
        # The verdict on the file appears before it can be saved.
        tab.wait_for_selector("#export:enabled")
    if tab.context.browser.browser_type.name == "chromium":
        with tab.expect_download() as download:
            press()
        return Saved(download.value.suggested_filename, download.value.path().read_bytes())
    # WebDriver BiDi reports no download of a file made in the page; the answer of the server is used instead.
    with tab.expect_response(lambda answer: "/file/" in answer.url) as answer:
        press()
    said = answer.value.headers["content-disposition"]
    return Saved(unquote(said.split("''")[1]), answer.value.body())


def give(tab, button, path):
    """Open a file by a button of the menu."""
    tab.locator(".menu summary").click()
    tab.locator(f"#files {button}").click()
    tab.set_input_files("#pick", path)
