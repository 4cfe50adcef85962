"""Room to pass for robots that are stuck behind others: they are led around those that hover, or an idle one steps aside.

Robots of an online team keep apart by waiting, and whoever waits behind a robot that has nothing left to do waits for ever. So a robot
that cannot go on gets another course around all that hover; where there is none, as when somebody hovers in the very region that it
is to visit, an idle robot in its way flies to a free place, if the team can still finish with what that one then shows.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ltlplan.mtac.agent_moves import RobotTask
from ltlplan.paths.hoops import route
from ltlplan.sharing.belief import admits
from verify.data import Infeasible, Mission, RobotPlan, Visit, Word
from verify.data.shapes.inequalities import Point
from verify.data.shapes.region import Region

if TYPE_CHECKING:
    from ltlplan.sharing.team import OnlineTeam

Floats = NDArray[np.float64]

_SPARE = 0.03
"""m beyond the distance that robots keep, by which a way leads around one that hovers."""
_NEAR = 0.05
"""m beyond the margin that a way's start keeps from what it leads around."""
_PLACES = 12
"""Places to step aside to that are tried."""
_GRID = 0.15
"""m between places to step aside to."""
_LEAST = 0.02
"""m; radius of the smallest body that is led around."""


def make_way(team: OnlineTeam, waiting: Sequence[str], now: float, tried: set[tuple[str, Point]]) -> str | None:
    """Let one of some robots that wait for others have a way again; return a sentence that says how, or None where there is none.

    Args:
        team: All robots.
        waiting: Those that are stuck, who is to go first first.
        now: Flight time, s.
        tried: Robots that were led around others, and where (m), so that none is led around in circles; grows.
    """
    able = [n for n in waiting if _may_turn(team, n, now)]
    for name in able:
        sentence = _around(team, name, now, tried)
        if sentence is not None:
            return sentence
    for name in able:
        for other in _in_the_way(team, name, now):
            if _steps_aside(team, other, name, now):
                return f"At {now:.2f} s {other} steps aside for {name}."
    return None


def _may_turn(team: OnlineTeam, name: str, now: float) -> bool:
    pilot = team.pilots[name]
    return team.rests(pilot, now) and not (pilot.entered or pilot.shown or pilot.detour or not pilot.moves)


def _around(team: OnlineTeam, name: str, now: float, tried: set[tuple[str, Point]]) -> str | None:
    """Lead a robot that rests around all others that rest."""
    pilot = team.pilots[name]
    here = _at(team, name, now)
    if any(who == name and np.linalg.norm(np.array(place) - here) < _NEAR for who, place in tried):
        return None
    others = [other for other in team.pilots if other != name and team.rests(team.pilots[other], now)]
    team.root(pilot, now)
    tried.add((name, pilot.where.position))
    task = RobotTask(pilot.where, pilot.moves, pilot.leaves)
    try:
        plan = team.plan_for(pilot, task, [_point(_at(team, other, now)) for other in others])
    except Infeasible:
        return None
    pilot.take(task, plan, team.rng)
    return f"At {now:.2f} s {name} is led around {', '.join(others)}."


def _in_the_way(team: OnlineTeam, name: str, now: float) -> list[str]:
    """Return the idle robots that stand in a robot's way and may leave their places, the nearest to its way first."""
    path = _ahead(team, name)
    found = []
    for other, pilot in team.pilots.items():
        idle = pilot.done and pilot.arrived and not pilot.course.gliding(now)
        if other != name and idle and team.mission.agents[other].end is None:
            away = float(np.linalg.norm(path - _at(team, other, now), axis=1).min())
            if away < team.distance:
                found.append((away, other))
    return [other for _, other in sorted(found)]


def _steps_aside(team: OnlineTeam, name: str, passing: str, now: float) -> bool:
    """Let an idle robot fly to a free place off another one's way, if the team can still finish then."""
    pilot = team.pilots[name]
    team.root(pilot, now)
    where = pilot.where
    letters = () if where.inside is None else (team.world.free_letter(where.internal),)
    ahead = {n: p.ahead for n, p in team.pilots.items()}
    inside = {n: p.chain for n, p in team.pilots.items() if p.entered}
    rest = {n: p.rest if n in inside else p.ahead for n, p in team.pilots.items()}
    if letters and not (team.keeps({**ahead, name: letters}) and admits(team.belief, {**inside, name: letters}, rest)):
        return False
    others = [_at(team, other, now)[None] for other in team.pilots if other != name]
    ways = [_ahead(team, other) for other, p in team.pilots.items() if other != name and not p.arrived]
    word = Word((team.world.letter(where), *letters))
    for place in places_aside(team.mission, where.position, [*others, *ways, _ahead(team, passing)], team.distance)[:_PLACES]:
        plan = way_aside(team.mission, name, where.position, where.inside, word, place)
        if plan is not None:
            pilot.take(RobotTask(replace(where), ()), plan, team.rng)
            pilot.detour = letters
            return True
    return False


