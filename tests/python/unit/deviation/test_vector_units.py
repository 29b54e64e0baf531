"""The core computes the same on every vector unit, down to plain code, which is what other processors run."""

import json
import subprocess
import sys

import numpy as np
import pytest

import allanite as al
from allanite import _core

# Widths are for the life of a process.
CODE = """
import json, sys
import numpy as np
import allanite as al
from allanite import _core
from allanite.deviation import ESTIMATORS
assert _core.vector_unit(sys.argv[1]) == sys.argv[1]
x = np.random.default_rng(1).normal(size=20_011) + np.linspace(0.0, 3.0, 20_011)
names = [name for name in ESTIMATORS if "theo" not in name]
found = {name: getattr(al, name)(x, taus=6).deviation.tolist() for name in names}
found["theo1"] = al.theo1(x[:4000]).deviation.tolist()
model = al.parse_model("N(N=1)+B(B=0.3)+K(K=0.01)+GM(q_c=1, correlation_time=2)")
found["bits"] = model.simulate(duration=5000, rate=1.0, seed=2).samples.tolist()
fit = al.parse_model("N+B").fit(al.Recording(x, rate=1.0))
found["fit"] = [one.value for column in fit.estimates for one in column.values()]
print(json.dumps(found))
"""


def computed(unit):
    run = subprocess.run([sys.executable, "-c", CODE, unit], capture_output=True, check=True)
    return {name: np.array(values) for name, values in json.loads(run.stdout).items()}


@pytest.mark.long
def test_every_unit_computes_the_same():
    found = {unit: computed(unit) for unit in ("portable", _core.vector_unit())}
    plain, wide = found["portable"], found[_core.vector_unit()]
    # Random numbers are the same bits everywhere.
    np.testing.assert_array_equal(plain.pop("bits"), wide.pop("bits"))
    # The climb ends within its own tolerance.
    np.testing.assert_allclose(plain.pop("fit"), wide.pop("fit"), rtol=1e-6)
    # A phase of some 1e4 rounds at 2e-12, and the parabolic sums, which lose most, are differences of such phases times m.
    for name, values in plain.items():
        np.testing.assert_allclose(values, wide[name], rtol=2e-11, err_msg=name)


def test_a_unit_that_is_not_there_is_refused():
    with pytest.raises(al.InputError, match='no vector unit "neon": this processor has portable'):
        _core.vector_unit("neon")
