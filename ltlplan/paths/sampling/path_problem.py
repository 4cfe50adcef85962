"""One robot's nominal path as a search problem: points of the path as candidates, sampled paths, what counts, what it costs.

The candidates are the positions of n points, equidistant along the nominal path; start and end stay, and a lasso's closing
point moves with the point where its cycle begins. A candidate's path is the spline of least snap through them at
the nominal path's own times there, stretched so that its mean speed is the nominal one.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from ltlplan.paths.costs import Cost, SampledPaths, Sampling, WeightedCost, evaluate
from ltlplan.paths.sampling.least_snap_spline import LeastSnapSpline
from ltlplan.paths.sampling.word_filter import WordFilter, word_filter
from verify.data import Mission, RobotPlan
from verify.data.arrays import Floats, Integers

_INSTANT = 0.05  # m between sampled instants, about
_SLACK = 0.02  # m beyond the margin, where the nominal path has it
_SPACING = 0.35  # m between points, about
_POINTS = 20
_HEIGHTS = (0.5, 0.35, 0.25, 0.15, 0.1)  # m by which a leg is raised or lowered, the first at which its path counts
_BLOCK = 250  # paths sampled and costed at a time, so that the arrays stay in the cache
_MOST_POINTS = 120  # more than that, and a covariance is too large to be worth its time


@dataclass(frozen=True, eq=False)
class PathProblem:
    """The search for better points of one path.

    Attributes:
        spline: Times of all points; closes a lasso.
        nominal: The nominal path's points. Shape (points, 3).
        free: Index of each candidate's own points among all; the others stay. Shape (n,).
        cost: What is minimised.
        sampling: Instants and matrices, shared by all candidates.
        keeps: Which paths count.
        length: Of the nominal path, m.
        slack: m that paths keep beyond the mission's margin, for refinement to use.
        visits: s, when the nominal path is at the middle of each visit, in order. Shape (visits,).
    """

    spline: LeastSnapSpline
    nominal: Floats
    free: Integers
    cost: Cost
    sampling: Sampling
    keeps: WordFilter
    length: float
    slack: float
    visits: Floats

    @property
    def mean(self) -> Floats:
        """The nominal path as a candidate. Shape (3 n,)."""
        return self.nominal[self.free].ravel()

    def starts(self) -> tuple[Floats, ...]:
        """Return candidates at which several populations may begin: the nominal path, and it raised and lowered between visits.

        The planner passes a hoop on its left or right, at its own height (Fig. 2 of the 2019 paper). The cheapest way may
        be over or under it, which is another valley of the costs. Each leg is moved as far as its path still counts.
        """
        if not np.isfinite(self.costs(self.mean[None])[0]):
            return (self.mean,)
        return (self.mean, self._moved_up(1.0), self._moved_up(-1.0))

    def _moved_up(self, sign: float) -> Floats:
        edges = np.concatenate([self.spline.times[:1], self.visits, self.spline.times[-1:]])
        at, moved = self.spline.times[self.free], self.mean
        for begin, end in itertools.pairwise(edges):
            share = np.clip((at - begin) / max(end - begin, 1e-9), 0.0, 1.0)
            tries = np.repeat(moved[None], len(_HEIGHTS), axis=0).reshape(len(_HEIGHTS), -1, 3)
            tries[:, :, 2] += sign * np.array(_HEIGHTS)[:, None] * np.sin(np.pi * share) ** 2
            tries = tries.reshape(len(_HEIGHTS), -1)
            counts = np.flatnonzero(np.isfinite(self.costs(tries)))
            moved = tries[counts[0]] if len(counts) else moved
        return moved

    def covariance(self, spread: float) -> Floats:
        """Return a smooth initial covariance: the inverse of what the integral of |r'|^2 makes of a displacement.

        All directions then lengthen the path alike, and samples of it are paths that a robot can fly.

        Args:
            spread: Root mean square of the coordinates' standard deviations, m.

        Returns:
            Shape (3 n, 3 n).
        """
        velocity = self.sampling.matrix(1)
        if self.spline.cycle is not None:
            velocity = velocity.copy()
            velocity[:, self.spline.cycle] += velocity[:, -1]
        form = velocity[:, self.free].T @ velocity[:, self.free]
        form += 1e-9 * np.trace(form) * np.eye(len(form))
        kernel = np.linalg.inv(form)
        return np.asarray(spread**2 / np.mean(np.diag(kernel)) * np.kron(kernel, np.eye(3)), dtype=np.float64)

    def points(self, candidates: Floats) -> Floats:
        """Return all points of each candidate's path. Shape (samples, 3 n) to (samples, points, 3)."""
        result = np.repeat(self.nominal[None], len(candidates), axis=0)
        result[:, self.free] = candidates.reshape(len(candidates), -1, 3)
        if self.spline.cycle is not None:
            result[:, -1] = result[:, self.spline.cycle]
        return result

    def paths(self, candidates: Floats) -> SampledPaths:
        """Return the sampled paths of candidates, each at the nominal mean speed."""
        paths = self.sampling.paths(self.points(candidates))
        if isinstance(self.cost, WeightedCost) and not self.cost.time_matters:
            return paths
        return paths.rescaled(paths.length / self.length)

    def costs(self, candidates: Floats) -> Floats:
        """Return the cost of each candidate, infinite where its path does not count. Shape (samples,)."""
        block = _BLOCK if isinstance(self.cost, WeightedCost) else len(candidates)  # a user's function sees them all
        blocks = [candidates[first : first + block] for first in range(0, len(candidates), block)]
        return np.concatenate([self._costs(part) for part in blocks])

    def _costs(self, candidates: Floats) -> Floats:
        paths = self.paths(candidates)
        counts = self.keeps.keeps(paths.axes(0))
        values = evaluate(self.cost, paths)
        return np.where(counts, values, np.inf)


