"""Draw the figures of the documentation: python docs/make_figures.py (a minute)."""

import runpy
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
from pictures import picture

import allanite as al
from allanite.plots import plot_check, plot_study

FOLDER = Path(__file__).parent / "figures"
#: A MEMS gyroscope: N = 0.3 °/√h and B = 3 °/h, and the two effects that are hidden, in deg/s.
SHOWN = "N(N=0.005)+B(B=8.333333e-4)"
HIDDEN = "GM(correlation_time=60,q_c=6.944444e-4)+SIN(frequency=12.5,amplitude=0.002)"


#: N, B and K of the explained curve, in deg/s; colors of the notes.
READ = {"N": 0.005, "B": 0.0011, "K": 5e-5}
INK, BLUE, ORANGE = "#1f2430", "#0072b2", "#d55e00"


def reading():
    """Draw an Allan curve with the places where N, B and K are read, for docs/reading-the-numbers.md."""
    model = al.AngleRandomWalk(N=READ["N"]) + al.BiasInstability(B=READ["B"])
    model = model + al.RateRandomWalk(K=READ["K"])
    recording = model.simulate(duration=14400.0, rate=50.0, seed=3, unit="deg/s")
    fit = al.fit_model(recording, "N+B+K")
    curve = recording.oadev()
    figure, axes = plt.subplots(figsize=(8.0, 4.6), layout="constrained")
    tau = np.geomspace(curve.tau[0], curve.tau[-1], 200)
    lines = {
        "N/√τ": READ["N"] / np.sqrt(tau),
        "0.664 B": np.full_like(tau, 0.6643 * READ["B"]),
        "K √(τ/3)": READ["K"] * np.sqrt(tau / 3.0),
    }
    for name, values in lines.items():
        axes.loglog(tau, values, "--", lw=1.0, color=BLUE)
        place = {"N/√τ": 8, "0.664 B": 20, "K √(τ/3)": 130}[name]
        axes.annotate(
            name,
            (tau[place], values[place]),
            color=BLUE,
            xytext=(6, -14),
            textcoords="offset points",
        )
    band = fit.band
    axes.fill_between(
        band.tau,
        band.low,
        band.high,
        color=ORANGE,
        alpha=0.2,
        lw=0,
        label="scatter of a true model (95 %)",
    )
    whole = np.sqrt(sum(values**2 for values in lines.values()))
    axes.loglog(tau, whole, color=ORANGE, lw=1.6, label="model N+B+K")
    bars = [curve.deviation - curve.low, curve.high - curve.deviation]
    axes.errorbar(
        curve.tau,
        curve.deviation,
        bars,
        fmt="o",
        ms=3.5,
        lw=1.0,
        color=INK,
        label="measured, 95 % interval",
    )
    notes = (
        ("N: the value at τ = 1 s", 1.0, READ["N"], (30, 25)),
        ("B: the flat part is 0.664 B", 0.3, 0.6643 * READ["B"], (-30, -30)),
        ("K: the line's value at τ = 3 s", 3.0, READ["K"], (30, -4)),
        (
            "few averages (edf < 10):\nwide intervals",
            curve.tau[-2],
            curve.deviation[-2],
            (-150, 40),
        ),
    )
    for words, x, y, shift in notes:
        axes.annotate(
            words, (x, y), xytext=shift, textcoords="offset points", arrowprops={"arrowstyle": "->"}
        )
    axes.set_ylim(READ["K"] / 2.0, 0.06)
    axes.set_xlabel("averaging time τ (s)")
    axes.set_ylabel("Allan deviation (°/s)")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False, loc="upper right")
    figure.savefig(FOLDER / "reading.svg", metadata={"Date": None})
    plt.close(figure)


def clock():
    """Simulate a day of a clock against a reference, with a pause, and draw MDEV, for docs/howto/clock-log.md."""
    model = al.parse_model("Q(Q=2e-10)+N(N=1e-11)+B(B=2e-13)")
    frequency = model.simulate(n=86_400, rate=1.0, seed=1, unit="1").samples
    phase = np.concatenate([[0.0], np.cumsum(frequency)])
    phase[30_000:30_400] = np.nan
    recording = al.Recording(
        phase, rate=1.0, unit="s", quantity="angle", columns=["simulated clock"]
    )
    al.mdev(recording).plot(FOLDER / "clock.svg")


def compared():
    """Compare two simulated gyroscopes, for docs/howto/comparing.md."""
    models = ("N(N=0.005)+B(B=8.33e-4)+GM(T=60,q_c=6.94e-4)", "N(N=0.0067)+B(B=1.67e-3)")
    records = [
        al.Recording(
            al.parse_model(text)
            .simulate(duration=7200.0, rate=100.0, seed=i, unit="deg/s")
            .samples,
            rate=100.0,
            unit="deg/s",
            columns=[f"gyroscope {i}"],
        )
        for i, text in enumerate(models, 1)
    ]
    al.compare([(r.columns[0], r, None) for r in records]).plot(FOLDER / "compare.svg")


def main():
    """Simulate two hours at 100 Hz, improve N+B+K, and draw the steps and all other figures."""
    model = al.parse_model(f"{SHOWN}+{HIDDEN}")
    samples = model.simulate(duration=7200.0, rate=100.0, seed=1, unit="deg/s").samples
    recording = al.Recording(samples, rate=100.0, unit="deg/s", columns=["simulated gyroscope"])
    study = al.improve(recording, "N+B+K")
    print(study)
    FOLDER.mkdir(exist_ok=True)
    # The same bytes on every run: names inside an SVG are made from this salt.
    with mpl.rc_context({"svg.hashsalt": "allanite"}):
        plot_study(study, FOLDER / "loop.svg")
        plot_check(study.ladder[0].fit.check(), FOLDER / "check.svg")
        reading()
        clock()
        compared()
    simulator = runpy.run_path(str(FOLDER.parents[1] / "examples" / "gyro_simulator.py"))
    found = simulator["main"]()
    model = al.Model(tuple(term.effect for term in found["terms"].values()))
    picture(
        simulator["figure"](found["terms"], found["whole"], model), FOLDER / "gyro_simulator.png"
    )


if __name__ == "__main__":
    main()
