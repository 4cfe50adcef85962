"""Room to pass for robots that are stuck behind others: they are led around those that hover, or an idle one steps aside.

Robots of an online team keep apart by waiting, and whoever waits behind a robot that has nothing left to do waits for ever. So a robot
that cannot go on gets another course around all that hover; where there is none, as when somebody hovers in the very region that it
is to visit, an idle robot in its way flies to a free place, if the team can still finish with what that one then shows.

"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Sequence
from contextlib import suppress
from functools import cache

import numpy as np

from ltlplan.allocation import Itinerary
from ltlplan.mtac.agent_moves import AgentState, RobotTask, World
from ltlplan.online_mtac.pilot import PilotedTeam, way_from
from ltlplan.online_mtac.possible_states import admits
from verify.data import Infeasible, Letter, Mission, Word
from verify.data.arrays import Floats
from verify.data.shapes.inequalities import Point, point_of

LOOK_AHEAD = 1.6
"""s over which robots keep out of each other's way."""
_NEAR = 0.05
"""m; a robot that was led around others from a place as near as this is not led around again."""
_PLACES = 12
"""Places to step aside to that are tried."""
_GRID = 0.15
"""m between places to step aside to."""


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
        ring = hoop.opening + hoop.rim + inset + max(mission.vehicle_of(robot).radius for robot in mission.agents)
        grid = grid[np.linalg.norm(grid - np.array(hoop.center), axis=1) > ring]
    for path in paths:
        if len(grid):
            grid = grid[np.linalg.norm(grid[:, None] - path[None], axis=2).min(axis=1) > distance]
    order = np.argsort(np.linalg.norm(grid - np.array(start), axis=1), kind="stable")
    return list(map(point_of, grid[order]))


def clear_ahead(team: PilotedTeam, names: Sequence[str], moving: Collection[str]) -> dict[str, bool]:
    """Tell of robots that move whether they may go on: who comes first keeps its way, and the others wait where they would come too near.

    Args:
        team: All robots.
        names: Who comes first.
        moving: Those that are under way.
    """
    horizon = np.arange(1, 9) * (LOOK_AHEAD / 8)
    held = np.stack([team.pilots[n].way.future(horizon, go=False) for n in names])
    gone = np.stack([team.pilots[n].way.future(horizon, go=True) if n in moving else held[i] for i, n in enumerate(names)])
    chosen, going = held.copy(), dict[str, bool]()
    for i, name in enumerate(names):
        if name not in moving:
            continue
        others = chosen[np.arange(len(names)) != i]
        away, stay = (float(np.sqrt(np.sum((others - path[i]) ** 2, axis=-1)).min()) for path in (gone, held))
        # where standing still is no better, going is the way out
        going[name] = away >= team.distance or away >= stay
        if going[name]:
            chosen[i] = gone[i]
    return going


def make_way(team: PilotedTeam, waiting: Sequence[str], now: float, tried: set[tuple[str, Point]]) -> str | None:
    """Let one of some robots that wait for others have a way again; return a sentence that says how, or None where there is none.

    Args:
        team: All robots.
        waiting: Those that are stuck, who is to go first first.
        now: Flight time, s.
        tried: Robots that were led around others, and where (m), so that none is led around in circles; grows.
    """
    resting = [n for n in waiting if team.rests(team.pilots[n], now)]
    able = [n for n in resting if (p := team.pilots[n]).moves and not (p.entered or p.shown or p.detour)]
    led = (said for name in able if (said := _around(team, name, now, tried)) is not None)
    aside = (
        f"At {now:.2f} s {other} steps aside for {name}."
        for name in able
        for other in _in_the_way(team, name, now)
        if _steps_aside(team, other, name, now)
    )
    return next(itertools.chain(led, aside), None)


