"""A team's flight that comes to rest where its vehicles' memories end: all robots slow down together on their ways, rest, and go on.

Paths stay as they are, and so does who is where when others are elsewhere: one clock slows down for all. At its time t every robot is where
the plan has it at s(t), so that robots keep the distances that they had, and do everything in the order that they had. Towards a rest s' falls
from 1 to 0 within `length` s by the polynomial 10 u^3 - 15 u^4 + 6 u^5, whose first two derivatives vanish at both ends, and rises likewise behind it.
Pieces of degree 7 meet x(s(t)) at their nodes up to jerk; between them they follow it within a fraction of a millimetre, or get more nodes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from refine.limits.limits import Limits
from refine.limits.stretching import SAFETY
from refine.limits.usage import peaks, worst
from refine.rest_to_rest import TICK
from refine.spline.basis import ORDER, values
from refine.spline.spline import Spline
from verify.data import DoesNotFit, Mission

Floats = NDArray[np.float64]

_LENGTHS = (1.0, 1.5, 2.0, 3.0, 4.0, 6.0)
"""s that slowing down takes, as they are tried: the first at which all limits hold is taken."""
_SLOWER = (1.05, 1.1, 1.2)
"""How much slower the whole flight is tried, where it uses all of a limit while it slows down."""
_MUCH_SLOWER = (1.5, 2.0, 3.0, 4.0)
"""The same where so many pieces are flown while it slows down that vehicles do not hold them."""
_SHORT, _FAST = 0.5, (1.0, 1.5, 2.0, 3.0, 4.0, 6.0)
"""s that slowing down takes where a second is long for a fast flight, and how much slower the whole is tried then."""
_FOLLOWED = 2e-4
"""m (and rad) by which pieces may leave the slowed motion between their nodes."""
_NEAR = 0.1
"""s from a node within which no other one is put where slowing begins or ends: coefficients of short pieces drown in float32."""
_ROUNDS = 4
"""How often pieces that do not follow are halved."""
_WITHIN = np.linspace(0.0, 1.0, 9)[1:-1]
"""Shares of a piece at which it is compared."""


@dataclass(frozen=True, eq=False, slots=True)
class Clock:
    """Map from the plan's times to those at which they are flown.

    Attributes:
        rests: Times of the plan at which all rest, s, increasing, at least `length` apart.
        length: s that slowing down takes, and going on.
    """

    rests: Floats
    length: float

    @property
    def pauses(self) -> Floats:
        """Times at which the rests are flown, s."""
        return self.rests + self.length * (np.arange(len(self.rests)) + 0.5)

    def flown(self, plan: Floats) -> Floats:
        """Return when times of the plan are flown, s.

        Args:
            plan: Times of the plan, s.
        """
        passed = np.searchsorted(self.rests + self.length / 2, plan, side="right")  # rests that are over
        found = plan + self.length * passed
        for rest, pause in zip(self.rests, self.pauses, strict=True):
            near = np.abs(plan - rest) < self.length / 2
            found[near] = pause + np.sign(plan[near] - rest) * self.length * _share_of(np.abs(plan[near] - rest) / self.length)
        return found

    def plan(self, flown: Floats) -> Floats:
        """Return the plan's times and their first three derivatives at times that are flown. Shape (4, times).

        Args:
            flown: Times that are flown, s. Shape (times,).
        """
        found = np.zeros((ORDER, len(flown)))
        found[0] = flown - self.length * np.searchsorted(self.pauses, flown)
        found[1] = 1.0
        for rest, pause in zip(self.rests, self.pauses, strict=True):
            near = np.abs(flown - pause) < self.length
            u, side = np.abs(flown[near] - pause) / self.length, np.sign(flown[near] - pause)
            found[0, near] = rest + side * self.length * _advance(u)
            found[1, near] = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
            found[2, near] = side * 30.0 * u**2 * (1.0 - u) ** 2 / self.length
            found[3, near] = 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / self.length**2
        return found


def _advance(u: Floats) -> Floats:
    """Return the integral of the share of speed from a rest on, over shares u of the slowing's length."""
    return u**4 * (2.5 - 3.0 * u + u**2)


def _share_of(advance: Floats) -> Floats:
    """Return the inverse of `_advance` on [0, 1/2]."""
    low, high = np.zeros_like(advance), np.ones_like(advance)
    for _ in range(60):
        middle = (low + high) / 2
        below = _advance(middle) < advance
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return high


