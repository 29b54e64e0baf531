"""allanite demo: the whole loop on a generated recording with a hidden effect or two."""

from __future__ import annotations

import sys
from shutil import which
from typing import TYPE_CHECKING

import click

from allanite.cli.options import SEED, json_option

if TYPE_CHECKING:
    from allanite.study import Study

# A consumer MEMS gyroscope in rad/s, two hours at 100 Hz. The three classical coefficients are
# those of the MathWorks example of an Allan variance; the other two are what it cannot show.
SHOWN = "N(N=0.0126)+B(B=0.002)+K(K=9.07e-5)"
HIDDEN = "GM(correlation_time=30,q_c=2.5e-3)+SIN(frequency=3.1,amplitude=0.003)"
START = "N+B+K"
RATE, DURATION = 100.0, 7200.0


@click.command("demo")
@click.option(
    "-o",
    "--output",
    default="allanite-demo",
    show_default=True,
    metavar="DIR",
    help="For the log and the figures.",
)
@click.option("--seed", type=SEED, default=1, show_default=True, metavar="N", help="Seed.")
@json_option
def command(output: str, seed: int, as_json: bool) -> None:
    """Simulate two hours of a gyroscope, hide two effects in it, and let the loop find them."""
    from pathlib import Path

    from allanite.cli.output import dumps, write_csv
    from allanite.common.files import whole_file
    from allanite.effects.files import parse_model
    from allanite.study import improve

    folder = Path(output)
    folder.mkdir(parents=True, exist_ok=True)
    recording = parse_model(f"{SHOWN}+{HIDDEN}").simulate(
        duration=DURATION, rate=RATE, seed=seed, unit="rad/s"
    )
    log = folder / "imu.csv"
    with whole_file(log) as draft:
        write_csv(recording, draft)
    if not as_json:
        click.echo(
            f"A simulated gyroscope: {recording.n} samples at {RATE:g} Hz of {SHOWN}, in rad/s.\n"
            f"Hidden in it: {HIDDEN}.\n\nThe model that everybody starts with is {START}:\n"
        )
    study = improve(recording, parse_model(START))
    first, last = study.ladder[0].fit, study.fit
    figures = (("start", first), ("end", last), ("ladder", study))
    for name, result in figures:
        result.plot(folder / f"{name}.svg")
    last.save(folder / "model.json")
    if as_json:
        click.echo(dumps(study.to_dict()))
        return
    click.echo(str(first))
    click.echo("\nThe ladder, one missing effect a rung:\n")
    click.echo(str(study))
    click.echo(f"\n{_verdict(study)}")
    names = ", ".join(f"{name}.svg" for name, _ in figures)
    click.echo(f"In {folder}: {names}, imu.csv, and model.json for simulate, compare and export.")
    program = "allanite" if which("allanite") else sys.argv[0]
    click.echo(f"Go on with your own log or with this one: {program} explore {log}")


def _verdict(study: Study) -> str:
    """Say in a sentence whether the loop found what was hidden."""
    from allanite.effects.files import parse_model

    hidden = {effect.kind: effect for effect in parse_model(HIDDEN)}
    found = {rung.added.kind for rung in study.ladder if rung.added is not None}
    missed = [kind for kind in hidden if kind not in found]
    more = sorted(found - set(hidden))
    words = "Both hidden effects were found" if not missed else f"Not found: {', '.join(missed)}"
    return f"{words}{', and nothing else' if not more else '; also added: ' + ', '.join(more)}."
