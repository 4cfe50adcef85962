"""Online MTAC-E as a planning method: a team flown in simulated time on the papers' model until the formula is satisfied.

Robots are where they are asked to be (the model of the papers' Algorithms 3 to 5: no dynamics, no wind), and each step takes its
50th of a second whatever it took to compute. What the team settled on and flew becomes the plan: its words, who does what,
and waypoints on the paths that were flown. Refinement, certificate, flight and export follow as for any plan.

A plan's words are to hold in every order of the robots, so here tasks are shared only in such ways. In flight some order would do,
because a robot can be made to wait; a plan promises no times.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from ltlplan.allocation import Allocation, Context, Itinerary
from ltlplan.mtac.optimality_gap import best_known
from ltlplan.online_mtac.initial_allocation import NEEDS_WAITS
from ltlplan.online_mtac.online_team import OnlineTeam
from ltlplan.online_mtac.pilot import Pilot
from ltlplan.online_mtac.team_in_flight import PERIOD
from ltlplan.paths.costs import Sampling, WeightedCost, cost_of, plan_cost, team_cost
from ltlplan.paths.hoops import route_itinerary
from ltlplan.paths.path_result import candidate_plans
from ltlplan.paths.sampling.least_snap_spline import LeastSnapSpline
from ltlplan.paths.sampling.path_problem import PathProblem, word_filter
from ltlplan.systems.visit_log import VisitLog
from verify.data import BadInput, Infeasible, Mission, RobotPlan, Unsatisfiable, Visit, Word
from verify.data.arrays import Floats
from verify.data.language.sequence import Direction
from verify.data.shapes.inequalities import Point, point_of
from verify.data.shapes.region import Hoop

LONGEST = 600.0
"""s of simulated flight, at most."""
_SPACINGS = (0.35, 0.25, 0.15)
"""m between the points taken from a path that was flown, about; the first at which it is still that path."""
_SLACKS = (0.02, 0.0)
"""m that waypoints keep beyond the margin, where the path has them."""
_STILL = 1e-7
"""m; a robot that moves less in one step waits."""


def online_mtac_e(mission: Mission, context: Context) -> Allocation:
    """Share a mission by online MTAC-E in simulated time, and return who did what with the paths that were flown.

    Args:
        mission: What is asked; `planner` gives costs and the numbers of online cross-entropy.
        context: Source of draws, progress.

    Raises:
        BadInput: The trace is infinite.
        Unsatisfiable: No words that these robots can fly satisfy the formula in every order; the message says why.
        Infeasible: No way between the hoops was found, or robots had no way past each other.
    """
    if mission.spec.trace == "infinite":
        raise BadInput("MTAC-E shares tasks that end; laps for ever are planned by `method: exact`.")
    say = context.progress
    say("sharing the tasks", 0.05)
    try:
        team = OnlineTeam(mission, rng=context.rng, every_order=True)
    except Unsatisfiable:
        from ltlplan.search.exact import assign

        if assign(mission).precedences:  # or it says which parts cannot hold together
            raise Unsatisfiable(NEEDS_WAITS) from None
        raise
    flown = {name: _Flown(mission.agents[name].start) for name in mission.agents}
    switched: list[str] = []
    for step in range(round(LONGEST / PERIOD)):
        now = step * PERIOD
        if step % 50 == 0:
            say(f"flying online in simulated time, {now:.0f} s", min(0.9, 0.05 + now / 60.0))
        desired = team.step(now, {name: track.points[-1] for name, track in flown.items()})
        switched += desired.switched
        if desired.holding is not None:
            raise Infeasible(f"Online MTAC-E came to no end: {desired.holding}")
        for j, (name, pilot) in enumerate(team.pilots.items()):
            flown[name].see(pilot, mission)
            flown[name].points.append(point_of(desired.flat[0, :3, j]))
        if desired.finished:
            said = [f"Online MTAC-E flew {now:.1f} s of simulated time until the formula was satisfied.", *switched]
            return _allocation(mission, context, flown, team, said)
    raise Infeasible(f"Online MTAC-E did not satisfy the formula within {LONGEST:.0f} s of simulated flight.")


@dataclass
class _Flown:
    """Flight of one robot: its position at each step, and its visits."""

    start: Point
    points: list[Point] = field(default_factory=list)
    log: VisitLog = field(default_factory=VisitLog)
    entered: list[int] = field(default_factory=list)
    internal: str | None = None
    arrivals: int = 0

    def __post_init__(self) -> None:
        self.points.append(self.start)

    def see(self, pilot: Pilot, mission: Mission) -> None:
        """Take note of where the robot is seen, and of what it has done there."""
        where, begins = pilot.where, self.internal is None
        self.entered += [len(self.points) - 1] * len(self.log.enter(where.inside))
        if begins and where.inside:
            self.log.stop(where.vertex)
        for region in pilot.arrivals[self.arrivals :]:
            self.log.stop(region)
        self.arrivals = len(pilot.arrivals)
        if not begins and where.internal != self.internal and where.inside:
            change = (self.internal, where.internal)
            self.log.act(
                next(a for a in mission.robot_of(pilot.name).actions if (a.source, a.target) == change and a.at in where.inside)
            )
        self.internal = where.internal

    @property
    def moving(self) -> Floats:
        """Positions while it moved. Shape (n, 3)."""
        points = np.array(self.points)
        moves = np.linalg.norm(np.diff(points, axis=0), axis=1) > _STILL
        return points[np.concatenate([[True], moves])]

    def sided(self, mission: Mission) -> tuple[Visit, ...]:
        """Return the visits with the sides from which hoops were flown through; None where one was not."""
        points = np.array(self.points)
        hoops = (
            (visit, mission.hoops.get(visit.region), first) for visit, first in zip(self.log.visits, self.entered, strict=True)
        )
        sides = ((visit, None if hoop is None else _direction(hoop, points[first:])) for visit, hoop, first in hoops)
        return tuple(visit.model_copy(update={"direction": side}) for visit, side in sides)


def _direction(hoop: Hoop, points: Floats) -> Direction | None:
    """Return how a path that begins in a hoop's region goes on through the opening; None where it turns back or stays."""
    offset = points - np.array(hoop.center)
    outside = np.flatnonzero(np.einsum("ni,ij,nj->n", offset, hoop.shape, offset) > 1.0)
    along = offset @ np.array(hoop.normal)
    if not len(outside) or along[0] * along[outside[0]] >= 0.0:
        return None
    return "F" if along[0] < 0.0 else "R"