@dataclass(frozen=True, eq=False, slots=True)
class Resting:
    """A team's flights with common rests.

    Attributes:
        paths: Robot: x, y, z and yaw; durations are whole ticks.
        cuts: Robot: the piece that begins at each rest.
    """

    paths: dict[str, Spline]
    cuts: dict[str, tuple[int, ...]]


def resting(
    paths: Mapping[str, Spline], mission: Mission, limits: Mapping[str, Limits], held: Mapping[str, int | None]
) -> Resting:
    """Return a team's flights with as many common rests as it takes for every vehicle to hold what it flies between two of them.

    Args:
        paths: Each robot's x, y, z and yaw, all from 0 to one common end.
        mission: In whose hoops nobody rests where that can be helped.
        limits: What each robot's flight keeps.
        held: Pieces that each vehicle holds; None for any number.

    Raises:
        DoesNotFit: Vehicles hold too few pieces, or no slowing that was tried keeps all limits.
    """
    allowed = {name: max(1.0 - SAFETY, _used(path, limits[name])) for name, path in paths.items()}
    full: DoesNotFit | None = None
    ways = (
        *((1.0, length) for length in _LENGTHS),
        *((slower, _LENGTHS[-1]) for slower in _SLOWER),
        *((slower, _LENGTHS[0]) for slower in _MUCH_SLOWER),
        *((slower, _SHORT) for slower in _FAST),
    )
    for slower, length in ways:
        stretched = {name: path.stretched(slower) for name, path in paths.items()}
        try:
            rests = _rests(stretched, mission, held, length)
        except DoesNotFit as error:
            full = full or error
            continue
        found = _slowed(stretched, Clock(rests, length))
        if all(_used(path, limits[name]) <= allowed[name] for name, path in found.paths.items()):
            return found
    raise full or DoesNotFit(
        f"The flight is longer than its vehicles hold, and robots that slow down to rest within {_LENGTHS[-1]:g} s on their ways, so that it is "
        "uploaded in parts, do not keep their limits. Stream it, or fly a vehicle that holds more (`pieces` of its profile)."
    )


def _used(path: Spline, limits: Limits) -> float:
    """Return the greatest share of a limit that a flight uses."""
    axes = Spline(path.durations, path.states[..., :3]), Spline(path.durations, path.states[..., 3:])
    peak = worst(peaks(*axes, limits))
    return 0.0 if peak is None else peak.share


def _rests(paths: Mapping[str, Spline], mission: Mission, held: Mapping[str, int | None], length: float) -> Floats:
    """Return the plan's times at which the team rests: each as late as all vehicles hold what comes before it, outside of hoops if possible."""
    end = next(iter(paths.values())).duration
    knots = np.unique(np.round(np.concatenate([path.knots for path in paths.values()]) / TICK) * TICK)
    in_hoop = np.zeros(len(knots), dtype=np.bool_)
    for path in paths.values():
        places = _states_at(path, knots)[:, 0, :3]
        for hoop in mission.hoops.values():
            in_hoop |= hoop.level(places) <= 1.0
    limited = {name: most for name, most in held.items() if most is not None}
    rests: list[float] = []
    while True:
        begin = rests[-1] if rests else 0.0
        if all(_pieces(paths[name], rests, end, length) <= most for name, most in limited.items()):
            return np.array(rests)
        soonest = begin + length if rests else length / 2
        last = min(_reached(paths[name], begin, most) for name, most in limited.items())
        candidates = [
            (index, knot) for index, knot in enumerate(knots.tolist()) if soonest <= knot <= min(last, end - length / 2)
        ]
        for _, at in sorted(candidates, key=lambda each: (in_hoop[each[0]], -each[1])):
            if all(_pieces(paths[name], rests, at, length) <= most for name, most in limited.items()):
                rests.append(at)
                break
        else:
            name = min(limited, key=lambda name: limited[name])
            raise DoesNotFit(
                f"The flight is longer than its vehicles hold, and the {limited[name]} pieces that {name}'s holds are too few to slow down to "
                "rest and go on, so that it is uploaded in parts. Stream it, or fly a vehicle that holds more (`pieces` of its profile)."
            )


def _reached(path: Spline, begin: float, most: int) -> float:
    """Return how far a number of pieces leads at most from a time of the plan on, s."""
    after = path.knots[path.knots > begin]
    return float(after[most - 1]) if len(after) >= most else path.duration


