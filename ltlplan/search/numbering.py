"""States in the order in which they come up: their numbers, and all that some lead to."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Iterator
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


def closure(begin: Iterable[Key], onwards: Callable[[Key], Iterable[Key]]) -> Iterator[Key]:
    """Yield all keys that some lead to, these first, breadth first.

    Args:
        begin: Where to begin.
        onwards: What can follow each key; asked once of each, after it was yielded.
    """
    found = dict.fromkeys(begin)
    waiting = list(found)
    for key in waiting:  # grows while it is walked
        yield key
        fresh = dict.fromkeys(after for after in onwards(key) if after not in found)
        found |= fresh
        waiting += fresh
