"""A Crazyflie's supervisor, as the firmware of August 2026 has it: states, what leads from one to another, and what it reports.

Written from the transitions that `supervisor.c` and `supervisor_state_machine.c` of bitcraze/crazyflie-firmware list. It looks 25 times a second. Brushless
vehicles are armed, then spin up, and only then can fly; others arm themselves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

PERIOD = 0.04
"""s between two looks."""
FLYING_FOR = 2.0
"""s for which it takes a vehicle to fly behind the last thrust."""
PREFLIGHT, LANDED = 30.0, 3.0
"""s until an armed vehicle that does not fly is disarmed, and one that has landed."""
SPIN_UP_MOST = 2.0
"""s that motors have to spin up."""


@dataclass
class Supervisor:
    """One vehicle's.

    Attributes:
        brushless: Whether it has to be armed.
        spin_up: s that motors take until they can carry it.
        armed: Whether it is asked to be armed.
        emergency: Whether it was told to stop whatever it does.
        tumbled: Whether it lies on its back.
        state: Of the firmware's.
        said: All states that it was in, in order.
    """

    brushless: bool = False
    spin_up: float = 0.0
    armed: bool = False
    emergency: bool = False
    tumbled: bool = False
    state: str = "checks not passed"

    def __post_init__(self) -> None:
        self.said: list[str] = [self.state]
        self._since, self._thrust, self._looked = 0.0, -math.inf, -math.inf

    def settle(self) -> None:
        """Be as a vehicle is some time after it was switched on."""
        for step in range(6):
            self.look((step - 6) * PERIOD, thrust=False)

    def request(self, arm: bool) -> bool:
        """Take a request to arm, or to disarm; return whether it was taken."""
        if arm != self.armed and arm and self.state != "checks passed":
            return False
        self.armed = arm
        return True

    def look(self, now: float, *, thrust: bool) -> None:
        """Go on to the next state where it is time to look.

        Args:
            now: s.
            thrust: Whether motors turn faster than idle.
        """
        if thrust:
            self._thrust = now
        if now < self._looked + PERIOD - 1e-9:
            return
        self._looked = now
        found = self._next(now)
        if found == self.state:
            return
        self.state, self._since = found, now
        self.said.append(found)
        if found not in ("arming", "ready", "flying", "landed"):
            self.armed = False
        if found == "checks passed" and not self.brushless:
            self.armed = True

    def _next(self, now: float) -> str:
        flies, long = now - self._thrust < FLYING_FOR, now - self._since
        match self.state:
            case "checks not passed":
                return "locked" if self.emergency else self.state if self.tumbled else "checks passed"
            case "checks passed":
                return (
                    "locked"
                    if self.emergency
                    else "checks not passed"
                    if self.tumbled
                    else "arming"
                    if self.armed
                    else self.state
                )
            case "arming":
                stays = self.state if long < self.spin_up else "ready"
                failed = self.tumbled or not self.armed or long > SPIN_UP_MOST
                return "locked" if self.emergency else "checks not passed" if failed else stays
            case "ready":
                failed = self.tumbled or not self.armed or long > PREFLIGHT
                stays = "flying" if flies else self.state
                return "locked" if self.emergency else "checks not passed" if failed else stays
            case "flying":
                stays = self.state if flies else "landed"
                return "locked" if self.emergency else "crashed" if self.tumbled else stays if self.armed else "reset"
            case "landed":
                return "reset" if not self.armed or long > LANDED else "flying" if flies else self.state
            case "reset":
                return "checks not passed"
            case _:
                return "locked" if self.emergency else self.state

    @property
    def can_fly(self) -> bool:
        """Whether commands are taken, and set-points followed."""
        return self.state in ("ready", "flying", "landed")

    @property
    def runs_motors(self) -> bool:
        """Whether motors may turn."""
        return self.can_fly or self.state == "arming"

    @property
    def info(self) -> int:
        """The bits of `supervisor.info` that are the supervisor's own."""
        bits = (self.state == "checks passed", self.armed, not self.brushless, self.can_fly, self.state == "flying",
                self.tumbled, self.state == "locked", self.state == "crashed")  # fmt: skip
        return sum(bit << place for place, bit in enumerate(bits))
