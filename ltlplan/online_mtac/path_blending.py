"""The way of one robot that is being flown and improved at the same time.

A course is the least-snap spline through points of a robot's planned path, at fixed nominal times. Three things let the course
change under a robot that is flying it, without a jump in position, velocity, acceleration or jerk:

* the path is linear in its points, so points that glide from old to new places give a path that glides;
* the glide is a polynomial of degree 7 that starts and ends with three derivatives zero;
* the robot moves along the course by a clock of its own, whose rate is a third-order lag of 1 (go) or 0 (wait), so it can
  come to rest anywhere on its path and go on.

Course (`GlidingPath`) and clock are evaluated here; what is worth flying is decided in `sharing.team` and `sharing.course_in_flight`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ltlplan.paths.sampling.least_snap_spline import LeastSnapSpline
from refine.spline.basis import derivative_rows
from verify.data import RobotPlan
from verify.data.arrays import Floats

GLIDE = 0.8
"""s over which points move from old places to new ones."""

BRAKE = 6.0
"""1/s, the clock's triple pole: from full rate a robot comes to rest within 3 / BRAKE = 0.5 s of its nominal time."""

ORDERS = 5
"""Position, velocity, acceleration, jerk and snap are handed to the controller."""


@dataclass(frozen=True, slots=True)
class Clock:
    """Position of a robot on its course: nominal time, and how fast that passes.

    Attributes:
        time: Nominal time on the course, s.
        rate: d time / dt and its first three derivatives. Shape (4,).
    """

    time: float = 0.0
    rate: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)

    @property
    def run_on(self) -> float:
        """Nominal time that still passes if the robot is told to wait now, s."""
        r, s, a, _ = self.rate
        return (3 * BRAKE**2 * r + 3 * BRAKE * s + a) / BRAKE**3

    @property
    def resting(self) -> bool:
        """Return whether the robot stands still on its course, for all that matters."""
        return abs(self.rate[0]) < 1e-2 and abs(self.rate[1]) < 5e-2

    def after(self, dt: float, go: bool) -> Clock:
        """Return the clock after `dt` seconds of going (rate to 1) or waiting (rate to 0), exactly."""
        aim = 1.0 if go else 0.0
        k = BRAKE
        # rate - aim = (c0 + c1 t + c2 t^2) exp(-k t)
        c0 = self.rate[0] - aim
        c1 = self.rate[1] + k * c0
        c2 = (self.rate[2] + 2 * k * c1 - k * k * c0) / 2
        decay = float(np.exp(-k * dt))
        slope, bend = c1 + 2 * c2 * dt, 2 * c2
        value = c0 + c1 * dt + c2 * dt * dt
        rate = (
            aim + value * decay,
            (slope - k * value) * decay,
            (bend - 2 * k * slope + k * k * value) * decay,
            (-3 * k * bend + 3 * k * k * slope - k**3 * value) * decay,
        )
        # integral of (c0 + c1 t + c2 t^2) exp(-k t) over [0, dt]
        total = (c0 / k + c1 / k**2 + 2 * c2 / k**3) - decay * (value / k + slope / k**2 + bend / k**3)
        return Clock(self.time + aim * dt + total, rate)


