"""What the page says of a model: its verdict, the places where it fails, what else explains the record."""

import re
from types import SimpleNamespace

import numpy as np
import pytest

import allanite as al
from allanite import Recording
from allanite.fit.rivals.undecided import Undecided
from allanite.page.edits import SHEET
from allanite.page.sessions import Sessions
from allanite.page.shown.cards import cards, failures
from allanite.page.shown.figures import figure_of
from allanite.page.source import Source
from allanite.page.state import state
from allanite.page.tab import Tab
from allanite.page.work import ColumnSteps, Step, Work
from allanite.plots.curves import residuals_between
from allanite.plots.spec import HeatMap, Points
from allanite.plots.time import failing_range_panel
from allanite.study import Rung
from allanite.suggestion import check_fit
from generators import sinusoid, walk, white
from page_sessions import act, client_of, opened

pytestmark = pytest.mark.slow

RATE, N = 100.0, 40_000


@pytest.fixture(scope="module")
def lined():
    """A client and a checked tab on white noise and a line at 38 Hz that no bin of the spectrum shows."""
    rng = np.random.default_rng(11)
    x = white(rng, N, RATE, 0.01) + sinusoid(N, RATE, 38.0, 0.02)
    sessions = Sessions([Source("lined.npz", recording=Recording(x, RATE, unit="deg/s"))])
    client = client_of(sessions)
    yield client, *opened(client)
    sessions.uploads.close()


@pytest.fixture
def white_only():
    """A tab at the step of white noise, the true model of its record."""
    x = white(np.random.default_rng(2), 4000, 1.0, 1.0)
    log = Recording(x, 1.0, unit="deg/s", columns=["gyro"])
    tab = Tab([Source("white.npz", recording=log)])
    tab.source_index, tab.works[0] = 0, Work(log)
    step = Step("start", Rung(al.fit_model(log, "N+K")))
    tab.set_steps(ColumnSteps((step,), 0))
    step.error = step.fit.error
    step.study = al.Study(log, (step.rung,), check_fit(step.fit), "nothing helps")
    assert step.study.check.adequate
    return tab


def test_a_model_is_adequate_only_if_its_study_says_so(white_only, monkeypatch):
    why = "the Allan deviation differs by 30 % rms from the model, where 5 % are expected"
    monkeypatch.setattr(al.Study, "doubts", (why,))
    said = state(white_only)
    assert said["adequate"] is False
    assert said["verdict"] == "unexplained"
    assert [one["text"] for one in said["where"]] == [why]
    assert said["axes"][0]["state"] == "fails"
    assert said["ladder"][0]["left_text"] == "100 %"


def test_an_adequate_model_leaves_nothing_unexplained(white_only):
    said = state(white_only)
    assert said["adequate"] is True
    assert said["where"] == []
    assert said["view"] == "allan"
    assert said["ladder"][0]["left_text"] == "0 %"
    assert re.match(r"This record cannot distinguish N\+K|No other model", said["alternatives"])


def test_residuals_of_single_ordinates_are_normal_if_the_model_is_true(white_only):
    fit = white_only.step.fit
    f, z = residuals_between(fit, 0.01, 0.49, most=10_000)
    assert 3800 < f.size < 3900
    # Standard errors: 0.016 of the mean, 0.011 of the scatter.
    assert abs(z.mean()) < 0.08
    assert abs(z.std() - 1.0) < 0.05
    f, z = residuals_between(fit, 0.01, 0.49, most=100)
    assert f.size <= 100
    assert abs(z.std() - 1.0) < 0.3


def test_residuals_of_single_ordinates_show_a_line():
    x = white(np.random.default_rng(11), N, RATE, 0.01) + sinusoid(N, RATE, 38.0, 0.02)
    fit = al.fit_model(Recording(x, RATE, unit="deg/s"), "N+K")
    f, z = residuals_between(fit, 37.0, 39.0, most=10_000)
    assert f[np.argmax(z)] == pytest.approx(38.0, abs=0.01)
    assert z.max() > 8.0


