"""One robot of an online team: what it still has to show, its course, and the searches that improve the course.

A pilot knows which letters are ahead of it, which of them cannot be interrupted once begun (a passage: entering a region,
acting there, leaving it), and when its course comes to the next region. Whether it may go there is the team's decision.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from ltlplan.mtac.agent_moves import Move, World
from ltlplan.mtac.agent_states import AgentState
from ltlplan.mtac.robot_tasks import RobotTask
from ltlplan.paths.costs import Sampling, WeightedCost, cost_of
from ltlplan.paths.improvement import with_ramped_times
from ltlplan.paths.path_problem import PathProblem, path_problem
from ltlplan.paths.quantile import square_root
from ltlplan.sharing import cross_entropy
from ltlplan.sharing.cross_entropy import OnlineSettings, OnlineState
from ltlplan.sharing.gliding_path import GLIDE, Clock, gliding_path_of
from verify.data import Letter, Mission, RobotPlan
from verify.data.sections import Action

Floats = NDArray[np.float64]

AHEAD = GLIDE + 0.2
"""s; points of the course that are nearer than this are left where they are."""

INSTANT = 0.06
"""m between the instants at which paths are sampled, about."""


MOST_REGIONS = 12
"""Regions on one course that sampled words can tell apart; a longer course is flown as it is."""

SPREAD = 0.06
"""m; first standard deviation of a point."""

BETTER = 0.01
"""Share by which a path must be cheaper than the one that is flown, before the course changes."""


@dataclass(frozen=True, slots=True)
class RegionTimes:
    """When a course comes to a region, in nominal s.

    Attributes:
        enter: When the path may first be in the region, margin included.
        centre: When it is at the centre; planned actions happen from then on.
        leave: When it is out of the region, margin included; infinite where it stays.
    """

    enter: float
    centre: float
    leave: float


class Pilot:
    """One robot in flight. It changes as it flies; `sharing.team.OnlineTeam` drives it.

    Attributes:
        name: The robot.
        where: Where it is in A = E x R, as it was last seen.
        moves: Visits that are not over, the present one first.
        shown: How many letters of the present visit it has shown.
        leaves: Whether it flies out of its last region.
        detour: Letters to show before the present visit's, after something unforeseen.
        course: Its path.
        clock: Where it is on its path.
        arrivals: The regions to which its visits have led so far, in order.
        entered: Whether it is committed to the present passage.
        stop_number: Index of the present visit among the course's stops.
        stop: Whether to wait even within a passage, because its ring has moved.
    """

    def __init__(self, mission: Mission, world: World, name: str, where: AgentState, settings: OnlineSettings) -> None:
        self.mission, self.world, self.name, self.where, self.settings = mission, world, name, where, settings
        self.moves: tuple[Move, ...] = ()
        self.shown = 0
        self.leaves = True
        self.detour: tuple[Letter, ...] = ()
        self.course = gliding_path_of(_hover(where))
        self.clock = Clock()
        self.arrivals: tuple[str, ...] = ()
        self.entered = False
        self.stop = False
        self.stop_number = 0
        self.cost: WeightedCost = cost_of(mission, name)
        self.problem: PathProblem | None = None
        self.sampling: Sampling | None = None
        self.state: OnlineState | None = None
        self.free: NDArray[np.int64] = np.zeros(0, dtype=np.int64)
        self.base = self.smooth = self.course.new
        self.better: Floats | None = None
        self.better_cost = math.inf
        self.passages: list[RegionTimes] = []
        self.newly: tuple[frozenset[str], ...] = ()
        self.table: Floats = self.course.new[:1]
        self.price = 0.0

    @property
    def ahead(self) -> tuple[Letter, ...]:
        """The letters that it is still to show."""
        return (*self.chain, *self.rest)

    @property
    def chain(self) -> tuple[Letter, ...]:
        """The letters of the present passage that are still to come, up to and with the one of free flight after it.

        A way that leads from one region straight into the next belongs to the same passage.
        """
        later = (letter for k in range(1, self._passage) for letter in self._letters(k))
        return (*self.detour, *self._letters(0)[self.shown :], *later)

    @property
    def rest(self) -> tuple[Letter, ...]:
        """The letters of the visits after the present passage."""
        return tuple(letter for k in range(self._passage, len(self.moves)) for letter in self._letters(k))

    @property
    def done(self) -> bool:
        """Whether it has nothing left to do but to fly its course to the end."""
        return not self.moves and not self.detour

    @property
    def arrived(self) -> bool:
        """Whether it has come to the end of its course."""
        return self.clock.time >= self.course.duration

    def _letters(self, k: int) -> tuple[Letter, ...]:
        if k >= len(self.moves):
            return ()
        move = self.moves[k]
        leaving = self.moves[k + 1].departs if k + 1 < len(self.moves) else move.left if self.leaves else None
        return move.letters if leaving is None else (*move.letters, leaving)

    @property
    def _passage(self) -> int:
        """How many visits the present passage makes."""
        return next((k for k in range(1, len(self.moves)) if self.moves[k].departs is not None), len(self.moves))

    def take(self, task: RobotTask, plan: RobotPlan, rng: Generator) -> None:
        """Begin a task along a plan that starts where the robot hovers.

        Args:
            task: The visits to make.
            plan: The way along them.
            rng: Source of the samples for the search that begins.
        """
        self.moves, self.leaves, self.shown, self.entered, self.stop = task.moves, task.leaves, 0, False, False
        starts_inside = bool(task.where.inside)
        in_place = bool(self.moves) and self.moves[0].in_place
        self.stop_number = 0 if in_place or not starts_inside else 1
        self.detour = tuple(move.departs for move in self.moves[:1] if move.departs is not None)
        self.newly = _newly(task)
        self.clock = Clock()
        self.problem = self.state = None
        plan = with_ramped_times(plan, self.cost)
        self.course = gliding_path_of(plan)
        if len({w.position for w in plan.waypoints}) > 2 and len({v.region for v in plan.visits}) <= MOST_REGIONS:
            self.problem = path_problem(self.mission, plan, self.cost)
            self.course = gliding_path_of(plan, self.problem.spline, self.problem.nominal)
        metres = float(np.linalg.norm(np.diff(self.course.new, axis=0), axis=1).sum())
        self.sampling = (
            None if self.course.spline is None else Sampling(self.course.spline, max(48, math.ceil(metres / INSTANT)))
        )
        self._look()
        self._search_anew(rng)

    def observe(self, letter: Letter, inside: frozenset[str]) -> bool:
        """Take note of a new letter; return whether it was the one that was to come next."""
        expected = self.chain[0] if self.chain else None
        self.where = self.where.seen_in(inside)
        if expected != letter:
            return False
        if self.detour:
            self.detour = self.detour[1:]
            return True
        self.shown += 1
        move = self.moves[0]
        if self.shown == len(move.letters) - len(move.visit.actions):
            self.arrivals = (*self.arrivals, move.visit.region)
        if self.shown == len(self._letters(0)):
            self.entered = self.entered and self._passage > 1
            self.moves, self.shown = self.moves[1:], 0
            self.stop_number += 1
        return True

    def surprised(self, inside: frozenset[str]) -> None:
        """Put what an unforeseen letter makes necessary before what was planned: to leave, or to come again."""
        free = self.world.free_letter(self.where.internal, self.where.kind)
        if self.moves and self.moves[0].visit.region in inside and self.shown:
            return  # it is where it should be; its letter differs by what it carries, which the plan already knows
        self.detour = (free,) if inside and (self.moves or self.leaves) else ()
        if not inside and self.shown:
            self.shown = 0  # it has left too early and comes again
        self.entered = bool(inside)

    def wants_to_act(self) -> Action | None:
        """Return the present visit's next action, once the robot is at the centre."""
        if self.detour or not self.moves:
            return None
        move = self.moves[0]
        entering = 0 if move.in_place else 1
        acted = self.shown - entering
        actions = move.visit.actions
        if not 0 <= acted < len(actions) or move.visit.region not in self.where.inside:
            return None
        if self.stop_number < len(self.passages) and self.clock.time < self.passages[self.stop_number].centre - 1e-9:
            return None
        return actions[acted]

    def comes_to_region(self, dt: float) -> bool:
        """Tell whether the robot must decide now whether to enter the next region: later it could not stop before it."""
        if self.entered or not self.moves or self.stop_number >= len(self.passages):
            return False
        if self.where.inside and self.moves[0].departs is None:  # from within a region straight into the next: when it sets out
            return not self.detour
        return self.clock.time + self.clock.run_on + 2 * dt >= self.passages[self.stop_number].enter

    def future(self, horizon: NDArray[np.floating], *, go: bool) -> Floats:
        """Return where the robot will be, m. Shape (len(horizon), 3)."""
        if self.sampling is None:
            return np.broadcast_to(self.table[0], (len(horizon), 3))
        # going: at full rate from now; waiting: it runs on a little and stops
        times = self.clock.time + (horizon if go else np.minimum(horizon, self.clock.run_on))
        step = self.sampling.instants[1] - self.sampling.instants[0]
        return self.table[np.minimum(np.rint(times / step).astype(np.int64), len(self.table) - 1)]

    def search(self, now: float, rng: Generator, paths: int, obstacles: Floats, separation: float) -> None:
        """Sample paths for what is left of the course, learn from them, and glide to a cheaper one.

        Args:
            now: Flight time, s.
            rng: Source of the samples.
            paths: How many are sampled; the paper samples one. More cost little, because they are sampled together.
            obstacles: Robots that stand still, m. Shape (n, 3).
            separation: m to keep from them.
        """
        if self.problem is None or self.sampling is None or self.state is None:
            return
        if len(self.free) and self.course.times[self.free[0]] < self._first_free_time():
            self._search_anew(rng)
            if self.state is None:  # pyright: ignore[reportUnnecessaryComparison]  # the call above may have changed it
                return
        drawn = cross_entropy.ask_all(self.state, rng, paths)
        # the last two candidates are the row's mean and what is flown now
        trial = np.repeat(self.base[None], paths + 2, axis=0)
        trial[:paths, self.free] += np.einsum("ij,bjk->bik", self.smooth, drawn)
        trial[paths, self.free] += self.smooth @ self.state.mean[0]
        trial[paths + 1] = self.course.new
        flown = self.sampling.paths(trial)
        costs = self.cost(flown)
        valid = self.problem.keeps.keeps(flown.axes(0))
        if len(obstacles):
            near = self._too_near(flown.axes(0), obstacles, separation)
            costs = np.where(near, np.inf, costs)
        told = valid & np.isfinite(costs)
        self.state = cross_entropy.tell_all(self.state, drawn, costs[:paths], told[:paths], settings=self.settings)
        best = int(np.argmin(np.where(told[: paths + 1], costs[: paths + 1], np.inf)))
        if told[best] and costs[best] < min(self.better_cost, float(costs[paths + 1])):
            self.better, self.better_cost = trial[best], float(costs[best])
        if self.better is None or self.course.gliding(now):
            return
        if self.clock.time == 0.0:
            # nothing of this course was flown, and its first point is where the robot is: no glide is needed
            self.course = gliding_path_of(self.course.plan, self.course.spline, self.better)
            self.better, self.better_cost = None, math.inf
            self._look()
            return
        if self.better_cost < float(costs[paths + 1]) * (1 - BETTER):
            halfway = self.sampling.paths((self.better + self.course.new) / 2)
            if self.problem.keeps.keeps(halfway.axes(0))[0]:  # it stands for the glide
                self.course = self.course.moved(self.better, now)
                self._look()
        self.better, self.better_cost = None, math.inf

    @property
    def best_cost(self) -> float:
        """Cost of the best path that is known: the one that is flown, or one that it will glide to."""
        return min(self.price, self.better_cost)

    def _first_free_time(self) -> float:
        return self.clock.time + (AHEAD if self.clock.time > 0 else 0.0)

    def _search_anew(self, rng: Generator) -> None:
        """Begin a row for the points that are still far enough ahead; those behind stay where they are.

        Points move in smooth directions: the row's coordinates are multiplied by a root of the covariance that the
        offline search begins with, given that the points behind do not move. What the row before has learned of the
        points that are left is kept: its mean path, and how far it has narrowed.
        """
        known: tuple[Floats, float] | None = None
        if self.state is not None:
            path = self.base.copy()
            path[self.free] += self.smooth @ self.state.mean[0]
            known = path, float(np.sqrt(np.mean(np.sum(self.state.root[0] ** 2, axis=-1))))
        self.state, self.better, self.better_cost = None, None, math.inf
        self.base = self.course.new
        if self.problem is None:
            return
        free = self.problem.free
        ahead = self.course.times[free] >= self._first_free_time()
        self.free = free[ahead]
        if not len(self.free):
            return
        covariance = self.problem.covariance(SPREAD)[::3, ::3]
        given = np.linalg.inv(covariance)[np.ix_(ahead, ahead)]
        self.smooth = square_root(np.asarray(np.linalg.inv((given + given.T) / 2), dtype=np.float64))
        mean, spread = np.zeros((len(self.free), 3)), 1.0
        if known is not None:
            mean, spread = np.linalg.solve(self.smooth, known[0][self.free] - self.base[self.free]), known[1]
        self.state = cross_entropy.start(np.asarray(mean[None], dtype=np.float64), spread**2, rng, settings=self.settings)

    def _too_near(self, positions: Floats, obstacles: Floats, separation: float) -> NDArray[np.bool_]:
        """Tell for each path whether what is ahead of the robot comes too near to robots that stand still."""
        assert self.sampling is not None
        ahead = positions[self.sampling.instants >= self.clock.time]
        offset = ahead[:, :, :, None] - obstacles.T[None, :, None, :]
        return np.sqrt(np.sum(offset * offset, axis=1)).min(axis=(0, 2)) < separation

    def _look(self) -> None:
        """Compute what follows from the course's points: positions, passages, cost."""
        if self.sampling is None:
            self.table, self.passages, self.price = self.course.new[:1], [], 0.0
            return
        paths = self.sampling.paths(self.course.new)
        self.table = paths.axes(0)[:, :, 0]
        self.price = float(self.cost(paths)[0])
        instants, stops = self.sampling.instants, self.course.stops
        centres = np.array([time for _, time in stops], dtype=np.float64)
        between = np.concatenate([[-math.inf], (centres[1:] + centres[:-1]) / 2, [math.inf]])
        self.passages = []
        for k, (visit, _) in enumerate(stops):
            name = self.course.plan.visits[visit].region
            level = self.mission.all_regions[name].level(self.table)
            own = (instants >= between[k]) & (instants <= between[k + 1])
            at = int(np.argmin(np.where(own, level, np.inf)))
            near = self._near(name, level)
            after = np.flatnonzero(~near[at:])
            others = self.newly[k] - {name} if k < len(self.newly) else ()
            for other in others:  # entered on the way there
                near = near | self._near(other, self.mission.all_regions[other].level(self.table))
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


def _newly(task: RobotTask) -> tuple[frozenset[str], ...]:
    """Return, for each stop of a task, the regions that are entered on the way there."""
    inside, found = task.where.inside, [task.where.inside] if task.where.inside else []
    for move in task.moves:
        if not move.in_place:
            new = frozenset[str]()
            for regions in move.regions:
                new, inside = new | (regions - inside), regions
            found.append(new)
    return tuple(found)


def _hover(where: AgentState) -> RobotPlan:
    """Return the plan of a robot that stays where it is."""
    from verify.data import Waypoint, Word

    return RobotPlan(word=Word((where.inside,)), waypoints=(Waypoint(position=where.position, role="start"),), times=(0.0,))
