"""A dense search for an easy answer to a plan, and a judge of sampled flights; neither shares code with the project.

An easy answer stops at every corner: straight legs between sampled points of the visited regions, joined over a roadmap of
random points where a straight leg would meet something, flown at a few uniform paces with departures from a grid. Whoever
refuses a plan for which this finds a flight gave up too early.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from tests.helpers.motion.dense_sampler import Flight, quantities
from verify.data import Mission, Plan, RobotPlan
from verify.data.shapes.region import Hoop, Region

RATE = 40.0
"""Samples per second of flights that are checked."""
PACES = (1.0, 2.0, 4.0)
DELAYS = np.arange(0.0, 30.0, 1.0)
SLACK = 0.01
"""m that robots keep on top of separation and margins: what keeps them to the millimetre is no easy answer."""
ROADMAP = 60
TRIES = 6
STEP = 0.02
"""m between the samples of a leg that is tried."""


@dataclass
class Walk:
    """Corners of one robot's flight and, for each, the index of the stop that it is; -1 for corners of a detour."""

    corners: np.ndarray
    stops: list[int]


def easy_answer(plan: Plan, rng: np.random.Generator) -> dict[str, tuple[np.ndarray, float, float]] | None:
    """Return corners, departure (s) and pace (times slower) for each robot; None where the search finds nothing."""
    mission = plan.mission
    options: dict[str, list[tuple[np.ndarray, np.ndarray, float]]] = {}
    for name, robot in plan.robots.items():
        options[name] = []
        for attempt in range(TRIES):
            walk = _walk(mission, robot, rng, exact=attempt == 0)
            if walk is None:
                continue
            for pace in PACES:
                path = sampled(walk.corners, 1.5 * pace / mission.effective_limits.speed)
                if not faults(mission, robot, path):
                    options[name].append((walk.corners, path[0], pace))
                    break
            if len(options[name]) >= (1 if len(plan.robots) == 1 else 3):
                break
        if not options[name]:
            return None
    distance = mission.separation + 2 * mission.margin + SLACK
    for chosen in itertools.product(*options.values()):
        delays = _delays([path for _, path, _ in chosen], distance)
        if delays is not None:
            return {
                name: (corners, delay, pace) for name, (corners, _, pace), delay in zip(options, chosen, delays, strict=True)
            }
    return None


def sampled(corners: np.ndarray, slowness: float) -> np.ndarray:
    """Return position and four derivatives of a flight that rests at each corner. Shape (5, samples, 3).

    Each leg is 35 s^4 - 84 s^5 + 70 s^6 - 20 s^7 along a straight line, whose speed is at most 2.19 times its mean.
    """
    step = np.array([0, 0, 0, 0, 35.0, -84.0, 70.0, -20.0])
    parts = [np.concatenate([corners[:1][None], np.zeros((4, 1, 3))])]
    for a, b in itertools.pairwise(corners):
        time = max(1.6 * slowness * float(np.linalg.norm(b - a)), 1.5)
        local = np.arange(1, int(time * RATE) + 1) / int(time * RATE)
        rows = [
            np.polynomial.polynomial.polyval(local, np.polynomial.polynomial.polyder(step, d))[:, None] * (b - a) / time**d
            for d in range(5)
        ]
        rows[0] = rows[0] + a
        parts.append(np.stack(rows))
    return np.concatenate(parts, axis=1)


