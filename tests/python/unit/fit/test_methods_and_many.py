"""Three methods side by side; several recordings together."""

import json

import numpy as np
import pytest

import allanite as al
import generators as g
from allanite.cli import main


def record(model, seed, n=100_000, axis=0):
    return al.parse_model(model).simulate(n=n, rate=100, seed=seed, unit="rad/s", axis=axis)


def test_methods_agree_where_lines_apply():
    # Decades of slope −½, a wide plateau gone, decades of +½: what the classical reading is for.
    table = al.fit_model(record("N(N=0.01)+K(K=0.02)", 3), "N+K").compare_methods()
    for name, truth in (("N", 0.01), ("K", 0.02)):
        row = table[name]
        intervals = [row.whittle.interval, row.gls.interval, (row.line.low, row.line.high)]
        # Joint: three 95 % intervals at three standard errors each must meet.
        wide = [(a * (a / b) ** 0.25, b * (b / a) ** 0.25) for a, b in intervals]
        assert max(a for a, _ in wide) < min(b for _, b in wide)
        assert all(a < truth < b for a, b in wide)
        assert row.remark == ""
    assert "slope holds" in str(table)


def test_no_rate_random_walk_is_read_off_a_gauss_markov_process():
    fit = al.fit_model(record("N(N=0.0126)+GM(q_c=6e-3,T=10)", 1, 360_000), "N+GM")
    table = fit.compare_methods()
    readings = {row.name: row for row in table.rows if row.line is not None}
    assert readings["N"].line.present
    if "K" in readings:
        assert not readings["K"].line.present
        assert "no rate random walk is read" in readings["K"].remark
    assert table["GM.q_c"].line is None
    assert all(row.remark for name, row in readings.items() if name != "N")


def test_a_line_over_other_effects_is_told_to_mislead():
    # Between N and K the curve has a floor that is nobody's: without a B, and with one of which it shows only a part.
    without = al.fit_model(record("N(N=0.0126)+K(K=3e-4)", 1, 360_000), "N+B+K").compare_methods()
    assert "whole spectrum allows" in without["B"].remark
    truth = "N(N=0.0126)+B(B=0.002)+K(K=3e-4)"
    table = al.fit_model(record(truth, 1, 360_000), "N+B+K").compare_methods()
    assert table["B"].line.value > 1.4 * 0.002
    assert "other effects contribute" in table["B"].remark
    document = table.to_dict()
    assert {m["name"] for m in document["methods"]} >= {"N", "B", "K"}
    assert document["schema"] == "allanite/fit/1"
    json.dumps(document, allow_nan=False)


def test_recordings_that_agree_and_one_that_does_not():
    same = [record("N(N=0.01)+K(K=0.01)", 5, 20_000, axis) for axis in range(3)]
    together = al.fit_many(same, "N+K")
    assert together.agree
    assert together["N"].interval[0] < 0.01 < together["N"].interval[1]
    # The common value is known √3 times better than each alone.
    alone = np.diff(together.fits[0]["N"].interval)[0]
    assert np.diff(together["N"].interval)[0] == pytest.approx(alone / np.sqrt(3), rel=0.1)
    other = record("N(N=0.011)+K(K=0.01)", 5, 20_000, 3)
    differ = al.fit_many([*same, other], "N+K")
    assert not differ.agree
    assert differ["N"].p_value < 1e-6
    # Four values of which one is 10 % off scatter by 5 %.
    assert differ["N"].spread == pytest.approx(0.05, rel=0.2)
    assert differ["K"].agree
    assert "the recordings differ: N" in str(differ)


def test_columns_and_units():
    samples = np.column_stack([record("N(N=0.01)", 7, 5000, a).samples for a in range(2)])
    both = al.fit_many(al.Recording(samples, rate=100, unit="rad/s", columns=("x", "y")), "N")
    assert [label.split()[0] for label in both.labels] == ["x", "y"]
    first = al.Recording(samples[:, 0], rate=100, unit="rad/s")
    with pytest.raises(al.InputError, match=r"deg/s and rad/s"):
        al.fit_many([first, first.to("deg/s")], "N")
    with pytest.raises(al.InputError, match="no recordings"):
        al.fit_many([], "N")
    assert al.fit_many(first, "N").pooled == ()


