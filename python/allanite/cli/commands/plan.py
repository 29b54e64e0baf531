"""allanite plan: how long and at what rate to record."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import click

from allanite.cli.models import models_of
from allanite.cli.options import json_option
from allanite.cli.output import json_text
from allanite.common.errors import InputError

if TYPE_CHECKING:
    from allanite.effects import Effect


@click.command(
    "plan",
    epilog='Example: allanite plan --model "N(N=0.003)+K(K=1e-5)" --know K --to 10% --rate 100',
)
@click.option(
    "--model",
    required=True,
    metavar="MODEL",
    help='Your model with the values you expect, e.g. "N(N=0.003)+K(K=1e-5)", or a model file. Values with a unit, as in'
    ' "N(N=0.3 deg/sqrt(h))", are converted to SI units.',
)
@click.option(
    "--find",
    metavar="EFFECT",
    help='Effect that allanite check should find, with the size you expect, e.g. "GM(T=30,q_c=2e-3)". Values may'
    " have units, as in GM(T=30,q_c=2e-3 deg/s/sqrt(s)). Values of EFFECT without a unit are in the unit of the samples of"
    " MODEL. If MODEL is a text with units, they are in SI units.",
)
@click.option(
    "--know",
    metavar="NAME",
    help="Parameter of an effect in MODEL to measure with the accuracy --to, e.g. K or GM.correlation_time.",
)
@click.option(
    "--tell",
    metavar="A,B",
    help="Two effects to distinguish, e.g. GM,K. MODEL must contain the more specific one with values (here GM)"
    " and not the other: if K is true, no record can exclude a GM with a very long T.",
)
@click.option(
    "--to",
    "share",
    default="10%",
    show_default=True,
    metavar="SHARE",
    help="With --know: standard error relative to the value, 10% or 0.1.",
)
@click.option(
    "--power",
    type=float,
    default=0.9,
    show_default=True,
    metavar="P",
    help="With --find: probability of finding the effect.",
)
@click.option(
    "--rate",
    type=float,
    metavar="HZ",
    help="Sampling rate. Default: from the model file; otherwise rates from 0.1 to 1000 Hz are compared.",
)
@click.option(
    "--duration",
    type=float,
    metavar="SECONDS",
    help="Show what a record of this length would reach, instead of the shortest length. Needs a rate.",
)
@json_option
def command(
    model: str,
    find: str | None,
    know: str | None,
    tell: str | None,
    share: str,
    power: float,
    rate: float | None,
    duration: float | None,
    as_json: bool,
) -> None:
    """Compute how long and at what rate to record.

    State the goal with one of these options: --find (detect an effect), --know (measure a parameter), or --tell
    (distinguish two effects). Prints the shortest record that reaches the goal, and the standard errors of the parameters.
    With --duration, prints what a record of this length would reach. The result follows from the spectrum of MODEL;
    nothing is simulated.
    """
    from allanite.planning import detection_power, plan

    models = models_of(model)
    if len(models) > 1:
        raise InputError(
            f"{model} holds the models of {len(models)} columns: plan needs a file with one model"
        )
    base = models[0].model
    result: object
    effect = None if find is None else _effect_to_find(find, models[0].unit)
    # A model file states the rate of its log.
    rate = models[0].rate if rate is None else rate
    if duration is not None:
        if rate is None:
            raise InputError("--duration needs the sampling rate: add --rate HZ")
        found = detection_power(base, effect, duration=duration, rate=rate)
        document, result = found.to_dict(), replace(found, unit=models[0].unit)
    else:
        planned = plan(
            base,
            find=effect,
            know=know,
            tell=None if tell is None else _effect_pair(tell),
            to=_fraction_of(share),
            power=power,
            rate=rate,
        )
        power_found = replace(planned.power, unit=models[0].unit)
        document, result = planned.to_dict(), replace(planned, power=power_found)
    click.echo(json_text(document) if as_json else str(result))


def _effect_to_find(text: str, unit: str | None) -> Effect | str:
    """Effect that the text of --find names, in the unit of the model; the name of a file unchanged.

    Raises `InputError` if the text is not exactly one effect, or if the effect has a unit and the model has none.
    """
    from allanite.effects.strings import parse_with_units
    from allanite.sources import is_source_file

    if is_source_file(text):
        return text
    model, own = parse_with_units(text, unit)
    if unit is None and own is not None:
        raise InputError(
            f"--find {text}: the value has a unit, but the values of --model have none; give both with units"
        )
    if len(model) != 1:
        raise InputError(f"--find {text}: these are {len(model)} effects; give one")
    return model.effects[0]


def _effect_pair(text: str) -> tuple[str, str]:
    """Tuple of the two names in a text such as ``GM,K``. Raises `InputError` unless one comma separates two names."""
    first, comma, second = (part.strip() for part in text.partition(","))
    if not comma or not first or not second or "," in second:
        raise InputError(f"--tell {text}: write two effects separated by a comma, such as GM,K")
    return first, second


def _fraction_of(text: str) -> float:
    """Fraction from a text: 0.1 from ``10%`` or ``0.1``; raises `InputError` for 1 or more without %."""
    try:
        number = float(text.strip().removesuffix("%"))
    except ValueError:
        raise InputError(f"--to {text}: write 10% or 0.1") from None
    if "%" in text:
        return number / 100.0
    if 1.0 <= number < math.inf:
        # --tolerance takes a bare 5 as 5 %, but here 5 would be 500 %: ask the user which one is meant.
        raise InputError(
            f"--to {text}: {number:g} is {100.0 * number:g} %; write {text.strip()}% or {number / 100.0:g}"
        )
    return number
