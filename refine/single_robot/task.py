"""Inputs and results of the steps of one robot's refinement."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from refine.corridor.corridor import Corridor
from refine.corridor.fitting import BUFFER
from refine.corridor.sampled_stays import violations
from refine.feedback import Feedback
from refine.limits.limits import Limits
from refine.spline.spline import Spline
from verify.data import Mission, Plan, RobotPlan, Witness
from verify.data.validation.spacing import Spacing

Pace = float | Literal["nominal", "time", "blend"]
TooLong = Literal["refuse", "rest"]

Effort = Literal["full", "soon", "least"]
"""How hard a fastest flight is looked for: by every programme; without those whose states are free, which take longest; by speeding the plan's own
times up as a whole, where places are only tried."""

NOWHERE: frozenset[int] = frozenset()
"""No points, no legs."""


def unheard(_sentence: str) -> None:
    """Receive a note that nobody asked for."""


@dataclass(frozen=True, slots=True)
class RefinementOptions:
    """Options of the caller.

    Attributes:
        pace: Instead of the mission's paces: a share of the fastest flight, the plan's own times, or a blend; None for the mission's.
        weight: Of time in a blend, m^2/s^8.
        max_pieces: Pieces that the target holds for one robot; None for what each robot's vehicle holds.
        too_long: What becomes of a flight of more pieces.
        note: Receives what is to be said of how a flight was found.
        even: Whether other shares of a flight's time are tried where the plan's own would slow it much.
        rests: Whether the flight rests at every point.
        closes: Whether it is a lap, which ends with the heading that it began with.
        lingers: Whether a robot that acts only after others comes to the region first, and rests there.
        effort: How hard the fastest flight is looked for.
    """

    pace: Pace | None
    weight: float
    max_pieces: int | None
    too_long: TooLong = "refuse"
    note: Callable[[str], None] = unheard
    even: bool = True
    rests: bool = False
    closes: bool = False
    lingers: bool = False
    effort: Effort = "full"

    @property
    def blend(self) -> float | None:
        """Weight of time against snap where a blend of both is least; None where time alone is."""
        return self.weight if self.pace == "blend" else None

    def share(self, mission: Mission, name: str) -> float | None:
        """Return the share of the fastest flight at which a robot flies; None for the plan's own times.

        Args:
            mission: Says each robot's pace.
            name: The robot's.
        """
        pace = mission.pace_of(name) if self.pace is None else self.pace
        if pace == "nominal":
            return None
        return 1.0 if isinstance(pace, str) else float(pace)

    def held(self, mission: Mission, name: str) -> int | None:
        """Return the pieces that a robot's flight may have; None for any number.

        Args:
            mission: Says what vehicles hold.
            name: The robot's.
        """
        return mission.limits_of(name).pieces if self.max_pieces is None else self.max_pieces


@dataclass(frozen=True, eq=False, slots=True)
class Problem:
    """Problem of one refinement.

    Attributes:
        plan: Who visits what.
        feedback: What witnesses asked for.
        options: What the caller asked for.
        spacing: How far robots keep apart.
    """

    plan: Plan
    feedback: Feedback
    options: RefinementOptions
    spacing: Spacing


@dataclass(frozen=True, eq=False, slots=True)
class Task:
    """One robot's part of a problem, as far as it concerns that robot alone.

    Attributes:
        mission: Whose regions, margin and leg limits it keeps.
        name: The robot's.
        robot: Its plan.
        corridor: Points and rules of its path.
        limits: What its flight keeps.
        clearance: m on top of the margin that witnesses asked for.
        options: What the caller asked for.
    """

    mission: Mission
    name: str
    robot: RobotPlan
    corridor: Corridor
    limits: Limits
    clearance: float
    options: RefinementOptions

    @property
    def buffer(self) -> float:
        """Distance of planes from bodies, m."""
        return BUFFER + self.clearance

    def violations(self, path: Spline, clearance: float = 0.0) -> tuple[Witness, ...]:
        """Return what the checker would refuse about a path's visits (see `sampled_stays.violations`)."""
        return violations(path, self.mission, self.name, self.robot, clearance)


@dataclass(frozen=True, eq=False, slots=True)
class Motion:
    """A path of three axes and its yaw, with the same durations.

    Attributes:
        path: Three axes.
        yaw: None where it is 0 throughout.
        note: Sentence for a person where a faster one was looked for and not found; empty where there is nothing to say.
    """

    path: Spline
    yaw: Spline | None
    note: str = ""

    def stretched(self, factor: float) -> Motion:
        """Return the same motion, so many times slower."""
        return Motion(self.path.stretched(factor), None if self.yaw is None else self.yaw.stretched(factor), self.note)


@dataclass(frozen=True, eq=False, slots=True)
class Fitted:
    """A motion that shows the planned visits.

    Attributes:
        motion: Path and yaw.
        rest: Points at which it rests.
        monotone: Legs that never go back along their own direction.
    """

    motion: Motion
    rest: frozenset[int]
    monotone: frozenset[int]


@dataclass(frozen=True, eq=False, slots=True)
class RobotFlight:
    """Flight of one robot, without the wait before it departs.

    Attributes:
        name: The robot's.
        plan: What it was asked.
        limits: What it keeps.
        corridor: Points and rules of its path; None where it hovers.
        path: Three axes.
        yaw: One axis; None where it is 0 throughout.
        cycle: Piece at which its lap begins; None for a finite flight.
        halts: Visit: the node at which the robot rests when it sets out for it.
        planned: The same flight at the plan's own times, where its pace is another.
        note: Sentence for a person on how it was found; empty where there is nothing to say.
    """

    name: str
    plan: RobotPlan
    limits: Limits
    corridor: Corridor | None
    path: Spline
    yaw: Spline | None
    cycle: int | None
    halts: dict[int, int]
    planned: Spline | None = None
    note: str = ""
