"""Numbers for states of a search, in the order in which they come up."""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from typing import TypeVar

Key = TypeVar("Key", bound=Hashable)


class Numbers(dict[Key, int]):
    """The number of each key that was asked for, from 0.

    Attributes:
        known: The keys, by number.
    """

    def __init__(self, keys: Iterable[Key] = ()) -> None:
        """Number some keys.

        Args:
            keys: Different ones, in their order.
        """
        super().__init__()
        self.known: list[Key] = []
        for key in keys:
            self.__missing__(key)

    def __missing__(self, key: Key) -> int:
        """Return the next number."""
        number = self[key] = len(self.known)
        self.known.append(key)
        return number
