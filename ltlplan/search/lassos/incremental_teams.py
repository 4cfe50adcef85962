"""The cheapest lasso of a team's product, looked for among few flying robots first.

Products of three robots and more are large, and most laps need few of the robots to fly. So laps are looked for in which one
robot flies at all, then two, and so on, while the others stay at their starts. What such laps cost is a limit: of the product of the whole team, only
places that are reached for less have to be walked over. Where even these are too many, the best laps of fewer robots stand.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.search.lassos.lasso import LassoRun, cheapest_lasso
from ltlplan.search.lassos.team_readers import AnyReader, reads_letters, team_readers
from ltlplan.search.lassos.team_system import TeamSystem
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Formula, Mission

MOST_TEAMS = 32
"""Choices of so many flying robots that are looked at."""

MOST_TO_IMPROVE = 20_000
"""Places of a product that are walked over where other or fewer robots are known to suffice."""

_GRAIN = 1e-6


@dataclass(frozen=True, slots=True)
class TeamRun:
    """A lasso of a team's product.

    Attributes:
        run: The lasso.
        system: The product.
        readers: How the formula's conjuncts read it.
        whole: Whether laps of all robots were compared.
    """

    run: LassoRun
    system: TeamSystem
    readers: list[AnyReader]
    whole: bool = True


def cheapest_team_lasso(mission: Mission, each: Sequence[TransitionSystem], asked: Formula, budget: Budget) -> TeamRun | None:
    """Return the cheapest lasso of robots that fly one at a time, or None where there is none.

    Args:
        mission: Gives the reading, and how many laps count.
        each: What each robot can do.
        asked: The formula over what they can show, written out.
        budget: Bounds on the product's states, and on those expanded in search of rounds.

    Raises:
        BadInput: A conjunct is of a form that is not planned.
        TooLarge: The product has more states than the budget allows, and no few robots have laps.
    """
    everyone, best, limit = range(len(each)), None, math.inf
    for size in range(1, len(each)) if len(each) > 2 else ():
        try:
            for flying in itertools.islice(itertools.combinations(everyone, size), MOST_TEAMS):
                found = _lasso(mission, each, asked, budget, flying, limit)
                if found is not None and _cost(mission, found.run) < limit - _GRAIN:
                    best, limit = replace(found, whole=False), _cost(mission, found.run)
                    budget = replace(budget, lasso=min(budget.lasso, MOST_TO_IMPROVE))
        except TooLarge:
            break
    try:
        return _lasso(mission, each, asked, budget, everyone, limit + _GRAIN) or best
    except TooLarge:
        if best is None:
            raise
        return best


# six parameters: what is planned with which bounds, and who of the team flies for less than what
def _lasso(
    mission: Mission, each: Sequence[TransitionSystem], asked: Formula, budget: Budget, flying: Sequence[int], limit: float
) -> TeamRun | None:
    """Return the cheapest lasso below a limit in which only some robots fly and the others stay where they start."""
    some = [own if k in flying else replace(own, edges=tuple(() for _ in own.edges)) for k, own in enumerate(each)]
    system = TeamSystem(some, movers=not reads_letters(mission, asked))
    readers = team_readers(mission, asked, system.letters, budget, flying)
    run = cheapest_lasso(system, readers, weight=mission.spec.repeat, budget=budget, limit=limit)
    return None if run is None else TeamRun(run, system, readers)


def _cost(mission: Mission, run: LassoRun) -> float:
    return run.prefix_cost + mission.spec.repeat * run.cycle_cost
