"""Details that a person notices: passing words, units of all axes at once, names for a screen reader, verdict of a file."""

import re

import numpy as np
import pytest

import allanite as al
from allanite.fit.rivals.undecided import Undecided
from allanite.page import open_page
from page_browser import READY, give
from six_axes import six_axes

pytestmark = [pytest.mark.browser, pytest.mark.long]


@pytest.fixture
def tab(context):
    page = al.explore(six_axes(n=4000), open_browser=False)
    tab = context.new_page()
    tab.goto(page.url)
    tab.wait_for_selector(READY)
    yield tab
    page.close()


def test_words_that_tell_what_happened_pass(tab):
    tab.keyboard.press("n")
    tab.get_by_role("button", name="Copy", exact=True).first.click()
    tab.wait_for_selector("#message:visible")
    tab.wait_for_selector("#message", state="hidden", timeout=20_000)
    # An error stays longer, and Esc closes it.
    tab.keyboard.press("m")
    tab.fill("#typed-model", "N + ZZ")
    tab.keyboard.press("Enter")
    tab.wait_for_selector("#message >> text=ZZ")
    tab.keyboard.press("Escape")
    tab.keyboard.press("Escape")
    tab.wait_for_selector("#message", state="hidden", timeout=5_000)


def test_every_figure_has_a_name_for_a_screen_reader(tab):
    names = {
        "allan": "Allan deviation",
        "psd": "Power spectral density",
        "map": "",
        "samples": "Samples",
        "compare": "Comparison",
        "error": "Error since the last fix",
        "nis": "Normalized innovation squared",
    }
    seen = set()
    for view, words in names.items():
        tab.locator(f"[data-tab={view}]").click()
        tab.wait_for_selector(f"body[data-drawn*=' {view} ']")

        label = tab.locator("#plot").get_attribute("aria-label")
        assert label.startswith(words)
        assert len(label) > 5
        seen.add(label)
    assert len(seen) == len(names)
    # A table is no figure: the name of the last figure is gone.
    tab.locator("[data-tab=axes]").click()
    tab.wait_for_selector("#table tbody")
    assert tab.locator("#plot").get_attribute("aria-label") == "No figure"
    # A canvas beside another has a name, too; each axis of the strip is named with its state.
    tab.locator("[data-tab=allan]").click()
    tab.locator("#two").click()
    tab.wait_for_selector("#second[data-drawn]")
    assert tab.locator("#plot2").get_attribute("aria-label").startswith("Power spectral density")
    labels = tab.locator(".axis").evaluate_all("all => all.map(a => a.getAttribute('aria-label'))")
    assert all(re.fullmatch(r"(gyro|acc)_[xyz]: [\w ]+", label) for label in labels)
    assert len(set(labels)) == 6


def test_units_are_set_for_all_axes_of_a_sensor_at_once(context, tmp_path):
    page = open_page([]).start()
    tab = context.new_page()
    tab.goto(page.url)
    rows = np.column_stack([np.arange(3000) / 100, six_axes(n=3000).samples])
    log = tmp_path / "bare.csv"
    np.savetxt(log, rows, delimiter=",", fmt="%.6f", comments="", header="time,gx,gy,gz,ax,ay,az")
    give(tab, "[data-pick=log]", log)
    tab.wait_for_selector("#form-columns [data-unit=ax]")
    for kind, unit in (("acceleration", "m/s^2"), ("angular rate", "deg/s")):
        tab.locator(f"[data-kind='{kind}']").select_option(unit, force=True)
    units = tab.locator("#form-columns [data-unit]").evaluate_all(
        "all => Object.fromEntries(all.map(s => [s.dataset.unit, s.value]))"
    )
    assert [units[f"a{k}"] for k in "xyz"] == ["m/s^2"] * 3
    assert [units[f"g{k}"] for k in "xyz"] == ["deg/s"] * 3
    # No select of the form is narrower than its words.
    cut = tab.locator("#form-columns [data-unit]").evaluate_all(
        "all => all.filter(s => s.getBoundingClientRect().right > s.closest('dialog').getBoundingClientRect().right)"
        ".map(s => s.dataset.unit)"
    )
    assert cut == []
    tab.locator("#form-read").click()
    tab.wait_for_selector(".chip:has-text('°/√h')")
    tab.locator("[data-axis='3']").click()
    tab.wait_for_selector(".chip:has-text('µg/√Hz'), .chip:has-text('m/s/√h')")
    page.close()


def test_all_axes_are_improved_from_the_menu_before_a_file_is_saved(tab):
    tab.locator(".menu summary").click()
    tab.wait_for_selector("#export-verdict p:not(.faint)")
    assert "not yet checked" in tab.inner_text("#export-verdict")
    tab.get_by_role("button", name="Improve all axes first").click()
    tab.wait_for_selector("body[data-busy=true]")
    tab.wait_for_selector("body[data-busy=false]", timeout=300_000)
    if not tab.locator("#export-verdict").is_visible():
        tab.locator(".menu summary").click()
    tab.wait_for_selector("#export:enabled")
    # The file is written again whenever the state of an axis changes.
    said = tab.locator("#export-verdict p:not(.faint)").first.inner_text()
    assert re.match(r"Use: (yes|no)\.", said)
    assert "not yet checked" not in said
    assert tab.locator(".axis.new").count() == 0


def test_alternatives_are_beside_the_numbers_that_they_change(tab, monkeypatch):
    monkeypatch.setattr(
        al.Study,
        "undecided",
        property(
            lambda study: Undecided(
                (("N+K", 0.6), ("N+B", 0.4)),
                tuple(
                    {
                        name: (0.2 * value.value, 5.0 * value.value)
                        for name, value in values.items()
                        if getattr(value, "value", 0.0)
                    }
                    for values in study.fit.estimates
                ),
            )
        ),
    )
    # Another unit is another state, which is made with the alternatives.
    tab.locator("#unit").select_option(label="SI: rad/s", force=True)
    tab.wait_for_selector(".chip >> text=over all alternatives")
    tab.locator("#unit").select_option(index=0, force=True)
    tab.wait_for_selector(".chip .text:has-text('°/√h')")
    low, high = map(
        float,
        re.search(
            r"([\d.]+)\s*…\s*([\d.]+)\s*over all alternatives",
            tab.locator(".chip[data-kind=angle_random_walk]").inner_text(),
        ).groups(),
    )
    value = float(
        tab.locator(".chip[data-kind=angle_random_walk] .text").first.inner_text().split()[0]
    )
    assert low < value < high
    alternatives = tab.get_by_label("Alternative explanations").inner_text()
    assert "cannot distinguish N+K (60\xa0%) from N+B (40\xa0%)" in alternatives
