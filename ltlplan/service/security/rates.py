"""Rate limits of clients: a bucket for each, which a request empties and time fills."""

from __future__ import annotations

import math
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field

from ltlplan.service.problems import TooManyRequests
from ltlplan.service.settings import Rate

MOST_CLIENTS = 10_000
"""Clients that are remembered; those not seen for longest are forgotten."""


@dataclass
class Rates:
    """The buckets of one kind of request.

    Attributes:
        rate: How fast they fill, and how much they hold.
        clock: s, growing.
    """

    rate: Rate
    clock: Callable[[], float] = time.monotonic
    _left: OrderedDict[str, tuple[float, float]] = field(default_factory=OrderedDict, init=False, repr=False)

    def take(self, client: str) -> None:
        """Take one request out of a client's bucket.

        Raises:
            TooManyRequests: It is empty; says how long to wait.
        """
        now = self.clock()
        left = self._filled(client, now)
        self._left[client] = (max(0.0, left - 1.0) if left >= 1.0 else left, now)
        self._left.move_to_end(client)
        while len(self._left) > MOST_CLIENTS:
            self._left.popitem(last=False)
        if left < 1.0:
            wait = (1.0 - left) / self.rate.per_second
            raise TooManyRequests(
                f"Too many requests: {self.rate.per_second:g} a second are answered, and {self.rate.burst} at once. "
                f"Try again in {math.ceil(wait)} s.",
                wait,
            )

    def require_any(self, client: str) -> None:
        """Reject a client whose bucket is empty, without taking anything.

        Raises:
            TooManyRequests: It is empty.
        """
        left = self._filled(client, self.clock())
        if left < 1.0:
            wait = (1.0 - left) / self.rate.per_second
            raise TooManyRequests(f"Too many wrong tokens from this address. Try again in {math.ceil(wait)} s.", wait)

    def _filled(self, client: str, now: float) -> float:
        left, then = self._left.get(client, (float(self.rate.burst), now))
        return min(float(self.rate.burst), left + (now - then) * self.rate.per_second)
