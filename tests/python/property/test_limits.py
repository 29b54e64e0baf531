"""No fitted number is outside of its limits, whatever they are and whatever the record."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import allanite as al

RATE, N = 10.0, 4_000
TRUTHS = ["N(N=0.1)", "N(N=0.1)+K(K=0.01)", "N(N=0.1)+GM(q_c=0.05,T=8)", "N(N=0.1)+SIN(f=1.3,A=0.1)+R(R=1e-3)"]  # fmt: skip
MODELS = ["N+B+K", "Q+N+K+R", "N+GM+SIN", "N+K+RES", "N+GM+GM", "N+BW", "N+PL+R", "N+X"]


@st.composite
def limited(draw):
    """A model with limits on some parameters, near and far from any truth."""
    effects = []
    for effect in al.parse_model(draw(st.sampled_from(MODELS))):
        limits = {}
        for p in effect.parameters:
            if p.role not in {"coefficient", "shape"} or p.unit == "rad" or draw(st.booleans()):
                continue
            low = 10.0 ** draw(st.floats(-6, 3))
            high = low * 10.0 ** draw(st.floats(0.001, 4))
            low, high = max(low, 1.001 * p.low), min(high, 0.999 * p.high)
            if low < high:
                open_end = draw(st.sampled_from(["none", "low", "high"]))
                limits[p.name] = (
                    None if open_end == "low" else low,
                    None if open_end == "high" else high,
                )
        effects.append(effect.with_values(limits=limits))
    return al.Model(tuple(effects))


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(limited(), st.sampled_from(TRUTHS), st.integers(0, 50))
def test_no_fitted_number_nor_interval_is_outside(model, truth, seed):
    log = al.parse_model(truth).simulate(duration=N / RATE, rate=RATE, seed=seed, unit="deg/s")
    try:
        fit = al.fit_model(log, model)
    except al.InputError as error:
        if "are outside the range that this record can resolve" not in str(error):
            raise
        return
    for given_effect, effect, values in zip(model, fit.model, fit.estimates, strict=True):
        assert effect.limits == given_effect.limits
        for name, (low, high) in effect.limits.items():
            value = values[name]
            if value is None:  # an optional number that the model does without
                continue
            assert low <= value <= high
            declared, ends = effect.parameter(name), {low, high}
            if declared.role == "shape":
                ends |= {declared.low, declared.high}  # its declared range limits it, too
            assert (name in effect.at_limit) == (value in ends)
            if value.interval is not None:
                assert low <= value.interval[0] <= value.interval[1] <= high
    assert np.isfinite(fit.solution.log_likelihood)
