"""From a mission to a plan: choose who visits what, then the way there.

    mission - allocation - nominal paths - improved paths - plan

Each arrow is a function; the first is the planning method (`ltlplan.allocation`), the others are shared by all methods. Planning
shares only plain data with the checker; whether the plan keeps its word is checked above this layer, in `pipeline`.
"""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from functools import partial
from numbers import Real
from typing import TYPE_CHECKING, SupportsIndex

import numpy as np

from ltlplan.allocation import Allocation, Context, Itinerary, Known, Leg, PlanningMethod
from ltlplan.logic.budget import DEFAULT_BUDGET, Budget
from ltlplan.systems.objective import is_counted_by_legs, objective_text
from ltlplan.systems.touching_points import is_large, words_touch
from verify.data import BadInput, Infeasible, Mission, Plan, RobotPlan
from verify.data.language.counting import first_count
from verify.data.names.choices import PLANNING_METHODS
from verify.data.progress import Progress, silent

if TYPE_CHECKING:
    from flight.processes import Workers

_CHUNKS = 4
"""Parts that each process gets of the paths to improve: more even than one, and the mission is not sent for every robot."""
_NO_COUNTS = ("online-mtac-e",)
"""Methods that hand tasks from one robot to the next in flight, and know nothing of several at one time."""

_BOUNDING = Budget(states=10_000)
"""Of the search for what no plan costs less than."""
SEQUENCE = "sequence"
"""What `Plan.method` says where the mission's own sequence of passages is flown."""


def make_plan(
    mission: Mission,
    *,
    method: PlanningMethod | str | None = None,
    seed: int | None = None,
    progress: Progress | None = None,
    workers: Workers | None = None,
    known: Known | None = None,
) -> Plan:
    """Plan a mission.

    Args:
        mission: What is asked.
        method: Who does what is decided by this function, or the one of this name; by default the mission's `planner.method`.
        seed: Source of every draw, instead of the mission's own `planner.seed`.
        progress: Receives a sentence and the share done, 0 to 1.
        workers: Who improves robots' paths side by side; None does it here. The plan does not depend on it.
        known: What earlier searches and refinements found.

    Raises:
        BadInput: There is no such method, or what it returned is no allocation of this mission. Robots start, or are to end,
            nearer to each other than they may. The environment has an edge that no robot can fly for obstacles.
        Unsatisfiable: No word that these robots can fly satisfies the formula; the message says why.
        Infeasible: A word exists, but no way between the hoops was found.
    """
    mission = with_seed(mission, seed)
    say, rng = progress or silent, np.random.default_rng(mission.planner.seed)
    if mission.passages is not None:
        from ltlplan.paths.nominal import nominal_sequence

        if method is not None:
            raise BadInput("A sequence of passages leaves a planning method nothing to choose; leave one of the two out.")
        say("laying the path through the sequence of hoops", 0.2)
        laid = nominal_sequence(mission)
        return plan_of(mission, laid, _improved(mission, laid, rng, say, workers), method=SEQUENCE)
    known = known or Known()
    planned = partial(plan_of, budget=known.budget)
    named = mission.planner.method if method is None else method
    if isinstance(named, str) and named in _NO_COUNTS and (count := first_count(mission.written)) is not None:
        raise BadInput(
            f"`{count}` speaks of single robots or of how many there are, which `{named}` does not plan; `planner.method: exact` and `mtac-e` do."
        )
    allocate = PLANNING_METHODS.resolve(named)
    name = named if isinstance(named, str) else getattr(named, "__name__", type(named).__name__)

    def allocation(blocked: frozenset[Leg] = frozenset()) -> Allocation:
        return _checked(allocate(mission, Context(rng, say, blocked, known)), mission, name)

    if mission.obstacles:
        from ltlplan.systems.flyable_edges import require_flyable_edges

        require_flyable_edges(mission)
    first = allocation()
    if first.paths is not None:
        from ltlplan.search.shared_walls import open_wall

        words = {name: does.word for name, does in first.robots.items()}
        if (first.meetings or not first.precedences) and (wall := open_wall(mission, words)) is not None:
            raise wall
        return planned(mission, first, first.paths, method=name)
    from ltlplan.paths.nominal import lay_path, nominal_paths
    from ltlplan.paths.team_laps import lay_laps
    from ltlplan.paths.unnamed_regions import finished

    laps = mission.spec.trace == "infinite" and len(mission.agents) > 1
    lay = lay_laps if laps else lay_path
    laid = nominal_paths(mission, lambda blocked: allocation(blocked) if blocked else first, lay=lay, progress=say)
    paths = laid.paths or {}
    if laps:
        return planned(mission, laid, paths, method=name)
    waits = mission.written.counts or bool(laid.meetings)
    if waits and len(mission.agents) > 1 and not mission.hoops:
        from ltlplan.paths.improvement import without_swings

        steady = {
            robot: finished(mission, robot, does, paths[robot], lambda few, path, robot=robot: without_swings(few, robot, path))
            for robot, does in laid.robots.items()
        }
        return planned(mission, laid, steady, method=name)  # refinement gives each robot places of its own
    return planned(mission, laid, _improved(mission, laid, rng, say, workers), method=name)


