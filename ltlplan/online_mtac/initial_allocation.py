"""The satisfying run that online MTAC-E begins with, and its tasks for each robot (Algorithm 5, lines 1 to 4), by straight lines.

Walks of one robot after another over the team automaton find it, as offline. Where there are so many sets of robots and states that
their heuristic would take long, and for what no such walk leads to (two places that are to be held at once), the exact search does.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING

from ltlplan.mtac.admissible_heuristic import TeamModel
from ltlplan.mtac.agent_moves import AgentState, Move, RobotTask, World
from ltlplan.mtac.beam_search import BeamSearch, Options
from ltlplan.mtac.optimality_gap import straight_line_costs
from ltlplan.online_mtac.pilot import Pilot, PilotedTeam
from verify.data import Letter, LtlplanError, Unsatisfiable
from verify.data.language.word import stutter_free
from verify.data.mission import check_mission
from verify.data.progress import silent

if TYPE_CHECKING:
    from ltlplan.allocation import Itinerary

MOST_WALKED = 512
"""States of the automaton, times sets of robots that may still go on, up to which a run is made by walks: their heuristic knows each."""

NEEDS_WAITS = (
    "No words of these robots hold in every order of the robots, as words do whose tasks are shared in flight. Words that hold while robots "
    "wait for each other are planned before the flight (`planner.method: exact`, with `ltlplan run`), or in flight in certified pieces: "
    "`ltlplan online MISSION --certified`."
)

WIDTH = 8
"""Walks side by side; by straight lines they cost next to nothing."""


def share_out(team: PilotedTeam, blocked: set[tuple[str, tuple[Move, ...]]]) -> dict[str, RobotTask]:
    """Return a cheap way to share what is left, by straight lines.

    Args:
        team: Where everybody is, and what the letters so far have led to.
        blocked: Robots and moves that have no way.

    Raises:
        Unsatisfiable: There is none.
    """
    if team.reader.size << len(team.pilots) <= MOST_WALKED:
        found = _by_walks(team, blocked)
        if found is not None:
            return found
    return _by_exact_search(team, blocked)


def _by_walks(team: PilotedTeam, blocked: set[tuple[str, tuple[Move, ...]]]) -> dict[str, RobotTask] | None:
    leg, world, begun = straight_line_costs(team.mission), team.world, team.belief.settled
    starts = {name: pilot.where for name, pilot in team.pilots.items()}

    def price(robot: str, task: RobotTask) -> float:
        if (robot, task.moves) in blocked:
            return math.inf
        position, total = task.where.position, 0.0
        for move in task.moves:
            if not move.in_place:
                total += leg(robot, position, move.visit.region)
                position = move.end.position
        return total

    robots = TeamModel(
        world, team.reader, starts, begun=begun, takes_off=False,
        in_decomposition_set=partial(team.reader.in_decomposition_set, begun=begun), metric=leg,
    )  # fmt: skip
    search = BeamSearch(robots, price=price, holds=partial(_holds, team), options=Options(width=WIDTH))
    best = search.search(silent)
    return None if best is None else dict(best.tasks)


def _by_exact_search(team: PilotedTeam, blocked: set[tuple[str, tuple[Move, ...]]]) -> dict[str, RobotTask]:
    """Return the cheapest way to share what is left.

    Raises:
        Unsatisfiable: There is none in which the blocked ways are not needed.
    """
    from ltlplan.search.exact import assign

    problem: LtlplanError | None = None
    try:
        assigned = assign(check_mission(team.left()) if team.steps else team.mission)
        if assigned.precedences:
            raise Unsatisfiable(NEEDS_WAITS)
        found = assigned.robots
        tasks = {name: _part(team.world, team.pilots[name], itinerary) for name, itinerary in found.items()}
        if _holds(team, tasks) and not any((name, task.moves) in blocked for name, task in tasks.items()):
            return tasks
    except LtlplanError as error:
        problem = error
    raise Unsatisfiable(
        f"What is left of the formula cannot be satisfied by {', '.join(team.pilots)} from where they are."
        if team.steps
        else "No sharing of the formula among these robots was found."
    ) from problem


def _holds(team: PilotedTeam, tasks: Mapping[str, RobotTask]) -> bool:
    """Tell whether the team can finish by these tasks."""
    return team.keeps({robot: task.ahead for robot, task in tasks.items()})


def _part(world: World, pilot: Pilot, itinerary: Itinerary) -> RobotTask:
    """Return what one robot does as its task.

    Raises:
        Unsatisfiable: No visits that a robot in flight makes show that word.
    """
    stops = range(len(itinerary.visits)) if itinerary.stops is None else itinerary.stops
    regions = tuple(itinerary.visits[stop].region for stop in stops)
    if pilot.where.inside:
        regions = regions[1:]
    moves = _showing(world, pilot.where, regions, itinerary.word.letters, first=True)
    if moves is None:
        raise Unsatisfiable(f"{pilot.name} cannot show {itinerary.word} from where it is.")
    end = moves[-1].end if moves else pilot.where
    return RobotTask(pilot.where, moves, not end.inside or not end.inside <= itinerary.word.letters[-1])


def _showing(
    world: World, where: AgentState, regions: tuple[str, ...], word: tuple[Letter, ...], *, first: bool = False
) -> tuple[Move, ...] | None:
    """Return moves by which a robot comes to some regions one after another and shows a word, its present letter first; None if none do."""
    if not regions and len(word) <= 1 + (len(where.inside) > 0 and world.left(where) == word[-1]):
        return ()
    for move in world.moves(where, first=first):
        if not move.in_place and move.visit.region != next(iter(regions), None):
            continue
        seen = stutter_free((word[0], *move.shown))
        if seen == word[: len(seen)]:
            rest = _showing(world, move.end, regions if move.in_place else regions[1:], word[len(seen) - 1 :])
            if rest is not None:
                return (move, *rest)
    return None
