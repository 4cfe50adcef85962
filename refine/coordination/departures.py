"""Departure times: each robot departs so that robots keep their distance and planned precedences hold.

Departures are tried first: robots in some order, each as early as the ones before it allow. Distances are sampled with
what may happen between two samples added on top (half the way to the neighbours, and a tenth): the judge has the last word.
Where that leaves no departures, robots may be asked to pass or land within millimetres of what is allowed: they are tried
again with distances to the chords between samples.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from refine.spline.spline import Spline
from verify.data.plan import Meeting, Precedence

Wait = Precedence | Meeting
"""What one robot waits for: that another one has left a visit, or has arrived at one."""

Floats = NDArray[np.float64]

GRID = 1 / 8
"""s between two departures that are tried; exact in float32."""
STEP = 1 / 64
"""s between two samples of a flight; a whole number of them make up `GRID`."""
COARSE = 8
"""Samples that a first look goes on by."""
_ORDERS = 48
_MANY = 16
"""Robots above which fewer orders are tried: each takes as many looks as there are pairs, and more."""
_ORDERS_OF_MANY = 6
_FEW = 4
"""Robots of which all orders are tried."""


@dataclass(frozen=True, eq=False)
class ScheduledPath:
    """A robot's flight as scheduling needs it.

    Attributes:
        name: The robot's.
        path: From its departure; before and after it hovers. At least three axes.
        visits: (enter, leave) of each visit in s after departure.
        earliest: Least departure, s.
        arrives: When it has come to each visit's place, or deep into its region where it flies on, s after departure; only for meetings.
        sets_out: When it sets out for visits for which it waits for others to arrive, s after departure.
        inside: For each visit from when to when it is inside for sure at first, s after departure; only where precedences ask for it.
        acts: For each visit with actions, when it makes the first and the last of them, s after departure; likewise.
        shares: For each visit with actions, by how much the first one comes later where it departs 1 s later: where it starts in the
            region its stay is longer then, over which actions are spread.
    """

    name: str
    path: Spline
    visits: tuple[tuple[float, float], ...]
    earliest: float
    arrives: tuple[float, ...] = ()
    sets_out: Mapping[int, float] = field(default_factory=dict[int, float])
    inside: tuple[tuple[float, float], ...] = ()
    acts: Mapping[int, tuple[float, float]] = field(default_factory=dict[int, tuple[float, float]])
    shares: Mapping[int, float] = field(default_factory=dict[int, float])

    def done(self, wait: Wait) -> float:
        """Return when it has done what others wait for, in s after departure."""
        visit = wait.first[1]
        if isinstance(wait, Meeting):
            return self.arrives[visit] + GRID
        if wait.done == "left":
            return self.visits[visit][1]
        return (self.inside[visit][0] if wait.done == "entered" else self.acts[visit][1]) + GRID

    def due(self, wait: Wait) -> float:
        """Return when it does what waits for others, in s after departure."""
        visit = wait.then[1]
        if isinstance(wait, Meeting):
            return self.sets_out[visit]
        if wait.due == "enters":
            return self.visits[visit][0]
        return (self.inside[visit][1] if wait.due == "leaves" else self.acts[visit][0]) - GRID

    def share(self, wait: Wait) -> float:
        """Return by how much what waits for others comes later where the robot departs 1 s later."""
        acts = isinstance(wait, Precedence) and wait.due == "acts"
        return self.shares.get(wait.then[1], 1.0) if acts else 1.0


@dataclass(frozen=True, eq=False)
class DepartureConflict:
    """No departures were found; `pair` names two robots that come too near each other: at `distance` m, at the worst of clocks."""

    pair: tuple[str, str]
    distance: float
    time: float


@dataclass(frozen=True, eq=False)
class _Track:
    points: Floats
    """At multiples of STEP from departure to arrival, z scaled. Shape (samples, 3)."""
    reach: Floats
    """How far it may be from each point within half a step, m. Shape (samples,)."""
    wide: Floats
    """The same within half of COARSE steps."""
    lag: Floats
    """How far it flies at most in the clocks' error before and after each sample, m. Shape (samples,)."""
    wide_lag: Floats
    """The most of it within COARSE steps."""


