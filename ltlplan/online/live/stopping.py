"""Stopping of a team in the air after an event: computed in a background process, and anew where its answer comes too late."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import inf

from flight.link.live_executive import STEP, Alarm
from ltlplan.online.live.executors import Answer, way_to_stop
from ltlplan.online.live.flight_session import InAir, result_of
from ltlplan.online.segments.braking import StoppingManoeuvre
from verify.data import Trajectory

REACTION = 0.3
"""s from an event to where robots begin to slow down, at first: finding a way for three robots takes 0.15 s."""
LONGEST_REACTION = 2.0
"""s from an event, after which a team that has no proved way to come to rest holds as its vehicles do, and lands."""


@dataclass
class ComingToRest:
    """Search for a way to stop, if one goes on.

    Attributes:
        air: The team.
        then: What is done once all are on the way to rest.
        looks: Whether one is looked for now.
    """

    air: InAir
    then: Callable[[], None]
    looks: bool = False

    def ask(self, reaction: float = REACTION) -> None:
        """Ask for a way to come to rest.

        Args:
            reaction: s from now to where it begins.

        Raises:
            Alarm: None was found for too long.
        """
        air = self.air
        stop, self.looks = air.team.stop(), True
        assert stop is not None, "somebody is in the air"
        late = air.now - float(air.present.since)
        if late + reaction > LONGEST_REACTION:
            raise Alarm(f"no proved way to come to rest was found within {LONGEST_REACTION:g} s.")
        about = replace(stop, reaction=late + reaction)
        air.ask(way_to_stop, about, lambda answer: self._found(answer, reaction))

    def _found(self, answer: Answer, reaction: float) -> None:
        """Come to rest as was found, unless it begins in the past: then ask for a later one."""
        how: StoppingManoeuvre = result_of(answer)
        air, before = self.air, self.air.present.team
        if how.refused:
            raise Alarm(f"no way to come to rest is proved: {how.refused[0].sentence}")
        if air.now - float(air.present.start) >= _first_change(before, how.team) - STEP:
            self.ask(2 * reaction)
            return
        air.team.take_stop(how)
        for robot in before.keys() - air.gone.keys():  # who hovers may be flying something else that ended there
            if how.team[robot].digest() != before[robot].digest():
                air.link.upload(robot, air.number, how.team[robot])
        air.watch_again()
        self.looks = False
        if air.answered[-1].stop is None:
            air.took(stop=air.link.now() - air.known)
        air.breathe()
        self.then()


def _first_change(before: Mapping[str, Trajectory], after: Mapping[str, Trajectory]) -> float:
    """Return when the first robot begins to fly otherwise, s on the trajectories' clocks."""
    begins = [float(path.knots[-2]) for name, path in after.items() if path.digest() != before[name].digest()]
    return min(begins, default=inf)
