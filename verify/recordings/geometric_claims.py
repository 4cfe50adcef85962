"""Recorded flights in space: workspace, rims, obstacles and separation, whatever the robots did between their samples."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction
from functools import partial

import numpy as np

from verify.arithmetic.intervals import Interval, interval
from verify.claims.claim import Claim, Outcome, claim_of
from verify.data.errors import BadInput
from verify.data.mission import Mission
from verify.data.shapes.region import Hoop
from verify.motion.obstacles.bodies import SolidBodies
from verify.motion.obstacles.points import is_near
from verify.motion.passages import rim_distance, unit_normal
from verify.recordings.reachable_sets import Cells, Floats, Track, Value, least

TELLS: dict[Outcome, str] = {"holds": "holds", "fails": "broken", "undecided": "the samples cannot tell"}
"""What a claim's outcome is called where a recording is checked."""

_ROUNDS = 6
"""How often the time in which two robots are near each other is halved."""


# as many parameters as a claim and its witness have parts, each by its keyword
def recorded_claim(
    name: str,
    verdict: Outcome,
    sentence: str,
    *,
    robot: str | None = None,
    other: str | None = None,
    bound: float | None = None,
    limit: float | None = None,
    time: float | None = None,
    region: str | None = None,
    visit: int | None = None,
    what: str = "",
) -> Claim:
    """Return a claim about a recorded flight, with its witness where it does not hold; bound and limit are lengths in m.

    Args:
        name: Of the claim.
        verdict: Its outcome.
        sentence: For a person.
        robot: Name of the robot concerned.
        other: Name of the other one, for a claim about two.
        bound: What the samples show, m.
        limit: What is asked, m.
        time: When, s of the recording.
        region: Name of the region concerned.
        visit: Index of the planned visit concerned.
        what: What the bound measures.
    """
    return claim_of(
        name, verdict, sentence, robot=robot, other=other, unit="" if bound is None else "m", bound=bound, limit=limit, time=time,
        region=region, visit=visit, what=what,
    )  # fmt: skip


def workspace_claim(track: Track, mission: Mission) -> Claim:
    """Claim that the robot's centre stays in the workspace."""
    low, high = np.array(mission.workspace.min), np.array(mission.workspace.max)

    def inside(places: Floats) -> Interval:
        at = interval(places)
        from_low, to_high = at - interval(low), interval(high) - at
        return Interval(np.minimum(from_low.low, to_high.low).min(axis=1), np.minimum(from_low.high, to_high.high).min(axis=1))

    found = least(track, _moving(inside), 0.0)
    worst, when = _worst_sample(track, inside(track.positions))
    robot = track.robot
    if found.proved:
        sentence = f"{robot} stays in the workspace, at least {found.low:.4f} m from its walls."
        return recorded_claim("workspace", "holds", sentence, robot=robot, bound=found.low, limit=0.0, time=found.time)
    if worst < 0:
        place = track.positions[int(np.searchsorted(track.times, when))]
        wall = _wall(place, mission)
        sentence = f"{robot} is at least {-worst:.4f} m outside the workspace's wall {wall} at {when:.4f} s."
        return recorded_claim(
            "workspace", "fails", sentence, robot=robot, bound=worst, limit=0.0, time=when, what=f"wall {wall}"
        )
    sentence = f"{robot} may be {-found.low:.4f} m outside the workspace at {found.time:.4f} s."
    return recorded_claim("workspace", "undecided", sentence, robot=robot, bound=found.low, limit=0.0, time=found.time)


def _wall(place: Floats, mission: Mission) -> str:
    beyond = np.r_[place - np.array(mission.workspace.min), np.array(mission.workspace.max) - place]
    return ("x min", "y min", "z min", "x max", "y max", "z max")[int(np.argmin(beyond))]


