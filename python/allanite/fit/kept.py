"""Results of searches about a fit that are computed once and kept with the fit."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import TYPE_CHECKING, Any, Concatenate, ParamSpec, TypeVar

if TYPE_CHECKING:
    from allanite.fit.result import Fit

P = ParamSpec("P")
T = TypeVar("T")


def kept_with_fit(function: Callable[Concatenate[Fit, P], T]) -> Callable[Concatenate[Fit, P], T]:
    """Decorator of a function of a fit and of hashable arguments: the fit keeps each result until `forget`."""

    @wraps(function)
    def kept(fit: Fit, /, *args: P.args, **kwargs: P.kwargs) -> T:
        """Result of `function` for these arguments, computed at the first call."""
        results = fit.kept.setdefault(function.__name__, {})
        if args not in results:
            results[args] = function(fit, *args, **kwargs)
        found: T = results[args]
        return found

    return kept


def forget(fit: Fit, function: Callable[..., Any]) -> None:
    """Drop the results of a `function` with `kept_with_fit` from the fit, to free their memory."""
    fit.kept.pop(function.__name__, None)