def departures(
    flights: Sequence[ScheduledPath],
    *,
    distance: float,
    z_scale: float,
    skew: float = 0.0,
    precedences: Sequence[Wait] = (),
    given: Mapping[str, float] | None = None,
) -> dict[str, float] | DepartureConflict:
    """Return departure times in s by robot, the shortest team time among the orders that were tried.

    Args:
        flights: One each robot.
        distance: m to keep between centres.
        z_scale: Distances in z count this many times.
        skew: s by which clocks may be apart: distances and precedences are kept however they differ.
        precedences: Visits that must be over before others begin.
        given: Departures that are settled; they are checked too.
    """
    tracks = {flight.name: _track(flight, z_scale, skew) for flight in flights}
    asked = _Asked(precedences, given or {}, max(GRID / 2, 2 * (skew + STEP)))
    found = _in_some_order(flights, _Pairs(tracks, distance), asked)
    if isinstance(found, DepartureConflict) and found.distance >= distance:
        found = _in_some_order(flights, _Pairs(tracks, distance, closely=True), asked)
    return found


@dataclass(frozen=True, slots=True)
class _Asked:
    """Constraints on departures beside distances: precedences, by `late` s each, and departures that are given."""

    precedences: Sequence[Wait]
    given: Mapping[str, float]
    late: float


def _in_some_order(flights: Sequence[ScheduledPath], pairs: _Pairs, asked: _Asked) -> dict[str, float] | DepartureConflict:
    """Return the shortest team time's departures among the orders that are tried."""
    best: tuple[float, float, dict[str, float]] | None = None
    conflict: DepartureConflict | None = None
    settled = [flight for flight in flights if flight.name in asked.given]
    others = [flight for flight in flights if flight not in settled]
    by_name = {flight.name: flight for flight in others}
    orders = Orders(tuple(by_name), _ORDERS if len(others) <= _MANY else _ORDERS_OF_MANY)
    for order in orders:
        found = _in_order((*settled, *(by_name[name] for name in order)), pairs, asked)
        if isinstance(found, DepartureConflict):
            conflict = conflict or found
            orders.stuck(order, found.pair[0])
            continue
        total = max(found[flight.name] + flight.path.duration for flight in flights)
        key = (total, sum(found.values()))
        if best is None or key < best[:2]:
            best = (*key, found)
        if all(found[flight.name] <= np.ceil(flight.earliest / GRID) * GRID for flight in flights):
            break  # nobody departs sooner
    if best is not None:
        return {flight.name: best[2][flight.name] for flight in flights}
    return conflict or DepartureConflict(("", ""), 0.0, 0.0)


class Orders:
    """Orders of robots worth trying: all orders of a few; of many, each robot first, and whoever was stuck before the others."""

    def __init__(self, names: tuple[str, ...], most: int) -> None:
        few = len(names) <= _FEW
        first = [(name, *(other for other in names if other != name)) for name in names]
        self._left = list(itertools.permutations(names)) if few else list(dict.fromkeys((names, *first)))
        self._known, self._most = set(self._left), most

    def __iter__(self) -> Iterator[tuple[str, ...]]:
        for _ in range(self._most):
            if not self._left:
                return
            yield self._left.pop(0)

    def stuck(self, order: tuple[str, ...], name: str) -> None:
        """Take notice that a robot found no way past those before it: it goes first in an order that is tried soon."""
        other = (name, *(each for each in order if each != name))
        if other in self._left:
            self._left.remove(other)
        elif name not in order or other in self._known:
            return
        self._known.add(other)
        self._left.insert(0, other)


def _track(flight: ScheduledPath, z_scale: float, skew: float) -> _Track:
    times = np.arange(0.0, flight.path.duration + STEP, STEP)
    knots = flight.path.knots
    piece = np.clip(np.searchsorted(knots, times, side="right") - 1, 0, len(flight.path) - 1)
    local = np.minimum(times - knots[piece], flight.path.durations[piece])
    points = np.zeros((len(times), 3))
    coefficients = flight.path.coefficients[piece]
    for power in range(7, -1, -1):
        points = points * local[:, None] + coefficients[:, :3, power]
    points[:, 2] *= z_scale
    reach, lag = reach_of(points), lag_of(points, skew)
    return _Track(points, reach, wider(reach), lag, most_nearby(lag))


