"""A hold that is ordered: robots brake to a hover and stay there until the team is ordered to land, or until a hold cannot last.

Nothing of it is certified, and it is flown by what vehicles have on board: a Crazyflie goes to where it comes to rest, PX4 changes to its mode Hold, a simulated
vehicle brakes. It becomes a landing by itself where a pose grows stale, where a robot does not acknowledge or has battery for little more than a landing, and after `LONGEST` in any case.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from flight.exports.scripts.flying.ending import AGAIN, time_to_land
from flight.link.link import Link
from flight.link.record import Record

LONGEST = 60.0
"""s that a team holds at most before it lands."""


class Hold:
    """Hold of one team.

    Attributes:
        since: When the last robot acknowledged it, s of the link's clock; infinite before.
    """

    def __init__(
        self, link: Link, record: Record, robots: Sequence[str], ground: Callable[[str], float], limits: Mapping[str, float]
    ) -> None:
        """Take a team in the air.

        Args:
            link: To the robots.
            record: Takes in where they are.
            robots: Whose motors turn.
            ground: Returns z in m of the ground below a robot.
            limits: The numbers.
        """
        self._link, self._record, self._robots, self._limits = link, record, robots, limits
        self._targets = {robot: ground(robot) + limits["landing_height"] for robot in robots}
        self._begun, self.since = link.now(), math.inf

    def last(self) -> str:
        """Tell robots to hold until each has acknowledged it, and let time go on while that can last; return why it cannot, in words.

        Whatever the link raises meanwhile, an order to land among it, comes through.
        """
        left = list(self._robots)
        while not (why := self._ends(left)):
            left = [robot for robot in left if not self._link.hold(robot)]
            if not left:
                self.since = min(self.since, self._link.now())
            self._link.sleep(AGAIN)
            self._record.see(self._link, self._robots)
        return why

    def _ends(self, left: Sequence[str]) -> str:
        """Return why a hold ends now; nothing while it goes on. `left` have not acknowledged it."""
        link, lasted = self._link, self._link.now() - self._begun
        needed = self._limits["empty"] + time_to_land(link, self._targets, self._limits)
        for robot in self._robots:
            pose, lasts = link.pose(robot), link.health(robot).endurance
            if pose is None or link.now() - pose.time > self._limits["fresh"]:
                return f"{robot} is not seen"
            if lasts is not None and lasts <= needed:
                return f"{robot}'s battery lasts for {max(lasts, 0.0):.0f} s, of which landing takes {needed:.0f} s"
        if left and lasted > self._limits["patience"]:
            return f"{', '.join(left)} has not acknowledged it"
        return f"it has lasted {LONGEST:g} s" if lasted >= LONGEST else ""
