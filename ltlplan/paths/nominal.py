"""Nominal paths along what a method allocates; where the way of one allocation is blocked, the next ones are tried in turn.

A method that counts straight lines between regions does not know what stands between them. Where no path can be laid along a
word, another one differs from it in a leg at least: each leg of the blocked robot is shut in turn and the method is asked
again, the cheapest answer first (`ltlplan.search.lawler`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from ltlplan.allocation import Allocation, Itinerary, Leg
from ltlplan.logic.budget import TooLarge
from ltlplan.paths.flight_times import require_endurance
from ltlplan.paths.hoops import route_itinerary, route_sequence
from ltlplan.search.lawler import Partition
from ltlplan.search.shared_walls import OpenWall, open_wall
from verify.data import Infeasible, Mission, RobotPlan
from verify.data.progress import Progress, silent

_TRIES = 6  # allocations whose paths are tried
_SEARCHES = 61  # times that a method is asked, at most


Lay = Callable[[Mission, str, Itinerary], tuple[RobotPlan, tuple[str, ...]]]
"""From a robot and what it does to its path, with notes; raises Infeasible where there is none."""


def nominal_sequence(mission: Mission) -> Allocation:
    """Return the path through the mission's `sequence`, which leaves no method anything to choose.

    Raises:
        BadInput: The mission has no sequence, or several agents.
        Infeasible: A hoop cannot be reached.
    """
    path = route_sequence(mission)
    (name,) = mission.agents
    does = Itinerary(path.visits, path.word, path.cycle_visit, path.cost)
    return Allocation(robots={name: does}, cost=path.cost, complete=True, paths={name: path})


def lay_path(mission: Mission, name: str, does: Itinerary) -> tuple[RobotPlan, tuple[str, ...]]:
    """Lay one robot's path; where the nearest sides of its hoops are blocked, by the cheapest sides, with a note.

    Args:
        mission: Hoops, regions, workspace and margin.
        name: Of the robot.
        does: Its visits and word.

    Raises:
        Infeasible: There is no way.
    """
    asked, problem = mission.planner.directions, None
    through_hoops = any(visit.region in mission.hoops for visit in does.visits)
    for directions in dict.fromkeys((asked, "cheapest" if through_hoops else asked)):
        try:
            path = route_itinerary(mission, name, does, directions=directions)
            require_endurance(mission, name, path)
        except Infeasible as error:
            problem = problem or error
        else:
            note = f"{name}: the nearest sides of its hoops are blocked; the cheapest sides that are not were taken."
            return path, () if directions == asked else (note,)
    assert problem is not None
    raise problem


def nominal_paths(
    mission: Mission,
    allocate: Callable[[frozenset[Leg]], Allocation],
    *,
    lay: Lay = lay_path,
    progress: Progress = silent,
) -> Allocation:
    """Lay the paths of the cheapest allocation that has some.

    Args:
        mission: What is asked.
        allocate: From legs that are blocked to an allocation that does without them, if there is one.
        lay: Lays one robot's path.
        progress: Told a sentence and the share done, 0 to 1.

    Returns:
        The allocation with its paths, and with notes on what was passed over.

    Raises:
        Unsatisfiable: No words that these robots can fly satisfy the formula.
        Infeasible: No path was found along any of the words that were tried; the error is the cheapest words' own. Or each of them
            leads through a wall that rooms share, at which the formula may break.
    """
    blocked_robot: dict[tuple[object, ...], str] = {}  # of each allocation that was tried
    errors: list[Infeasible] = []
    first: Allocation | None = None

    def solve(shut: frozenset[Leg]) -> Iterator[tuple[float, Allocation]]:
        try:
            found = allocate(shut)
        except (TooLarge, Infeasible):
            if not shut:
                raise
            return  # this space is too large to search, or takes longer than vehicles fly; the others may not be
        if not found.legs(mission) & shut:
            yield found.cost, found

    def part(shut: frozenset[Leg], found: Allocation) -> Iterator[frozenset[Leg]]:
        robot = blocked_robot[_key(found)]
        return (shut | {leg} for leg in sorted(found.robots[robot].legs(mission, robot), key=str))

    def laid(found: Allocation) -> Iterator[tuple[str, RobotPlan, tuple[str, ...]]]:
        words = {name: does.word for name, does in found.robots.items()}
        if (found.meetings or not found.precedences) and (wall := open_wall(mission, words)) is not None:
            blocked_robot[_key(found)] = wall.robot
            raise wall
        for name, does in found.robots.items():
            progress(f"laying the path of {name}", 0.2)
            blocked_robot[_key(found)] = name
            yield name, *lay(mission, name, does)

    for _, _, _, found in Partition([frozenset[Leg]()], solve, part, searches=_SEARCHES):
        first = first or found
        if _key(found) in blocked_robot:
            continue
        try:
            paths = list(laid(found))
        except Infeasible as error:
            errors.append(error)
        else:
            notes = [note for _, _, said in paths for note in said]
            return replace(_noted(found, first, notes, errors), paths={name: path for name, path, _ in paths})
        if len(errors) == _TRIES:
            break
    raise errors[0]


def _noted(found: Allocation, first: Allocation, notes: list[str], errors: list[Infeasible]) -> Allocation:
    """Return an allocation that was laid, with what was passed over; the bound of the first one holds for all."""
    said = [*found.notes, *notes]
    if over := len(errors):
        which = "The cheapest words were" if over == 1 else f"The {over} cheapest words were"
        why = "" if isinstance(errors[0], OpenWall) else "a path is blocked: "
        said.append(f"{which} passed over, because {why}{errors[0]}")
    complete = first.complete and not errors
    return replace(found, notes=tuple(said), lower_bound=first.lower_bound, complete=complete)


def _key(found: Allocation) -> tuple[object, ...]:
    return tuple(
        (robot, tuple(visit.region for visit in does.visits), does.cycle_visit) for robot, does in found.robots.items()
    )