def faults(mission: Mission, robot: RobotPlan, path: np.ndarray) -> list[str]:
    """Return what is wrong with one robot's sampled flight (for a lasso: prefix and one lap), in words."""
    found, points, margin = [], path[0], mission.margin
    if np.any(points < np.array(mission.workspace.min) + margin) or np.any(points > np.array(mission.workspace.max) - margin):
        found.append("leaves the workspace")
    flight = Flight(np.arange(points.shape[0]) / RATE, np.concatenate([path, np.zeros((*path.shape[:2], 1))], axis=2))
    used, limits = quantities(mission.resolved(), flight), mission.effective_limits
    for name, limit in (("speed", limits.speed), ("acceleration", limits.acceleration), ("thrust", limits.thrust_max)):
        if used[name].max() > limit:
            found.append(f"breaks {name}")
    if used["tilt"].max() > limits.tilt or used["body_rate"].max() > limits.body_rate:
        found.append("leans or turns too much")
    if used["thrust"].min() < limits.thrust_min:
        found.append("falls too fast")
    stays = _stays(mission, points)
    if [name for name, _, _ in stays] != [visit.region for visit in robot.visits]:
        return [*found, f"visits {[name for name, _, _ in stays]}"]
    passed: dict[str, list[tuple[int, int]]] = {}
    for visit, (name, begin, end) in zip(robot.visits, stays, strict=True):
        region = mission.all_regions[name]
        if _level(region, points[begin:end]).min() > 1 - margin / min(region.radii):
            found.append(f"is not inside '{name}'")
        hoop = mission.hoops.get(name)
        if hoop is not None and visit.direction is not None:
            passed.setdefault(name, []).append((begin, end))
            found += _passage_faults(mission, hoop, visit.direction, points[begin:end])
        own = mission.limits.legs.get(name)
        if own is not None and used["speed"].max() > (own.speed or np.inf):
            found.append(f"flies to '{name}' too fast")
    for name, hoop in mission.hoops.items():
        within, rim = _about(hoop, points)
        if rim.min() < margin + mission.vehicle.radius:
            found.append(f"meets the rim of '{name}'")
        for begin, end in passed.get(name, []):
            within[begin:end] = np.inf
        if within.min() < margin:
            found.append(f"enters the opening of '{name}'")
    return found