def test_alternatives_stand_beside_the_numbers_that_they_change(white_only, monkeypatch):
    own = white_only.step.fit.estimates[0]["N"]
    low, high = own.interval
    wide = {"N": (low - 2 * (high - low), high)}
    monkeypatch.setattr(al.Study, "undecided", Undecided((("N+K", 0.6), ("N+B", 0.4)), (wide, {})))
    white_only.unit = None
    said = state(white_only)
    beside = [v["over_all"] for chip in said["chips"] for v in chip["values"]]
    assert beside[0].endswith("over all alternatives")
    assert float(beside[0].split()[0]) == pytest.approx(wide["N"][0], rel=5e-3)
    assert beside[1] == ""
    assert said["alternatives"].startswith(
        "This record cannot distinguish N+K (60 %) from N+B (40 %)"
    )


def test_each_sentence_has_the_view_and_the_place_that_it_speaks_of(lined):
    _, _, said = lined
    place = next(one for one in said["where"] if one["view"] == "psd")
    assert place["place"][0] < 38.0 < place["place"][1]
    assert "Hz" in place["text"]
    assert said["view"] == "psd"


def test_a_line_that_no_bin_shows_is_drawn_among_single_ordinates(lined):
    client, tab, said = lined
    view = client.get(f"tabs/{tab}/view/psd").json()
    single = next(t for t in view["data"] if t.get("meta") == "single")
    measured = next(t for t in view["data"] if t.get("meta") == "measured")
    top = max(range(len(single["y"])), key=lambda i: single["y"][i])
    assert single["x"][top] == pytest.approx(38.0, abs=0.01)
    # In the bins the line is lost; the single ordinate holds A²/4 of it over 1/(2T) Hz.
    near = [y for x, y in zip(measured["x"], measured["y"], strict=True) if 30 < x < 50]
    assert single["y"][top] > 30 * max(near)
    # The shaded range says by how much the model is wrong there.
    texts = [a["text"] for a in view["layout"]["annotations"]]
    assert any("× the model" in text for text in texts)
    low, high = said["where"][0]["place"]
    close = client.get(f"tabs/{tab}/view/psd?from={low}&to={high}").json()
    fine = next(t for t in close["data"] if t.get("meta") == "single")
    assert len(fine["x"]) == pytest.approx((high - low) * 2 * N / RATE, abs=1)
    assert min(fine["x"]) >= low
    assert max(fine["x"]) <= high


def test_what_is_not_detected_is_drawn_dashed_at_its_limit(lined):
    client, tab, said = lined
    said = act(client, tab, checked=False, do="unit", unit="deg/s")
    chip = next(c for c in said["chips"] if c["kind"] == "rate_random_walk")
    assert "95 % limit" in chip["values"][0]["spread"]
    view = client.get(f"tabs/{tab}/view/allan").json()
    line = next(t for t in view["data"] if t.get("meta") == f"limit-{chip['place']}")
    assert line["line"]["dash"] == "dash"
    assert line["name"].endswith("(95 % limit)")
    # σ² = K² τ / 3 at the limit of K, °/s/√s.
    limit = float(re.search(r"[\d.]+(e-?\d+)?", chip["values"][0]["text"])[0])
    k = len(line["x"]) - 1
    assert line["y"][k] == pytest.approx(limit * np.sqrt(line["x"][k] / 3), rel=0.06)


def test_lines_are_smooth_and_a_logged_temperature_is_seen_in_the_first_figure():
    rng = np.random.default_rng(3)
    n = 5000
    t = 20 + 5 * np.tanh((np.arange(n) - 3000) / 500)
    x = white(rng, n, 1.0, 1.0) + walk(rng, n, 1.0, 1e-4) + 0.4 * t
    log = Recording(
        x,
        1.0,
        unit="mrad/s",
        covariates={"temperature": t},
        covariate_units={"temperature": "degC"},
    )
    sessions = Sessions([Source("warm.npz", recording=log)])
    client = client_of(sessions)
    tab, said = opened(client)
    view = client.get(f"tabs/{tab}/view/allan").json()
    for trace in view["data"]:
        if str(trace.get("meta")).startswith("effect-"):
            # 32 places a decade from where they are whole numbers of samples.
            assert len(trace["x"]) > 40
    assert said["view"] == "samples"
    drawn = client.get(f"tabs/{tab}/view/samples").json()
    assert "temperature" in drawn["drift"]
    sessions.uploads.close()
    # The card of the temperature leads to the samples.
    card = next(c for c in said["cards"] if c["kind"] == "covariate")
    assert (card["view"], card["place"]) == ("samples", None)


