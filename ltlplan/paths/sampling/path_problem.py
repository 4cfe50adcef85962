"""One robot's nominal path as a search problem: points of the path as candidates, sampled paths, what counts, what it costs.

The candidates are the positions of n points, equidistant along the nominal path; start and end stay, and a lasso's closing
point moves with the point where its cycle begins. Their axes point back from where the path first leads, so that of a mission and of
its mirror image the same candidates are drawn. A candidate's path is the spline of least snap through them at
the nominal path's own times there, stretched so that its mean speed is the nominal one.

A `WordFilter` says which of many sampled paths keep the planned word: a filter for the search, never a claim. A path counts when the word that its samples show is the planned one, with every region shrunk by the margin and with
every region grown by it; when each hoop is flown through in the planned direction, inside its opening; and when it
meets no ring, no other opening, no obstacle and no wall. Between samples nothing is known: whatever is kept is judged for all times.

Samples are sifted first: one matrix product gives all squared distances to the regions' centres, and only the few samples
within a region's bounding sphere are looked at closely.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ltlplan.paths.costs import Cost, SampledPaths, Sampling, WeightedCost, evaluate
from ltlplan.paths.hoops.keep_out import KeptRegion, Room, room
from ltlplan.paths.sampling.least_snap_spline import LeastSnapSpline
from verify.data import Mission, RobotPlan
from verify.data.arrays import Booleans, Floats, Integers

_INSTANT = 0.05  # m between sampled instants, about
_SLACK = 0.02  # m beyond the margin, where the nominal path has it
_SPACING = 0.35  # m between points, about
_POINTS = 20
_HEIGHTS = (0.5, 0.35, 0.25, 0.15, 0.1)  # m by which a leg is raised or lowered, the first at which its path counts
_BLOCK = 250  # paths sampled and costed at a time, so that the arrays stay in the cache
_ASIDE = 0.01  # m from its start along an axis, from where on a path has a side
_MOST_POINTS = 120  # more than that, and a covariance is too large to be worth its time
_CHUNK = 32768  # samples looked at together, so that the arrays stay in the cache


@dataclass(frozen=True, eq=False)
class WordFilter:
    """Tells which sampled paths keep a planned word, its passages, and clear of rings and walls.

    Attributes:
        weights: Of the regions that the word visits, each one digit of a sample's code: 0 outside, 1 inside before the
            hoop's plane (or anywhere in a region that is not flown through), 2 inside beyond it.
        word: The codes that a path must show, in order. Shape (letters,).
        through: Hoops that are flown through.
        shrunk: Of each region the level inside which a path is in it for sure.
        where: What is kept clear of, and the regions' levels outside which a path is clear of them.
    """

    weights: Mapping[str, int]
    word: Integers
    through: Collection[str]
    shrunk: Mapping[str, float]
    where: Room

    def keeps(self, positions: Floats) -> Booleans:
        """Tell for each path whether its samples keep everything. Shape (instants, 3, paths) to (paths,)."""
        low, high = positions.min(axis=0), positions.max(axis=0)
        walls = (low >= self.where.low[:, None]) & (high <= self.where.high[:, None])
        wrong = self._met(positions)
        shrunk, grown = np.zeros(wrong.shape, dtype=np.int64), np.zeros(wrong.shape, dtype=np.int64)
        in_shrunk, in_grown, bad = shrunk.reshape(-1), grown.reshape(-1), wrong.reshape(-1)
        near = self.where.near(low.min(axis=1)[None], high.max(axis=1)[None])[0]
        regions = list(itertools.compress(self.where.regions.values(), near))
        for region, at, offset in samples_near(positions, regions):
            level, weight = region.levels(offset.T), self.weights.get(region.name, 0)
            along = None if region.normal is None else region.normal @ offset
            if weight:
                digit = weight * (1 + (along > 0)) if region.name in self.through and along is not None else weight
                in_shrunk[at] += np.where(level <= self.shrunk[region.name], digit, 0)
                in_grown[at] += np.where(level <= region.level, digit, 0)
            else:
                bad[at] |= level <= region.level
            if along is not None:
                across = np.einsum("an,an->n", offset, offset) - along**2
                ring = (across <= region.outer**2) & (np.abs(along) <= region.height)
                bad[at] |= ring & (across >= region.inner**2) if weight else ring
        return np.all(walls, axis=0) & ~np.any(wrong, axis=0) & self._shows_word(shrunk) & self._shows_word(grown)

    def _met(self, positions: Floats) -> Booleans:
        """Tell which samples are too near to an obstacle. Shape (instants, 3, paths) to (instants, paths)."""
        met = np.zeros((len(positions), positions.shape[2]), dtype=np.bool_)
        solids = self.where.solids
        for part, near in zip(solids.parts, solids.near(positions.min(axis=2), positions.max(axis=2)), strict=True):
            if near.any():
                points = positions[near].transpose(0, 2, 1)
                met[near] |= part.met(points.reshape(-1, 3)).reshape(points.shape[:2])
        return met

    def _shows_word(self, codes: Integers) -> Booleans:
        """Tell for each path whether its codes are the word's, each held as long as it may be. Shape (instants, paths) to (paths,)."""
        letter = np.cumsum(np.diff(codes, axis=0, prepend=self.word[0]) != 0, axis=0)
        last = len(self.word) - 1
        return (letter[-1] == last) & np.all(codes == self.word[np.minimum(letter, last)], axis=0)


