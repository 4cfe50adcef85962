"""Branch and bound over instants and shares of the braking, whatever is asked there: what is not proved of a part is asked of its halves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Generic, Protocol, Self, TypeVar

import numpy as np

from verify.arithmetic.balls import Floats
from verify.arithmetic.bounds import Indices
from verify.motion.braking.patches import Flags

TOLERANCE = 1e-3
SHARE = 1 / 8
"""m, or this share of what is missing: how closely the least distance is sought of what comes too near."""
FINEST = 1e-6
"""m; parts that reach no further are not halved."""
MOST = 300_000
"""Parts that are looked at; what is left then is not proved."""
CERTAIN = 1e-9
"""m; what is too near by less is left to the bounds: roundings are far smaller."""
BLOCK = 4_096
"""Parts that are looked at at once."""


class Parts(Protocol):
    """Parts of flights and of the braking there, n of them."""

    def __len__(self) -> int: ...

    def __getitem__(self, index: Indices | Flags | slice) -> Self: ...

    def reaches(self) -> Floats:
        """Return how far each direction that can be halved reaches, about, m. Shape (directions, n)."""
        ...

    def halved(self, reaches: Floats) -> Self:
        """Return the halves of each along the direction that reaches furthest."""
        ...


Kind = TypeVar("Kind", bound=Parts)


@dataclass(eq=False, slots=True)
class Search(Generic[Kind]):
    """Parts that are not proved, and the one that falls short by most.

    Attributes:
        bounds: Returns how much more than is asked is proved of parts, m, and how much more is kept somewhere in them, m, in floats; infinite
            where that is not known. Shape (n,) each.
        excess: The least that was reached; 0 where nothing falls short.
        worst: Where, one part; None where nothing falls short.
        left: Parts of which it is not proved, and how much more than is asked is, m.
    """

    bounds: Callable[[Kind], tuple[Floats, Floats]]
    excess: float = 0.0
    worst: Kind | None = None
    left: list[tuple[Kind, Floats]] = field(default_factory=list[tuple[Kind, Floats]])
    _seen: int = 0

    def run(self, parts: Kind) -> None:
        """Halve parts until each is proved, or falls short by no more than what is reached already, or cannot be halved.

        Args:
            parts: Of any number.
        """
        stack = [parts]
        while stack:
            now = stack.pop()
            if len(now) > BLOCK:
                stack.append(now[BLOCK:])
                now = now[:BLOCK]
            if not len(now):
                continue
            self._seen += len(now)
            low, near = self.bounds(now)
            least = int(np.argmin(near))
            if near[least] < min(self.excess, -CERTAIN):
                self.excess, self.worst = float(near[least]), now[least : least + 1]
            still = np.flatnonzero(~(low >= (0.0 if self.worst is None else self.excess - self.tolerance)))
            still = still[np.argsort(low[still])]
            now, reaches = now[still], now[still].reaches()
            done = np.ones(len(now), dtype=bool) if self._seen > MOST else ~(reaches.max(axis=0) > FINEST)
            if done.any():
                self.left.append((now[done], low[still][done]))
            if not done.all():
                stack.append(now[~done].halved(reaches[:, ~done]))

    @property
    def tolerance(self) -> float:
        """Excess over `excess` by which parts may fall short, m."""
        return max(TOLERANCE, -SHARE * self.excess)
