"""The report in a browser: its first page says what was measured and what to do, and six axes are a small file."""

import pytest

from allanite.cli import main
from page_browser import BROWSERS, launched
from six_axes import six_axes, write_csv

pytestmark = [pytest.mark.browser, pytest.mark.long]

pytest.importorskip("matplotlib")

#: Height in px of a sheet of A4 at the width of the page of the test.
SHEET = {"width": 1000, "height": 1414}
NAMES = ("gyro_x", "gyro_y", "gyro_z", "acc_x", "acc_y", "acc_z")


@pytest.fixture(scope="module")
def six(tmp_path_factory):
    """Report on 20 s of six axes, with sensor, serial number and date."""
    folder = tmp_path_factory.mktemp("report")
    log = write_csv(six_axes(n=2000), folder / "six.csv")
    told = ["--sensor", "ACME-3", "--serial", "0042", "--date", "2026-11-28"]
    with pytest.raises(SystemExit) as ended:
        main(["report", str(log), *told, "--quiet", "-o", str(folder / "six.html")])
    assert ended.value.code == 0
    return folder / "six.html"


@pytest.fixture(scope="module", params=BROWSERS)
def tab(request, six):
    """The report in a window of the size of a sheet, and the addresses that it requested."""
    with launched(request.param) as browser:
        tab = browser.new_page(viewport=SHEET)
        tab.asked = []
        tab.on("request", lambda request: tab.asked.append(request.url))
        tab.goto(six.as_uri())
        yield tab


def test_six_axes_are_a_small_file_that_stands_by_itself(tab, six):
    assert six.stat().st_size < 600_000
    assert [url for url in tab.asked if not url.startswith(("file:", "data:"))] == []
    assert tab.locator("svg[role=img], figure svg").count() >= 12


def test_the_first_page_has_everything(tab):
    places = tab.evaluate(
        """() => {
          const bottom = n => n.getBoundingClientRect().bottom + scrollY, all = [...document.querySelectorAll("main *")];
          const of = text => bottom(all.filter(n => n.textContent.includes(text)).pop());
          const figure = document.querySelector("figure svg").getBoundingClientRect();
          const next = all.find(n => n.textContent === "Next step").nextElementSibling;
          return { told: ["ACME-3", "0042", "2026-11-28", "not logged", "20\u00a0s at 100\u00a0Hz"].map(
              text => Math.min(...all.filter(n => !n.children.length && n.textContent.includes(text)).map(bottom))),
            figure: [figure.top + scrollY, figure.bottom + scrollY, figure.width],
            next: bottom(next), words: next.textContent };
        }"""
    )
    assert max(places["told"]) < places["figure"][0] < places["figure"][1] < places["next"]
    assert places["next"] < SHEET["height"]
    assert places["figure"][2] > 0.6 * SHEET["width"]
    assert "allanite characterize" in places["words"]
    # Verdict and coefficients of each axis, in units of data sheets.
    rows = tab.locator("table").nth(1).locator("tbody tr").all_inner_texts()
    assert [row.split()[0] for row in rows] == list(NAMES)
    for row in rows:
        assert row.split()[1] in ("adequate", "unexplained", "fails", "within", "limited")
        assert ("°/√h" if row.startswith("gyro") else "m/s/√h") in row


def test_details_follow_and_links_lead_to_them(tab):
    first = tab.get_by_role("link", name="gyro_z")
    first.click()
    heading = tab.locator("#column-2")
    assert heading.inner_text() == "gyro_z"
    box = heading.bounding_box()
    assert -1 < box["y"] < SHEET["height"]