def plan_of(
    mission: Mission, allocation: Allocation, paths: Mapping[str, RobotPlan], *, method: str, budget: Budget = DEFAULT_BUDGET
) -> Plan:
    """Put a plan together: the only place where one is made.

    Args:
        mission: What is asked.
        allocation: Who does what, with bounds and notes.
        paths: Each robot's path.
        method: Name of the planning method.
        budget: Of the search, which may have been ended on request.

    Raises:
        Infeasible: A path has no finite cost, or lasts longer than a vehicle can stay in the air.
    """
    from ltlplan.paths.costs import team_cost
    from ltlplan.paths.flight_times import require_endurance
    from ltlplan.paths.k_best_words import lower_bound

    minimised = objective_text(mission)
    bound = None if allocation.lower_bound is None else lower_bound(mission, budget=budget.beside(_BOUNDING))
    straight = _by_straight_legs(mission, allocation) if method == "exact" else ()
    costs = [path.cost for path in paths.values()]
    if not np.all(np.isfinite(costs)):
        raise Infeasible("The planned path has no finite cost; a waypoint is out of reach.")
    for name, path in paths.items():
        require_endurance(mission, name, path)
    return Plan(
        mission=mission,
        robots=dict(paths),
        method=method,
        seed=mission.planner.seed,
        cost=team_cost(mission, costs),
        lower_bound=bound,
        complete=allocation.complete,
        precedences=allocation.precedences,
        meetings=allocation.meetings,
        notes=(
            *budget.notes,
            *allocation.notes,
            *straight,
            *(f"Precedence: {each.sentence(paths)}." for each in allocation.precedences),
            *([] if minimised is None else [f"Minimised: {minimised}."]),
        ),
    )


def _by_straight_legs(mission: Mission, allocation: Allocation) -> tuple[str, ...]:
    """Return what is known of the words by straight legs between middles, of all laps, as the exact search counts them."""
    if allocation.lower_bound is None or not is_counted_by_legs(mission):
        return ()
    lasso = mission.spec.trace == "infinite"
    laps = f" of all {mission.spec.repeat} laps" if lasso and mission.spec.repeat > 1 else ""
    large = words_touch(mission) and any(is_large(mission, name) for name in mission.regions)
    ends = " and touched places" if large else ""
    counted, what = f"By straight legs between middles{laps}{ends}", "word" if lasso else "assignment"
    if allocation.complete:
        return (f"{counted} the {what} is the cheapest: {allocation.lower_bound:.3f}.",)
    return (f"{counted} the bound is {allocation.lower_bound:.3f}; a cheaper {what} may exist.",)


def with_seed(mission: Mission, seed: int | None) -> Mission:
    """Return a mission that has another seed, where one is given: the one that its plan, its flight and its files state.

    Raises:
        BadInput: The seed is no whole number, or below 0.
    """
    if seed is None or seed is mission.planner.seed:
        return mission
    unlike = isinstance(seed, bool) or not isinstance(seed, SupportsIndex)  # pyright: ignore[reportUnnecessaryIsInstance]  # callers may not check
    if unlike or seed.__index__() < 0:
        raise BadInput(f"A seed is a whole number from 0 on, not {seed!r}.")
    return _with_planner(mission, seed=seed.__index__())