def test_a_missing_effect_leads_to_its_figure_even_if_no_view_fails(white_only, monkeypatch):
    study = white_only.step.study
    effect = al.parse_model("SIN(frequency=0.1)").effects[0]
    monkeypatch.setattr(al.Check, "adequate", False)
    monkeypatch.setattr(al.Check, "significant", (SimpleNamespace(effect=effect),))
    (sentence,) = failures(study)
    assert sentence["view"] == "psd"
    assert sentence["text"].endswith("significantly missing: sinusoid")


def test_a_line_that_drifts_is_followed_in_the_map():
    rng = np.random.default_rng(1)
    n, rate = 36_000, 60.0
    frequency = 18.0 + 4.0 * np.arange(n) / n
    x = white(rng, n, rate, 0.01) + 0.15 * np.sin(2 * np.pi * np.cumsum(frequency) / rate)
    check = check_fit(al.fit_model(Recording(x, rate, unit="deg/s"), "N"))
    panel = failing_range_panel(check)
    (heat,) = panel.find(HeatMap)
    rows = np.argmax(heat.values, axis=0)
    height = np.diff(heat.y_edges)[0]
    found = heat.y_edges[rows] + 0.5 * height
    middle = 0.5 * (heat.x_edges[1:] + heat.x_edges[:-1]) / panel.x.high
    # Within a row, and the drift within a column.
    column = 4.0 * np.diff(heat.x_edges)[0] / panel.x.high
    assert np.max(np.abs(found - (18.0 + 4.0 * middle))) < height + column


def test_the_spectrum_shows_where_the_model_fails_over_time():
    rng = np.random.default_rng(1)
    n, rate = 36_000, 60.0
    frequency = 18.0 + 4.0 * np.arange(n) / n
    x = white(rng, n, rate, 0.01) + 0.15 * np.sin(2 * np.pi * np.cumsum(frequency) / rate)
    client = client_of(Sessions([Source("band", recording=Recording(x, rate, unit="deg/s"))]))
    tab, state = opened(client)
    assert state["view"] == "psd"
    got = client.get(f"tabs/{tab}/view/psd", params={"theme": "light"}).json()
    (heat,) = (trace for trace in got["data"] if trace["type"] == "heatmap")
    brightest = np.array(heat["z"], dtype=float).argmax(axis=0)
    middle = 0.5 * (np.array(heat["y"][1:]) + np.array(heat["y"][:-1]))
    # The line rises from 18 to 22 Hz.
    assert middle[brightest[0]] < 19.0
    assert middle[brightest[-1]] > 21.0


def test_the_card_of_a_drifting_line_names_the_frequencies_that_the_line_has():
    rng = np.random.default_rng(5)
    t = np.arange(N) / RATE
    x = white(rng, N, RATE, 0.01) + 0.02 * np.sin(2 * np.pi * (10.0 * t + 0.5 * 0.005 * t**2))
    check = check_fit(al.fit_model(Recording(x, RATE, unit="deg/s"), "N"))
    card = next(c for c in cards(check) if c["kind"] == "drifting_line")
    # From 10 Hz to 10 Hz + 0.005 Hz/s · 400 s; the page shows 12 % more on each side.
    assert card["acts"]["frequency"] == pytest.approx([10.0 / 1.12, 12.0 * 1.12], rel=1e-3)
    assert card["size_text"].endswith("between 10 and 12 Hz")


def test_a_card_has_the_units_of_the_model_and_the_harmonics_of_a_comb():
    rng = np.random.default_rng(8)
    t = np.arange(N) / RATE
    comb = sum(a * np.sin(2 * np.pi * m * 1.3 * t) for m, a in ((1, 0.01), (2, 0.006), (3, 0.006)))
    check = check_fit(
        al.fit_model(Recording(white(rng, N, RATE, 0.01) + comb, RATE, unit="rad/s"), "N")
    )
    card = next(c for c in cards(check, SHEET) if c["kind"] == "sinusoid")
    amplitude = float(re.search(r"A? ?= (\S+) °/h", card["values"], re.I)[1])
    assert amplitude == pytest.approx(0.01 * 180 / np.pi * 3600, rel=0.05)
    assert card["values"].endswith("with harmonics 2, 3")
    assert card["sentence"].startswith(("up to", "at most"))


def test_every_measured_error_is_inside_its_axis(white_only):
    figure = figure_of(white_only, "error", {})
    for panel in figure.panels:
        points = next(m for m in panel.marks if isinstance(m, Points))
        assert panel.y.low < points.y.min()
        assert points.y.max() < panel.y.high
