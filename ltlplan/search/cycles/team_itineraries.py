"""From a team's cycles as paths of their systems to what each robot visits, and who waits for whom."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence

from ltlplan.allocation import Itinerary
from ltlplan.search.cycles.concurrent_cycle_steps import Stage
from ltlplan.search.cycles.team_cycles import TeamCycles
from ltlplan.search.itineraries import itinerary, path_cost
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Infeasible, Word
from verify.data.language.word import stutter_free
from verify.data.plan import Meeting


def team_itineraries(each: Sequence[TransitionSystem], team: TeamCycles, repeat: int) -> dict[str, Itinerary]:
    """Return what each robot does: visits of the prefix, then those of one cycle.

    Args:
        each: The robots' systems.
        team: Their paths.
        repeat: How many cycles count in costs.

    Raises:
        Infeasible: A cycle would begin with an action where the robot rests.
    """
    found: dict[str, Itinerary] = {}
    for system, prefix, cycle in zip(each, team.prefixes, team.cycles, strict=True):
        before, after = itinerary(system, prefix).visits, itinerary(system, cycle).visits
        begun = len(system.nodes[cycle[0]].regions)
        if any(visit.actions for visit in after[:begun]):
            raise Infeasible(
                f"{system.robot}'s lap would begin with an action in '{after[0].region}', where it rests: laps begin and end in the same "
                "internal state, and what is done in a region where a lap begins is done at its end. Give the robot another region to rest in."
            )
        once, again = (stutter_free(system.labels[node] for node in way) for way in (prefix, cycle))
        word = Word(once, again[1:]) if len(again) > 1 else Word(once[:-1], once[-1:])
        cost = path_cost(system, prefix) + repeat * path_cost(system, cycle)
        found[system.robot] = Itinerary((*before, *after[begun:]), word, len(before), cost)
    return found


def team_meetings(each: Sequence[TransitionSystem], team: TeamCycles) -> list[Meeting]:
    """Return the waits between stages: each robot of a stage sets out when all others of the one before have arrived.

    Args:
        each: The robots' systems.
        team: Their paths, in stages.

    Raises:
        Infeasible: A robot would have to wait where it visits nothing, or with an action.
    """
    if team.course is None:
        return []
    prefixes = [len(itinerary(system, prefix).visits) for system, prefix in zip(each, team.prefixes, strict=True)]
    begun = [len(system.nodes[cycle[0]].regions) for system, cycle in zip(each, team.cycles, strict=True)]
    found = [
        *_meetings(each, team.course.prefix, [prefix[0] for prefix in team.prefixes], [0] * len(each)),
        *_meetings(
            each, team.course.cycle, [cycle[0] for cycle in team.cycles], [n - b for n, b in zip(prefixes, begun, strict=True)]
        ),
    ]
    return list(dict.fromkeys(found))


def _meetings(
    each: Sequence[TransitionSystem], stages: Sequence[Stage], begin: Sequence[int], offsets: Sequence[int]
) -> Iterator[Meeting]:
    ways = [[node] for node in begin]
    spans: list[Mapping[int, tuple[int, int]]] = []  # of each stage: robot, how many visits it has made before and after
    for stage in stages:
        before = [len(itinerary(system, tuple(way)).visits) for system, way in zip(each, ways, strict=True)]
        for move in stage:
            ways[move.robot].extend(move.way[1:])
        after = [len(itinerary(system, tuple(way)).visits) for system, way in zip(each, ways, strict=True)]
        spans.append({move.robot: (before[move.robot], after[move.robot]) for move in stage})
    for earlier, later in itertools.pairwise(spans):
        for robot, (setting_out, _) in sorted(later.items()):
            for other, (_, arrived) in sorted(earlier.items()):
                if other == robot:
                    continue
                for who, stage in ((robot, later), (other, earlier)):
                    if stage[who][0] == stage[who][1]:
                        raise Infeasible(_NOTHING.format(name=each[who].robot))
                yield Meeting(
                    first=(each[other].robot, arrived - 1 + offsets[other]),
                    then=(each[robot].robot, setting_out + offsets[robot]),
                )


_NOTHING = (
    "The formula asks that {name} does something before or after another robot sets out without coming to a region: such waits are not "
    "planned. Give the place or the action a region of its own."
)
