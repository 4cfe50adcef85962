"""Methods whose answers each object keeps, so that nothing is worked out twice."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, TypeVar, cast

Method = TypeVar("Method", bound=Callable[..., object])


def memoized(method: Method) -> Method:
    """Keep what a method answers, for each object and for arguments that can be hashed; an answer that was raised is not kept.

    The object needs a `__dict__`: there the first call puts the method with its answers, so that later ones cost no more than a look-up.

    Args:
        method: Of a class, whose answer depends on its arguments alone.
    """
    return cast(Method, _Memoized(method))


class _Memoized:
    """Stands in a class for a method, until an object has its own with the answers."""

    def __init__(self, method: Callable[..., object]) -> None:
        self._method = method

    def __get__(self, owner: Any, _: type) -> Callable[..., object]:
        found = owner.__dict__[self._method.__name__] = cache(self._method.__get__(owner))
        return found
