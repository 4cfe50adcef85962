"""Former names of what users call: they go on, with a `DeprecationWarning` that gives the present name."""

from __future__ import annotations

import functools
import sys
import warnings

TYPE_CHECKING = False  # type checkers take it for True; `typing` takes long to load for what must be quick to begin
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import ParamSpec, TypeVar

    _Given = ParamSpec("_Given")
    _Made = TypeVar("_Made")


def former_names(module: str, **present: str) -> Callable[[str], object]:
    """Return a module's `__getattr__` (PEP 562) that finds what it defines by former names, too.

    Args:
        module: Its name.
        present: The present name of each former one.
    """

    def get(name: str) -> object:
        if name not in present:
            raise AttributeError(f"module '{module}' has no attribute '{name}'")
        warn_former(f"{module}.{name}", f"{module}.{present[name]}")
        return getattr(sys.modules[module], present[name])

    return get


def former_arguments(**present: str) -> Callable[[Callable[_Given, _Made]], Callable[_Given, _Made]]:
    """Return a decorator of functions whose arguments are given by former names, too.

    A call that gives an argument by both of its names raises `TypeError`.

    Args:
        present: The present name of each former one.
    """

    def decorate(function: Callable[_Given, _Made]) -> Callable[_Given, _Made]:
        @functools.wraps(function)
        def call(*args: _Given.args, **given: _Given.kwargs) -> _Made:
            for name in present.keys() & given.keys():
                if present[name] in given:
                    raise TypeError(f"`{name}` is the former name of `{present[name]}`; give `{present[name]}` alone.")
                warn_former(f"`{name}`", f"`{present[name]}`")
                given[present[name]] = given.pop(name)
            return function(*args, **given)

        return call

    return decorate


def warn_former(name: str, present: str) -> None:
    """Warn the caller's caller of a former name.

    Args:
        name: The former name.
        present: The present one.
    """
    warnings.warn(f"{name} is {present} now.", DeprecationWarning, stacklevel=3)
