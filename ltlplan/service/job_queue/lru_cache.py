"""Cache of what was requested lately, in memory up to a size, so that a second request waits for no disk and no other thread."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Hashable
from typing import Generic, TypeVar

Value = TypeVar("Value")


class Recent(Generic[Value]):
    """Values by a key; those that were not asked for longest are forgotten. May be used from any thread."""

    def __init__(self, most: int) -> None:
        """Keep nothing yet.

        Args:
            most: How large all values may be together, by the sizes that they are put with.
        """
        self._most = most
        self._size = 0
        self._kept: OrderedDict[Hashable, tuple[Value, int]] = OrderedDict()
        self._lock = threading.Lock()

    def __contains__(self, key: Hashable) -> bool:
        """Return whether there is a value."""
        return key in self._kept

    def get(self, key: Hashable) -> Value | None:
        """Return a value, or None where it is not kept."""
        with self._lock:
            if key not in self._kept:
                return None
            self._kept.move_to_end(key)
            return self._kept[key][0]

    def put(self, key: Hashable, value: Value, size: int = 1) -> Value:
        """Keep a value and return it; one that is larger than all may be is not kept.

        Args:
            key: What it is asked for by.
            value: Not to be changed any more.
            size: How large it is.
        """
        with self._lock:
            if size <= self._most and key not in self._kept:
                self._kept[key] = (value, size)
                self._size += size
                while self._size > self._most:
                    self._size -= self._kept.popitem(last=False)[1][1]
        return value
