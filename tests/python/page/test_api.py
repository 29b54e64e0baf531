"""The API under the page, without a browser."""

import io
import json
import threading

import numpy as np
import pytest

import allanite as al
from allanite import Recording
from allanite.common.documents import jsonable
from allanite.page import tab_state as bench_module
from allanite.page.jobs import Job
from allanite.page.sessions import Sessions
from allanite.page.shown.catalogue import GROUPS, catalogue
from allanite.page.shown.views import view
from allanite.page.source import Source
from allanite.page.tab import Tab
from allanite.page.work import ColumnSteps, Step, Work
from allanite.plots.themes import COMPONENTS, theme_of
from allanite.study import Rung
from page_sessions import act, client_of, opened, send, until, wait


@pytest.mark.slow
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
    # Each step leads with what is left of the first one's misfit.
    left = [r["left"] for r in second["ladder"]]
    assert left[0] == 100.0
    assert left[2] < left[1] < left[0]
    assert second["ladder"][2]["predictive"] < second["ladder"][0]["predictive"]
    assert len(act(client, tab, checked=False, do="undo")["ladder"]) == 2
    assert len(act(client, tab, checked=False, do="redo")["ladder"]) == 3
    back = act(client, tab, checked=False, do="go", rung=0)
    assert back["at"] == 0
    assert len(back["chips"]) == 3


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_views_are_small_and_plain(looked, theme):
    client, _, tab, _ = looked
    for name in ("allan", "psd", "map", "samples", "compare", "error", "nis"):
        answer = client.get(f"tabs/{tab}/view/{name}?theme={theme}")
        assert answer.status_code == 200, answer.text
        assert len(answer.content) <= 300_000
        assert "NaN" not in answer.text
        assert answer.json()["data"]
    effects = [t.get("meta") for t in client.get(f"tabs/{tab}/view/allan").json()["data"]]
    assert {"effect-0", "effect-1", "limit-2"} <= set(effects)


@pytest.mark.long
def test_improve_runs_rung_by_rung(client):
    tab, _ = opened(client)
    state = act(client, tab, do="improve")
    assert state["adequate"] is True
    # One step may make two changes: the line is added, and the Gauss–Markov process replaces another effect.
    assert len(state["ladder"]) >= 2
    assert {"gauss_markov", "sinusoid"} <= {c["kind"] for c in state["chips"]}
    assert all(r["label"].startswith("+ ") for r in state["ladder"][1:])
    told = " ".join(r["label"] for r in state["ladder"])
    assert "+ Gauss-Markov process" in told
    assert "+ sinusoid" in told


def test_a_tried_value_changes_the_misfit_and_no_rung(client):
    tab, before = opened(client, checked=False)
    value = before["chips"][0]["values"][0]
    assert value["name"] == "N"
    tried = act(
        client, tab, checked=False, do="what-if", place=0, name="N", value=3 * value["number"]
    )
    assert tried["preview"]["chi2"] > tried["preview"]["before"]
    assert len(tried["ladder"]) == 1
    assert tried["chips"][0]["values"][0]["number"] == pytest.approx(3 * value["number"], rel=1e-5)
    fitted = act(client, tab, checked=False, do="fit-tried")
    # Fitted from a wrong start the likelihood ends where it did: its maximum is one.
    assert fitted["chips"][0]["values"][0]["number"] == pytest.approx(value["number"], rel=1e-3)


def test_a_held_value_stays(client):
    tab, _ = opened(client, checked=False)
    state = act(client, tab, checked=False, do="hold", place=0, name="N", value=0.02)
    held = state["chips"][0]["values"][0]
    assert (held["held"], held["number"]) == (True, 0.02)
    assert state["ladder"][1]["chi2"] > state["ladder"][0]["chi2"]
    free = act(client, tab, checked=False, do="hold", place=0, name="N", value=None)
    assert free["chips"][0]["values"][0]["held"] is False