def _at(team: OnlineTeam, name: str, now: float) -> Floats:
    """Return where a robot should be. Shape (3,)."""
    pilot = team.pilots[name]
    return pilot.course.flat(pilot.clock, now)[0]


def _ahead(team: OnlineTeam, name: str) -> Floats:
    """Return where a robot will be on its course. Shape (n, 3)."""
    pilot = team.pilots[name]
    return pilot.future(np.linspace(0.0, max(pilot.course.duration - pilot.clock.time, 0.0), 100), go=True)


def _point(values: Floats) -> Point:
    x, y, z = (float(value) for value in values)
    return (x, y, z)


def led_around(
    mission: Mission,
    robot: str,
    start: Point,
    visits: tuple[Visit, ...],
    word: Word,
    hovering: Iterable[Point],
    distance: float,
) -> RobotPlan:
    """Lay one robot's way around places where others hover, as far from them as `distance`, or as the start allows.

    Args:
        mission: What is asked.
        robot: Who flies.
        start: m, from where.
        visits: What it visits, with its start region first where it begins inside.
        word: The letters that it will show.
        hovering: m, where others hover.
        distance: m.

    Raises:
        Infeasible: There is no way around, or somebody hovers where the robot is to go.
    """
    bodies: dict[str, Region] = {}
    for index, place in enumerate(hovering):
        away = float(np.linalg.norm(np.array(place) - np.array(start)))
        radius = min(distance + _SPARE, away - _NEAR) - mission.margin
        if radius > _LEAST:
            bodies[f" robot {index} "] = Region(center=place, radii=(radius, radius, radius))
    agent = mission.agents[robot].model_copy(update={"start": start})
    here = mission.model_copy(update={"agents": {robot: agent}, "regions": {**mission.regions, **bodies}})
    return route(here, robot, visits, word=word)


def places_aside(mission: Mission, start: Point, paths: Sequence[Floats], distance: float) -> list[Point]:
    """Return places in free flight that are as far as `distance` from some paths, the nearest to a start first.

    Args:
        mission: Regions, margin and workspace.
        start: m.
        paths: m, where nobody may be. Each of shape (n, 3).
        distance: m.
    """
    inset = mission.margin + 0.1
    low, high = np.array(mission.workspace.min) + inset, np.array(mission.workspace.max) - inset
    axes = [np.arange(a, b, _GRID) if b > a else np.array([(a + b) / 2.0]) for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    for region in mission.all_regions.values():
        reach = region.outer_radius
        grid = grid[np.linalg.norm(grid - np.array(region.center), axis=1) > reach * (1.0 + inset / region.inner_radius)]
    for hoop in mission.hoops.values():
        ring = hoop.opening + hoop.rim + inset + mission.vehicle.radius
        grid = grid[np.linalg.norm(grid - np.array(hoop.center), axis=1) > ring]
    for path in paths:
        if len(grid):
            grid = grid[np.linalg.norm(grid[:, None] - path[None], axis=2).min(axis=1) > distance]
    order = np.argsort(np.linalg.norm(grid - np.array(start), axis=1), kind="stable")
    return [(float(x), float(y), float(z)) for x, y, z in grid[order]]


def way_aside(mission: Mission, robot: str, start: Point, inside: str | None, word: Word, place: Point) -> RobotPlan | None:
    """Lay the way of a robot that steps aside; None where there is none.

    Args:
        mission: What to keep clear of.
        robot: Who steps aside.
        start: Where it hovers, m.
        inside: The region that it is in, or None.
        word: What it shows on the way.
        place: Where it is to hover, m.
    """
    agent = mission.agents[robot].model_copy(update={"start": start, "end": place})
    here = mission.model_copy(update={"agents": {robot: agent}})
    try:
        return route(here, robot, () if inside is None else (Visit(region=inside),), word=word)
    except Infeasible:
        return None
