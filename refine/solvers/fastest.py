"""As fast as the limits allow: free times and free node states, from points alone.

The ladder: least snap at times in proportion to the straight legs, stretched until the limits hold; from there the
nonlinear programme with one piece a leg, without rotor limits and then with them; from its answer, where asked, the
programme with more pieces a leg. Each rung ends with a dense check and the small stretch that closes what lay between the
programme's instants, and the best rung is returned: never slower than uniform stretching.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from refine.limits.limits import Limits
from refine.limits.stretching import stretch_to_limits
from refine.obstacles.keep_out_bodies import Ball
from refine.planes import Plane
from refine.solvers.nlp import INSTANTS, Timing, optimise
from refine.solvers.programme import Objective
from refine.solvers.retiming import retime
from refine.spline.least_snap import minimum_snap
from refine.spline.spline import Spline
from verify.data import BadInput, Infeasible

Floats = NDArray[np.float64]

SAFETY = 2e-5
"""Share of each limit kept back after the dense check: what float32 and the samples' gaps can use up."""
_FREE_TIME_WEIGHT = 1300.0
"""Weight of time where a leg has several pieces, in units of the last answer's own snap over its time: pure time leaves
free nodes with next to nothing that holds them, and the programme wanders."""
_SNAP_SHARE = 0.01
"""Share of the objective that snap may have where points are regions or rotors are limited: nearly the shortest time,
and the programme converges in tens of steps instead of hundreds or never."""
_FASTER = 0.6
"""How much shorter than uniform stretching the answer is expected to be, for that share only."""
_COINCIDENT = 1e-6


# ten parameters: what a caller may ask for, each by its keyword
def time_optimal(
    waypoints: ArrayLike,
    limits: Limits,
    *,
    pieces: int = 1,
    objective: Objective = "time",
    weight: float = 0.0,
    tolerance: float = 0.0,
    end: Literal["rest", "free"] = "rest",
    walls: Sequence[Plane] = (),
    start: Spline | None = None,
    instants: int = INSTANTS,
) -> Spline:
    """Return a fast flight through points that keeps the limits.

    Limits hold at dense samples with a small share kept back; `verify` decides whether they hold for all times. Yaw is
    the caller's (`heading_spline`, `least_spin`): rotor limits are kept for torques about x and y in any direction, and the
    caller ends with `stretch_to_limits(path, yaw, limits)` for what yaw adds.

    Args:
        waypoints: m, at least two, neighbours apart. Shape (points, 3). The flight starts at rest.
        limits: What must hold; with `objective` "time" at least a speed or a thrust must be limited.
        pieces: Polynomial pieces a leg.
        objective: "time", or "blend": integral of |snap|^2 plus `weight` times the duration.
        weight: m^2/s^8.
        tolerance: m; the points between the first and the last may be passed within this distance.
        end: "rest", or "free": any velocity at the last point.
        walls: Planes that the whole flight stays beyond, for all times.
        start: A first guess with one piece a leg; left out: minimum snap, stretched.
        instants: A piece at which the programme keeps the limits.

    Raises:
        BadInput: Shapes or numbers are wrong, or neighbours coincide.
        Infeasible: The limits cannot be kept at any speed.
        SolverTimeout: An engine's seconds ran out before its iterations.
    """
    points = _points(waypoints)
    _require_sense(limits, objective, end, tolerance, pieces)
    course = _Course(points, limits, objective, weight, tolerance, end, tuple(walls), instants)
    guess = stretched_guess(points, course.still) if start is None else start
    best = slow = guess.stretched(stretch_to_limits(guess, None, limits, safety=SAFETY))
    answer = _with_one_piece(course, guess)
    if answer is not None:
        best = course.better(best, answer)
    if pieces > 1:
        finer = _with_pieces(course, best if answer is None else answer, pieces)
        if finer is not None:
            best = course.better(best, finer)
    if best is slow and any(_crosses(best, wall) for wall in walls):
        raise Infeasible(
            "No flight within the walls was found: the programme did not converge, and the plain path crosses one."
        )
    return best


@dataclass(frozen=True, eq=False, slots=True)
class _Course:
    """Problem of a flight through points: `time_optimal` documents each field."""

    points: Floats
    limits: Limits
    objective: Objective
    weight: float
    tolerance: float
    end: Literal["rest", "free"]
    walls: tuple[Plane, ...]
    instants: int

    @property
    def still(self) -> Limits:
        """The limits without those of rotors and yaw."""
        return replace(self.limits, rotors=None, yaw_rate=np.inf)

    def problem(self, guess: Spline, limits: Limits, objective: Objective, weight: float, *, pieces: int = 1) -> Timing:
        """Return the programme from a first guess on, with so many pieces a leg."""
        inner = range(1, len(self.points) - 1) if self.tolerance else ()
        return Timing(
            guess,
            self._fixed(pieces),
            limits,
            objective,
            weight,
            [(index * pieces, Ball("point", self.points[index], np.eye(3) / self.tolerance)) for index in inner],
            [(piece, wall) for piece in range(len(guess)) for wall in self.walls],
            instants=self.instants,
        )

    def better(self, one: Spline, other: Spline) -> Spline:
        """Return the one of less cost; the other is stretched first by what its samples break of limits that yaw does not touch."""
        other = other.stretched(stretch_to_limits(other, None, self.still, safety=SAFETY))

        def cost(path: Spline) -> float:
            return path.duration if self.objective == "time" else path.snap_cost() + self.weight * path.duration

        return other if cost(other) < cost(one) else one

    def _fixed(self, pieces: int) -> Floats:
        """Return the fixed states: points (where they are not regions), rest at the start and, where asked, at the end."""
        fixed = np.full(((len(self.points) - 1) * pieces + 1, 4, 3), np.nan)
        fixed[0, 1:] = 0.0
        if self.end == "rest":
            fixed[-1, 1:] = 0.0
        fixed[::pieces, 0] = self.points
        if self.tolerance:
            fixed[pieces:-pieces, 0] = np.nan
        return fixed


