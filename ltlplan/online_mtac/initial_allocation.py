"""The satisfying run that online MTAC-E begins with, and its tasks for each robot (Algorithm 5, lines 1 to 4): the exact search's, by straight lines."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ltlplan.allocation import Context
from ltlplan.mtac.agent_moves import AgentState, Move, RobotTask, World
from ltlplan.online_mtac.pilot import Pilot, PilotedTeam
from verify.data import Letter, LtlplanError, Mission, Unsatisfiable
from verify.data.language.word import stutter_free
from verify.data.mission import check_mission

if TYPE_CHECKING:
    from ltlplan.allocation import Allocation, Itinerary, Leg

NEEDS_WAITS = (
    "No words of these robots hold in every order of the robots, as words do whose tasks are shared in flight. Words that hold while robots "
    "wait for each other are planned before the flight (`planner.method: exact`, with `ltlplan run`), or in flight in certified pieces: "
    "`ltlplan online MISSION --certified`."
)


def share_out(team: PilotedTeam, shut: frozenset[Leg]) -> Iterator[tuple[float, tuple[Allocation, dict[str, RobotTask]]]]:
    """Yield the cheapest way to share what is left, by straight lines, without legs that are shut; nothing where there is none without them.

    Args:
        team: Where everybody is, and what the letters so far have led to.
        shut: Legs that robots do without.

    Raises:
        Unsatisfiable: There is none at all.
    """
    from ltlplan.search.exact import without_legs

    problem: LtlplanError | None = None
    try:
        asked = left_of(team)
        found = without_legs(shut)(asked, Context(team.rng))
        tasks = {name: _part(team.world, team.pilots[name], does) for name, does in found.robots.items()}
        if not found.legs(asked) & shut:
            if team.keeps({robot: task.ahead for robot, task in tasks.items()}):
                yield found.cost, (found, tasks)
                return
            problem = Unsatisfiable(NEEDS_WAITS) if found.precedences else None
    except LtlplanError as error:
        problem = error
    if not shut:
        raise Unsatisfiable(
            f"What is left of the formula cannot be satisfied by {', '.join(team.pilots)} from where they are."
            if team.steps
            else "No sharing of the formula among these robots was found."
        ) from problem


def left_of(team: PilotedTeam) -> Mission:
    """Return what is left for a team as a mission of its own."""
    begun = team.steps or team.pilots.keys() != team.mission.agents.keys()
    return check_mission(team.left()) if begun else team.mission


def _part(world: World, pilot: Pilot, itinerary: Itinerary) -> RobotTask:
    """Return what one robot does as its task.

    Raises:
        Unsatisfiable: No visits that a robot in flight makes show that word.
    """
    regions = tuple(itinerary.visits[stop].region for stop in itinerary.all_stops)
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