def lag_of(points: Floats, skew: float) -> Floats:
    """Return how far a robot flies at most in a time before or after each sample of its path, m. Shape (samples, 3) to (samples,).

    Args:
        points: At multiples of STEP, m, z scaled; it rests before and after.
        skew: That time, s.
    """
    if skew == 0.0:
        return np.zeros(len(points))
    flown = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    when = np.arange(len(points)) * STEP
    return np.maximum(np.interp(when + skew, when, flown) - flown, flown - np.interp(when - skew, when, flown))


def reach_of(points: Floats) -> Floats:
    """Return how far from each sample of a path it may be within half a step, m. Shape (samples, 3) to (samples,).

    Half the way to the neighbours, and a tenth for what is not straight or even in between.
    """
    steps = np.concatenate([[0.0], np.linalg.norm(np.diff(points, axis=0), axis=1), [0.0]])
    return 0.55 * np.maximum(steps[:-1], steps[1:])


def wider(reach: Floats) -> Floats:
    """Return the reach within half of COARSE steps, for looks at every so many samples only. Shape (samples,)."""
    return COARSE * most_nearby(reach)


def most_nearby(values: Floats) -> Floats:
    """Return the greatest value within COARSE steps of each sample. Shape (samples,)."""
    padded = np.pad(values, COARSE, mode="edge")
    return np.maximum.reduce([padded[k : k + len(values)] for k in range(2 * COARSE + 1)])


def least_between(offsets: Floats, less: Floats | float = 0.0) -> float:
    """Return how near a sampled curve comes to the origin: its chords, less what it may bulge beyond them. Shape (samples, 3).

    What is to be taken off at each sample besides has shape (samples,).

    A curve leaves a chord of length h in time by at most h^2 / 8 of its acceleration, which second differences give times h^2;
    twice that is taken, for accelerations that change.
    """
    steps = np.diff(offsets, axis=0)
    squared = np.maximum((steps**2).sum(axis=1), np.finfo(float).tiny)
    share = np.clip(-(offsets[:-1] * steps).sum(axis=1) / squared, 0.0, 1.0)
    nearest = np.linalg.norm(offsets[:-1] + share[:, None] * steps, axis=1)
    bends = np.concatenate([[0.0], np.linalg.norm(np.diff(steps, axis=0), axis=1), [0.0]])
    off = np.broadcast_to(less, len(offsets))
    return float((nearest - np.maximum(bends[:-1], bends[1:]) / 4 - np.maximum(off[:-1], off[1:])).min())