def _around(team: PilotedTeam, name: str, now: float, tried: set[tuple[str, Point]]) -> str | None:
    """Lead a robot that rests around all others that rest."""
    pilot = team.pilots[name]
    here = _at(team, name, now)
    if any(who == name and np.linalg.norm(np.array(place) - here) < _NEAR for who, place in tried):
        return None
    others = [other for other in team.pilots if other != name and team.rests(team.pilots[other], now)]
    team.root(pilot, now)
    tried.add((name, pilot.where.position))
    moves = team.world.retraced(pilot.where, pilot.moves)
    if moves is None:
        return None
    task = RobotTask(pilot.where, moves, pilot.leaves)
    try:
        plan = team.plan_for(pilot, task, [point_of(_at(team, other, now)) for other in others])
    except Infeasible:
        return None
    pilot.take(task, plan, team.rng)
    return f"At {now:.2f} s {name} is led around {', '.join(others)}."


def _in_the_way(team: PilotedTeam, name: str, now: float) -> list[str]:
    """Return the idle robots that stand in a robot's way and may leave their places, the nearest to its way first."""
    path = _ahead(team, name)
    found = []
    for other, pilot in team.pilots.items():
        idle = pilot.done and pilot.way.arrived and not pilot.way.course.gliding(now)
        if other != name and idle and team.mission.agents[other].end is None:
            away = float(np.linalg.norm(path - _at(team, other, now), axis=1).min())
            if away < team.distance:
                found.append((away, other))
    return [other for _, other in sorted(found)]


def _steps_aside(team: PilotedTeam, name: str, passing: str, now: float) -> bool:
    """Let an idle robot fly to a free place off another one's way, if the team can still finish then."""
    pilot = team.pilots[name]
    team.root(pilot, now)
    where = pilot.where
    free, ahead = team.world.free_letter(where.internal, where.kind), team.ahead()
    inside = {n: p.chain for n, p in team.pilots.items() if p.entered}
    rest = {n: p.rest if n in inside else p.ahead for n, p in team.pilots.items()}

    @cache
    def may_show(letters: tuple[Letter, ...]) -> bool:
        return team.keeps({**ahead, name: letters}) and admits(team.belief, {**inside, name: letters}, rest)

    others = [_at(team, other, now)[None] for other in team.pilots if other != name]
    ways = [_ahead(team, other) for other, p in team.pilots.items() if other != name and not p.way.arrived]
    for place in places_aside(team.mission, where.position, [*others, *ways, _ahead(team, passing)], team.distance)[:_PLACES]:
        sets = _out_to(team.world, where, place)
        letters = None if sets is None else tuple(free | regions for regions in sets)
        if sets is None or letters is None or (letters and not may_show(letters)):
            continue
        log = where.log()
        for regions in sets:
            log.enter(regions)
        does = Itinerary(log.visits, Word((team.world.letter(where), *letters)), stops=log.stops)
        with suppress(Infeasible):
            pilot.take(RobotTask(where), way_from(team.mission, name, where.position, does, place), team.rng)
            pilot.detour = letters
            return True
    return False


def _out_to(world: World, where: AgentState, place: Point) -> tuple[frozenset[str], ...] | None:
    """Return the sets of regions that a robot is in on its way out to a place in free flight; None where they are not clear."""
    if not where.inside or world.left(where) == world.free_letter(where.internal, where.kind):
        return (frozenset(),) if where.inside else ()
    layout = world.graph.layout
    here = layout.at(where.position)
    way = layout.way(here, layout.at(place)) if frozenset(here.inside) == where.inside else None
    return None if way is None else way[1:]


def _at(team: PilotedTeam, name: str, now: float) -> Floats:
    """Return where a robot should be. Shape (3,)."""
    pilot = team.pilots[name]
    return pilot.way.course.flat(pilot.way.clock, now)[0]


def _ahead(team: PilotedTeam, name: str) -> Floats:
    """Return where a robot will be on its course. Shape (n, 3)."""
    pilot = team.pilots[name]
    return pilot.way.future(np.linspace(0.0, max(pilot.way.course.duration - pilot.way.clock.time, 0.0), 100), go=True)
