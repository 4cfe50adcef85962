"""A team that is kept apart, flown faster on one clock: where all have room the clock runs faster, and slower where one has none.

Robots that are apart at equal times stay so whatever the clock does, and do everything in the order that they had. At the plan's time s the
clock runs p(s) times as fast as before, and log p is a spline; a robot's motion is then a polynomial in p and its derivatives, so that the
least duration within all limits is found by L-BFGS with penalties (`refine.limits.excess`). It is retiming along a path (Verscheure and
others, IEEE TAC 2009), for all robots at once and up to snap. Pieces of degree 7 meet the retimed motion at their nodes up to jerk.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.ndimage import maximum_filter1d
from scipy.optimize import minimize

from refine.limits.excess import Penalty
from refine.limits.limits import Limits
from refine.limits.stretching import SAFETY
from refine.limits.usage import Samples
from refine.spline.basis import ORDER, values
from refine.spline.spline import Spline

Floats = NDArray[np.float64]

_DEGREE = 5
_KNOT = 0.25
"""s of the plan between two knots of the clock, about."""
_MOST_KNOTS = 80
_PER_KNOT = 6
"""Samples between two knots."""
_FASTEST = 20.0
"""How many times as fast the clock runs at most: where all hover nothing else holds it back."""
_BREACHES = (1e3, 3e4)
"""Weights of breaches of limits against time, both in units of the whole flight, one search after the other."""
_SMOOTH = 1e-2
"""Weight of the clock's bends, likewise."""
_STEPS = 150
_FOLLOWED = 2e-4
"""m by which pieces may leave the retimed motion between their nodes, as far as samples show."""
_CORRECTIONS = 2
"""How often the clock is looked for again where pieces exceed limits between their nodes."""
_OVER = 1.01
"""Share of a limit up to which stretching the whole flight is left to see to it."""
_LOOKS = 24
"""Samples a piece for that."""
_ORDERS = np.arange(1.0, 5.0)[:, None, None]
_ROUNDS = 8
"""How often pieces that do not follow are halved at most: where a robot creeps they change by much within a short time."""
_WITHIN = np.linspace(0.0, 1.0, 9)[1:-1]
_FINE = 40
"""Steps between two knots over which times are added up."""


@dataclass(frozen=True, eq=False, slots=True)
class Flown:
    """One robot's motion on the common clock.

    Attributes:
        path: Three axes.
        start: When it departs, s.
        limits: What it keeps at its greatest pace.
        share: Its pace: a share of the fastest flight.
        most: Pieces that it may fly; None for any number.
    """

    path: Spline
    start: float
    limits: Limits
    share: float
    most: int | None = None


def on_faster_clock(team: Mapping[str, Flown]) -> dict[str, tuple[Spline, float]]:
    """Return each robot's path and departure on a clock that is as fast as all limits allow, about.

    Args:
        team: Robots that are kept apart. A small breach of limits is left for the caller to stretch away.
    """
    end = max(each.start + each.path.duration for each in team.values())
    search = _Search(team, end)
    found: dict[str, tuple[Spline, float]] = {}
    for breach in (*_BREACHES, *_BREACHES[-1:] * _CORRECTIONS):
        clock = search.fastest(breach)
        found = {
            name: (retimed(each.path, each.start, clock, each.most), float(clock.flown(np.array([each.start]))[0]))
            for name, each in team.items()
        }
        if breach == _BREACHES[-1] and not search.corrected(clock, found):
            break
    return found


