"""Plans for `team: joint`, where a formula speaks of what all robots show together.

A plan must hold when one robot flies at a time, in every order, while the others hold their first or last letters. So the
robots' product is walked along one order of the robots only (who flies, where, what the others hold), which is far
smaller than all their positions at once. What somebody holds is forgotten as soon as no unfinished conjunct asks for it.
Where the cheapest run breaks a conjunct in another order, the search begins again and also remembers what each robot's word
does to that conjunct, for everything that the others may hold meanwhile (`ltlplan.search.joint.conjuncts`).
"""

from __future__ import annotations

from ltlplan.allocation import Allocation
from ltlplan.search.joint.reading import JointTask
from ltlplan.search.problem import Problem
from ltlplan.search.team_planning import assigned


def plan(problem: Problem) -> Allocation:
    """Plan words that hold in every order of the robots, by the mission's objective and within the endurance of vehicles.

    Raises:
        NoWords: There are none.
        Infeasible: None are within a vehicle's endurance.
        TooLarge: A budget was used up before an answer was found.
    """
    return assigned(problem, JointTask(problem.each, problem.automata))