def obstacle_claim(track: Track, mission: Mission, radius: float) -> Claim | None:
    """Claim that the vehicle's sphere meets no obstacle; None where there are none.

    Args:
        track: Where a robot was, while the world was so.
        mission: The world; the robot may join it later.
        radius: The vehicle's, m.
    """
    if not mission.obstacles:
        return None
    robot, bodies = track.robot, SolidBodies.of(mission)
    found = least(track, _moving(lambda places: bodies.nearest(places)[0]), radius)
    near, parts = bodies.nearest(track.positions)
    worst, when = _worst_sample(track, near)
    at = int(np.searchsorted(track.times, when))
    x, y, z = (Fraction(value) for value in track.positions[at].tolist())
    if worst <= radius and is_near((x, y, z), bodies.parts[parts[at]], Fraction(radius) - Fraction(track.bounds.error)):
        name = bodies.parts[parts[at]].obstacle
        place = f"within {worst:.4f} m of" if worst > 0 else "inside"
        sentence = f"{robot} is {place} obstacle '{name}' at {when:.4f} s; its radius is {radius:g} m."
        return recorded_claim("obstacles", "fails", sentence, robot=robot, bound=worst, limit=radius, time=when, region=name)
    where = np.stack([np.interp(found.time, track.times, axis) for axis in track.positions.T])
    name = bodies.parts[int(bodies.nearest(where[None])[1][0])].obstacle
    if found.proved:
        sentence = f"{robot} stays {found.low:.4f} m from obstacle '{name}' and from every other."
        return recorded_claim(
            "obstacles", "holds", sentence, robot=robot, bound=found.low, limit=radius, time=found.time, region=name
        )
    sentence = f"{robot} may come within {max(found.low, 0.0):.4f} m of obstacle '{name}' at {found.time:.4f} s; its radius is {radius:g} m."
    return recorded_claim(
        "obstacles", "undecided", sentence, robot=robot, bound=found.low, limit=radius, time=found.time, region=name
    )


def rim_claim(track: Track, mission: Mission, radius: float) -> Claim | None:
    """Claim that the vehicle's sphere meets no rim; None where there are no hoops.

    Args:
        track: Where a robot was, while the world was so.
        mission: The world; the robot may join it later.
        radius: The vehicle's, m.
    """
    robot = track.robot
    near: list[tuple[float, float, str, Outcome]] = []
    for name, hoop in mission.hoops.items():

        def distance(places: Floats, hoop: Hoop = hoop) -> Interval:
            along, across = seen_from(places, hoop)
            opening, rim = interval(hoop.opening).low, interval(hoop.rim).low
            return Interval(*rim_distance(along.low, along.high, across.low, across.high, opening, rim))

        found = least(track, _moving(distance), radius)
        at_samples = distance(track.positions)
        worst, when = _worst_sample(track, at_samples)
        if worst <= radius:
            near.append((worst, when, name, "fails"))
        else:
            near.append((found.low, found.time, name, "holds" if found.proved else "undecided"))
    if not near:
        return None
    rank: dict[Outcome, int] = {"fails": 0, "undecided": 1, "holds": 2}
    low, time, hoop, verdict = min(near, key=lambda item: (rank[item[3]], item[0]))
    if verdict == "holds":
        sentence = f"{robot} stays {low:.4f} m from the rim of '{hoop}' and of every other hoop."
    elif verdict == "fails":
        sentence = f"{robot} is within {low:.4f} m of the rim of '{hoop}' at {time:.4f} s; its radius is {radius:g} m."
    else:
        sentence = (
            f"{robot} may come within {max(low, 0.0):.4f} m of the rim of '{hoop}' at {time:.4f} s; its radius is {radius:g} m."
        )
    return recorded_claim("rims", verdict, sentence, robot=robot, bound=low, limit=radius, time=time, region=hoop)


def seen_from(places: Floats, hoop: Hoop) -> tuple[Interval, Interval]:
    """Enclose the distances of places along a hoop's normal (signed) and from its axis, m. Shape (n, 3) to (n,) each."""
    normal, error = unit_normal(hoop)
    offset = interval(places) - interval(np.array(hoop.center))
    parts = [Interval(offset.low[:, i], offset.high[:, i]) for i in range(3)]
    axis = [Interval(np.array(n - e), np.array(n + e)) for n, e in zip(normal, error, strict=True)]
    along = parts[0] * axis[0] + parts[1] * axis[1] + parts[2] * axis[2]
    length = parts[0].squared() + parts[1].squared() + parts[2].squared()
    return along, (length - along.squared()).at_least_zero().root()


def _moving(function: Callable[[Floats], Interval]) -> Value:
    """Return a quantity of the position alone, for `least`: it changes along the chord as the position does."""

    def value(cells: Cells) -> tuple[Interval, Floats, float]:
        return function(cells.centres), cells.along, 0.0

    return value


def _worst_sample(track: Track, found: Interval) -> tuple[float, float]:
    """Return the least value that the position at a sample surely does not exceed, and when; infinite where there is none."""
    index = track.samples
    if not len(index):
        return np.inf, track.start
    sure = np.nextafter(found.high[index] + track.bounds.error, np.inf)
    at = int(np.argmin(sure))
    return float(sure[at]), float(track.times[index[at]])


# -- pairs ----------------------------------------------------------------------------------------------------


