"""Parts of a log: what is left out is missing, time goes on, and the models are fitted again."""

import json

import numpy as np
import pytest

from allanite import InputError, Recording, parse_model
from allanite.page.shown.figures import samples_figure
from allanite.page.source import merged_segments, model_for_part, part_of
from page_sessions import act, opened


def log(n=2000, dtype=float):
    samples = np.arange(2 * n).reshape(n, 2).astype(dtype)
    return Recording(samples, 10.0, unit=["rad/s", "m/s^2"], columns=["a", "b"])


def test_stretches_that_touch_are_one():
    assert merged_segments([(5.0, 6.0), (1.0, 2.0), (2.0, 3.0), (5.5, 5.8)]) == (
        (1.0, 3.0),
        (5.0, 6.0),
    )


@pytest.mark.parametrize("dtype", [float, np.float32, np.int16])
def test_what_is_left_out_is_missing_and_the_rest_is_as_it_was(dtype):
    whole = log(dtype=dtype)
    part = part_of(whole, (50.0, 150.0), ((40.0, 60.0), (100.0, 101.0)))
    assert part.n == 1000
    assert part.missing == 110
    there = np.isfinite(part.samples[:, 0])
    assert np.array_equal(part.samples[there], whole.samples[500:1500][there])
    assert (part.units, part.columns) == (whole.units, whole.columns)
    assert not np.isnan(whole.samples).any()


def test_of_too_little_nothing_is_made():
    with pytest.raises(InputError, match="too few"):
        part_of(log(), None, ((1.0, 200.0),))


def test_events_stay_where_time_has_not_moved():
    model = parse_model("N+STEP(time=5,height=1)")
    assert model_for_part(model, moved=False).name == "N+STEP"
    assert model_for_part(model, moved=True).name == "N"


@pytest.mark.long
def test_a_stretch_is_left_out_and_put_back(client):
    tab, state = opened(client)
    act(client, tab, do="model", model="N+K+GM")
    found = act(client, tab, **{"do": "leave-out", "from": 100.0, "to": 300.0})
    said = found["recording"]
    assert said["left_out"] == [[100.0, 300.0]]
    assert said["n"] == state["recording"]["n"]
    assert "excluded" in said["text"]
    assert [c["short"] for c in found["chips"]] == ["N", "K", "GM"]
    # It goes into what is saved, and comes back with it.
    saved = client.get(f"tabs/{tab}/part/saved").json()
    assert saved["left_out"] == [[100.0, 300.0]]
    for order, left in (("undo", []), ("redo", [[100.0, 300.0]])):
        assert act(client, tab, do=order)["recording"]["left_out"] == left
    assert act(client, tab, do="put-back", number=0)["recording"]["left_out"] == []
    found = act(client, tab, do="study", study=saved)
    assert found["recording"]["left_out"] == [[100.0, 300.0]]
    assert [c["short"] for c in found["chips"]] == ["N", "K", "GM"]


def test_the_envelope_of_samples_ends_at_a_gap():
    part = part_of(log(20_000), None, ((500.0, 1000.0),)).column("a")
    figure = samples_figure(part, {}, None, out=[(500.0, 1000.0)])
    data = figure.to_plotly("light")["data"]
    band = next(t for t in data if t.get("fill") == "toself")
    # Two outlines, parted by a point that is not there; none reaches into the gap.
    assert sum(v is None for v in band["y"]) == 1
    times = [t for t in band["x"] if t is not None]
    unit = 2000.0 / max(times)
    assert not any(505.0 < t * unit < 995.0 for t in times)


@pytest.mark.slow
@pytest.mark.parametrize("bad", [[["a", 1]], [[5, 1]], [[0, 1e999]], [[1]], 7, {"a": 1}])
def test_a_study_with_damaged_stretches_is_refused(client, bad):
    tab, _ = opened(client, checked=False)
    saved = {**client.get(f"tabs/{tab}/part/saved").json(), "left_out": bad}
    text = json.dumps({"do": "study", "study": saved})
    answer = client.post(f"tabs/{tab}/act", content=text)
    assert answer.status_code == 400
