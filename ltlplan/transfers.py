"""Certified flights before and after the claim: from where robots stand to their starts, and from their ends to the ground.

Each is a mission of its own that asks for nothing but to be somewhere else (formula `true`), refined and checked like any other:
separation, obstacles, rims, workspace and limits hold for all times. Robots climb where they stand, each to the height of its start,
then all fly to their starts, whoever stands below whose. After the flight they sink where they are, or, where one would come
down on another or on an obstacle, fly home first. All robots hover between these flights, so that pauses of any length keep them apart.

With N robots that is one refinement of N paths a stage, as for a mission of one leg a robot. Others leave these stages to
set-points: the usual scripts send all robots straight to their starts at once.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from flight.link.phases import Part, Stage
from flight.monitoring.thresholds import CLIMB_SPEED
from ltlplan.pipeline import Certified, certified_team, plan
from verify.data import BadInput, Infeasible, Mission, NotCertified, Trajectory, check_trajectories
from verify.data.events import unknown
from verify.data.mission import check_mission
from verify.data.progress import Progress, part_of, silent
from verify.data.sections import Agent, Box, Limits, Spec
from verify.data.shapes.obstacle import Obstacle
from verify.flight_segments import judge_stop

Place = tuple[float, float, float]

LANDING = 0.05
"""m above the ground at which a landing ends and motors may stop."""
_BELOW = 0.01
"""m that a climb's workspace reaches below the places where robots stand, beyond the margin."""
_CLEAR = 0.01
"""m more than needed that a climb is planned to stay away from robots that hover."""
_AT_REST = 1e-4
"""m/s and m/s^2 that a flight may differ from a hover where it begins or ends."""


@dataclass(frozen=True, slots=True)
class Transfer:
    """A certified flight beside the claim.

    Attributes:
        name: `climb`, `way`, `home` or `landing`.
        mission: What it was certified for: the mission's world, other starts and ends, formula `true`.
        certified: Plan, trajectories and certificate.
    """

    name: str
    mission: Mission
    certified: Certified

    @property
    def team(self) -> dict[str, Trajectory]:
        """One trajectory a robot."""
        return self.certified.team

    @property
    def stage(self) -> Stage:
        """The flight as a link flies it."""
        return Stage(self.name, self.certified.plan, self.certified.team, self.certified.certificate)


@dataclass(frozen=True, eq=False, slots=True)
class Solo:
    """A flight of one robot while all others hover, checked with them.

    Attributes:
        name: `climb` or `way`.
        mission: What it was checked in: the mission's world, where everybody begins, formula `true`.
        team: One trajectory a robot.
    """

    name: str
    mission: Mission
    team: Mapping[str, Trajectory]

    @property
    def part(self) -> Part:
        """The flight as all begin it."""
        return Part(self.name, self.team, self.mission.margin, max(path.duration for path in self.team.values()))


def to_starts(
    mission: Mission, team: Mapping[str, Trajectory], places: Mapping[str, Place], *, progress: Progress | None = None
) -> tuple[Transfer, ...]:
    """Return certified flights that bring robots from where they stand to a team's starts: climb and way.

    Args:
        mission: What the team was certified for.
        team: Its trajectories.
        places: Where each robot stands, x, y and z in m.
        progress: Receives a sentence and the share done, 0 to 1.

    Raises:
        BadInput: A robot has no place or stands where no flight can begin, or a trajectory does not begin at rest.
        Infeasible: There is no way.
        NotCertified: None was certified.
    """
    team = _of_mission(mission, team)
    places = _checked(mission, places)
    starts = {name: _hover(name, path, 0.0) for name, path in team.items()}
    yaws = {name: float(path.evaluate(0.0)[3]) for name, path in team.items()}
    above = {name: (*places[name][:2], starts[name][2]) for name in places}
    climb = _transfer("climb", _near_ground(mission, places), places, above, yaws, part_of(progress, 0.0, 0.5))
    way = _transfer("way", mission, above, starts, yaws, part_of(progress, 0.5, 1.0))
    return (climb, way)