class Retiming(Protocol):
    """A map between the plan's times and those at which they are flown."""

    def flown(self, plan: Floats) -> Floats:
        """Return when times of the plan are flown, s."""
        ...

    def plan(self, flown: Floats) -> Floats:
        """Return the plan's times at times that are flown, s, about."""
        ...

    def rates(self, plan: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the first three derivatives of the plan's time by the flown one. Shapes (times,)."""
        ...


class Clock:
    """A clock that is given by the spline of log p over the plan's time.

    Args:
        coefficients: Of the spline of degree 5 over even knots.
        end: The plan's duration, s.
    """

    def __init__(self, coefficients: Floats, end: float) -> None:
        spline = BSpline(_knots(len(coefficients), end), coefficients, _DEGREE)
        count = _FINE * (len(spline.t) - 2 * _DEGREE - 1)
        self._spline = spline
        self._plan = np.linspace(0.0, end, count + 1)
        middle = 0.5 * (self._plan[1:] + self._plan[:-1])
        slow, slow_middle = np.exp(-spline(self._plan)), np.exp(-spline(middle))
        steps = np.diff(self._plan) / 6.0 * (slow[:-1] + 4.0 * slow_middle + slow[1:])  # Simpson's rule
        self._flown = np.concatenate([[0.0], np.cumsum(steps)])

    def flown(self, plan: Floats) -> Floats:
        """Return when times of the plan are flown, s."""
        index = np.clip(np.searchsorted(self._plan, plan, side="right") - 1, 0, len(self._plan) - 2)
        left = self._plan[index]
        gap = plan - left
        slow = [np.exp(-self._spline(left + share * gap)) for share in (0.0, 0.5, 1.0)]
        return self._flown[index] + gap / 6.0 * (slow[0] + 4.0 * slow[1] + slow[2])

    def plan(self, flown: Floats) -> Floats:
        """Return the plan's times at times that are flown, s, about."""
        return np.interp(flown, self._flown, self._plan)

    def rates(self, plan: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the first three derivatives of the plan's time by the flown one. Shapes (times,)."""
        p = np.exp(self._spline(plan))
        first, second = self._spline(plan, 1), self._spline(plan, 2)
        return p, p**2 * first, p**3 * (2.0 * first**2 + second)


def _knots(coefficients: int, end: float) -> Floats:
    """Return the knots of a clock's spline."""
    return np.concatenate([np.zeros(_DEGREE), np.linspace(0.0, end, coefficients - _DEGREE + 1), np.full(_DEGREE, end)])


def _rows(knots: Floats, at: Floats, order: int) -> Floats:
    """Return the map from coefficients of a spline to a derivative at times. Shape (times, coefficients)."""
    count = len(knots) - _DEGREE - 1
    basis = BSpline(knots, np.eye(count), _DEGREE)
    return basis(at) if order == 0 else basis.derivative(order)(at)


class _Search:
    """The sum that is made least: the duration, squared breaches of limits, and a little of the clock's bends, with its gradient."""

    def __init__(self, team: Mapping[str, Flown], end: float) -> None:
        spans = int(np.clip(np.ceil(end / _KNOT), 4, _MOST_KNOTS))
        knots = _knots(spans + _DEGREE, end)
        at = (np.arange(spans * _PER_KNOT) + 0.5) * end / (spans * _PER_KNOT)
        self._maps = [_rows(knots, at, order) for order in range(4)]
        self._team, self._at, self._step, self._end = team, at, end / len(at), end
        self._unknowns = np.zeros(spans + _DEGREE)
        self._robots: dict[str, tuple[Floats, Penalty]] = {}
        for name, each in team.items():
            there = np.flatnonzero((at > each.start) & (at < each.start + each.path.duration))
            sampled = np.zeros((4, len(at), 3))
            sampled[:, there] = _derivatives(each.path, at[there] - each.start)
            free = np.array([np.inf])
            scaled = sampled / each.share**_ORDERS
            self._robots[name] = scaled, Penalty(each.limits.shrunk(SAFETY), free, free)

    def fastest(self, breach: float) -> Clock:
        """Return the clock of least duration, from the one before on.

        Args:
            breach: Weight of breaches of limits against time.
        """
        with np.errstate(over="ignore", invalid="ignore"):  # of a step that went much too far, and is taken back
            found = minimize(
                self,
                self._unknowns,
                args=(breach,),
                jac=True,
                method="L-BFGS-B",
                bounds=[(None, float(np.log(_FASTEST)))] * len(self._unknowns),
                options={"maxiter": _STEPS, "maxcor": 20, "ftol": 1e-8},
            )
        self._unknowns = found.x
        return Clock(found.x, self._end)

    def corrected(self, clock: Clock, flown: Mapping[str, tuple[Spline, float]]) -> bool:
        """Keep more room where pieces exceed limits that the motion at their nodes keeps; tell whether any did."""
        any_over = False
        for name, (path, start) in flown.items():
            robot, (scaled, penalty) = self._team[name], self._robots[name]
            shares = Samples.of(path.stretched(robot.share), None, _LOOKS).shares(robot.limits)
            over = np.max([share for _, _, share in shares.values()], axis=0, initial=0.0)
            if over.max(initial=0.0) <= _OVER:
                continue
            any_over = True
            times = (start + path.knots[:-1, None] + path.durations[:, None] * np.linspace(0.0, 1.0, _LOOKS)).ravel()
            seen = np.interp(clock.flown(self._at), times, np.maximum(over.ravel(), 1.0), left=1.0, right=1.0)
            seen = maximum_filter1d(seen, 2 * _PER_KNOT + 1)
            self._robots[name] = scaled * np.sqrt(seen)[:, None] ** _ORDERS, penalty
        return any_over

    def __call__(self, unknowns: Floats, breach: float) -> tuple[float, Floats]:
        """Return the sum and its gradient."""
        u, u1, u2, u3 = (rows @ unknowns for rows in self._maps)
        p = np.exp(u)
        rates = (p, p**2 * u1, p**3 * (2.0 * u1**2 + u2), p**4 * (6.0 * u1**3 + 7.0 * u1 * u2 + u3))
        share = self._step / self._end
        value = share * (np.sum(1.0 / p) + _SMOOTH * np.sum(u2**2))
        by_rates = [np.zeros_like(p) for _ in range(4)]
        for sampled, penalty in self._robots.values():
            motion = _retimed_motion(sampled, rates)
            excess, slopes = penalty(motion, np.full((1, len(p)), breach * share))
            if excess[0] > 0.0:
                value += float(excess[0])
                for total, part in zip(by_rates, _by_rates(sampled, rates, [slope[0] for slope in slopes]), strict=True):
                    total += part
        r0, r1, r2, r3 = by_rates
        by_u = -share / p + rates[0] * r0 + 2.0 * rates[1] * r1 + 3.0 * rates[2] * r2 + 4.0 * rates[3] * r3
        by_u1 = p**2 * r1 + 4.0 * p**3 * u1 * r2 + p**4 * (18.0 * u1**2 + 7.0 * u2) * r3
        by_u2 = p**3 * r2 + 7.0 * p**4 * u1 * r3 + 2.0 * share * _SMOOTH * u2
        parts = (by_u, by_u1, by_u2, p**4 * r3)
        return float(value), np.sum([rows.T @ part for rows, part in zip(self._maps, parts, strict=True)], axis=0)


def _retimed_motion(x: Floats, rates: tuple[Floats, ...]) -> tuple[Floats, Floats, Floats, Floats]:
    """Return velocity to snap by the clock's rates, by the chain rule. Shapes (1, times, 3)."""
    p, bend, turn, more = (rate[:, None] for rate in rates)
    return (
        (x[0] * p)[None],
        (x[1] * p**2 + x[0] * bend)[None],
        (x[2] * p**3 + 3.0 * x[1] * p * bend + x[0] * turn)[None],
        (x[3] * p**4 + 6.0 * x[2] * p**2 * bend + x[1] * (3.0 * bend**2 + 4.0 * p * turn) + x[0] * more)[None],
    )


def _by_rates(x: Floats, rates: tuple[Floats, ...], slopes: list[Floats]) -> tuple[Floats, Floats, Floats, Floats]:
    """Return derivatives by the clock's rates, given those by velocity to snap. Shapes (times,)."""
    p, bend, turn, _ = (rate[:, None] for rate in rates)
    v, a, j, s = slopes
    return (
        np.sum(
            v * x[0]
            + a * x[1] * (2.0 * p)
            + j * (3.0 * x[2] * p**2 + 3.0 * x[1] * bend)
            + s * (4.0 * x[3] * p**3 + 12.0 * x[2] * p * bend + 4.0 * x[1] * turn),
            axis=1,
        ),
        np.sum(a * x[0] + j * (3.0 * x[1] * p) + s * (6.0 * x[2] * p**2 + 6.0 * x[1] * bend), axis=1),
        np.sum(j * x[0] + s * (4.0 * x[1] * p), axis=1),
        np.sum(s * x[0], axis=1),
    )


def _derivatives(path: Spline, times: Floats) -> Floats:
    """Return velocity to snap at times from the departure on. Shape (4, times, 3)."""
    piece = np.clip(np.searchsorted(path.knots, times, side="right") - 1, 0, len(path) - 1)
    local = (times - path.knots[piece])[:, None]
    return np.stack([values(path.coefficients[piece], local, order)[:, 0] for order in (1, 2, 3, 4)])


def retimed(path: Spline, start: float, clock: Retiming, most: int | None = None) -> Spline:
    """Return a robot's pieces on a clock: they meet the motion at their nodes up to jerk, and follow it between them.

    Args:
        path: By the plan's times.
        start: When it departs, s.
        clock: The team's, or its own.
        most: Pieces that it may have, where there are not more already: then it follows less closely.
    """
    nodes = path.knots
    found = _through(path, start, clock, nodes)
    for _ in range(_ROUNDS):
        times = found.knots[:-1, None] + found.durations[:, None] * _WITHIN
        begun = clock.flown(np.array([start]))
        wanted = _places(path, clock.plan(begun + times.ravel()) - start).reshape(*times.shape, -1)
        off = np.abs(found.sample(_WITHIN) - wanted).max(axis=(1, 2))
        worst = np.argsort(-off, kind="stable")[: None if most is None else max(most - len(off), 0)]
        halved = worst[off[worst] > _FOLLOWED]
        if not len(halved):
            break
        nodes = np.unique(np.concatenate([nodes, 0.5 * (nodes[:-1] + nodes[1:])[halved]]))
        found = _through(path, start, clock, nodes)
    return found


def _places(path: Spline, times: Floats) -> Floats:
    at = np.clip(times, 0.0, path.duration)
    piece = np.clip(np.searchsorted(path.knots, at, side="right") - 1, 0, len(path) - 1)
    return values(path.coefficients[piece], (at - path.knots[piece])[:, None])[:, 0]


def _through(path: Spline, start: float, clock: Retiming, nodes: Floats) -> Spline:
    """Return the pieces that meet a robot's motion on the clock at nodes, times since its departure, up to jerk."""
    rate, bend, turn = (each[:, None] for each in clock.rates(start + nodes))
    known = path.knots
    piece = np.clip(np.searchsorted(known, nodes, side="right") - 1, 0, len(path) - 1)
    local = (nodes - known[piece])[:, None]
    motion = [values(path.coefficients[piece], local, order)[:, 0] for order in range(ORDER)]
    at = np.searchsorted(known, nodes)
    exact = np.flatnonzero(known[np.clip(at, 0, len(known) - 1)] == nodes)
    for order, each in enumerate(motion):
        each[exact] = path.states[at[exact], order]
    position, velocity, acceleration, jerk = motion
    states = np.stack(
        [
            position,
            velocity * rate,
            acceleration * rate**2 + velocity * bend,
            jerk * rate**3 + 3.0 * acceleration * rate * bend + velocity * turn,
        ],
        axis=1,
    )
    return Spline(np.diff(clock.flown(start + nodes)), states)