@pytest.mark.long
def test_limits_are_set_shown_saved_undone_and_lifted(client):
    tab, before = opened(client, checked=False)
    free = before["chips"][0]["values"][0]
    assert (free["limits"], free["kept"]) == ([None, None], "")
    act(client, tab, checked=False, do="unit", unit="deg/s")
    state = act(client, tab, checked=False, do="limits", place=0, name="N", low="", high=0.5)
    value = state["chips"][0]["values"][0]
    # In the unit that is shown: 0.5 deg/s/√Hz is less than the noise has.
    assert (value["limits"], value["number"], value["kept"]) == ([None, 0.5], 0.5, "at its limit")
    assert not value["held"]
    assert state["ladder"][-1]["label"].startswith("limit N of")
    assert f"N(N={0.5 * np.pi / 180:.6g}[,{0.5 * np.pi / 180:.6g}])" in state["model"]
    saved = client.get(f"tabs/{tab}/file/study.json").json()
    assert saved["axes"][0]["ladder"][1]["effects"][0]["at_limit"] == ["N"]
    other, _ = opened(client, checked=False)
    again = act(client, other, do="study", study=saved)
    assert again["model"].split("+")[0] == state["model"].split("+")[0]
    assert again["chips"][0]["values"][0]["kept"] == "at its limit"
    # A trial goes beyond them, a fit from there does not.
    tried = act(client, tab, checked=False, do="what-if", place=0, name="N", value=0.7)
    assert tried["chips"][0]["values"][0]["number"] == pytest.approx(0.7)
    assert tried["chips"][0]["values"][0]["limits"] == [None, 0.5]
    fitted = act(client, tab, checked=False, do="fit-tried")
    assert fitted["chips"][0]["values"][0]["number"] == 0.5
    held = act(client, tab, checked=False, do="hold", place=0, name="N", value=0.4)
    assert held["chips"][0]["values"][0]["kept"] == "held"
    act(client, tab, checked=False, do="hold", place=0, name="N", value=None)
    lifted = act(client, tab, checked=False, do="limits", place=0, name="N")
    assert lifted["chips"][0]["values"][0]["limits"] == [None, None]
    undone = act(client, tab, checked=False, do="undo")
    assert undone["chips"][0]["values"][0]["limits"] == [None, 0.5]


def test_a_unit_chosen_for_one_kind_of_sensor_leaves_the_others_in_their_own():
    rng = np.random.default_rng(1)
    two = Recording(
        rng.standard_normal((2000, 2)),
        10.0,
        unit=["rad/s", "m/s^2"],
        columns=["g", "a"],
        covariates={"oven": np.linspace(20, 21, 2000)},
    )
    client = client_of(Sessions([Source("two.npz", recording=two)]))
    tab, _ = opened(client, checked=False)
    act(client, tab, checked=False, do="unit", unit="deg/h")
    other = act(client, tab, checked=False, do="column", column=1)
    assert other["chips"][0]["values"][0]["unit"].startswith("m/s")
    view = client.get(f"tabs/{tab}/view/allan").json()
    assert view["layout"]["yaxis"]["title"]["text"] == "Allan deviation (m/s²)"
    back = act(client, tab, checked=False, do="column", column=0)
    assert back["chips"][0]["values"][0]["unit"].startswith("°/h")
    # The figure has the unit of the values beside it.
    view = client.get(f"tabs/{tab}/view/allan").json()
    assert view["layout"]["yaxis"]["title"]["text"] == "Allan deviation (°/h)"
    # A level per root of a power of the frequency keeps its unit. A change with a column has the chosen one.
    odd = act(client, tab, checked=False, do="model", model="N+PL+COV(column=oven,lag=1!)")
    assert [c["values"][i]["unit"][:4] for c, i in zip(odd["chips"], (0, 1, 0), strict=True)] == [
        "°/h·", "rad/", "°/h/"
    ]  # fmt: skip
    act(client, tab, checked=False, do="unit", unit=None)


@pytest.mark.slow
def test_a_clock_is_offered_the_files_that_take_one(client):
    tab, state = opened(client, checked=False)
    assert ["kalibr.yaml", "Kalibr"] in state["recording"]["targets"]
    rng = np.random.default_rng(1)
    clock = Recording(rng.standard_normal(2000), 1.0, unit="1", columns=["y"])
    other = client_of(Sessions([Source("clock.npz", recording=clock)]))
    tab, state = opened(other, checked=False)
    offered = [name for name, _ in state["recording"]["targets"]]
    assert set(offered) == {"parameters.json", "noise.h", "state-space.json"}
    assert {other.get(f"tabs/{tab}/file/{name}").status_code for name in offered} == {200}


@pytest.mark.slow
def test_a_filters_file_waits_for_no_search_of_rivals(client, sessions):
    tab, _ = opened(client, checked=False)
    assert b"gyroscope_noise_density" in client.get(f"tabs/{tab}/file/kalibr.yaml").content
    fit = sessions.tabs[tab].step.fit
    assert fit.kept == {}
    assert (
        client.get(f"tabs/{tab}/file/parameters.json").json()["axes"][0]["effects"][0]["rivals"]
        is not None
    )
    assert fit.kept


