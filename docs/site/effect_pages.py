"""A page for each effect of the catalogue, from what its class declares, with a picture of a simulated record."""

from __future__ import annotations

from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from reference_pages import markdown

import allanite as al
from allanite.common.units import parse_unit
from allanite.effects import Modifier, Stochastic
from allanite.effects._documented import INTRODUCTION, unit_of
from allanite.testing import example_of

if TYPE_CHECKING:
    from pathlib import Path

    from allanite.effects import Effect

RATE, LENGTH = 100.0, 2**16
#: The effect's Allan deviation is at most this times that of the white noise beside it.
HEIGHT = 3.0
#: A limit up to this only keeps a parameter from 0.
SMALL = 1e-6
SENSORS = {"gyroscope": "rad/s", "accelerometer": "m/s^2", "clock": "1"}


def example(kind: type[Effect]) -> Effect:
    """The effect with typical values for the record of the picture."""
    return example_of(kind, LENGTH, RATE, temperature())


def temperature() -> dict[str, np.ndarray]:
    """A slow random walk in °C."""
    steps = np.random.default_rng(1).standard_normal(LENGTH)
    return {"temperature": 20.0 + np.cumsum(steps) / RATE}


def simulated(model: al.Model | Effect, seed: int = 1) -> np.ndarray:
    effects = model if isinstance(model, al.Model) else (model,)
    options = {"covariates": temperature()} if any(e.follows for e in effects) else {}
    return model.simulate(n=LENGTH, rate=RATE, seed=seed, **options).samples


def beside_white(effect: Effect) -> tuple[np.ndarray, np.ndarray | None, Effect]:
    """Samples of white noise and of it with the effect, and the effect so scaled that it is seen."""
    white = al.AngleRandomWalk(N=1.0)
    if isinstance(effect, Modifier):
        plain = simulated(white)
        if effect.removes:
            hit = plain.copy()
            hit[effect.missing(LENGTH, RATE)] += 100.0 * plain.std()
            return plain, hit, effect
        return plain, simulated(white + effect), effect
    curve = al.oadev(simulated(effect), rate=RATE)
    use = curve.tau < LENGTH / RATE / 8.0
    factor = HEIGHT / float(np.max(curve.deviation[use] * np.sqrt(curve.tau[use])))
    scaled = {
        p.name: factor
        for p in effect.parameters
        if p.role == "coefficient" and getattr(effect, p.name) == 1.0
    }
    effect = effect.with_values(**scaled)
    if isinstance(effect, Stochastic) and effect.white:
        return simulated(effect), None, effect
    return simulated(white), simulated(white + effect), effect


def picture(kind: type[Effect], path: Path) -> Effect:
    """Samples, Allan deviation and density of white noise and of white noise with the effect."""
    plain, whole, effect = beside_white(example(kind))
    records = [(plain, "0.6", "white noise")] + (
        [] if whole is None else [(whole, "tab:blue", f"with {effect.title}")]
    )
    figure = Figure(figsize=(9.0, 2.8), layout="constrained")
    samples, curve, density = figure.subplots(1, 3)
    step = 32  # means of 0.32 s: the picture stays small
    time = (np.arange(LENGTH // step) + 0.5) * step / RATE
    for x, colour, label in records:
        samples.plot(time, x.reshape(-1, step).mean(axis=1), color=colour, lw=0.5)
        found = al.oadev(x, rate=RATE, taus=8)
        curve.loglog(found.tau, found.deviation, color=colour, label=label)
        spectrum = al.psd(x, rate=RATE)
        density.loglog(spectrum.frequency, spectrum.density, color=colour)
    samples.set(xlabel="time (s)", title="means of 0.32 s")
    curve.set(xlabel="τ (s)", title="Allan deviation")
    density.set(xlabel="frequency (Hz)", title="density (two-sided)")
    curve.legend(fontsize=7)
    with mpl.rc_context({"svg.hashsalt": "allanite"}):
        figure.savefig(path, metadata={"Date": None})
    return effect


def parameters(effect: Effect) -> str:
    """The table of parameters."""
    rows = ["| name | also | unit | range | role | what it is |", "|---|---|---|---|---|---|"]
    for p in effect.parameters:
        also = ", ".join(dict.fromkeys([*p.aliases, p.symbol])).strip(", ")
        limits = limits_of(p)
        what = p.description.replace("|", "\\|")
        rows.append(f"| `{p.name}` | {also} | {unit_of(p)} | {limits} | {p.role} | {what} |")
    return "\n".join(rows)


def limits_of(p: object) -> str:
    """The range of a parameter; a floor that only keeps it from 0, and no end, are not numbers to read."""
    if p.role == "choice":
        return ""
    if p.low <= SMALL and np.isinf(p.high):
        return "> 0" if p.low > 0.0 else "≥ 0" if p.low == 0.0 else "any"
    low = "0" if 0.0 <= p.low <= SMALL else f"{p.low:g}".replace("inf", "∞")
    return f"≥ {low}" if np.isinf(p.high) else f"{low} … {p.high:g}"


def page(kind: type[Effect], folder: Path) -> None:
    """The page of one effect and its picture."""
    effect = picture(kind, folder / f"{kind.kind}.svg")
    titles = {s: effect.name_for(parse_unit(u).kind) for s, u in SENSORS.items()}
    other = [f"{name} ({sensor})" for sensor, name in titles.items() if name != kind.title]
    title = kind.title[0].upper() + kind.title[1:]
    # The parameters stand in a table of their own, with more than a docstring shows.
    before, _, code = markdown(kind).partition("**Examples**")
    formula = before.partition(INTRODUCTION)[0]
    source = before.partition("**References**")[2].strip()
    others = {other.kind: other.title for other in al.CATALOG}
    rivals = ", ".join(f"[{others[r]}]({r}.md)" for r in kind.rivals)
    text = f"""# {title}

`{kind.short}` in model strings, `{kind.kind}` in files, `al.{kind.__name__}` in Python.{" Also called " + ", ".join(other) + "." if other else ""}

{formula.strip()}

![{title}: samples, Allan deviation and density]({kind.kind}.svg)

Simulated: `N(N=1) + {effect}` at {RATE:g} Hz, {LENGTH} samples.

**What it is.** {sentence(kind.physics)}

**What it looks like.** {sentence(kind.looks_like)}

**How to confirm it.** {sentence(kind.check_by)}

**Alternative explanations on a short record.** {rivals or "None in the catalog."}

## Parameters

U is the unit of the samples. A `coefficient` is fitted by likelihood. A `shape` is found by a scan and then fitted.

{parameters(effect)}

## Example

{code.strip()}
{f"{chr(10)}Source: {source}{chr(10)}" if source else ""}"""
    (folder / f"{kind.kind}.md").write_text(text, encoding="utf-8")


def sentence(text: str) -> str:
    """A declared text as a sentence."""
    return text[0].upper() + text[1:].rstrip(".") + "."


def write(folder: Path) -> None:
    """All pages and their table of contents."""
    folder.mkdir(parents=True)
    rows = ["| | effect | what it is |", "|---|---|---|"]
    for kind in al.CATALOG:
        page(kind, folder)
        physics = kind.physics.replace("|", "\\|")
        rows.append(f"| `{kind.short}` | [{kind.title}]({kind.kind}.md) | {physics} |")
    head = "# Effects\n\nA model is a sum of effects. Each page is generated from the class of the effect.\n\n"
    (folder / "index.md").write_text(head + "\n".join(rows) + "\n", encoding="utf-8")