def _pieces(path: Spline, rests: list[float], until: float, length: float) -> int:
    """Return how many pieces a robot flies from the last rest to a next one, or to the end."""
    begin = rests[-1] if rests else 0.0
    ends = until >= path.duration
    clock = Clock(np.array(rests if ends else [*rests, until])[-2:], length)
    nodes = _nodes(path, clock)
    low, high = clock.flown(np.array([begin, until]))
    return int(np.count_nonzero((nodes > low + TICK / 2) & (nodes < high - TICK / 2))) + 1


def _slowed(paths: Mapping[str, Spline], clock: Clock) -> Resting:
    """Return all flights by a clock that slows down."""
    slow: dict[str, Spline] = {}
    cuts: dict[str, tuple[int, ...]] = {}
    for name, path in paths.items():
        nodes = _nodes(path, clock)
        slow[name] = _through(path, clock, nodes)
        cuts[name] = tuple(int(np.argmin(np.abs(nodes - pause))) for pause in clock.pauses)
    return Resting(slow, cuts)


def _nodes(path: Spline, clock: Clock) -> Floats:
    """Return the times at which a robot's pieces by a slowing clock meet, s, whole ticks."""
    known = path.knots
    edges = np.concatenate([clock.rests - clock.length / 2, clock.rests + clock.length / 2])
    moving = np.array(
        [_moves(path, min(edge, rest), max(edge, rest)) for edge, rest in zip(edges, np.tile(clock.rests, 2), strict=True)]
    )
    gaps = np.abs(edges[:, None] - known).min(axis=1)
    added = edges[moving & (gaps >= _NEAR)] if len(edges) else edges
    ticks = np.round(clock.flown(np.concatenate([known, added])) / TICK)
    pauses = np.round(clock.pauses / TICK)
    if len(pauses):  # a node next to a rest is where robots hardly move
        ticks = ticks[np.abs(ticks[:, None] - pauses).min(axis=1) * TICK >= _NEAR / 2]
    ticks = np.unique(np.concatenate([ticks, pauses]))
    for _ in range(_ROUNDS):
        halved = _off(path, clock, ticks * TICK) > _FOLLOWED
        if not halved.any():
            break
        ticks = np.unique(np.concatenate([ticks, np.round((ticks[:-1] + ticks[1:])[halved] / 2)]))
    return ticks * TICK


def _moves(path: Spline, low: float, high: float) -> bool:
    """Return whether a robot moves between two times of the plan."""
    first, last = np.clip(np.searchsorted(path.knots, [low, high], side="right") - 1, 0, len(path) - 1)
    return not all(_hovers(path)[first : last + 1])


def _hovers(path: Spline) -> NDArray[np.bool_]:
    still = (path.states[:-1] == path.states[1:]).all(axis=(1, 2))
    return still & ~path.states[:-1, 1:].any(axis=(1, 2))


def _off(path: Spline, clock: Clock, nodes: Floats) -> Floats:
    """Return how far each piece through nodes leaves the slowed motion, as samples tell, m. Shape (pieces,)."""
    through = _through(path, clock, nodes)
    times = nodes[:-1, None] + np.diff(nodes)[:, None] * _WITHIN
    wanted = _states_at(path, clock.plan(times.ravel())[0])[:, 0].reshape(*times.shape, -1)
    return np.abs(through.sample(_WITHIN) - wanted).max(axis=(1, 2))


def _through(path: Spline, clock: Clock, nodes: Floats) -> Spline:
    """Return the pieces that meet x(s(t)) at nodes up to jerk."""
    s, rate, bend, turn = clock.plan(nodes)
    position, velocity, acceleration, jerk = _states_at(path, s).transpose(1, 0, 2)
    rate, bend, turn = rate[:, None], bend[:, None], turn[:, None]
    states = np.stack(
        [
            position,
            velocity * rate,
            acceleration * rate**2 + velocity * bend,
            jerk * rate**3 + 3.0 * acceleration * rate * bend + velocity * turn,
        ],
        axis=1,
    )
    return Spline(np.diff(nodes), states)


def _states_at(path: Spline, times: Floats) -> Floats:
    """Return a path's position and first three derivatives at times of the plan. Shape (times, 4, axes)."""
    at = np.clip(times, 0.0, path.duration)
    piece = np.clip(np.searchsorted(path.knots, at, side="right") - 1, 0, len(path) - 1)
    local = (at - path.knots[piece])[:, None]
    found = np.stack([values(path.coefficients[piece], local, order)[:, 0] for order in range(ORDER)], axis=1)
    still = _hovers(path)[piece]
    found[still] = path.states[piece[still]]
    return found