def path_problem(
    mission: Mission, plan: RobotPlan, cost: Cost, *, points: int | None = None, instants: int | None = None
) -> PathProblem:
    """Build the search for one robot's plan.

    Args:
        mission: What must be kept.
        plan: The nominal path; at least three waypoints.
        cost: Named terms or any function of sampled paths.
        points: n, start and end not counted; by default about one every 0.35 m, 4 to 20, more where the spline through so
            few does not keep the word, and the nominal path's own waypoints (up to 120) where more do not help.
        instants: At which each path is sampled; by default about one every 0.05 m, at least 64.
    """
    waypoints = np.array([w.position for w in plan.waypoints])
    nominal = LeastSnapSpline(plan.times, plan.cycle_waypoint)
    length = _length(nominal, waypoints)
    count = points if points is not None else int(np.clip(np.ceil(length / _SPACING), 4, _POINTS))
    choices = [_equidistant(nominal, waypoints, count)]
    if points is None:
        choices.append(_equidistant(nominal, waypoints, count * 7 // 5))
        choices += [(nominal.times, nominal.cycle)] if len(waypoints) <= _MOST_POINTS else []
    visits = np.array([t for w, t in zip(plan.waypoints, plan.times, strict=True) if w.role == "centre"])
    problems = []
    for slack in (_SLACK, 0.0):
        keeps = word_filter(mission, plan, slack=slack)
        for times, cycle in choices:
            knots = nominal.evaluate(waypoints, times)
            sampling = Sampling(LeastSnapSpline(times, cycle), instants or max(64, int(np.ceil(length / _INSTANT))))
            free = np.arange(1, len(times) - 1)
            problems.append(PathProblem(sampling.spline, knots, free, cost, sampling, keeps, length, slack, visits))
            if keeps.keeps(sampling.paths(knots).axes(0))[0]:
                return problems[-1]
    return problems[-1]


def _length(spline: LeastSnapSpline, waypoints: Floats) -> float:
    at = np.linspace(spline.times[0], spline.times[-1], 2000)
    return float(np.linalg.norm(np.diff(spline.evaluate(waypoints, at), axis=0), axis=1).sum())


def _equidistant(spline: LeastSnapSpline, waypoints: Floats, count: int) -> tuple[Floats, int | None]:
    """Times of start, `count` equidistant points and end; a lasso's cycle begins at one of them."""
    at = np.linspace(spline.times[0], spline.times[-1], 4000)
    steps = np.linalg.norm(np.diff(spline.evaluate(waypoints, at), axis=0), axis=1)
    place = np.concatenate([[0.0], np.cumsum(steps + 1e-12)])
    if spline.cycle is None:
        return np.interp(np.linspace(0.0, place[-1], count + 2), place, at), None
    begin = float(np.interp(spline.times[spline.cycle], at, place))
    before = int(np.clip(round(count * begin / place[-1]), 1 if begin > 0 else 0, max(1, count - 3)))
    first = np.linspace(0.0, begin, before + 1)
    second = np.linspace(begin, place[-1], count - before + 2)[1:]
    times = np.interp(np.concatenate([first, second]), place, at)
    times[before] = spline.times[spline.cycle]
    return times, before
