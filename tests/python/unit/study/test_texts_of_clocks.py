"""A check of a clock speaks of frequency and phase, and starts from the noises of a clock."""

import re

import pytest

import allanite as al
from allanite.cli import main

CLOCK = "fractional frequency"
#: Words of inertial sensors, which no text of a clock may contain.
OF_SENSORS = re.compile(
    r"\b(angle|mount|velocity|gyro\w*|bias|tilt|vibrat\w*|flight|gravity|pulse weight|motion)\b"
)


@pytest.mark.parametrize("effect", tuple(al.CATALOG), ids=lambda effect: effect.kind)
def test_texts_of_a_clock_have_no_words_of_inertial_sensors(effect):
    for name in ("physics", "looks_like", "check_by"):
        assert not OF_SENSORS.search(effect.text_for(name, CLOCK))
        assert effect.text_for(name, "acceleration") == getattr(effect, name)


def test_a_check_of_fractional_frequency_starts_from_the_noises_of_a_clock(tmp_path, capsys):
    log = tmp_path / "clock.csv"
    model = al.parse_model("Q(Q=2e-10)+N(N=1e-11)+SIN(f=0.05,A=5e-11)")
    y = model.simulate(n=20_000, rate=1.0, seed=3, unit="1").samples
    log.write_text("y [1]\n" + "\n".join(map(repr, y.tolist())) + "\n", encoding="utf-8")
    with pytest.raises(SystemExit) as done:
        main(["check", str(log), "--rate", "1"])
    out = capsys.readouterr().out
    assert done.value.code in (0, None)
    assert "model Q+F+N+B+K" in out
    assert "white PM" in out
    assert "white FM" in out
    assert "sinusoid" in out
    assert "modulates the frequency" in out
    assert not OF_SENSORS.search(out)


def test_a_check_of_a_gyroscope_without_a_unit_starts_from_n_b_k():
    recording = al.parse_model("N(N=1)").simulate(n=2000, rate=10.0, seed=1, unit="1")
    from allanite.readers.starts import start_model

    gyro = al.Recording(recording.samples, rate=10.0, unit="1", columns=["gyro_x"])
    assert start_model(gyro) == "N+B+K"
    assert start_model(recording) == "Q+F+N+B+K"
