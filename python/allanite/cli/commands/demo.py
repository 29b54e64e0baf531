"""allanite demo: simulate a gyroscope with hidden effects and find them."""

from __future__ import annotations

import sys
from pathlib import Path
from shutil import which
from typing import TYPE_CHECKING

import click

from allanite.cli.options import SEED, json_option
from allanite.cli.output import json_text, write_csv
from allanite.common.files import whole_file

if TYPE_CHECKING:
    from allanite.study import Study

# A MEMS gyroscope, two hours at 100 Hz. A fit of N+B+K cannot describe the two hidden effects.
CLASSICAL = "N(N=0.3 deg/sqrt(h))+B(B=3 deg/h)"
HIDDEN = "GM(correlation_time=60,q_c=150 deg/h/sqrt(h))+SIN(frequency=12.5,amplitude=7.2 deg/h)"
START = "N+B+K"
UNIT, RATE, DURATION = "deg/s", 100.0, 7200.0


@click.command("demo", epilog="Example: allanite demo -o demo")
@click.option(
    "-o",
    "--output",
    default="allanite-demo",
    show_default=True,
    metavar="DIR",
    help="Folder for the log, the figures and the model.",
)
@click.option(
    "--seed", type=SEED, default=1, show_default=True, metavar="N", help="Seed of the simulation."
)
@json_option
def command(output: str, seed: int, as_json: bool) -> None:
    """Simulate two hours of a gyroscope with two hidden effects, and find them step by step.

    Prints the fit of the usual model N+B+K, then each step of the search. Writes the simulated log, three figures and the
    final model to a folder.
    """
    from allanite.effects.files import parse_model
    from allanite.effects.strings import parse_with_units
    from allanite.study import improve

    folder = Path(output)
    folder.mkdir(parents=True, exist_ok=True)
    sensor, _ = parse_with_units(f"{CLASSICAL}+{HIDDEN}", UNIT)
    recording = sensor.simulate(duration=DURATION, rate=RATE, seed=seed, unit=UNIT)
    log = folder / "imu.csv"
    with whole_file(log) as draft:
        write_csv(recording, draft)
    if not as_json:
        click.echo(
            f"A simulated gyroscope: {recording.n} samples at {RATE:g} Hz of {CLASSICAL}.\n"
            f"Hidden effects: {HIDDEN}.\n\nFit of the usual model {START}:\n"
        )
    study = improve(recording, parse_model(START))
    first, last = study.ladder[0].fit, study.fit
    figures = (("start", first), ("end", last), ("ladder", study))
    for name, result in figures:
        result.plot(folder / f"{name}.svg")
    last.save(folder / "model.json")
    if as_json:
        click.echo(json_text(study.to_dict()))
        return
    click.echo(str(first))
    click.echo("\nStepwise model building, one missing effect per step:\n")
    click.echo(str(study))
    click.echo(f"\n{_verdict_sentence(study)}")
    names = ", ".join(f"{name}.svg" for name, _ in figures)
    click.echo(
        f"Files in {folder}: {names}, imu.csv, and model.json for allanite simulate, compare and export."
    )
    program = "allanite" if which("allanite") else sys.argv[0]
    click.echo(f"Next, open this log or your own in the browser: {program} explore {log}")


def _verdict_sentence(study: Study) -> str:
    """Sentence on whether the search found the hidden kinds of effects, with the missed and the excess ones."""
    from allanite.effects.strings import parse_with_units

    hidden = [effect.kind for effect in parse_with_units(HIDDEN, UNIT)[0]]
    found = {step.added.kind for step in study.ladder if step.added is not None}
    missed = [kind for kind in hidden if kind not in found]
    more = sorted(found - set(hidden))
    words = "Both hidden effects were found" if not missed else f"Not found: {', '.join(missed)}"
    return f"{words}{', and no other effect' if not more else '; also added: ' + ', '.join(more)}."
