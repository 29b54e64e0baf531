"""allanite: noise models of inertial sensors and clocks, checked against measurements until nothing is missing.

`__init__.pyi` lists the public names. Each name is imported at its first use, so that importing allanite is fast.
`allanite.simulate` is a module; models have a method `simulate`.
"""

from __future__ import annotations

import ast
from importlib import import_module
from pkgutil import get_data

_STUB = ast.parse(get_data(__name__, "__init__.pyi") or b"").body
#: Module of each public name.
_HOMES = {
    alias.name: node.module
    for node in _STUB
    if isinstance(node, ast.ImportFrom)
    for alias in node.names
}
#: Present name of each former name.
_FORMER = {
    ast.unparse(node.targets[0]): ast.unparse(node.value)
    for node in _STUB
    if isinstance(node, ast.Assign)
}
__all__ = ["__version__"]
__all__ += sorted(name for name, module in _HOMES.items() if module != __name__)


def __getattr__(name: str) -> object:
    if name == "__version__":
        from allanite._kernels import version

        value: object = version()
    elif name in _HOMES:
        home = _HOMES[name]
        # The value of a public module, such as `allanite.effects`, is the module itself.
        value = (
            import_module(f"{home}.{name}")
            if home == __name__
            else getattr(import_module(home), name)
        )
    elif name in _FORMER:
        _warn(name, _FORMER[name])
        value = __getattr__(_FORMER[name])
    else:
        value = _former_effect(name)
    globals()[name] = value
    return value


def _former_effect(name: str) -> object:
    """Effect class `name`, formerly a name of this package, with a `DeprecationWarning`.

    The class is now in `allanite.effects`. `AttributeError` if no effect class of the catalog has this name.
    """
    if name[:1].isupper():
        effects = import_module("allanite.effects")
        if name in (effect.__name__ for effect in effects.CATALOG) and hasattr(effects, name):
            _warn(name, f"effects.{name}", stacklevel=5)
            found: object = getattr(effects, name)
            return found
    raise AttributeError(f"module 'allanite' has no attribute {name!r}")


def _warn(former: str, name: str, stacklevel: int = 4) -> None:
    """Warn (`DeprecationWarning`) that ``al.former`` is now ``al.name``; for `stacklevel` see `warnings.warn`."""
    from allanite.common.former import warn_of_former_name

    warn_of_former_name(f"al.{former}", f"al.{name}", stacklevel)


def __dir__() -> list[str]:
    return __all__