class _Pairs:
    """Conflicts of robots by their departures: one depends on the difference of two departures alone, and is looked at once."""

    def __init__(self, tracks: dict[str, _Track], distance: float, *, closely: bool = False) -> None:
        self._tracks, self._distance, self._closely = tracks, distance, closely
        self._apart: dict[tuple[str, str, int], bool] = {}

    def met(self, name: str, departure: float, chosen: Mapping[str, float]) -> str | None:
        """Return who a robot departing then comes too near to; None where it meets nobody."""
        for other, departed in chosen.items():
            key = (name, other, round(departure / STEP) - round(departed / STEP))
            if key not in self._apart:
                self._apart[key] = self._are_apart(*key)
            if not self._apart[key]:
                return other
        return None

    def conflict(self, name: str, departure: float, other: str, departed: float) -> DepartureConflict:
        """Return how near two robots come to each other, and when."""
        gap, _, _ = self._gaps(name, other, round(departure / STEP) - round(departed / STEP), 1)
        nearest = int(np.argmin(gap))
        return DepartureConflict((name, other), max(float(gap[nearest]), 0.0), nearest * STEP + min(departure, departed))

    def _are_apart(self, name: str, other: str, late: int) -> bool:
        """Return whether two robots keep the distance; a coarse look settles most cases."""
        gap, reach, wide = self._gaps(name, other, late, COARSE)
        if (gap - reach).min() < self._distance:
            return False
        if (gap - wide).min() >= self._distance:
            return True
        gap, reach, _ = self._gaps(name, other, late, 1)
        if (gap - reach).min() >= self._distance:
            return True
        if not self._closely:
            return False
        offsets, here, there = self._offsets(name, other, late, 1)
        return (
            least_between(offsets, np.minimum(self._tracks[name].lag[here], self._tracks[other].lag[there])) >= self._distance
        )

    def _gaps(self, name: str, other: str, late: int, every: int) -> tuple[Floats, Floats, Floats]:
        """Return distances while either one's clock is ahead, and both reaches together, from the first departure to the last arrival."""
        offsets, here, there = self._offsets(name, other, late, every)
        mine, theirs = self._tracks[name], self._tracks[other]
        gap = np.linalg.norm(offsets, axis=1)
        lag, wide = np.minimum(mine.lag[here], theirs.lag[there]), np.minimum(mine.wide_lag[here], theirs.wide_lag[there])
        return gap - lag, mine.reach[here] + theirs.reach[there], mine.wide[here] + theirs.wide[there] + (wide - lag)

    def _offsets(self, name: str, other: str, late: int, every: int) -> tuple[Floats, NDArray[np.intp], NDArray[np.intp]]:
        """Return where one robot is as seen from the other, shape (samples, 3), and the samples of both."""
        mine, theirs = self._tracks[name], self._tracks[other]
        shift, other_shift = max(late, 0), max(-late, 0)
        index = np.arange(0, max(shift + len(mine.points), other_shift + len(theirs.points)) + every - 1, every)
        here = np.clip(index - shift, 0, len(mine.points) - 1)
        there = np.clip(index - other_shift, 0, len(theirs.points) - 1)
        return mine.points[here] - theirs.points[there], here, there


def _in_order(
    order: Sequence[ScheduledPath],
    pairs: _Pairs,
    asked: _Asked,
) -> dict[str, float] | DepartureConflict:
    """Give each robot the earliest departure that those before it in the order allow."""
    chosen: dict[str, float] = {}
    by_name = {flight.name: flight for flight in order}
    for flight in order:
        least, latest = flight.earliest, np.inf
        for precedence in asked.precedences:
            (first, _), (then, _) = precedence.first, precedence.then
            if then == flight.name and first in chosen:
                late = chosen[first] + by_name[first].done(precedence) - flight.due(precedence) + asked.late
                least = max(least, late / flight.share(precedence))
            if first == flight.name and then in chosen:
                due = chosen[then] * by_name[then].share(precedence) + by_name[then].due(precedence)
                latest = min(latest, due - flight.done(precedence) - asked.late)
        if flight.name in asked.given:
            departure = asked.given[flight.name]
            other = pairs.met(flight.name, departure, chosen)
            if other is not None:
                return pairs.conflict(flight.name, departure, other, chosen[other])
            if not least - STEP <= departure <= latest + STEP:  # half of what `late` leaves beyond the clocks' error
                return DepartureConflict((flight.name, flight.name), 0.0, 0.0)
            chosen[flight.name] = departure
            continue
        earliest = np.ceil(least / GRID) * GRID
        busy = max((chosen[other] + by_name[other].path.duration for other in chosen), default=0.0)
        last = min(latest, max(earliest, busy) + 2 * GRID)
        found = _earliest(flight.name, earliest, last, chosen, pairs)
        if isinstance(found, DepartureConflict):
            return found
        chosen[flight.name] = found
    return chosen


def _earliest(name: str, earliest: float, last: float, chosen: Mapping[str, float], pairs: _Pairs) -> float | DepartureConflict:
    """Return a robot's first departure on the grid that meets nobody, or whom the last one meets."""
    departure, other = earliest, None
    for departure in np.arange(earliest, last + STEP, GRID).tolist():
        other = pairs.met(name, departure, chosen)
        if other is None:
            return departure
    if other is None:  # nothing lies between the planned precedences
        return DepartureConflict((name, name), 0.0, 0.0)
    return pairs.conflict(name, departure, other, chosen[other])