@dataclass(frozen=True, eq=False)
class GlidingPath:
    """A robot's path ahead, in nominal time.

    Attributes:
        plan: The plan whose waypoints these are.
        times: Nominal times of the points, s. Shape (points,).
        old: Points from which they glide, m. Shape (points, 3).
        new: Points to which they glide. Shape (points, 3).
        since: Flight time at which the glide began, s.
    """

    plan: RobotPlan
    times: Floats
    old: Floats
    new: Floats
    since: float = -np.inf
    spline: LeastSnapSpline | None = field(default=None)

    @property
    def duration(self) -> float:
        """Nominal time at the end, s."""
        return float(self.times[-1])

    @cached_property
    def stops(self) -> tuple[tuple[int, float], ...]:
        """The visits whose middles it comes to, in order, with the nominal time there, s; a start inside a region is one."""
        points = zip(self.plan.waypoints, self.plan.times, strict=True)
        return tuple((w.visit, t) for w, t in points if w.visit is not None and w.role in ("centre", "start"))

    def gliding(self, now: float) -> bool:
        """Tell whether the points are on their way to new places."""
        return now < self.since + GLIDE

    def moved(self, points: Floats, now: float) -> GlidingPath:
        """Return the course that begins at `now` to glide to other points; not while it is gliding."""
        assert not self.gliding(now), "a course glides to one place at a time"
        return replace(self, old=self.new, new=points, since=now)

    def points(self, now: float) -> Floats:
        """Points and their derivatives at a flight time while they glide. Shape (ORDERS, points, 3)."""
        result = glide(now - self.since)[:, None, None] * (self.new - self.old)
        result[0] += self.old
        return result

    def flat(self, clock: Clock, now: float) -> Floats:
        """Return the desired position, velocity, acceleration, jerk and snap. Shape (ORDERS, 3)."""
        if self.spline is None:
            result = np.zeros((ORDERS, 3))
            result[0] = self.new[0]
            return result
        time = min(max(clock.time, 0.0), self.duration)
        ended = clock.time >= self.duration
        piece = min(max(int(np.searchsorted(self.times, time, side="right")) - 1, 0), len(self.times) - 2)
        table = derivative_rows(time - self.times[piece], ORDERS)
        basis = table @ self.spline.coefficients[piece]  # (ORDERS, points): derivatives by nominal time
        if ended:
            basis[1:] = 0.0
        by_time = through_clock(basis, clock)
        if not self.gliding(now):
            return by_time @ self.new
        moving = self.points(now)
        # Leibniz: both the place on the course and the points move
        products = (
            [_BINOMIAL[order, k] * (by_time[k] @ moving[order - k]) for k in range(order + 1)] for order in range(ORDERS)
        )
        return np.array([sum(terms, np.zeros(3)) for terms in products])


def gliding_path_of(plan: RobotPlan, spline: LeastSnapSpline | None = None, points: Floats | None = None) -> GlidingPath:
    """Return the course through a plan's waypoints, or through other points of its path at times of their own.

    Args:
        plan: Whose visits are made.
        spline: Through the other points, with their times.
        points: m. Shape (points, 3).
    """
    if spline is not None and points is not None:
        return GlidingPath(plan, spline.times, points, points, spline=spline)
    times = np.array(plan.times, dtype=np.float64)
    through = np.array([w.position for w in plan.waypoints], dtype=np.float64)
    return GlidingPath(plan, times, through, through, spline=LeastSnapSpline(times) if len(times) > 1 else None)


def glide(elapsed: float) -> Floats:
    """Return the smooth step of degree 7 over GLIDE seconds, and its derivatives. Shape (ORDERS,)."""
    u = min(max(elapsed / GLIDE, 0.0), 1.0)
    return derivative_rows(u, ORDERS) @ _STEP / GLIDE ** np.arange(ORDERS)


def through_clock(basis: Floats, clock: Clock) -> Floats:
    """Turn derivatives by nominal time into derivatives by flight time (Faa di Bruno). Shape (ORDERS, n) kept."""
    r, s, a, b = clock.rate  # first to fourth derivative of nominal time
    result = np.empty_like(basis)
    result[0] = basis[0]
    result[1] = r * basis[1]
    result[2] = r * r * basis[2] + s * basis[1]
    result[3] = r**3 * basis[3] + 3 * r * s * basis[2] + a * basis[1]
    result[4] = r**4 * basis[4] + 6 * r * r * s * basis[3] + (3 * s * s + 4 * r * a) * basis[2] + b * basis[1]
    return result


_STEP = np.array([0.0, 0.0, 0.0, 0.0, 35.0, -84.0, 70.0, -20.0])
_BINOMIAL = np.array([[1, 0, 0, 0, 0], [1, 1, 0, 0, 0], [1, 2, 1, 0, 0], [1, 3, 3, 1, 0], [1, 4, 6, 4, 1]], dtype=np.float64)