def separation_claims(tracks: Mapping[str, Track], mission: Mission) -> Iterable[Claim]:
    """Any two robots keep their separation.

    Raises:
        BadInput: `separation_z` is 0.
    """
    if mission.separation_z == 0:
        raise BadInput("separation_z must be above 0 m; leave it out for the same clearance in all directions.")
    weight = mission.separation / (mission.separation_z or mission.separation or 1.0)
    for a, b in itertools.combinations(tracks, 2):
        start, stop = max(tracks[a].start, tracks[b].start), min(tracks[a].stop, tracks[b].stop)
        if start > stop:
            continue
        limit = mission.least_distance(a, b)
        low, at, high, when = _nearest(tracks[a], tracks[b], start, stop, weight, limit)
        claimed = partial(recorded_claim, "separation", robot=a, other=b, limit=limit)
        if low >= limit:
            yield claimed("holds", f"{a} and {b} stay {low:.4f} m apart; {limit:g} m are asked.", bound=low, time=at)
        elif high < limit:
            sentence = f"{a} and {b} are within {high:.4f} m of each other at {when:.4f} s; {limit:g} m are asked."
            yield claimed("fails", sentence, bound=high, time=when)
        else:
            sentence = f"{a} and {b} may come within {low:.4f} m of each other at {at:.4f} s; {limit:g} m are asked."
            yield claimed("undecided", sentence, bound=low, time=at)


def _nearest(
    first: Track, second: Track, start: float, stop: float, weight: float, limit: float
) -> tuple[float, float, float, float]:
    """Return how near two robots may come, and when; then how near they surely come, and when.

    Between two instants at which neither passes a sample, the difference of their chords' points is linear in time.
    """
    stretch = max(1.0, weight) * (1 + 1e-12)
    cuts = np.unique(np.r_[start, first.times, second.times, stop])
    cuts = cuts[(cuts >= start) & (cuts <= stop)]
    begin, end = (cuts, cuts) if len(cuts) == 1 else (cuts[:-1], cuts[1:])
    low, at, high, when = np.inf, start, np.inf, start
    for turn in range(_ROUNDS):
        if not len(begin):
            break
        offset, spread, instant = _apart(first, second, begin, end, weight)
        step = offset[1] - offset[0]
        bend = np.einsum("ij,ij->i", step, step)
        slope = np.einsum("ij,ij->i", offset[0], step)
        share = np.clip(np.divide(-slope, bend, out=np.zeros_like(slope), where=bend > 0), 0.0, 1.0)
        least_ = np.linalg.norm(offset[0] + share[:, None] * step, axis=1) * (1 - 1e-12)
        nearest = least_ - stretch * spread
        ends = np.stack([np.linalg.norm(offset[i], axis=1) * (1 + 1e-12) + stretch * instant[i] for i in (0, 1)])
        surely = ends.min(axis=0)
        if surely.min() < high:
            k = int(np.argmin(surely))
            high, when = float(surely[k]), float((begin, end)[int(np.argmin(ends[:, k]))][k])
        open_ = (nearest < limit) & (turn + 1 < _ROUNDS)
        if not np.all(open_):
            k = int(np.argmin(np.where(open_, np.inf, nearest)))
            if nearest[k] < low:
                low, at = float(nearest[k]), float(begin[k] + share[k] * (end[k] - begin[k]))
        middle = (begin + end)[open_] / 2
        begin, end = np.r_[begin[open_], middle], np.r_[middle, end[open_]]
    return low, at, high, when


def _apart(
    first: Track, second: Track, begin: Floats, end: Floats, weight: float
) -> tuple[tuple[Floats, Floats], Floats, tuple[Floats, Floats]]:
    """Return differences of the chords' points at both ends (z weighted), and bounds on what both robots are off them."""
    scale = np.array([1.0, 1.0, weight])
    places, spread, instants = [], np.zeros(len(begin)), [np.zeros(len(begin)), np.zeros(len(begin))]
    for track in (first, second):
        gap = np.clip(np.searchsorted(track.times, (begin + end) / 2, side="right") - 1, 0, len(track.times) - 2)
        length = np.diff(track.times)[gap]
        shares = [np.clip((time - track.times[gap]) / length, 0.0, 1.0) for time in (begin, end)]
        places.append([track.places(gap, share) * scale for share in shares])
        low, high = np.clip(shares[0] - 1e-12, 0, 1), np.clip(shares[1] + 1e-12, 0, 1)
        lost = track.rounding(gap) * 4
        spread += track.spread(gap, low, high) + lost
        for i, share in enumerate(shares):
            instants[i] += track.spread(gap, np.clip(share - 1e-12, 0, 1), np.clip(share + 1e-12, 0, 1)) + lost
    return (places[0][0] - places[1][0], places[0][1] - places[1][1]), spread, (instants[0], instants[1])