def samples_near(positions: Floats, regions: Collection[KeptRegion]) -> Iterator[tuple[KeptRegion, Integers, Floats]]:
    """Yield a region, samples that may have to do with it, as indices into all of them, and their offsets from its centre (3, near).

    Args:
        positions: m. Shape (instants, 3, paths).
        regions: Each with its centre, and how far from there a sample may be.
    """
    centres = np.array([region.centre for region in regions]).reshape(-1, 3)
    reach = np.array([region.reach for region in regions])
    bound = (reach**2 - np.einsum("ra,ra->r", centres, centres))[:, None]
    count = positions.shape[2]
    step = max(1, _CHUNK // max(1, count))
    for first in range(0, len(positions), step):
        flat = positions[first : first + step].transpose(1, 0, 2).reshape(3, -1)
        close = (-2.0 * centres) @ flat + np.einsum("an,an->n", flat, flat) <= bound
        for region, near in zip(regions, close, strict=True):
            if len(index := np.flatnonzero(near)):
                yield region, first * count + index, flat[:, index] - region.centre[:, None]


def word_filter(mission: Mission, plan: RobotPlan, *, slack: float = 0.0) -> WordFilter:
    """Return the filter for one robot's planned word and passages.

    Args:
        mission: Regions, margin, workspace, vehicle.
        plan: Word and visits with their sides.
        slack: m kept beyond the mission's margin.
    """
    near, regions = mission.margin + slack, mission.all_regions
    visited = dict.fromkeys(name for letter in plan.word.letters for name in sorted(letter) if name in regions)
    weights = {name: pow(3, i, 1 << 56) for i, name in enumerate(visited)}  # of very many regions, sums hardly coincide
    through = frozenset(visit.region for visit in plan.visits if visit.direction is not None)
    shrunk = {name: max(1.0 - near / region.inner_radius, 0.05) ** 2 for name, region in regions.items()}
    return WordFilter(weights, _codes(plan, weights, through), through, shrunk, room(mission, slack))


def _codes(plan: RobotPlan, weights: Mapping[str, int], through: Collection[str]) -> Integers:
    """The word as codes: a passage F shows its hoop's near half, then its far half; R the other way."""
    directions = {name: iter([visit.direction for visit in plan.visits if visit.region == name]) for name in weights}
    codes: list[int] = []
    held: frozenset[str] = frozenset()
    for letter in plan.word.letters:
        here = letter & weights.keys()
        if here == held and codes:
            continue
        digits: dict[str, tuple[int, int]] = dict.fromkeys(here, (1, 1))
        for name in here - held:
            direction = next(directions[name], None)
            if name in through:
                digits[name] = (2, 1) if direction == "R" else (1, 2)
        codes += [sum(weights[name] * halves[half] for name, halves in digits.items()) for half in (0, 1)]
        held = here
    return np.array([code for code, _ in itertools.groupby(codes)])


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

    @cached_property
    def facing(self) -> Floats:
        """Of each axis of candidates, whether it points along the mission's or against it: back from where the path first leads; up in z. Shape (3,)."""
        aside = self.nominal - self.nominal[0]
        first = np.argmax(np.abs(aside) > _ASIDE, axis=0)
        return np.where((aside[first, np.arange(3)] > _ASIDE) & (np.arange(3) < 2), -1.0, 1.0)

    @property
    def mean(self) -> Floats:
        """The nominal path as a candidate. Shape (3 n,)."""
        return (self.nominal[self.free] * self.facing).ravel()

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
        result[:, self.free] = candidates.reshape(len(candidates), -1, 3) * self.facing
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
        return np.where(self.keeps.keeps(paths.axes(0)), evaluate(self.cost, paths), np.inf)


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
    dense = nominal.evaluate(waypoints, np.linspace(nominal.times[0], nominal.times[-1], 2000))
    length = float(np.linalg.norm(np.diff(dense, axis=0), axis=1).sum())
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