def to_join(mission: Mission, robot: str, place: Place, hovers: Mapping[str, Trajectory]) -> tuple[Solo, ...]:
    """Return proved flights that bring one robot from the ground to its start, while all others hover where their flights end.

    It is planned past solid bodies in the others' places, and certified by itself; then it is checked with the others as they hover. They may
    hover anywhere, inside of a ring as well.

    Args:
        mission: The world, with everybody who is in the air and the newcomer, each with its start.
        robot: The newcomer.
        place: Where it stands, x, y and z in m.
        hovers: What the others flew last; it is over.

    Returns:
        Its climb; where its start is not above its place, the way there as well.

    Raises:
        BadInput: It stands where no flight can begin, or another one's trajectory does not end at rest.
        Infeasible: There is no way past the others.
        NotCertified: None is proved.
    """
    agent = mission.agents[robot]
    alone = mission.model_copy(update={"agents": {robot: agent}})
    (place,) = _checked(alone, {robot: place}).values()
    above = (*place[:2], agent.start[2])
    legs = [("climb", _near_ground(alone, {robot: place}), place, above)]
    if above != agent.start:
        legs.append(("way", alone, above, agent.start))
    still = {name: _still(name, path) for name, path in hovers.items()}
    found: list[Solo] = []
    for name, world, start, end in legs:
        past = world.model_copy(update={"obstacles": _with_bodies(mission, robot, still), "hoops": {}})
        path = _transfer(name, past, {robot: start}, {robot: end}, {robot: agent.yaw}, silent).team[robot]
        found.append(
            _judged(
                name, mission.model_copy(update={"workspace": world.workspace, "limits": world.limits}), {**still, robot: path}
            )
        )
    return tuple(found)


def _still(name: str, path: Trajectory) -> Trajectory:
    """Return a hover where a trajectory ends."""
    rest = np.zeros((1, 4, 8))
    rest[0, :3, 0], rest[0, 3, 0] = _hover(name, path, path.duration), path.evaluate(path.duration)[3]
    return Trajectory([1.0], rest.astype(np.float32))


def _with_bodies(mission: Mission, robot: str, still: Mapping[str, Trajectory]) -> dict[str, Obstacle]:
    """Return bodies of which who stays clear meets nothing: walls without openings, a ball around each ring, and a box around each robot that hovers.

    They are what is planned with, and hold more than there is; what comes of it is checked in the world itself.
    """
    bodies = {name: wall.model_copy(update={"openings": ()}) for name, wall in mission.obstacles.items()}
    for name, hoop in mission.hoops.items():
        bodies[name] = Obstacle.model_validate({"center": hoop.center, "radii": [hoop.opening + hoop.rim] * 3})
    own = mission.vehicle_of(robot).radius + mission.margin  # what any obstacle is given
    for name, path in still.items():
        apart = mission.least_distance(robot, name)
        high = apart * mission.separation_z / mission.separation if mission.separation_z and mission.separation else apart
        sides = [2.0 * max(length + 2.0 * mission.margin + _CLEAR - own, _CLEAR) for length in (apart, apart, high)]
        while name in bodies or name in mission.all_regions:
            name += "_"
        bodies[name] = Obstacle.model_validate({"center": path.evaluate(0.0)[:3].tolist(), "size": sides})
    return bodies


def _judged(name: str, world: Mission, team: Mapping[str, Trajectory]) -> Solo:
    """Check a flight of one robot while the others hover."""
    starts = {robot: path.evaluate(0.0).tolist() for robot, path in team.items()}
    places = {robot: (start[0], start[1], start[2]) for robot, start in starts.items()}
    asked = _only_moves(world, name, places, dict.fromkeys(places), {robot: start[3] for robot, start in starts.items()})
    refused = [claim for claim in judge_stop(asked, team, Fraction(0)) if claim.outcome != "holds"]
    if refused:
        witnesses = [claim.witness for claim in refused if claim.witness is not None]
        raise NotCertified(f"{name} past the others: {refused[0].sentence}", witnesses)
    return Solo(name, asked, team)


def to_ground(
    mission: Mission,
    team: Mapping[str, Trajectory],
    places: Mapping[str, Place],
    *,
    progress: Progress | None = None,
) -> tuple[Transfer, ...]:
    """Return certified flights that land robots after a team's flight: where they are, or at the places where they stood.

    Args:
        mission: What the team was certified for.
        team: Its trajectories; laps are flown as often as the mission repeats them.
        places: Where each robot stood, x, y and z in m. Landings below a robot's end are at the height of its own place.
        progress: Receives a sentence and the share done, 0 to 1.

    Returns:
        One landing, or the way home and a landing there.

    Raises:
        BadInput: A robot has no place, or a trajectory does not end at rest.
        Infeasible: There is no way.
        NotCertified: None was certified.
    """
    team = _of_mission(mission, team)
    places = _checked(mission, places)
    flown = {name: path.flattened(mission.spec.repeat) for name, path in team.items()}
    ends = {name: _hover(name, path, path.duration) for name, path in flown.items()}
    yaws = {name: float(path.evaluate(path.duration)[3]) for name, path in flown.items()}
    below = {name: (*ends[name][:2], places[name][2] + LANDING) for name in ends}
    try:
        return (_transfer("landing", _near_ground(mission, below), ends, below, yaws, part_of(progress, 0.0, 0.3)),)
    except (BadInput, Infeasible, NotCertified):  # somebody stands in somebody's way down: everybody flies home
        pass
    above = {name: (*places[name][:2], ends[name][2]) for name in ends}
    on_ground = {name: (*places[name][:2], places[name][2] + LANDING) for name in ends}
    home = _transfer("home", mission, ends, above, yaws, part_of(progress, 0.3, 0.7))
    landing = _transfer("landing", _near_ground(mission, on_ground), above, on_ground, yaws, part_of(progress, 0.7, 1.0))
    return (home, landing)


