"""Formats with white noise and a Gauss-Markov bias for each of x, y and z: KF-GINS, NaveGo and PSINS."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from allanite.exports._axis import Axis
from allanite.exports._choice import TIME_NOTE, choose_gauss_markov
from allanite.exports._follow import shared_correlation_time
from allanite.exports._head import head_comments
from allanite.exports._target import Target
from allanite.exports._text import as_comments
from allanite.exports._triad import Triads, triads_of

DEGREE, UG = math.pi / 180.0, 1e-6 * 9.7803267714
#: Sensor → rows of each format: key, attribute of `NoiseParameters`, its unit in SI, and a text about the number.
KFGINS = {
    "gyroscope": (("arw", "N", DEGREE / 60, "deg/sqrt(hr)"), ("gbstd", "sigma", DEGREE / 3600, "deg/hr")),
    "accelerometer": (("vrw", "N", 1 / 60, "m/s/sqrt(hr)"), ("abstd", "sigma", 1e-5, "mGal")),
}  # fmt: skip
NAVEGO = {
    sensor: (
        (white, "N", 1.0, f"{unit}/sqrt(Hz)"),
        (
            f"{bias}_psd",
            "q_c",
            1.0,
            f"{unit}/s/sqrt(Hz), density of the noise that drives the bias",
        ),
        (f"{bias}_corr", "correlation_time", 1.0, "s, correlation time T of the bias"),
        (f"{bias}_dyn", "sigma", 1.0, f"{unit}, standard deviation of the bias, used in P0"),
    )
    for sensor, white, bias, unit in (
        ("gyroscope", "arw", "gb", "rad/s"),
        ("accelerometer", "vrw", "ab", "m/s^2"),
    )
}
PSINS = {
    "gyroscope": (
        ("web", "N", DEGREE / 60.0, "deg/sqrt(h)"),
        ("sqrtR0G", "sigma", DEGREE / 3600.0, "deg/h"),
        ("TauG", "correlation_time", 1.0, "s"),
    ),
    "accelerometer": (
        ("wdb", "N", UG, "ug/sqrt(Hz)"),
        ("sqrtR0A", "sigma", UG, "ug"),
        ("TauA", "correlation_time", 1.0, "s"),
    ),
}


def _lines(
    axes: Sequence[Axis],
    rows: Mapping[str, Sequence[tuple[str, str, float, str]]],
    form: str,
    between: str,
    *,
    overbound: bool,
    time: float | None = None,
) -> tuple[Triads, dict[str, str]]:
    """Tuple (`Triads` of the axes, dict from each key in `rows` to its line in the format `form`).

    `between` separates the numbers of x, y and z. A `time` (s) is the correlation time of all axes.
    """
    choose = partial(choose_gauss_markov, time=time, overbound=overbound)
    found = triads_of(axes, rows, choose, ("N", "q_c", "correlation_time", "sigma"))
    lines = {}
    for sensor, places in found.numbers.items():
        for key, attribute, unit, text in rows[sensor]:
            values = between.join(f"{value / unit:.6e}" for value in places[attribute])
            lines[key] = form.format(key=key, values=values, text=text)
    return found, lines


def kfgins(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:  # noqa: ARG001
    """Text of the YAML node ``imunoise``: N, and σ and correlation time of the Gauss-Markov biases.

    N is in °/√h and m/s/√h, σ in °/h and mGal. All axes have one correlation time, in h. `rate` is not used.
    """
    if overbound:
        # All axes get the geometric mean of their best correlation times.
        times = [choose_gauss_markov(axis, overbound=True).correlation_time for axis in axes]
        time = float(np.exp(np.mean(np.log(times))))
    else:
        time = shared_correlation_time(axes)
    convention = [
        "KF-GINS, OB_GINS: arw and vrw are continuous-time, two-sided densities. gbstd and abstd are the standard",
        "deviation sigma (not the density) of Gauss-Markov biases. corrtime is their correlation time T: 37 % of a bias is",
        "left after T. Set the scale factors gsstd and asstd yourself.",
        TIME_NOTE,
    ]
    found, lines = _lines(
        axes, KFGINS, "  {key}: [{values}]  # {text}\n", ", ", overbound=overbound, time=time
    )
    return as_comments(head_comments(found.pairs, [*convention, *found.remarks])) + (
        "imunoise:\n"
        f"{lines['arw']}{lines['vrw']}{lines['gbstd']}{lines['abstd']}"
        "  gsstd: [0.0, 0.0, 0.0]  # ppm\n"
        "  asstd: [0.0, 0.0, 0.0]  # ppm\n"
        f"  corrtime: {time / 3600:.6e}  # hr\n"
    )


def navego(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:  # noqa: ARG001
    """Text of a MATLAB script: N, and density, correlation time and standard deviation of the bias, as fields in SI units.

    ins_gnss.m squares arw, vrw, gb_psd and ab_psd for the continuous Q; F_update.m has -1/corr for the biases
    (017fd29). The lines must come after `imu_si_errors`, which computes gb_psd without the factor √2 of a Gauss-Markov
    process. `rate` is not used.
    """
    convention = [
        "NaveGo: continuous-time, two-sided densities in SI. Put these lines after the call of imu_si_errors.",
        "gb and ab are Gauss-Markov biases with the correlation time T: 37 % of a bias is left after T.",
        TIME_NOTE,
    ]
    form = "imu.{key} = [{values}];  % {text}\n"
    found, lines = _lines(axes, NAVEGO, form, " ", overbound=overbound)
    head = as_comments(head_comments(found.pairs, [*convention, *found.remarks]), "%")
    return head + "".join(lines.values())


def psins(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:  # noqa: ARG001
    """Text of a MATLAB script: N in °/√h and µg/√Hz, σ of the Gauss-Markov bias in °/h and µg, and its correlation time.

    `imuerrset` of PSINS uses these units.
    """
    convention = [
        "PSINS: web and wdb are continuous-time, two-sided densities. sqrtR0G and sqrtR0A are sigma of Gauss-Markov",
        "biases, TauG and TauA their correlation times T: 37 % of a bias is left after T. g is glv.g0 of PSINS, 9.7803",
        "m/s^2. Set the constant biases eb and db yourself.",
        TIME_NOTE,
    ]
    form = "{key} = [{values}];  % {text}\n"
    found, lines = _lines(axes, PSINS, form, "; ", overbound=overbound)
    return as_comments(head_comments(found.pairs, [*convention, *found.remarks]), "%") + (
        "eb = zeros(3,1);  % deg/h\ndb = zeros(3,1);  % ug\n"
        + "".join(lines.values())
        + "imuerr = imuerrset(eb, db, web, wdb, sqrtR0G, TauG, sqrtR0A, TauA);\n"
    )


TARGETS = (
    Target("kfgins", "KF-GINS", "kf-gins.yaml", kfgins, both_sensors=True),
    Target("navego", "NaveGo", "navego_imu.m", navego, both_sensors=True),
    Target("psins", "PSINS", "psins_imuerr.m", psins, both_sensors=True),
)
