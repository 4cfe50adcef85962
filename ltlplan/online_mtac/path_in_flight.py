"""The way that one robot flies in an online team, and the searches that go on improving it while it is flown.

It says when it comes to each region, where the robot will be, and what it costs; which letters the robot shows on it is its pilot's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from ltlplan.mtac.agent_moves import AgentState
from ltlplan.online_mtac import cross_entropy
from ltlplan.online_mtac.cross_entropy import OnlineSettings, OnlineState
from ltlplan.online_mtac.path_blending import GLIDE, Clock, gliding_path_of
from ltlplan.paths.costs import Sampling, WeightedCost, cost_of
from ltlplan.paths.cross_entropy.cross_entropy import SPREAD
from ltlplan.paths.cross_entropy.quantile import square_root
from ltlplan.paths.improvement import with_ramped_times
from ltlplan.paths.sampling.path_problem import PathProblem, path_problem
from verify.data import Mission, RobotPlan, Waypoint, Word
from verify.data.arrays import Floats

AHEAD = GLIDE + 0.2
"""s; points of the course that are nearer than this are left where they are."""

INSTANT = 0.06
"""m between the instants at which paths are sampled, about."""

MOST_REGIONS = 12
"""Regions on one course that sampled words can tell apart; a longer course is flown as it is."""

BETTER = 0.01
"""Share by which a path must be cheaper than the one that is flown, before the course changes."""


@dataclass(frozen=True, slots=True)
class RegionTimes:
    """Times of a course at a region, in nominal s.

    Attributes:
        enter: When the path may first be in the region, margin included.
        centre: When it is at the centre; planned actions happen from then on.
        leave: When it is out of the region, margin included; infinite where it stays.
    """

    enter: float
    centre: float
    leave: float


class CourseInFlight:
    """One robot's way. It changes as it is flown.

    Attributes:
        course: The path.
        clock: Where the robot is on it.
        passages: When it comes to each of its stops.
    """

    def __init__(self, mission: Mission, name: str, where: AgentState, settings: OnlineSettings) -> None:
        self.mission, self.settings = mission, settings
        self.cost: WeightedCost = cost_of(mission, name)
        self.course = gliding_path_of(_hover(where))
        self.clock = Clock()
        self.passages: list[RegionTimes] = []
        self._problem: PathProblem | None = None
        self._sampling: Sampling | None = None
        self._state: OnlineState | None = None
        self._free: NDArray[np.int64] = np.zeros(0, dtype=np.int64)
        self._base = self._smooth = self.course.new
        self._better: Floats | None = None
        self._better_cost = math.inf
        self._newly: tuple[frozenset[str], ...] = ()
        self._table: Floats = self.course.new[:1]
        self._price = 0.0

    @property
    def arrived(self) -> bool:
        """Return whether the robot has come to the end of its course."""
        return self.clock.time >= self.course.duration

    def take(self, plan: RobotPlan, newly: tuple[frozenset[str], ...], rng: Generator) -> None:
        """Begin a way that starts where the robot hovers.

        Args:
            plan: The way.
            newly: For each of its stops, the regions that are entered on the way there.
            rng: Source of the samples for the search that begins.
        """
        self._newly = newly
        self.clock = Clock()
        self._problem = self._state = None
        plan = with_ramped_times(plan, self.cost)
        self.course = gliding_path_of(plan)
        if len({w.position for w in plan.waypoints}) > 2 and len({v.region for v in plan.visits}) <= MOST_REGIONS:
            self._problem = path_problem(self.mission, plan, self.cost)
            self.course = gliding_path_of(plan, self._problem.spline, self._problem.nominal)
        metres = float(np.linalg.norm(np.diff(self.course.new, axis=0), axis=1).sum())
        self._sampling = (
            None if self.course.spline is None else Sampling(self.course.spline, max(48, math.ceil(metres / INSTANT)))
        )
        self._look()
        self._search_anew(rng)

    def future(self, horizon: NDArray[np.floating], *, go: bool) -> Floats:
        """Return where the robot will be, m. Shape (len(horizon), 3)."""
        if self._sampling is None:
            return np.broadcast_to(self._table[0], (len(horizon), 3))
        # going: at full rate from now; waiting: it runs on a little and stops
        times = self.clock.time + (horizon if go else np.minimum(horizon, self.clock.run_on))
        step = self._sampling.instants[1] - self._sampling.instants[0]
        return self._table[np.minimum(np.rint(times / step).astype(np.int64), len(self._table) - 1)]

    def search(self, now: float, rng: Generator, paths: int, obstacles: Floats, separation: float) -> None:
        """Sample paths for what is left of the course, learn from them, and glide to a cheaper one.

        Args:
            now: Flight time, s.
            rng: Source of the samples.
            paths: How many are sampled; the paper samples one. More cost little, because they are sampled together.
            obstacles: Robots that stand still, m. Shape (n, 3).
            separation: m to keep from them.
        """
        if self._problem is None or self._sampling is None or self._state is None:
            return
        if len(self._free) and self.course.times[self._free[0]] < self._first_free_time():
            self._search_anew(rng)
            if self._state is None:  # pyright: ignore[reportUnnecessaryComparison]  # the call above may have changed it
                return
        drawn = cross_entropy.ask_all(self._state, rng, paths)
        # the last two candidates are the row's mean and what is flown now
        trial = np.repeat(self._base[None], paths + 2, axis=0)
        trial[:paths, self._free] += np.einsum("ij,bjk->bik", self._smooth, drawn)
        trial[paths, self._free] += self._smooth @ self._state.mean
        trial[paths + 1] = self.course.new
        flown = self._sampling.paths(trial)
        costs = self.cost(flown)
        valid = self._problem.keeps.keeps(flown.axes(0))
        if len(obstacles):
            costs = np.where(self._too_near(flown.axes(0), obstacles, separation), np.inf, costs)
        told = valid & np.isfinite(costs)
        self._state = cross_entropy.tell_all(self._state, drawn, costs[:paths], told[:paths], settings=self.settings)
        best = int(np.argmin(np.where(told[: paths + 1], costs[: paths + 1], np.inf)))
        if told[best] and costs[best] < min(self._better_cost, float(costs[paths + 1])):
            self._better, self._better_cost = trial[best], float(costs[best])
        if self._better is None or self.course.gliding(now):
            return
        if self.clock.time == 0.0:
            # nothing of this course was flown, and its first point is where the robot is: no glide is needed
            self.course = gliding_path_of(self.course.plan, self.course.spline, self._better)
            self._better, self._better_cost = None, math.inf
            self._look()
            return
        if self._better_cost < float(costs[paths + 1]) * (1 - BETTER):
            halfway = self._sampling.paths((self._better + self.course.new) / 2)
            if self._problem.keeps.keeps(halfway.axes(0))[0]:  # it stands for the glide
                self.course = self.course.moved(self._better, now)
                self._look()
        self._better, self._better_cost = None, math.inf

    @property
    def best_cost(self) -> float:
        """Cost of the best path that is known: the one that is flown, or one that it will glide to."""
        return min(self._price, self._better_cost)

    def _first_free_time(self) -> float:
        return self.clock.time + (AHEAD if self.clock.time > 0 else 0.0)

    def _search_anew(self, rng: Generator) -> None:
        """Begin a row for the points that are still far enough ahead; those behind stay where they are.

        Points move in smooth directions: the row's coordinates are multiplied by a root of the covariance that the
        offline search begins with, given that the points behind do not move. What the row before has learned of the
        points that are left is kept: its mean path, and how far it has narrowed.
        """
        known: tuple[Floats, float] | None = None
        if self._state is not None:
            path = self._base.copy()
            path[self._free] += self._smooth @ self._state.mean
            known = path, float(np.sqrt(np.mean(np.sum(self._state.root**2, axis=-1))))
        self._state, self._better, self._better_cost = None, None, math.inf
        self._base = self.course.new
        if self._problem is None:
            return
        free = self._problem.free
        ahead = self.course.times[free] >= self._first_free_time()
        self._free = free[ahead]
        if not len(self._free):
            return
        covariance = self._problem.covariance(SPREAD)[::3, ::3]
        given = np.linalg.inv(covariance)[np.ix_(ahead, ahead)]
        self._smooth = square_root(np.asarray(np.linalg.inv((given + given.T) / 2), dtype=np.float64))
        mean, spread = np.zeros((len(self._free), 3)), 1.0
        if known is not None:
            mean, spread = np.linalg.solve(self._smooth, known[0][self._free] - self._base[self._free]), known[1]
        self._state = cross_entropy.start(np.asarray(mean, dtype=np.float64), spread**2, rng, settings=self.settings)

    def _too_near(self, positions: Floats, obstacles: Floats, separation: float) -> NDArray[np.bool_]:
        """Tell for each path whether what is ahead of the robot comes too near to robots that stand still."""
        assert self._sampling is not None
        ahead = positions[self._sampling.instants >= self.clock.time]
        offset = ahead[:, :, :, None] - obstacles.T[None, :, None, :]
        return np.sqrt(np.sum(offset * offset, axis=1)).min(axis=(0, 2)) < separation

    def _look(self) -> None:
        """Compute what follows from the course's points: positions, passages, cost."""
        if self._sampling is None:
            self._table, self.passages, self._price = self.course.new[:1], [], 0.0
            return
        paths = self._sampling.paths(self.course.new)
        self._table = paths.axes(0)[:, :, 0]
        self._price = float(self.cost(paths)[0])
        instants, stops = self._sampling.instants, self.course.stops
        centres = np.array([time for _, time in stops], dtype=np.float64)
        between = np.concatenate([[-math.inf], (centres[1:] + centres[:-1]) / 2, [math.inf]])
        self.passages = []
        for k, (visit, _) in enumerate(stops):
            name = self.course.plan.visits[visit].region
            level = self.mission.all_regions[name].level(self._table)
            own = (instants >= between[k]) & (instants <= between[k + 1])
            at = int(np.argmin(np.where(own, level, np.inf)))
            near = self._near(name, level)
            after = np.flatnonzero(~near[at:])
            others = self._newly[k] - {name} if k < len(self._newly) else ()
            for other in others:  # entered on the way there
                near = near | self._near(other, self.mission.all_regions[other].level(self._table))
            before = np.flatnonzero(~near[:at])
            self.passages.append(
                RegionTimes(
                    float(instants[before[-1]]) if len(before) else 0.0,
                    float(instants[at]),
                    float(instants[at + after[0]]) if len(after) else math.inf,
                )
            )

    def _near(self, name: str, level: Floats) -> NDArray[np.bool_]:
        """Tell at which levels the course may be in a region, margin included."""
        return level <= (1.0 + 1.5 * max(self.mission.margin, 0.02) / self.mission.all_regions[name].inner_radius) ** 2


def _hover(where: AgentState) -> RobotPlan:
    """Return the plan of a robot that stays where it is."""
    return RobotPlan(word=Word((where.inside,)), waypoints=(Waypoint(position=where.position, role="start"),), times=(0.0,))
