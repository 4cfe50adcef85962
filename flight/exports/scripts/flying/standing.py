"""Detection that a landing robot stands, so that its motors may stop: for live links and exported scripts.

Standard library only; copied into exports.

A robot's own word goes first: a supervisor that said that it flies, and says so no more. A Crazyflie's does 2 s after its motors have carried
nothing. Where there is no such word a robot stands once it is measured low and at rest over a while, behind the end of its landing.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping


class Standing:
    """Looks at robots that land, and tells which of them stand."""

    def __init__(self, targets: Mapping[str, float], limits: Mapping[str, float]) -> None:
        """Look at robots from when they begin to land on.

        Args:
            targets: z in m where each one's landing ends.
            limits: The numbers: `near`, `watched`, `quiet` and `accuracy`.
        """
        self._targets, self._limits = dict(targets), limits
        self._heights: dict[str, deque[tuple[float, float]]] = {name: deque() for name in targets}
        self._word: dict[str, bool] = {}
        self._ends = -math.inf

    def land(self, ends: float) -> None:
        """Begin with a landing, or begin it anew: heights count from its end on.

        Args:
            ends: When it is to end, s of the poses' clock.
        """
        self._ends = ends
        for seen in self._heights.values():
            seen.clear()

    def see(self, name: str, time: float, height: float, flying: bool | None) -> None:
        """Take in what is measured of a robot, and what it says.

        Args:
            name: The robot's.
            time: s, when it was measured.
            height: z in m.
            flying: Whether it says that it flies; None where it does not say.
        """
        if flying is not None and (flying or name in self._word):  # that it does not fly says something only of one that flew
            self._word[name] = flying
        seen = self._heights[name]
        if time >= self._ends and (not seen or time > seen[-1][0]):
            seen.append((time, height))
        while len(seen) > 2 and seen[1][0] <= time - self._limits["watched"]:
            seen.popleft()

    def stands(self, name: str) -> bool:
        """Tell whether a robot stands.

        Args:
            name: The robot's.
        """
        if name in self._word:
            return not self._word[name]
        seen, limits = self._heights[name], self._limits
        if not seen or seen[-1][0] - seen[0][0] < limits["watched"]:
            return False
        heights = [height for _, height in seen]
        still = max(heights) - min(heights) <= limits["quiet"] + 2.0 * limits["accuracy"]
        return still and max(heights) <= self._targets[name] + limits["near"]

    def flying(self, names: list[str]) -> list[str]:
        """Return which of some robots are not known to stand.

        Args:
            names: The robots'.
        """
        return [name for name in names if not self.stands(name)]