@pytest.mark.slow
def test_tabs_do_not_disturb_each_other(client):
    one, two = client.post("tabs").json()["tab"], client.post("tabs").json()["tab"]
    wait(client, one, checked=False)
    wait(client, two, checked=False)
    act(client, one, checked=False, do="remove", place=2)
    assert len(client.get(f"tabs/{one}").json()["chips"]) == 2
    assert len(client.get(f"tabs/{two}").json()["chips"]) == 3


@pytest.mark.long
def test_a_second_tab_opens_the_same_study_and_goes_its_own_way(client):
    tab, before = opened(client, checked=False)
    act(client, tab, checked=False, do="model", model="N+K")
    copy = client.post(f"tabs/{tab}/copy").json()["tab"]
    assert copy != tab
    there = wait(client, copy, checked=False)
    assert [r["model"] for r in there["ladder"]] == ["N+B+K", "N+K"]
    assert there["log"] == before["log"]
    act(client, copy, checked=False, do="undo")
    assert len(client.get(f"tabs/{tab}").json()["ladder"]) == 2
    assert client.get(f"tabs/{copy}").json()["at"] == 0
    assert "no longer exists" in client.post("tabs/nobody/copy").json()["error"]


@pytest.mark.slow
def test_a_study_is_saved_and_opened(client):
    tab, state = opened(client)
    added = act(client, tab, checked=False, do="add", number=state["cards"][0]["number"])
    saved = client.get(f"tabs/{tab}/file/study.json").json()
    other, _ = opened(client, checked=False)
    again = act(client, other, do="study", study=saved)
    assert [r["label"] for r in again["ladder"]] == [r["label"] for r in added["ladder"]]
    assert [r["label"] for r in saved["axes"][0]["ladder"]] == [r["label"] for r in added["ladder"]]
    assert again["ladder"][1]["chi2"] == pytest.approx(added["ladder"][1]["chi2"], rel=1e-2)


@pytest.mark.long
def test_files(looked):
    client, _, tab, _ = looked
    assert client.get(f"tabs/{tab}/file/allan.svg").content.lstrip().startswith(b"<?xml")
    assert client.get(f"tabs/{tab}/file/psd.png?theme=dark").content.startswith(b"\x89PNG")
    assert "N" in client.get(f"tabs/{tab}/file/parameters.json").text
    report = client.get(f"tabs/{tab}/file/report.html")
    assert report.text.lstrip().lower().startswith("<!doctype html")
    refused = client.get(f"tabs/{tab}/file/passwd")
    assert refused.status_code == 400


@pytest.mark.long
def test_cancel_ends_the_work_at_once_and_it_can_be_done_again(client):
    tab = client.post("tabs").json()["tab"]
    state = client.post(f"tabs/{tab}/act", json={"do": "cancel"}).json()
    assert state["job"]["busy"] is False
    assert state["ladder"] == []
    # What the thread finds afterwards is dropped.
    assert wait(client, tab)["ladder"] == []
    assert act(client, tab, do="open", log=0)["checked"] is True


@pytest.mark.long
def test_other_work_takes_the_place_of_the_search(client):
    tab = client.post("tabs").json()["tab"]
    until(client, tab, lambda s: s["ladder"])
    state = client.post(f"tabs/{tab}/act", json={"do": "remove", "place": 2}).json()
    assert "error" not in state
    assert [r["label"] for r in wait(client, tab)["ladder"]] == ["start", "− rate random walk"]
    assert act(client, tab, do="go", rung=0)["checked"] is True


@pytest.mark.slow
def test_the_curve_is_there_before_the_model(client, monkeypatch):
    free = threading.Event()
    fit = bench_module.fit_model

    def slow(*args):
        free.wait(30)
        return fit(*args)

    monkeypatch.setattr(bench_module, "fit_model", slow)
    tab = client.post("tabs").json()["tab"]
    state = until(client, tab, lambda s: s["recording"])
    assert state["ladder"] == []
    assert client.get(f"tabs/{tab}/view/allan").json()["data"]
    assert client.get(f"tabs/{tab}/view/samples").json()["data"]
    free.set()
    assert wait(client, tab)["ladder"]


def test_where_nothing_is_new_only_the_work_is_told(looked):
    client, _, tab, state = looked
    assert set(client.get(f"tabs/{tab}?seen={state['version']}").json()) == {"job"}
    assert "ladder" in client.get(f"tabs/{tab}?seen=-1").json()


def test_a_closed_tab_is_forgotten(client, sessions):
    tab = client.post("tabs").json()["tab"]
    work = sessions.tabs[tab].job
    assert client.post(f"tabs/{tab}/close").status_code == 200
    assert sessions.tabs == {}
    work.wait(30)
    assert "reload" in client.get(f"tabs/{tab}").json()["error"]


