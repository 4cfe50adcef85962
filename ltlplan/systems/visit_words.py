"""The word that a robot shows when it makes some visits.

* A robot that starts inside a region begins with a visit of it; that visit is listed first, idle robots included.
* Flying to a region adds free flight and then the region; an action adds the region with the new internal propositions.
* At its end a robot stays in a plain region that it visited last, and has flown out of a hoop; where the formula needs
  the other choice, the last letter of the word says so.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from verify.data import BadInput, Letter, Mission, Visit, Word
from verify.data.language.word import stutter_free


def word_of(
    mission: Mission, agent: str, visits: Sequence[Visit], cycle_visit: int | None = None, *, stays: bool | None = None
) -> Word:
    """Return the word that a robot shows when it makes these visits, free flight included.

    Args:
        mission: Whose regions, start and internal states.
        agent: The robot's name.
        visits: In flight order. A robot that starts inside a region has that visit first.
        cycle_visit: Index of the first visit of the cycle, for a lasso; the number of visits where the cycle is a hover.
        stays: Whether the robot ends inside the region that it visited last; by default in a plain region, but not in a hoop.
            For a lasso: whether a hover is in that region.

    Raises:
        BadInput: An unknown region, one whose middle lies in another, an action that its region or the internal state does not
            permit, a robot that starts inside a region without visiting it.
    """
    regions, system = mission.all_regions, mission.robot_of(agent)
    start = np.array(mission.agents[agent].start)
    inside = frozenset(name for name, region in regions.items() if float(region.level(start)) <= 1.0)
    state = mission.initial_internal(agent)
    letters: list[Letter] = []
    entry: list[int] = []  # index of each visit's first letter
    for index, visit in enumerate(visits):
        if visit.region not in regions:
            raise BadInput(f"{agent}, visit {index}: '{visit.region}' is not a region of the mission.")
        shared = sorted(
            n for n, r in regions.items() if n != visit.region and float(r.level(np.array(regions[visit.region].center))) <= 1
        )
        if shared:
            raise BadInput(
                f"{agent}, visit {index}: the middle of '{visit.region}' also lies in {', '.join(shared)}, so the visits alone do "
                "not give the word; use the word of the planner's itinerary."
            )
        if index or not inside:
            letters.append(frozenset(system.states[state]))
        elif visit.region not in inside:
            raise BadInput(f"{agent} starts inside {', '.join(sorted(inside))}; its first visit must be that region.")
        entry.append(len(letters))
        letters.append(frozenset({visit.region, *system.states[state]}))
        for action in visit.actions:
            if action.at != visit.region or action.source != state or action not in system.actions:
                raise BadInput(
                    f"{agent}, visit {index}: the action {action.source} -> {action.target} at {action.at} is not possible "
                    f"in {visit.region} with internal state {state}."
                )
            state = action.target
            letters.append(frozenset({visit.region, *system.states[state]}))
    free = frozenset(system.states[state])
    if not visits:
        if inside:
            raise BadInput(f"{agent} starts inside {', '.join(sorted(inside))}; its first visit must be that region.")
        letters.append(free)
    if stays is None:
        stays = bool(visits) and visits[-1].region not in mission.hoops
    if cycle_visit is None or cycle_visit == len(visits):
        if visits and not stays:
            letters.append(free)
        return Word(stutter_free(letters)) if cycle_visit is None else Word(stutter_free(letters)[:-1], (letters[-1],))
    letters.append(free)  # on the way back to the cycle's first visit
    cut = entry[cycle_visit]
    return Word(stutter_free(letters[:cut]), stutter_free(letters[cut:]))
