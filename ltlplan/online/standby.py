"""Robots that wait on the ground, motors off, until they are told to join a team in flight.

They are no part of the team and of nothing that is claimed of it. What flies stays clear of them: the mission's workspace must begin above them,
so that no certified path reaches down to one, and flights to and from the ground are certified with each of them as a solid body.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from flight.exports.scripts.flying.checks import Check, one_body_each
from flight.link.link import Link, Pose
from flight.link.phases import Part
from flight.link.preflight_checks import on_ground
from flight.link.record import Record
from flight.monitoring.thresholds import FRESH, SHARE, WATCHED, limits
from ltlplan.transfers import Place
from verify.data import BadInput, Mission, Trajectory
from verify.data.events import RobotJoins, WorldEvent
from verify.data.sections import Agent
from verify.data.shapes.obstacle import Obstacle


@dataclass(frozen=True, eq=False, slots=True)
class Standby:
    """Robots that wait on the ground.

    Attributes:
        agents: Each one's vehicle and heading; of its start nothing is said before it is told to join.
        places: Where each stands, m.
    """

    agents: Mapping[str, Agent] = field(default_factory=dict[str, Agent])
    places: Mapping[str, Place] = field(default_factory=dict[str, Place])

    def without(self, robots: Iterable[str]) -> Standby:
        """Return those who are none of these."""
        left = [name for name in self.agents if name not in robots]
        return Standby({name: self.agents[name] for name in left}, {name: self.places[name] for name in left})

    def beside(self, mission: Mission) -> Mission:
        """Return a mission with their names, vehicles and headings beside the team's, for links; it is none to plan."""
        return mission.model_copy(update={"agents": {**mission.agents, **self.agents}})

    def solid(self, mission: Mission) -> Mission:
        """Return a mission in which each of them is a solid body on the ground, grown by the margin."""
        bodies = dict(mission.obstacles)
        for name, place in self.places.items():
            side = 2.0 * (self._radius(mission, name) + mission.margin)
            while name in bodies or name in mission.all_regions:
                name += "_"
            bodies[name] = Obstacle.model_validate({"center": place, "size": (side, side, side)})
        return mission.model_copy(update={"obstacles": bodies}) if self.places else mission

    def require_out_of_reach(self, mission: Mission) -> None:
        """Reject robots that wait where others may fly.

        Args:
            mission: What is flown above them.

        Raises:
            BadInput: As said, with where the workspace would have to begin.
        """
        largest = max(mission.vehicle_of(name).radius for name in mission.agents)
        for name, place in self.places.items():
            flown = max(largest, self._radius(mission, name))
            top = place[2] + self._radius(mission, name) + SHARE * mission.margin + flown
            if mission.workspace.min[2] < top:
                raise BadInput(
                    f"{name} waits on the ground at z = {place[2]:g} m, where others may fly: `workspace` begins at z = "
                    f"{mission.workspace.min[2]:g} m, and must begin at {top:.3f} m or above."
                )

    def standing(self, mission: Mission) -> Part | None:
        """Return where they stand, as what their climbs will begin with; None where nobody waits.

        Args:
            mission: Says how exactly.
        """
        paths: dict[str, Trajectory] = {}
        for name, place in self.places.items():
            still = np.zeros((1, 4, 8))
            still[0, :3, 0], still[0, 3, 0] = place, self.agents[name].yaw
            paths[name] = Trajectory([1.0], still)
        return Part("climb", paths, mission.margin, 1.0) if paths else None

    def fault(self, mission: Mission, event: RobotJoins) -> str | None:
        """Say why a robot cannot join that is none of the team; None where it waits here.

        Args:
            mission: Says what robots fly of which nothing is said.
            event: Who.
        """
        if event.robot not in self.agents:
            return (
                f"{event}: it is not among the robots that wait on the ground ({', '.join(self.agents) or 'there are none'}); over a link one joins "
                "that was named before the flight, by --standby NAME=X,Y,Z."
            )
        if (event.agent.vehicle or mission.vehicle) != (self.agents[event.robot].vehicle or mission.vehicle):
            return f"{event}: it flies another vehicle than was said of it before the flight."
        return None

    def _radius(self, mission: Mission, name: str) -> float:
        return (self.agents[name].vehicle or mission.vehicle).radius


@dataclass(slots=True)
class Lookout:
    """Positions in the last half a second of robots that wait on the ground.

    Attributes:
        seen: Poses of each, in order of time.
    """

    seen: dict[str, deque[Pose]] = field(default_factory=dict[str, "deque[Pose]"])

    def look(self, link: Link, record: Record, robots: Iterable[str]) -> None:
        """Take in where they are now, and keep it.

        Args:
            link: To them.
            record: Takes it in.
            robots: Who waits.
        """
        for robot in robots:
            pose, seen = link.pose(robot), self.seen.setdefault(robot, deque())
            if pose is None or (seen and pose.time <= seen[-1].time):
                continue
            seen.append(pose)
            record.poses.append((pose.time, robot, *pose.position))
            while seen[0].time < pose.time - WATCHED:
                seen.popleft()

    def checks(self, link: Link, climb: Part, robot: str, lasts: float) -> list[Check]:
        """Say what keeps one of them from climbing: what keeps robots from taking off.

        Args:
            link: To all.
            climb: What it is to fly first, beside those that hover.
            robot: Its name.
            lasts: s for which its battery must last.
        """
        poses = tuple(self.seen.get(robot, ()))
        long = poses[-1].time - poses[0].time if poses else 0.0
        bodies = {name: pose.position for name in climb.paths if (pose := link.pose(name)) is not None}
        found = [*on_ground(link, {robot: climb}, lasts, {robot: poses}), *one_body_each(bodies, limits(link.accuracy))]
        if long < WATCHED - FRESH:
            sentence = f"{robot} was seen for {long:.2g} s of the last {WATCHED:g} s: look at motion capture and the markers"
            found.append(Check("quiet", robot, False, sentence))
        return found


def shown_at(place: Place, mission: Mission) -> str | None:
    """Return a region that a robot may show that hovers at a place within its margin; None where it shows none for sure.

    Args:
        place: m.
        mission: The world.
    """
    for name, region in mission.all_regions.items():
        if float(region.level(np.array(place))) <= (1.0 + 1.05 * mission.margin / region.inner_radius) ** 2:
            return name
    return None


def standby_of(mission: Mission, places: Mapping[str, Place], events: Iterable[WorldEvent]) -> Standby:
    """Return who waits: those whose places are told, and those that events have join, below their starts at z = 0 where nothing else is told.

    Args:
        mission: The team's.
        places: Where robots stand that are none of the team, m.
        events: What happens at times that are known.

    Raises:
        BadInput: A robot is one of the team.
    """
    agents: dict[str, Agent] = {}
    stand: dict[str, Place] = {}
    for event in events:
        if isinstance(event, RobotJoins) and event.robot not in mission.agents:
            agents[event.robot] = event.agent
            stand[event.robot] = (*event.agent.start[:2], 0.0)
    for name, place in places.items():
        if name in mission.agents:
            raise BadInput(f"{name} is a robot of the mission: it takes off with the others, and does not wait.")
        agents.setdefault(name, Agent(start=place))
        stand[name] = place
    return Standby(agents, stand)