def test_a_coefficient_that_no_recording_shows_is_a_common_limit():
    many = al.fit_many([record("N(N=0.01)", 11, 20_000, a) for a in range(3)], "N+K")
    row = many["K"]
    assert row.interval[0] == 0.0
    assert row.spread is None
    assert row.interval[1] < min(fit["K"].interval[1] for fit in many.fits)


def with_lines(seed, *lines):
    """White noise and lines of (frequency, amplitude) with different phases."""
    rng = np.random.default_rng(seed)
    samples = g.white(rng, 20_000, 100.0, 0.01)
    for frequency, amplitude in lines:
        samples += g.sinusoid(20_000, 100.0, frequency, amplitude, rng.uniform(0.0, 2.0 * np.pi))
    return al.Recording(samples, rate=100.0, unit="rad/s")


def test_a_line_common_to_all_recordings_whatever_its_phase():
    many = al.fit_many([with_lines(seed, (3.1, 0.01)) for seed in range(3)], "N+SIN")
    assert [row.name for row in many.pooled] == ["N", "SIN.frequency", "SIN.amplitude"]
    assert many.agree
    low, high = many["SIN.frequency"].interval
    assert low < 3.1 < high
    # √6/(π T) σ_A/A of one line of 200 s, √3 times better from three: 3.92 times that from end to end.
    assert high - low == pytest.approx(3.92 * np.sqrt(2) / np.pi / 200.0 * 0.1, rel=0.3)
    # The table says the frequency to as many figures as are known.
    assert f"({low:.5g} … {high:.5g})" in str(many)
    moved = al.fit_many([with_lines(s, (3.1 + 0.01 * s, 0.01)) for s in range(3)], "N+SIN")
    assert not moved["SIN.frequency"].agree
    assert moved["SIN.amplitude"].agree


def test_lines_are_compared_by_frequency_not_by_strength():
    # The stronger line comes first in a fit: that of 9 Hz in the second recording.
    records = [with_lines(1, (3.1, 0.02), (9.0, 0.012)), with_lines(2, (3.1, 0.012), (9.0, 0.02))]
    many = al.fit_many(records, "N+SIN+SIN")
    # Neither fit puts both lines on the stronger one.
    first = [float(fit["SIN.frequency"]) for fit in many.fits]
    np.testing.assert_allclose(first, [3.1, 9.0], atol=2e-3)
    assert many["SIN.frequency"].agree
    assert many["SIN2.frequency"].agree
    found = sorted((many["SIN.frequency"].value, many["SIN2.frequency"].value))
    np.testing.assert_allclose(found, [3.1, 9.0], atol=2e-3)
    assert not many["SIN.amplitude"].agree


def test_what_happened_once_is_not_pooled():
    records = []
    for seed in range(2):
        rng = np.random.default_rng(seed)
        samples = g.white(rng, 5000, 10.0, 1.0) + g.step(5000, 10.0, 200.0 + 50.0 * seed, 5.0)
        records.append(al.Recording(samples, rate=10.0, unit="1"))
    assert [row.name for row in al.fit_many(records, "N+STEP").pooled] == ["N"]


def test_command_line(tmp_path, capsys):
    logs = []
    for axis in range(2):
        path = tmp_path / f"run{axis}.npy"
        np.save(path, record("N(N=0.01)", 13, 5000, axis).samples)
        logs.append(str(path))

    def run(*arguments):
        with pytest.raises(SystemExit) as caught:
            main(["fit", *arguments, "--rate", "100", "--unit", "rad/s", "--model", "N+K"])
        assert caught.value.code == 0
        return capsys.readouterr().out

    text = run(*logs)
    assert "p-value of agreement" in text
    document = json.loads(run(*logs, "--json"))
    assert len(document["columns"]) == 2
    assert document["pooled"][0]["agree"] is True
    one = json.loads(run(logs[0], "--json", "--compare-methods"))
    assert one["methods"][0]["name"] == "N"
    assert "whittle" in run(logs[0], "--compare-methods")
