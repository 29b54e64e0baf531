"""Draw the figures of the documentation: python docs/make_figures.py (a minute)."""

import runpy
from pathlib import Path

import matplotlib as mpl
from pictures import picture

import allanite as al
from allanite.plots import plot_check, plot_study

FOLDER = Path(__file__).parent / "figures"
#: A consumer gyroscope, rad/s: what everybody models, and what hides in it.
SHOWN = "N(N=0.0126)+B(B=0.002)+K(K=9.07e-5)"
HIDDEN = "GM(correlation_time=30,q_c=1.9e-3)+SIN(frequency=3.1,amplitude=0.002)"


def main():
    """Simulate two hours at 100 Hz, climb the ladder from N+B+K, draw the loop."""
    model = al.parse_model(f"{SHOWN}+{HIDDEN}")
    samples = model.simulate(duration=7200.0, rate=100.0, seed=1, unit="rad/s").samples
    recording = al.Recording(samples, rate=100.0, unit="rad/s", columns=["simulated gyroscope"])
    study = al.improve(recording, "N+B+K")
    print(study)
    FOLDER.mkdir(exist_ok=True)
    # The same bytes on every run: names inside an SVG are made from this salt.
    with mpl.rc_context({"svg.hashsalt": "allanite"}):
        plot_study(study, FOLDER / "loop.svg")
        plot_check(study.ladder[0].fit.check(), FOLDER / "check.svg")
    simulator = runpy.run_path(str(FOLDER.parents[1] / "examples" / "gyro_simulator.py"))
    found = simulator["main"]()
    model = al.Model(tuple(term.effect for term in found["terms"].values()))
    picture(
        simulator["figure"](found["terms"], found["whole"], model), FOLDER / "gyro_simulator.png"
    )


if __name__ == "__main__":
    main()
