"""The public names: each can be had, and none costs anything before it is asked for."""

import subprocess
import sys

import pytest

import allanite


@pytest.mark.parametrize("name", allanite.__all__)
def test_every_public_name_is_there(name):
    pytest.importorskip("allanite.deviation")
    value = getattr(allanite, name)
    assert value is getattr(allanite, name)
    assert type(value).__name__ != "module"


def test_unknown_names_are_refused():
    with pytest.raises(AttributeError, match="nonsense"):
        _ = allanite.nonsense


def test_listing():
    assert dir(allanite) == sorted(allanite.__all__)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("former", "now"),
    [
        ("power", "detection_power"),
        ("predict", "error_growth"),
        ("release", "free_buffers"),
        ("summarise", "summarize"),
        ("CATALOGUE", "CATALOG"),
        ("effects.CATALOGUE", "effects.CATALOG"),
        ("Bandwidth", "effects.Bandwidth"),
        ("WarmUp", "effects.WarmUp"),
    ],
)
def test_a_former_name_works_and_warns_of_the_new_one(former, now):
    code = (
        "import warnings, allanite\n"
        "with warnings.catch_warnings(record=True) as caught:\n"
        "    warnings.simplefilter('always')\n"
        f"    found = allanite.{former}\n"
        f"assert found is allanite.{now}\n"
        "print(*[f'{w.category.__name__}: {w.message}' for w in caught])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == f"DeprecationWarning: al.{former} is now al.{now}"


BAND = allanite.effects.Resonance(frequency=10.0, damping=0.01, rms=1.0)


@pytest.mark.parametrize(
    ("kind", "former", "arguments", "now"),
    [
        ("Outliers", "at", ([1.0, 7.0],), "Outliers(count=2, times=(1.0, 7.0))"),
        ("Disturbance", "during", (1.0, 2.0, 3.0), "Disturbance(start=1.0, end=2.0)"),
        ("NoiseLevelChange", "during", (1.0, 2.0, 3.0), "NoiseLevelChange(1.0, 2.0, 3.0)"),
        ("NoiseLevelChange", "at", ([1.0],), None),
        (
            "BandLevelChange",
            "changing",
            ((2.0, 4.0), (5.0, 9.0), 3.0),
            "BandLevelChange(low=2.0, high=4.0, start=5.0, end=9.0, factor=3.0)",
        ),
        (
            "NoiseLevels",
            "switched",
            ((5.0, 9.0), (2.0, 1.0)),
            "NoiseLevels(times=(5.0, 9.0), factors=(2.0, 1.0))",
        ),
        (
            "PeriodicNoiseLevel",
            "gated",
            (60.0, 12.0, 0.25, 2.0),
            "PeriodicNoiseLevel(period=60.0, start=12.0, share=0.25, factor=2.0)",
        ),
        (
            "DriftingResonance",
            "along",
            (BAND, [11.0, 10.0]),
            "DriftingResonance(course=(11.0, 10.0), damping=0.01, rms=1.0)",
        ),
        (
            "ModulatedVibration",
            "modulating",
            (BAND, 2.0, 2.0),
            "ModulatedVibration(10.0, 0.01, 3**0.5, modulation=2.0, depth=2.0)",
        ),
    ],
)
def test_a_former_way_to_make_an_effect_works_and_warns(kind, former, arguments, now):
    effect = getattr(allanite.effects, kind)
    with pytest.warns(DeprecationWarning, match=rf"{kind}\.{former} is now {kind}\.") as caught:
        found = getattr(effect, former)(*arguments)
    assert caught[0].filename == __file__
    assert found == (now and eval(now, vars(allanite.effects)))


@pytest.mark.parametrize(
    ("owner", "former", "now"),
    [
        (allanite.Check, "rest", "unexplained_shape"),
        (allanite.Fit, "excess", "unexplained_misfit"),
        (allanite.Fit, "instead_of_two", "alternatives_to_pairs"),
        (allanite.Fit, "together", "alternative_pairs"),
        (allanite.Fits, "together", "pooled"),
        (allanite.Growth, "shown", "display_unit"),
        (allanite.ManyFits, "of", "record_noun"),
        (allanite.Recording, "told_of", "with_findings"),
        (allanite.Recording, "told", "added_findings"),
        (allanite.Recording, "called", "with_path"),
        (allanite.Recording, "whole", "keeps_all_samples"),
        (allanite.Summary, "told", "added_findings"),
        (allanite.Summary, "whole", "keeps_all_samples"),
        (allanite.criticism.Where, "places", "failures"),
        (allanite.effects.Modifier, "swells", "changes_level_of"),
        (allanite.effects.Bandwidth, "otherwise", "equal_forms"),
        (allanite.effects.DriftingResonance, "stretches", "segments"),
    ],
)
def test_a_former_attribute_works_and_warns(owner, former, now):
    class Present(owner):
        pass

    setattr(Present, now, "present")
    instance = object.__new__(Present)
    with pytest.warns(
        DeprecationWarning, match=rf"Present\.{former} is now Present\.{now}"
    ) as caught:
        assert getattr(instance, former) == "present"
    assert caught[0].filename == __file__


def test_the_package_itself_imports_nothing():
    code = "import sys, allanite; print([m for m in ('numpy', 'scipy') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_name_of_an_effect_is_no_name_of_an_estimate():
    model = allanite.parse_model("N+GM")
    fit = model.fit(
        allanite.parse_model("N(N=0.1)+GM(q_c=0.1,T=5)").simulate(n=2000, rate=10.0, seed=1)
    )
    assert fit["GM.q_c"] == fit.estimates_of("GM")["q_c"]
    with pytest.warns(DeprecationWarning, match=r"fit\['GM'\] is now fit\.estimates_of\('GM'\)"):
        assert fit["GM"] == fit.estimates_of("GM")


def test_a_parameter_that_is_no_number_is_no_estimate():
    model = allanite.parse_model("N(N=0.1)+BW(cutoff=1,acts_on=white)")
    fit = model.fit(model.simulate(n=2000, rate=10.0, seed=1))
    with pytest.warns(DeprecationWarning, match=r"is now fit\.estimates\[1\]\['acts_on'\]"):
        assert fit["BW.acts_on"] == fit.estimates[1]["acts_on"]
