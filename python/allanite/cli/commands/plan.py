"""allanite plan: how long to record, and how fast."""

from __future__ import annotations

import math

import click

from allanite.cli.options import json_option


@click.command("plan")
@click.option(
    "--model",
    required=True,
    metavar="MODEL",
    help="What is modelled anyway, with values, or a file.",
)
@click.option("--find", metavar="EFFECT", help='Effect to be found, e.g. "GM(T=30,q_c=2e-3)".')
@click.option("--know", metavar="NAME", help="Number to be known: K, GM.correlation_time.")
@click.option(
    "--tell", metavar="A,B", help="Two effects to be told apart, one of them in MODEL: K,GM."
)
@click.option(
    "--to",
    "share",
    default="10%",
    show_default=True,
    metavar="SHARE",
    help="Its standard error as a share of its value: 10% or 0.1.",
)
@click.option(
    "--power",
    type=float,
    default=0.9,
    show_default=True,
    metavar="P",
    help="Probability of finding the effect.",
)
@click.option(
    "--rate",
    type=float,
    metavar="HZ",
    help="Sampling rate; default: that of the model file, else rates are compared.",
)
@click.option(
    "--duration", type=float, metavar="S", help="Say what a record of this length tells, instead."
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
    """How long to record, and at what rate, to find an effect, to know a number of MODEL or to tell two effects apart.

    Computed from the information in the spectrum that the model predicts; nothing is simulated.
    """
    from allanite.cli.models import models_of
    from allanite.cli.output import dumps
    from allanite.common.errors import InputError
    from allanite.planning import detection_power, plan

    models = models_of(model)
    if len(models) > 1:
        raise InputError(
            f"{model} holds the models of {len(models)} columns: plan for one at a time"
        )
    base = models[0].model
    result: object
    # A sensor that was logged keeps its rate unless another is asked for.
    rate = models[0].rate if rate is None else rate
    if duration is not None:
        if rate is None:
            raise InputError("no sampling rate: give --rate HZ beside --duration")
        found = detection_power(base, find, duration=duration, rate=rate)
        document, result = found.to_dict(), found
    else:
        planned = plan(
            base,
            find=find,
            know=know,
            tell=None if tell is None else _two(tell),
            to=_share(share),
            power=power,
            rate=rate,
        )
        document, result = planned.to_dict(), planned
    click.echo(dumps(document) if as_json else str(result))


def _two(text: str) -> tuple[str, str]:
    """``K,GM``."""
    from allanite.common.errors import InputError

    first, comma, second = (part.strip() for part in text.partition(","))
    if not comma or not first or not second or "," in second:
        raise InputError(f"--tell {text}: two effects with a comma between, such as K,GM")
    return first, second


def _share(text: str) -> float:
    """``10%`` or ``0.1``."""
    from allanite.common.errors import InputError

    try:
        number = float(text.strip().removesuffix("%"))
    except ValueError:
        raise InputError(f"--to {text}: a share such as 10% or 0.1") from None
    if "%" in text:
        return number / 100.0
    if 1.0 <= number < math.inf:
        # Elsewhere a bare 5 is 5 %: what is meant has to be said.
        raise InputError(
            f"--to {text}: {number:g} is {100.0 * number:g} %; write {text.strip()}% or {number / 100.0:g}"
        )
    return number
