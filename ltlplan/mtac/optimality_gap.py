"""How near an assignment is to the best one: both counted by straight lines, as the exact search counts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ltlplan.paths.costs import cost_of, team_cost
from verify.data import Mission, Visit
from verify.data.shapes.inequalities import Point


def straight_line_costs(mission: Mission) -> Callable[[str, Point, str], float]:
    """Return a lower bound on the cost of one leg under each robot's own weights: metres of a straight line, and their time.

    Returns:
        Function of a robot, a position (m) and the region that it flies to.
    """
    centres = {name: np.array(region.center) for name, region in mission.all_regions.items()}
    weights = {}
    for robot in mission.agents:
        cost = dict(cost_of(mission, robot).weights)
        weights[robot] = cost.get("length", 0.0) + cost.get("time", 0.0) / mission.seen_by(robot).planner.speed

    around = {name: 2.0 * region.inner_radius for name, region in mission.all_regions.items()}

    def leg(robot: str, position: Point, region: str) -> float:
        metres = float(np.linalg.norm(np.array(position) - centres[region]))
        return weights[robot] * (metres or around[region])  # a region that was just left is at least a way out and back

    return leg


def optimality_gap(mission: Mission, visits: Mapping[str, Sequence[Visit]]) -> tuple[str, float | None]:
    """Compare an assignment with the exact one by straight lines.

    Args:
        mission: What is asked.
        visits: The regions to whose middles each robot flies, in order, one that it starts in first.

    Returns:
        A sentence for a person, and the exact search's lower bound where it has one.

    Raises:
        Unsatisfiable: There is no exact assignment.
        TooLarge: A budget was used up before one was found.
    """
    from ltlplan.search.exact import assign

    exact = assign(mission)
    ours = straight_cost(mission, visits)
    gap = 100.0 * (ours / exact.cost - 1.0) if exact.cost > 0 else 0.0
    sentence = f"By straight lines this assignment costs {ours:.3f}, the {'best' if exact.complete else 'best known'} one {exact.cost:.3f}"
    return f"{sentence}: a gap of {gap:.1f} %.", exact.lower_bound


def straight_cost(mission: Mission, visits: Mapping[str, Sequence[Visit]]) -> float:
    """Return the objective of each robot's visits when every leg is a straight line, as the exact search counts.

    Args:
        mission: Gives starts, regions and weights.
        visits: The regions to whose middles each robot flies, in order, one that it starts in first.
    """
    costs: list[float] = []
    leg = straight_line_costs(mission)
    for robot, own in visits.items():
        position, total = mission.agents[robot].start, 0.0
        for index, visit in enumerate(own):
            inside = index == 0 and float(mission.all_regions[visit.region].level(np.array(position))) <= 1.0
            total += 0.0 if inside else leg(robot, position, visit.region)
            position = mission.all_regions[visit.region].center if not inside else position
        costs.append(total)
    return team_cost(mission, costs)
