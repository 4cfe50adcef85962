"""From a mission to a plan: choose who visits what, then the way there.

    formula - automaton - word - assignment - waypoints

Planning modules share only plain data with the checker; whether the plan keeps its word is judged above this
layer, in `pipeline`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from verify.data import Infeasible, Mission, Plan, RobotPlan

Progress = Callable[[str, float], None]


def make_plan(mission: Mission, *, seed: int | None = None, progress: Progress | None = None) -> Plan:
    """Plan a mission by the method that it names.

    Args:
        mission: What is asked.
        seed: Source of every draw, instead of the mission's own `planner.seed`.
        progress: Told a sentence and the share done, 0 to 1.

    Raises:
        Unsatisfiable: No word that these robots can fly satisfies the formula; the message says why.
        Infeasible: A word exists, but no way between the hoops was found.
    """
    from ltlplan.hoops import route, route_sequence
    from ltlplan.search import assign

    used_seed = mission.planner.seed if seed is None else seed
    say = progress or (lambda _sentence, _share: None)
    rng = np.random.default_rng(used_seed)
    if mission.passages is not None:
        (name,) = mission.agents
        say("laying the path through the sequence of hoops", 0.2)
        robots = {name: route_sequence(mission)}
        robots = _improved(mission, robots, rng, say)
        return _plan(mission, robots, method="sequence", seed=used_seed, complete=True)
    if mission.planner.method == "mtac-e":
        from ltlplan.mtac import allocate

        return allocate(mission, rng=rng, progress=progress)
    say("searching words and robots", 0.05)
    assignment = assign(mission)
    robots = {}
    for name, itinerary in assignment.robots.items():
        say(f"laying the path of {name}", 0.2)
        robots[name] = route(mission, name, itinerary.visits, itinerary.cycle_visit, directions=mission.planner.directions)
    robots = _improved(mission, robots, rng, say)
    return _plan(
        mission,
        robots,
        method="exact",
        seed=used_seed,
        complete=assignment.complete,
        lower_bound=assignment.lower_bound,
        notes=assignment.notes,
    )


def _improved(mission: Mission, robots: dict[str, RobotPlan], rng: np.random.Generator, say: Progress) -> dict[str, RobotPlan]:
    """Make each robot's nominal path cheaper by cross-entropy, each with a generator of its own."""
    from ltlplan.cross_entropy import improve

    better: dict[str, RobotPlan] = {}
    for index, ((name, nominal), own) in enumerate(zip(robots.items(), rng.spawn(len(robots)), strict=True)):
        say(f"optimising the path of {name} by cross-entropy", 0.3 + 0.7 * index / len(robots))
        better[name] = improve(mission, name, nominal, rng=own).plan
    return better


def _plan(
    mission: Mission,
    robots: dict[str, RobotPlan],
    *,
    method: str,
    seed: int,
    complete: bool,
    lower_bound: float | None = None,
    notes: tuple[str, ...] = (),
) -> Plan:
    costs = [robot.cost for robot in robots.values()]
    if not np.all(np.isfinite(costs)):
        raise Infeasible("The planned path has no finite cost; a waypoint is out of reach.")
    cost = max(costs) if mission.planner.objective == "longest" else sum(costs)
    return Plan(
        mission=mission,
        robots=robots,
        method=method,
        seed=seed,
        cost=cost,
        lower_bound=lower_bound,
        complete=complete,
        notes=notes,
    )
