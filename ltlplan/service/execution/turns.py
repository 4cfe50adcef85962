"""Fair shares of a pool: its users take turns, and each one's work is begun in the order in which it came.

Start-time fair queueing, each piece of work counting one, of studies more: a user's first piece has the rank that has come, every further one a
rank after that user's last. Pools begin what has the lowest rank.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from typing import Any


class Turns:
    """Ranks of work by whose it is. May be used from any thread."""

    def __init__(self) -> None:
        self._now = 0
        self._next: dict[str, int] = {}
        self._lock = threading.Lock()

    def rank(self, user: str, *, cost: int = 1) -> int:
        """Return the rank of a user's next piece of work.

        Args:
            user: A token's name, or an address.
            cost: How many turns of others pass before this user's next.
        """
        with self._lock:
            rank = max(self._now, self._next.get(user, 0))
            self._next[user] = rank + cost
            return rank

    def ended(self, rank: int) -> None:
        """Note that work of a rank has ended, however it did: who comes now does not come before others of that rank."""
        with self._lock:
            if rank > self._now:
                self._now = rank
                self._next = {user: following for user, following in self._next.items() if following > rank}


@dataclass(frozen=True, slots=True)
class SharedPool:
    """A pool, and whose turn it is there.

    Attributes:
        pool: Who computes: `LocalWorkers`, or what has its surface.
        turns: Of all who give it work.
    """

    pool: Any
    turns: Turns = field(default_factory=Turns)