def with_pace(mission: Mission, pace: float | str | None) -> Mission:
    """Return a mission that has another `planner.pace`, where one is given; agents with a pace of their own keep it.

    Raises:
        BadInput: The pace is neither a number above 0 up to 1 nor "nominal".
    """
    asked = mission.planner.pace if pace is None else checked_pace(pace)
    return mission if asked == mission.planner.pace else _with_planner(mission, pace=asked)


def checked_pace(pace: object) -> float | str:
    """Return a pace as missions keep it.

    Raises:
        BadInput: It is neither a number above 0 up to 1 nor "nominal".
    """
    if isinstance(pace, str) and pace == "nominal":
        return pace
    if isinstance(pace, bool) or not isinstance(pace, Real) or not 0.0 < float(pace) <= 1.0:
        raise BadInput(f"A pace is a share of the fastest flight, above 0 up to 1, or 'nominal', not {pace!r}.")
    return float(pace)


def pace_of(text: str | None) -> float | str | None:
    """Return the pace that a text means, for `with_pace`: a number where it is one."""
    try:
        return None if text is None else float(text)
    except ValueError:
        return text


def _with_planner(mission: Mission, **update: object) -> Mission:
    """Return a mission with other settings of its planner, made anew so that nothing computed from the old ones stays."""
    parts = {name: getattr(mission, name) for name in Mission.model_fields}
    return Mission.model_validate({**parts, "planner": mission.planner.model_copy(update=update)})


def generators(mission: Mission, rng: np.random.Generator) -> dict[str, np.random.Generator]:
    """Return a generator for each robot: of the same draws, whatever it is called, wherever it is listed, and whatever others draw."""
    (first,) = rng.spawn(1)
    return {name: deepcopy(first) for name in mission.agents}


def _checked(found: object, mission: Mission, method: str) -> Allocation:
    """Return what a method returned, if it is an allocation among the mission's robots."""
    if not isinstance(found, Allocation):
        raise BadInput(f"The planning method '{method}' returned a {type(found).__name__}; it must return an Allocation.")
    agents = list(mission.agents)
    for what, given in (("robots", found.robots), ("paths", found.paths)):
        if given is not None and list(given) != agents:
            raise BadInput(
                f"The planning method '{method}' returned {what} {', '.join(given) or 'of nobody'}; the mission's are, in order, "
                f"{', '.join(agents)}, idle ones too."
            )
    return found


_Part = list[tuple[str, Itinerary, RobotPlan, np.random.Generator]]
"""Robots with what they do, their nominal paths and their draws."""


def _improved(
    mission: Mission, laid: Allocation, rng: np.random.Generator, say: Progress, workers: Workers | None
) -> dict[str, RobotPlan]:
    """Improve each robot's path by cross-entropy: side by side or not, they come to the same."""
    paths, own = laid.paths or {}, generators(mission, rng)
    part: _Part = [(name, laid.robots[name], path, own[name]) for name, path in paths.items()]
    if workers is not None and workers.count > 1 and len(paths) > 1:
        from flight.processes import shared

        count = min(_CHUNKS * workers.count, len(part))
        parts = [part[k::count] for k in range(count)]
        sentence = f"optimising the paths of {len(paths)} robots by cross-entropy"
        found = shared(_improve, mission, parts, workers=workers, progress=lambda share: say(sentence, 0.3 + 0.7 * share))
        better = {name: path for part in found for name, path in part}
        return {name: better[name] for name in paths}
    improved: dict[str, RobotPlan] = {}
    for index, (name, does, path, draws) in enumerate(part):
        say(f"optimising the path of {name} by cross-entropy", 0.3 + 0.7 * index / len(paths))
        improved[name] = _better(mission, name, does, path, draws)
    return improved


def _improve(mission: Mission, part: _Part, report: Progress) -> list[tuple[str, RobotPlan]]:
    """Improve some robots' paths; called in a process."""
    done: list[tuple[str, RobotPlan]] = []
    for index, (name, does, path, draws) in enumerate(part):
        report("improving", index / len(part))
        done.append((name, _better(mission, name, does, path, draws)))
    return done


def _better(mission: Mission, robot: str, does: Itinerary, nominal: RobotPlan, draws: np.random.Generator) -> RobotPlan:
    """Improve one robot's path."""
    from ltlplan.paths.improvement import improved_path
    from ltlplan.paths.unnamed_regions import finished

    return finished(mission, robot, does, nominal, lambda few, path: improved_path(few, robot, path, lambda: draws).plan)
