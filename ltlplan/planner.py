"""From a mission to a plan: choose who visits what, then the way there.

    formula - automaton - word - assignment - waypoints

Planning modules share only plain data with the checker; whether the plan keeps its word is judged above this
layer, in `pipeline`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, SupportsIndex, get_args

import numpy as np

from verify.data import BadInput, Infeasible, Mission, Plan, RobotPlan
from verify.data.errors import did_you_mean
from verify.data.mission import Planner

if TYPE_CHECKING:
    from ltlplan.search.exact import Itinerary

Progress = Callable[[str, float], None]

METHODS: tuple[str, ...] = get_args(Planner.model_fields["method"].annotation)
"""What `planner.method` may say."""


def make_plan(mission: Mission, *, seed: int | None = None, progress: Progress | None = None) -> Plan:
    """Plan a mission by the method that it names.

    Args:
        mission: What is asked.
        seed: Source of every draw, instead of the mission's own `planner.seed`.
        progress: Told a sentence and the share done, 0 to 1.

    Raises:
        BadInput: There is no such method. Robots start, or are to end, nearer to each other than they may.
        Unsatisfiable: No word that these robots can fly satisfies the formula; the message says why.
        Infeasible: A word exists, but no way between the hoops was found.
    """
    mission = with_seed(mission, seed)
    say = progress or (lambda _sentence, _share: None)
    rng = np.random.default_rng(mission.planner.seed)
    method = mission.planner.method
    if method not in METHODS:
        raise BadInput(f"'{method}' is no planning method.{did_you_mean(method, METHODS)} Methods: {', '.join(METHODS)}.")
    if mission.passages is None and method == "mtac-e":
        from ltlplan.mtac.offline import allocate

        return allocate(mission, rng=rng, progress=progress)
    if mission.passages is None and method == "online-mtac-e":
        from ltlplan.sharing.simulated import share_online

        return share_online(mission, rng=rng, progress=progress)
    nominal = nominal_paths(mission, progress=say)
    robots = _improved(mission, nominal.robots, rng, say)
    return _plan(mission, robots, nominal)


def with_seed(mission: Mission, seed: int | None) -> Mission:
    """Return a mission that has another seed, where one is given: the one that its plan, its flight and its files state.

    Raises:
        BadInput: The seed is no whole number, or below 0.
    """
    if seed is None or seed is mission.planner.seed:
        return mission
    if isinstance(seed, bool) or not isinstance(seed, SupportsIndex) or seed.__index__() < 0:
        raise BadInput(f"A seed is a whole number from 0 on, not {seed!r}.")
    planner = mission.planner.model_copy(update={"seed": seed.__index__()})
    parts = {name: getattr(mission, name) for name in Mission.model_fields}
    return Mission.model_validate({**parts, "planner": planner})  # anew, so that nothing computed from the old seed stays


@dataclass(frozen=True)
class Nominal:
    """Paths along control points and primitives, before they are optimised.

    Attributes:
        robots: Each robot's path, in the mission's order.
        method: "sequence" or "exact".
        complete: Whether the search for words and robots was exhausted.
        lower_bound: A proved lower bound on the search's own objective (straight lines between regions).
        notes: Sentences for a person.
    """

    robots: dict[str, RobotPlan]
    method: str
    complete: bool
    lower_bound: float | None = None
    notes: tuple[str, ...] = ()


def nominal_paths(mission: Mission, *, progress: Progress | None = None) -> Nominal:
    """Choose words and robots (or take the mission's sequence) and lay the nominal paths.

    Raises:
        Unsatisfiable: No word that these robots can fly satisfies the formula.
        Infeasible: A word exists, but no way between the hoops was found.
    """
    from ltlplan.paths.hoops import route_sequence
    from ltlplan.search.next_best import lay_cheapest

    say = progress or (lambda _sentence, _share: None)
    if mission.passages is not None:
        say("laying the path through the sequence of hoops", 0.2)
        return Nominal({name: route_sequence(mission) for name in mission.agents}, "sequence", complete=True)
    say("searching words and robots", 0.05)
    notes: dict[str, list[str]] = {}

    def lay(name: str, itinerary: Itinerary) -> RobotPlan:
        say(f"laying the path of {name}", 0.2)
        path, notes[name] = _laid(mission, name, itinerary)
        return path

    found = lay_cheapest(mission, lay)
    said = [*found.assignment.notes, *(note for name in found.robots for note in notes[name])]
    if over := len(found.passed_over):
        which = "The cheapest words were" if over == 1 else f"The {over} cheapest words were"
        said.append(f"{which} passed over, because a path is blocked: {found.passed_over[0]}")
    complete = found.first.complete and not found.passed_over
    return Nominal(found.robots, "exact", complete, found.first.lower_bound, tuple(said))


def _laid(mission: Mission, name: str, itinerary: Itinerary) -> tuple[RobotPlan, list[str]]:
    """Lay one robot's path; where the nearest sides of its hoops are blocked, by the cheapest sides, with a note."""
    from ltlplan.paths.hoops import route

    def by(directions: Literal["nearest", "cheapest"]) -> RobotPlan:
        return route(mission, name, itinerary.visits, itinerary.cycle_visit, directions=directions, word=itinerary.word)

    try:
        return by(mission.planner.directions), []
    except Infeasible:
        if mission.planner.directions == "cheapest" or not any(visit.region in mission.hoops for visit in itinerary.visits):
            raise
        try:
            return by("cheapest"), [
                f"{name}: the nearest sides of its hoops are blocked; the cheapest sides that are not were taken."
            ]
        except Infeasible:
            pass
        raise


def generators(mission: Mission, rng: np.random.Generator) -> dict[str, np.random.Generator]:
    """Return a generator of its own for each robot, so that one robot's draws do not depend on the others' paths."""
    return dict(zip(mission.agents, rng.spawn(len(mission.agents)), strict=True))


def _improved(mission: Mission, robots: dict[str, RobotPlan], rng: np.random.Generator, say: Progress) -> dict[str, RobotPlan]:
    from ltlplan.mtac.offline import improved

    better: dict[str, RobotPlan] = {}
    for index, (name, own) in enumerate(generators(mission, rng).items()):
        say(f"optimising the path of {name} by cross-entropy", 0.3 + 0.7 * index / len(robots))
        better[name] = improved(mission, name, robots[name], lambda own=own: own).plan
    return better


def _plan(mission: Mission, robots: dict[str, RobotPlan], nominal: Nominal) -> Plan:
    costs = [robot.cost for robot in robots.values()]
    if not np.all(np.isfinite(costs)):
        raise Infeasible("The planned path has no finite cost; a waypoint is out of reach.")
    return Plan(
        mission=mission,
        robots=robots,
        method=nominal.method,
        seed=mission.planner.seed,
        cost=max(costs) if mission.planner.objective == "longest" else sum(costs),
        lower_bound=nominal.lower_bound,
        complete=nominal.complete,
        notes=nominal.notes,
    )
