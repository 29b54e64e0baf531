"""Gazebo SDF: <imu> with white noise per sample and a Gauss-Markov bias."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

from allanite.exports._axis import Axis, rate_of
from allanite.exports._choice import TIME_NOTE, choose_gauss_markov
from allanite.exports._head import head_comments
from allanite.exports._target import Target
from allanite.exports._text import xml_comment
from allanite.exports._triad import triads_of


def render(axes: Sequence[Axis], rate: float | None, *, overbound: bool = False) -> str:
    """Text of an ``<imu>`` element of SDF with white noise and a Gauss-Markov bias for each of x, y and z.

    ``stddev`` is N·√rate. ``dynamic_bias_stddev`` is the density q_c of the noise that drives the bias, and
    ``bias_stddev`` is σ of the bias. A sensor without axes is left out. Raises `InputError` if `rate` is None and the
    axes have no common rate.
    """
    fs = rate_of(axes, rate, "gazebo")
    convention = [
        f"Gazebo: stddev is the standard deviation of a sample at {fs:g} Hz, N*sqrt(rate). Set update_rate to {fs:g}.",
        "The bias is a Gauss-Markov process with the correlation time T in s: 37 % of a bias is left after T.",
        "dynamic_bias_correlation_time is T. dynamic_bias_stddev is the continuous-time density q_c of the noise",
        "that drives the bias. bias_stddev is sigma = q_c*sqrt(T/2), the standard deviation at the start of each run.",
        TIME_NOTE,
    ]
    body = []
    tags = ("angular_velocity", "linear_acceleration")
    choose = partial(choose_gauss_markov, overbound=overbound, simulator=True)
    names = ("N", "q_c", "correlation_time")
    found = triads_of(axes, tags, choose, names)
    for tag, places in found.numbers.items():
        body.append(f"  <{tag}>\n")
        for letter, white, q_c, time in zip("xyz", *places.values(), strict=True):
            body.append(
                f'    <{letter}><noise type="gaussian"><mean>0</mean>'
                f"<stddev>{white * math.sqrt(fs):.6e}</stddev>"
                f"<bias_mean>0</bias_mean><bias_stddev>{q_c * math.sqrt(time / 2):.6e}</bias_stddev>"
                f"<dynamic_bias_stddev>{q_c:.6e}</dynamic_bias_stddev>"
                f"<dynamic_bias_correlation_time>{time:.6e}</dynamic_bias_correlation_time>"
                f"</noise></{letter}>\n"
            )
        body.append(f"  </{tag}>\n")
    notes = head_comments(found.pairs, [*convention, *found.remarks], simulator=True)
    return xml_comment(notes) + "<imu>\n" + "".join(body) + "</imu>\n"


TARGETS = (Target("gazebo", "Gazebo", "gazebo.sdf", render, whole_record=True),)