def _with_one_piece(course: _Course, guess: Spline) -> Spline | None:
    """Climb the rungs with one piece a leg: without rotor limits, then with them. None where the programme does not converge."""
    still, weight = course.still, course.weight
    time_weight = _time_weight(guess)
    answer = None
    if course.objective == "blend" or not course.tolerance:
        answer = _attempt(course.problem(guess, still, course.objective, weight))
    if answer is None and course.objective == "time":
        answer = _attempt(course.problem(guess, still, "blend", time_weight))
    if answer is None and find_spec("cvxpy") and not course.walls:  # a better first guess, at the price of one more solve
        answer = _attempt(course.problem(_retimed(guess, still), still, "blend", weight or time_weight))
    if answer is not None and course.limits.rotors is not None:
        shift = weight if course.objective == "blend" else time_weight
        answer = _attempt(course.problem(answer.stretched(1.03), course.limits, "blend", shift))
    return answer


def _with_pieces(course: _Course, first: Spline, pieces: int) -> Spline | None:
    """Climb the last rung, several pieces a leg, from a flight with one. None where the programme does not converge."""
    blend = course.objective == "blend"
    weight = course.weight if blend else _FREE_TIME_WEIGHT * first.snap_cost() / first.duration
    return _attempt(course.problem(first.stretched(1.05).split(pieces), course.limits, "blend", weight, pieces=pieces))


def _require_sense(limits: Limits, objective: Objective, end: str, tolerance: float, pieces: int) -> None:
    """Reject numbers and words that make no problem."""
    if objective == "time" and not (
        np.isfinite(limits.speed) or np.isfinite(limits.acceleration) or np.isfinite(limits.thrust_max) or limits.rotors
    ):
        raise BadInput("the shortest time needs a limit on speed, acceleration or thrust.")
    if end not in ("rest", "free"):
        raise BadInput(f"end must be 'rest' or 'free', not {end!r}.")
    if not 0.0 <= tolerance < np.inf:
        raise BadInput(f"tolerance must be a length in m, 0 or more, not {tolerance}.")
    if pieces < 1:
        raise BadInput(f"pieces must be at least 1 a leg, not {pieces}.")


def _crosses(path: Spline, wall: Plane) -> bool:
    return bool(np.min(path.sample(np.linspace(0.0, 1.0, 101)) @ wall.normal) < wall.offset)


def stretched_guess(points: Floats, limits: Limits) -> Spline:
    """Return minimum snap with times in proportion to the legs' lengths, as fast as uniform stretching allows.

    Raises:
        BadInput: The points make no minimum-snap problem.
        Infeasible: The limits cannot be kept at any speed.
    """
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    times = np.concatenate([[0.0], np.cumsum(np.maximum(lengths, 0.02 * lengths.max()))])
    path = minimum_snap(points, times)
    return path.stretched(stretch_to_limits(path, None, limits, safety=SAFETY, faster=True))


def _points(waypoints: ArrayLike) -> Floats:
    points = np.asarray(waypoints, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 3 or len(points) < 2:
        raise BadInput(f"waypoints must have shape (points, 3) with at least two points, not {points.shape}.")
    if not np.all(np.isfinite(points)):
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(points))[0])
        raise BadInput(f"waypoints[{where[0]}, {where[1]}] is {points[where]}; it must be finite.")
    apart = np.linalg.norm(np.diff(points, axis=0), axis=1)
    if apart.min() < _COINCIDENT:
        index = int(np.argmin(apart))
        raise BadInput(f"waypoints {index} and {index + 1} coincide; give a hover piece for a wait, not a repeated point.")
    return points


def _time_weight(guess: Spline) -> float:
    """Return a weight of time beside snap that leaves snap a small share of the objective."""
    expected = guess.stretched(_FASTER)
    return expected.snap_cost() / (_SNAP_SHARE * expected.duration)


def _attempt(problem: Timing) -> Spline | None:
    """Return an answer, or None where the iterations ran out: the rung below stands then."""
    try:
        return optimise(problem)
    except Infeasible:
        return None


def _retimed(guess: Spline, limits: Limits) -> Spline:
    """Return the first guess, flown faster where that programme can be solved."""
    try:
        return retime(guess, limits)
    except Infeasible:
        return guess