def _allocation(mission: Mission, context: Context, flown: dict[str, _Flown], team: OnlineTeam, notes: list[str]) -> Allocation:
    words = {name: Word(tuple(team.word(name))) for name in mission.agents}
    plans: dict[str, RobotPlan] = {}
    robots: dict[str, Itinerary] = {}
    for name, track in flown.items():
        # where no regions overlap, it was in the middle of each
        stops = track.log.stops if team.world.overlaps else tuple(range(len(track.log.visits)))
        plan, note = _robot_plan(mission, name, track, Itinerary(track.sided(mission), words[name], stops=stops))
        plans[name], robots[name] = plan, Itinerary(plan.visits, plan.word, plan.cycle_visit, plan.cost, stops)
        notes += note
    known = best_known(mission, beside=context.known.budget)
    cost = team_cost(mission, [plan.cost for plan in plans.values()])
    return Allocation(robots=robots, cost=cost, paths=plans, lower_bound=known.bound, notes=(*notes, known.gap(robots)))


def _robot_plan(mission: Mission, name: str, track: _Flown, did: Itinerary) -> tuple[RobotPlan, list[str]]:
    """Return one robot's plan along the path that it flew, or with a note, along its visits where that path is not clear for all times."""
    cost = cost_of(mission, name)
    nominal = route_itinerary(mission, name, did)
    if nominal.still:
        return nominal, []
    for candidate in _along(mission, nominal, track.moving, cost):
        return candidate.model_copy(update={"cost": plan_cost(candidate, cost)}), []
    note = (
        f"{name}: the path that it flew online is not clear of everything for all times; it is led by control points instead."
    )
    return nominal, [note]


def _along(mission: Mission, nominal: RobotPlan, path: Floats, cost: WeightedCost) -> Iterator[RobotPlan]:
    """Yield plans with waypoints on a path, few waypoints first; none where the path does not keep the plan's visits and margins."""
    length = float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())
    at = np.arange(len(path)) * PERIOD
    place = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    for slack in _SLACKS:
        keeps = word_filter(mission, nominal, slack=slack)
        for spacing in _SPACINGS:
            count = max(4, int(np.ceil(length / spacing)))
            times = np.interp(np.linspace(0.0, length, count + 2), place, at)
            spline = LeastSnapSpline(times)
            points = np.stack([np.interp(times, at, path[:, axis]) for axis in range(3)], axis=1)
            sampling = Sampling(spline, max(64, int(np.ceil(length / 0.05))))
            problem = PathProblem(spline, points, np.arange(1, count + 1), cost, sampling, keeps, length, slack, np.zeros(0))
            yield from candidate_plans(mission, nominal, problem, points, length)