def _of_mission(mission: Mission, team: Mapping[str, Trajectory]) -> dict[str, Trajectory]:
    """Return checked trajectories of all robots, in the mission's order."""
    checked = check_trajectories(team)
    for name in checked:
        if name not in mission.agents:
            raise BadInput(unknown(name, "robot of the mission", mission.agents))
    missing = [name for name in mission.agents if name not in checked]
    if missing:
        raise BadInput(f"the team has no trajectory of {missing[0]}.")
    return {name: checked[name] for name in mission.agents}


def _checked(mission: Mission, places: Mapping[str, Place]) -> dict[str, Place]:
    """Return the places of all robots, in the mission's order, as finite numbers."""
    for name in places:
        if name not in mission.agents:
            raise BadInput(unknown(name, "robot of the mission", mission.agents))
    found: dict[str, Place] = {}
    for name in mission.agents:
        if name not in places:
            raise BadInput(f"where does {name} stand? Places are of {', '.join(places) or 'nobody'}.")
        try:
            x, y, z = (float(value) for value in places[name])
        except (TypeError, ValueError):
            raise BadInput(f"{name} stands at {places[name]!r:.60}; a place is x, y and z in m.") from None
        if not all(math.isfinite(value) for value in (x, y, z)):
            raise BadInput(f"{name} stands at ({x:g}, {y:g}, {z:g}); a place is finite.")
        found[name] = (x, y, z)
    return found


def _hover(name: str, path: Trajectory, time: float) -> Place:
    """Return where a trajectory hovers at its begin or end.

    Raises:
        BadInput: It moves there.
    """
    speeds = np.abs([path.evaluate(time, order)[:3] for order in (1, 2)])
    if float(speeds.max()) > _AT_REST:
        word = "begin" if time == 0.0 else "end"
        raise BadInput(f"{name}'s flight does not {word} at rest ({speeds[0].max():.3g} m/s): nothing can follow it.")
    x, y, z = path.evaluate(time)[:3].tolist()
    return x, y, z


def _near_ground(mission: Mission, places: Mapping[str, Place]) -> Mission:
    """Return the mission with a workspace down to the places where robots stand, and slow."""
    low = min(min(place[2] for place in places.values()) - mission.margin - _BELOW, mission.workspace.min[2])
    workspace = Box(min=(*mission.workspace.min[:2], low), max=mission.workspace.max)
    speed = min(CLIMB_SPEED, mission.limits.speed or CLIMB_SPEED)
    return mission.model_copy(update={"workspace": workspace, "limits": mission.limits.model_copy(update={"speed": speed})})


def _transfer(
    name: str,
    mission: Mission,
    starts: Mapping[str, Place],
    ends: Mapping[str, Place],
    yaws: Mapping[str, float],
    progress: Progress,
) -> Transfer:
    """Plan, refine and certify a flight from somewhere to somewhere else."""
    asked = check_mission(_only_moves(mission, name, starts, ends, yaws))
    made = plan(asked, method="exact", progress=part_of(progress, 0.0, 0.2))
    return Transfer(name, made.mission, certified_team(made, progress=part_of(progress, 0.2, 1.0)))


def _only_moves(
    mission: Mission, name: str, starts: Mapping[str, Place], ends: Mapping[str, Place | None], yaws: Mapping[str, float]
) -> Mission:
    """Return a mission in the same world that asks for nothing but other places; whether it can be is not looked at."""
    agents = {
        robot: Agent(
            start=starts[robot],
            end=ends[robot],
            yaw_deg=math.degrees(yaws[robot]),
            vehicle=agent.vehicle,
            limits=agent.limits and _all_over(agent.limits),
        )
        for robot, agent in mission.agents.items()
    }
    return mission.model_copy(
        update={
            "name": f"{mission.name} {name}"[:60].rstrip(),
            "spec": Spec(formula="true"),
            "environment": None,
            "regions": {},
            "robot": type(mission.robot)(),
            "robots": None,
            "sequence": None,
            "disturbance": None,  # proved of the mission's flight alone
            "hoops": {key: hoop.model_copy(update={"only": None}) for key, hoop in mission.hoops.items()},
            "limits": _all_over(mission.limits),
            "agents": agents,
            "planner": mission.planner.model_copy(
                update={"speed": min(mission.planner.speed, mission.limits.speed or math.inf)}
            ),
        }
    )


def _all_over(limits: Limits) -> Limits:
    """Return limits without those of legs to regions."""
    return limits.model_copy(update={"legs": {}})