def test_values_are_shown_and_typed_in_the_unit_chosen(client):
    tab, before = opened(client, checked=False)
    assert before["chips"][0]["values"][0]["unit"] == "°/√h"
    assert before["chip_unit"] == "data sheet"
    si = act(client, tab, checked=False, do="unit", unit="rad/s")
    own = si["chips"][0]["values"][0]
    assert [u["value"] for u in before["chip_units"]][:2] == ["data sheet", "rad/s"]
    small = act(client, tab, checked=False, do="unit", unit="deg/h")["chips"][0]["values"][0]
    assert small["number"] == pytest.approx(own["number"] * 180 / np.pi * 3600, rel=1e-5)
    sheet = act(client, tab, checked=False, do="unit", unit="data sheet")["chips"][0]["values"][0]
    assert sheet["unit"] == "°/√h"
    assert sheet["number"] == pytest.approx(own["number"] * 180 / np.pi * 60, rel=1e-5)
    tried = act(
        client, tab, checked=False, do="what-if", place=0, name="N", value=2 * sheet["number"]
    )
    assert tried["chips"][0]["values"][0]["number"] == pytest.approx(2 * sheet["number"], rel=1e-5)
    back = act(client, tab, checked=False, do="unit", unit=None)["chips"][0]["values"][0]
    assert back["number"] == pytest.approx(2 * own["number"], rel=1e-5)


@pytest.mark.long
def test_no_view_grows_with_the_log(hidden):
    """With forty times the samples, four columns and gaps, a view is still below 300 kB."""
    samples = np.tile(np.asarray(hidden.samples), 10)
    samples[1000:5000] = np.nan
    log = Recording(np.column_stack([samples] * 4), 20.0, unit="rad/s", columns=list("abcd"))
    tab = Tab([Source("long", recording=log)])
    tab.source_index, tab.works[0] = 0, Work(log)
    fit = al.fit_model(tab.log, "N+B+K")
    tab.set_steps(ColumnSteps((Step("start", Rung(fit)),), 0))
    for name in ("allan", "psd", "samples", "compare", "error", "nis"):
        assert len(json.dumps(jsonable(view(tab, name, "light"), figures=7))) <= 300_000


SHEET = b'name = "ACME"\n[figures]\nangle_random_walk = "30 deg/sqrt(h)"\nbias_instability = "20 deg/h"\n'


@pytest.mark.slow
def test_a_log_a_data_sheet_and_a_twin_beside_it(client, hidden):
    tab, _ = opened(client, checked=False)
    file = io.BytesIO()
    np.savez(file, data=np.asarray(hidden.samples[:5000]), rate_hz=20.0, unit="rad/s")
    for name, body, role in (("b.npz", file.getvalue(), "compare"), ("s.toml", SHEET, "sheet")):
        answer = client.post(f"tabs/{tab}/upload", params={"name": name, "as": role}, content=body)
        assert answer.status_code == 200, answer.text
    state = answer.json()
    assert state["log"] == "hidden.npz"
    assert [n.split()[0] for n in state["others"]] == ["b.npz"]
    row = state["sheet"]["rows"][0]
    assert (row["figure"], row["sheet"]) == ("angle random walk", "30 °/√h")
    assert state["sheet"]["name"] == "ACME"
    names = {t.get("name") for t in client.get(f"tabs/{tab}/view/compare").json()["data"]}
    assert {"gyro, measured", "Simulated sensor", state["others"][0]} <= names
    act(client, tab, checked=False, do="alone", name=state["others"][0])
    assert act(client, tab, checked=False, do="alone")["sheet"] is None
    assert client.get(f"tabs/{tab}").json()["others"] == []


@pytest.mark.long
def test_a_bare_log_is_compared_with_once_its_rate_was_said(client, hidden):
    tab, _ = opened(client, checked=False)
    file = io.BytesIO()
    np.save(file, np.asarray(hidden.samples[:5000]))
    refused = client.post(
        f"tabs/{tab}/upload", params={"name": "bare.npy", "as": "compare"}, content=file.getvalue()
    )
    assert "open it as a log" in refused.json()["error"]
    assert send(client, tab, "bare.npy", file.getvalue()).status_code == 200
    wait(client, tab, checked=False)
    act(client, tab, checked=False, do="read", rate=20, unit="rad/s")
    act(client, tab, checked=False, do="open", log=0)
    assert len(act(client, tab, checked=False, do="compare", log=1)["others"]) == 1
    # Opened again it is read as it was said.
    assert act(client, tab, checked=False, do="open", log=1)["problem"] is None


