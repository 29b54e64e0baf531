"""Puts allanite's deviations into allantools: `test_peers.py` makes it the conftest of allantools' own tests."""

from __future__ import annotations

import inspect

import allantools
import numpy as np
from allantools import allantools as module

import allanite as al

NAMES = [
    "adev",
    "oadev",
    "mdev",
    "hdev",
    "ohdev",
    "tdev",
    "pdev",
    "totdev",
    "mtotdev",
    "ttotdev",
    "htotdev",
    "tierms",
    "mtie",
    "theo1",
]


def _ours(name):
    function = getattr(al, name)
    # By default allanite divides known bias out.
    plain = {"unbiased": False} if "unbiased" in inspect.signature(function).parameters else {}

    def deviation(data, rate=1.0, data_type="phase", taus=None):
        data = np.asarray(data, dtype=float)
        # Which averaging times are asked for, and which of them fit, is allantools' own reading.
        phase = module.input_to_phase(data, rate, data_type)
        most = len(phase) // 3 if name in ("mtotdev", "ttotdev", "htotdev") else -1
        _, m, _ = module.tau_generator(phase, rate, taus, even=name == "theo1", maximum_m=most)
        quantity = {"phase": "angle", "freq": "rate"}[data_type]
        found = function(data, rate=rate, factors=m, quantity=quantity, **plain)
        # The τ of Theo1 is the effective one, 0.75 m τ0, here, and m τ0 there.
        tau = found.factors / rate
        errors = found.deviation / np.sqrt(np.maximum(found.n, 1))
        return module.remove_small_ns(tau, found.deviation, errors, found.n)

    return deviation


for _name in NAMES:
    for _place in (allantools, module):
        setattr(_place, _name, _ours(_name))
