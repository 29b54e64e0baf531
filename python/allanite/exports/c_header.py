"""C header with N and K of each axis, for your own filter."""

from __future__ import annotations

from collections.abc import Sequence

from allanite.exports._axis import Axis
from allanite.exports._head import head_comments
from allanite.exports._lines import choose_all
from allanite.exports._target import Target
from allanite.exports._text import as_comments


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:  # noqa: ARG001
    """Text of a C header with arrays of N and K in SI units, in the order of the given axes; `rate` is not used."""
    pairs = choose_all(axes, overbound=overbound)
    convention = (
        "N and K are continuous-time, two-sided, in SI. With the sampling interval dt, the standard deviation per sample",
        "is N/sqrt(dt), and that of a bias step from sample to sample is K*sqrt(dt).",
    )
    lines = [as_comments(head_comments(pairs, convention), "//")]
    lines += ["#ifndef ALLANITE_NOISE_H\n#define ALLANITE_NOISE_H\n\n"]
    lines.append(f"#define ALLANITE_AXES {len(pairs)}\n")
    for name, words in (("N", "white noise, unit*sqrt(s)"), ("K", "random walk, unit/sqrt(s)")):
        lines.append(f"// {words}\n")
        lines.append(f"static const double ALLANITE_{name}[ALLANITE_AXES] = {{\n")
        for axis, choice in pairs:
            note = f"{axis.name}, {axis.unit}" + (f"; {r}" if (r := choice.remark(name)) else "")
            lines.append(f"    {getattr(choice, name):.9e}, // {note}\n")
        lines.append("};\n")
    lines.append("\n#endif\n")
    return "".join(lines)


TARGETS = (Target("c-header", "C header", "noise.h", render, any_sensor=True),)
