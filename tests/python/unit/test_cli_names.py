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


def test_every_effect_is_public():
    names = {effect.__name__ for effect in allanite.CATALOGUE if "allanite" in effect.__module__}
    assert all(hasattr(allanite.effects, name) for name in names)


def test_the_package_itself_imports_nothing():
    code = "import sys, allanite; print([m for m in ('numpy', 'scipy') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