def _stays(mission: Mission, points: np.ndarray) -> list[tuple[str, int, int]]:
    """Return (region, first sample, one past the last) of each time within the margin of a region, in order."""
    found = []
    for name, region in mission.all_regions.items():
        near = np.concatenate([[False], _level(region, points) <= 1 + mission.margin / min(region.radii), [False]])
        edges = np.flatnonzero(near[1:] != near[:-1])
        found += [(name, int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    return sorted(found, key=lambda stay: stay[1])


def _passage_faults(mission: Mission, hoop: Hoop, way: str, points: np.ndarray) -> list[str]:
    offset = points - np.array(hoop.center)
    along = offset @ np.array(hoop.normal) * (1.0 if way == "F" else -1.0)
    across = np.linalg.norm(offset - np.outer(offset @ np.array(hoop.normal), hoop.normal), axis=1)
    near = np.abs(along) <= mission.margin
    if along[0] > -mission.margin or along[-1] < mission.margin:
        return ["does not pass"]
    return ["passes too near the rim"] if across[near].max() > hoop.opening - mission.margin - mission.vehicle.radius else []


def _level(region: Region, points: np.ndarray) -> np.ndarray:
    offset = points - np.array(region.center)
    return np.sqrt(np.einsum("...i,ij,...j->...", offset, np.array(region.matrix), offset))


def _about(hoop: Hoop, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return distances of points to the opening's disc and to the rim."""
    offset, normal = points - np.array(hoop.center), np.array(hoop.normal)
    along = offset @ normal
    across = np.linalg.norm(offset - along[..., None] * normal, axis=-1)
    disc = np.hypot(np.maximum(across - hoop.opening, 0.0), along)
    outside = np.maximum(np.maximum(hoop.opening - across, across - hoop.opening - hoop.rim), 0.0)
    return disc, np.hypot(outside, np.maximum(np.abs(along) - hoop.rim / 2, 0.0))


def _walk(mission: Mission, robot: RobotPlan, rng: np.random.Generator, *, exact: bool) -> Walk | None:
    """Return corners through all stops; each visit's point as planned, or drawn from its region less the margin."""
    corners, stops = [np.array(robot.waypoints[0].position)], [0]
    for index, waypoint in enumerate(robot.waypoints[1:], start=1):
        if waypoint.visit is None and waypoint.role in ("avoid", "via"):
            continue
        target = np.array(waypoint.position)
        if not exact and waypoint.region in mission.regions:
            target = _drawn(mission, robot, mission.regions[waypoint.region], rng)
            if target is None:
                return None
        before, after = robot.waypoints[stops[-1]], waypoint
        passing = before.visit is not None and before.visit == after.visit and waypoint.region in mission.hoops
        allowed = {w.region for w in (before, after) if w.visit is not None}
        way = _way(mission, corners[-1], target, allowed, waypoint.region if passing else None, rng)
        if way is None:
            return None
        corners += way
        stops += [-1] * (len(way) - 1)
        stops = [*(stop for stop in stops if stop >= 0), index]
    return Walk(np.array(corners), stops)


def _drawn(mission: Mission, robot: RobotPlan, region: Region, rng: np.random.Generator) -> np.ndarray | None:
    """Return a random point of a region less the margin that is in no region which is not visited."""
    scale = 1 - (mission.margin + 1e-3) / min(region.radii)
    if scale <= 0:
        return None
    visited = {visit.region for visit in robot.visits}
    values, vectors = np.linalg.eigh(np.array(region.matrix))
    for _ in range(60):
        unit = rng.normal(size=3)
        unit *= scale * rng.random() ** (1 / 3) / np.linalg.norm(unit)
        point = np.array(region.center) + vectors @ (unit / np.sqrt(values))
        others = [other for name, other in mission.all_regions.items() if name not in visited]
        if all(_level(other, point) > 1 + mission.margin / min(other.radii) for other in others):
            return point
    return None


def _way(
    mission: Mission, a: np.ndarray, b: np.ndarray, allowed: set[str | None], hoop: str | None, rng: np.random.Generator
) -> list[np.ndarray] | None:
    """Return corners after `a` up to `b`: a straight leg, or the shortest way over random points."""
    if _clear(mission, a, b, allowed, hoop):
        return [b]
    if hoop is not None:
        return None
    low, high = np.array(mission.workspace.min) + mission.margin, np.array(mission.workspace.max) - mission.margin
    points = np.concatenate([[a, b], rng.uniform(low, high, size=(ROADMAP, 3))])
    lengths = np.zeros((len(points), len(points)))
    for i, j in itertools.combinations(range(len(points)), 2):
        apart = float(np.linalg.norm(points[i] - points[j]))
        if apart < 2.0 and _clear(mission, points[i], points[j], allowed, None):
            lengths[i, j] = apart
    total, before = dijkstra(csr_matrix(lengths), directed=False, indices=0, return_predecessors=True)
    if not np.isfinite(total[1]):
        return None
    way = [1]
    while before[way[-1]] > 0:
        way.append(int(before[way[-1]]))
    return [points[i] for i in reversed(way)]


def _clear(mission: Mission, a: np.ndarray, b: np.ndarray, allowed: set[str | None], hoop: str | None) -> bool:
    points = a + np.linspace(0, 1, max(int(np.linalg.norm(b - a) / STEP), 2))[:, None] * (b - a)
    if np.any(points < np.array(mission.workspace.min) + mission.margin) or np.any(
        points > np.array(mission.workspace.max) - mission.margin
    ):
        return False
    for name, region in mission.all_regions.items():
        if name not in allowed and np.any(_level(region, points) <= 1 + mission.margin / min(region.radii)):
            return False
    for name, ring in mission.hoops.items():
        disc, rim = _about(ring, points)
        if rim.min() < mission.margin + mission.vehicle.radius or (name != hoop and disc.min() < mission.margin):
            return False
    return True


def _delays(paths: list[np.ndarray], distance: float) -> tuple[float, ...] | None:
    """Return departures on the grid at which all robots keep their distance for all samples, hovers included."""
    chosen: list[tuple[float, ...]] = [(0.0,)]
    if len(paths) > 1:
        chosen = [(d,) for d in DELAYS[:10]]
    for index in range(1, len(paths)):
        longer = []
        for delays in chosen:
            for delay in DELAYS:
                pairs = zip(paths[:index], delays, strict=True)
                if all(_apart(other, late, paths[index], delay) >= distance for other, late in pairs):
                    longer.append((*delays, float(delay)))
                    break
        chosen = longer
    return chosen[0] if chosen else None


def _apart(one: np.ndarray, late: float, other: np.ndarray, later: float) -> float:
    first, second = round(late * RATE), round(later * RATE)
    index = np.arange(0, max(len(one) + first, len(other) + second), 2)
    gap = one[np.clip(index - first, 0, len(one) - 1)] - other[np.clip(index - second, 0, len(other) - 1)]
    return float(np.linalg.norm(gap, axis=1).min())