@pytest.mark.slow
def test_a_log_is_uploaded(client, hidden):
    tab, _ = opened(client, checked=False)
    file = io.BytesIO()
    np.savez(file, data=np.asarray(hidden.samples[:5000]), rate_hz=20.0, unit="rad/s")
    answer = send(client, tab, "mine.npz", file.getvalue())
    assert answer.status_code == 200, answer.text
    state = wait(client, tab, checked=False)
    assert state["log"] == "mine.npz"
    assert state["recording"]["n"] == 5000


@pytest.mark.long
def test_a_rate_that_is_missing_is_asked_for(client, hidden, monkeypatch):
    tab, _ = opened(client, checked=False)
    file = io.BytesIO()
    np.save(file, np.asarray(hidden.samples[:20_000]))
    assert send(client, tab, "bare.npy", file.getvalue()).status_code == 200
    state = wait(client, tab, checked=False)
    assert "rate" in state["problem"]
    assert "allanite-page" not in state["problem"]
    order = {"do": "read", "rate": "20", "unit": "rad/s", "quantity": "rate"}
    # The old doubt is not shown, even before the log is read again.
    jobs = []
    with monkeypatch.context() as slow:
        slow.setattr(Job, "start", lambda job: jobs.append(job))
        assert client.post(f"tabs/{tab}/act", json=order).json()["problem"] is None
    jobs[0].start()
    state = wait(client, tab, checked=False)
    assert state["problem"] is None
    assert state["recording"]["rate"] == 20.0


@pytest.mark.slow
def test_the_offered_rate_of_the_stamps_overrides_that_of_the_file(client, hidden):
    tab, _ = opened(client, checked=False)
    samples = np.asarray(hidden.samples[:20_000])
    file = io.BytesIO()
    np.savez(file, data=samples, rate_hz=10.0, t=np.arange(samples.size) / 9.86, unit="rad/s")
    assert send(client, tab, "drift.npz", file.getvalue()).status_code == 200
    state = wait(client, tab, checked=False)
    assert state["recording"]["rate"] == 10.0
    offers = [offer for found in state["recording"]["audit"] for offer in found["offers"]]
    offer = next(offer for offer in offers if offer["act"]["do"] == "rate")
    # The form sends the rate with eight digits when the log is read again.
    again = {"do": "read", "rate": f"{offer['act']['rate']:.8g}", "unit": "rad/s"}
    for order in (offer["act"], again):
        assert client.post(f"tabs/{tab}/act", json=order).status_code == 200
        state = wait(client, tab, checked=False)
        assert state["problem"] is None
        assert state["recording"]["rate"] == pytest.approx(9.86)


@pytest.mark.slow
def test_units_of_bare_axes_are_asked_for(client):
    rows = np.random.default_rng(1).standard_normal((400, 3)).round(4)
    text = "time,z,y,x\n" + "".join(
        f"{0.01 * i:.2f},{a},{b},{c}\n" for i, (a, b, c) in enumerate(rows)
    )
    tab, _ = opened(client, checked=False)
    assert send(client, tab, "Gyroscope.csv", text.encode()).status_code == 200
    assert wait(client, tab, checked=False)["reading"]["unitless"] == ["z", "y", "x"]


@pytest.mark.slow
def test_compared_curves_have_each_a_colour_of_its_own(client):
    file = io.BytesIO()
    np.savez(
        file, data=np.random.default_rng(1).standard_normal((400, 9)), rate_hz=10.0, unit="rad/s"
    )
    tab, _ = opened(client, checked=False)
    send(client, tab, "nine.npz", file.getvalue())
    wait(client, tab, checked=False)
    shown = client.get(f"tabs/{tab}/view/compare").json()
    traces = [t for t in shown["data"] if t.get("showlegend")]
    colors = [t.get("marker", t.get("line"))["color"] for t in traces]
    assert len(set(colors)) == len(colors) >= 6
    # None is the color of an effect, and what is not drawn is named.
    effects = {theme_of("light").color(role) for role in COMPONENTS}
    assert not effects & set(colors)
    assert "not shown: x6, x7, x8" in shown["subtitle"]


def test_every_family_of_effects_has_a_group():
    """Families without a group would appear under noise and drift."""
    grouped = {family for _, families in GROUPS for family in families}
    assert {cls.family for cls in al.CATALOG.built_in} <= grouped
    assert {
        e["group"] for e in catalogue("angular rate") if e["kind"] in {"hump", "transition"}
    } == {"Events"}
