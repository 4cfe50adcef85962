"""A robot that leaves a team in flight: it lands where it is and stops its motors, told until it has acknowledged that."""

from __future__ import annotations

from dataclasses import dataclass

from flight.exports.scripts.flying.ending import AGAIN, see_down, time_to_land
from flight.exports.scripts.flying.standing import Standing
from flight.link.link import Link
from flight.link.live_executive import Alarm
from flight.link.record import Record
from flight.monitoring.alarm_response import LANDING_HEIGHT
from flight.monitoring.thresholds import LANDED, PATIENCE, limits


@dataclass(slots=True)
class Leaving:
    """Progress of a robot that leaves.

    Attributes:
        robot: Its name.
        ground: z in m below it.
        asked: When it was first told, s of the link's clock; None where it was not yet.
        down: When it is on the ground, s of the link's clock; None before it has acknowledged that it lands.
        stopped: Whether it has acknowledged that its motors stop, or was told for long enough.
        off: Whether it has acknowledged it.
    """

    robot: str
    ground: float
    asked: float | None = None
    down: float | None = None
    stopped: bool = False
    off: bool = False
    _told: float = float("-inf")
    _standing: Standing | None = None

    def go_on(self, link: Link, record: Record) -> None:
        """Tell it what is next, once more where it has not acknowledged that.

        Args:
            link: To it.
            record: Takes in what is done.

        Raises:
            Alarm: It does not acknowledge that it lands.
        """
        now = link.now()
        if self.stopped or now - self._told < AGAIN:
            return
        self._told = now
        if self.asked is None:
            self.asked = now
            record.note(now, f"{self.robot} lands where it is.", self.robot, "reaction")
        if self.down is None:
            target = self.ground + LANDING_HEIGHT
            seconds = time_to_land(link, {self.robot: target}, limits(link.accuracy))
            if link.land(self.robot, target, seconds):
                self.down = now + seconds
            elif now - self.asked > PATIENCE:
                raise Alarm(f"{self.robot} does not acknowledge that it lands.")
        elif self._stands(link) or now >= self.down + LANDED:
            self.off = link.stop(self.robot)
            self.stopped = self.off or now - self.down > LANDED + 3 * PATIENCE

    def _stands(self, link: Link) -> bool:
        """Return whether it stands, as far as was seen since it lands."""
        if self._standing is None:
            self._standing = Standing({self.robot: self.ground + LANDING_HEIGHT}, limits(link.accuracy))
            self._standing.land(self.down or link.now())
        return see_down(link, self._standing, self.robot)
