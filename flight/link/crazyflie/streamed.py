"""Crazyflies that are told every set-point from here, so that what they fly can be changed while it is flown.

Flights are kept here, and `sleep` sends each robot its full-state set-point of the instant, `RATE` times a second: that of the middle of the
time for which it holds, as the vehicle follows it unchanged until the next one.

On board a streamed set-point goes before the high-level commander and stops it, and a commander that is stopped asks for motors that stand
still. So a robot is handed to its high-level commander in this order: no more set-points; a go-to or a landing, from where the robot is,
until it is acknowledged; then that streamed set-points have ended, until it says that it follows another target than them. In between it
follows its last set-point, some hundredths of a second. From then on it needs nobody here.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from flight.link.crazyflie.link import CrazyflieLink
from flight.link.crazyflie.setpoints import full_state, require_near
from flight.link.crazyflie.steps import arm
from flight.link.link import LinkLost
from flight.link.streaming import RATE, SetpointStream
from verify.data import Mission, Trajectory

_LEVEL = "0.5 s after its last set-point a Crazyflie levels out, and drifts"
_STOPS = "1 s after the last sign of life from here its motors stop (the firmware's emergency-stop watchdog)"
_SHUTS = "2 s after it its motors stop (the firmware's supervisor; neither can be set or read back)"
_ALONE = "one that was told to hold or to land does so to the end"


class StreamedCrazyflies(CrazyflieLink):
    """Crazyflies, each by its own address, that follow set-points from here; made as a link whose flights lie on board.

    With `failsafe="fly on"` nothing acts on board but what set-points that end bring about.
    """

    _step = 0.002

    def _require(self, mission: Mission) -> None:
        require_near(mission)

    def _reached(self) -> None:
        if lacking := [name for name, vehicle in self._vehicles.items() if not vehicle.reports.tells_target]:
            raise LinkLost(f"{', '.join(lacking)} does not say what it follows (ctrltarget.x and z): flash a newer firmware.")
        self._stream = SetpointStream(self._vehicles)
        self._gone: dict[str, float] = {}
        self._landings: dict[str, tuple[float, float]] = {}

    @property
    def failsafe(self) -> str:
        """Reaction on board when nothing arrives from here any more."""
        return f"{_LEVEL}; {_STOPS if self._stops else _SHUTS}; {_ALONE}"

    @property
    def streams(self) -> bool:
        """Set-points come from here: what is stored anew while it is flown goes on changed."""
        return True

    def require_room(self, team: Mapping[str, Trajectory]) -> None:
        """Do nothing: flights are kept here.

        Args:
            team: Finite, as they are flown.
        """
        del team

    def upload(self, robot: str, number: int, path: Trajectory) -> None:
        """Keep a flight; it is streamed when it is started.

        Args:
            robot: Name.
            number: From 0.
            path: Finite, as it is flown.
        """
        self._stream.store(robot, number, path)
        self._commanders[robot].store(number, path)

    def bring(self, number: int, meanwhile: Callable[[], None]) -> None:
        """Do nothing: flights are kept here.

        Args:
            number: Of the flight.
            meanwhile: Not called.
        """
        del number, meanwhile

    def start(self, number: int, at: float | None = None) -> float:
        """Start a flight of all that have it: vehicles are armed before the first one, and each gets its first set-point at once.

        Args:
            number: Of the flight.
            at: When it is to begin, s of the link's clock; None for now.

        Returns:
            When it began, s of the link's clock.

        Raises:
            LinkLost: A vehicle does not arm.
        """
        new = [name for name in self._stream.those_in(number) if name not in self._flown]
        if new:
            arm([self._vehicles[name] for name in new], self.sleep)
            self._flown.update(new)
        self._stream.fly(number, self.now() if at is None else at)
        self.sleep(0.0)
        return self._stream.begin

    def hold(self, robot: str) -> bool:
        """Tell a robot to go to where it comes to rest when it brakes, and to follow that; return whether it does.

        Args:
            robot: Name.
        """
        self._leave(robot)
        return super().hold(robot) and self._follows_itself(robot)

    def land(self, robot: str, height: float, seconds: float) -> bool:
        """Tell a robot to sink, and to follow that; return whether it does. It is told once how far and how fast.

        Args:
            robot: Name.
            height: z in m where the landing ends.
            seconds: How long it takes.
        """
        self._leave(robot)
        return super().land(robot, *self._landings.setdefault(robot, (height, seconds))) and self._follows_itself(robot)

    def stop(self, robot: str) -> bool:
        """Tell a robot to stop its motors, by an emergency stop as well where it may follow set-points still; return whether it has acknowledged that.

        Args:
            robot: Name.
        """
        self._leave(robot)
        if robot in self._flown and not self._follows_itself(robot):
            self._vehicles[robot].emergency()
        return super().stop(robot)

    def _rest(self, robot: str, since: float) -> tuple[float, float, float, float]:
        """Return where a robot comes to rest that brakes from where it was last asked to be; x is between two millimetres, which no set-point is."""
        if (number := self._stream.begun(robot)) is not None:
            self._commanders[robot].start(number, self._stream.begin)
        x, y, z, heading = super()._rest(robot, min(since, self._stream.until))
        return (math.floor(1000.0 * x) + 0.5) / 1000.0, y, z, heading

    def _leave(self, robot: str) -> None:
        """Send a robot no more set-points."""
        if robot not in self._gone:
            self._gone[robot] = self.now()
            self._vehicles[robot].aim.end()

    def _follows_itself(self, robot: str) -> bool:
        """Return whether a robot follows its own commander since it was left; while it does not say so, it is told that set-points have ended."""
        vehicle = self._vehicles[robot]
        if vehicle.reports.own_target_at > self._gone[robot]:
            return True
        vehicle.aim.relax()
        return False

    def _go_on(self, now: float) -> None:
        """Give signs of life, and send each robot the set-point of this instant.

        Args:
            now: s of the link's clock.

        Raises:
            LinkLost: This computer was late by more than `LATE`; from then on robots are asked to stay where they last were.
        """
        super()._go_on(now)
        if not self._flown or not self._stream.due(now):
            return
        for name, vehicle in self._vehicles.items():
            asked = None if name in self._gone else self._stream.of(name, now + 0.5 / RATE, 4)
            if asked is not None:
                vehicle.aim.at(full_state(asked.flat))
        self._stream.require_in_time()
