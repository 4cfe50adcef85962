"""Courses for the refinement benchmarks, with their sources, and the judge's word on a flight that belongs to no mission."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from refine import Limits, Spline, quantise
from refine.spline.rounding import exact_end
from verify.claims.claim import Claim
from verify.claims.evidence import Evidence
from verify.claims.limit_claims import limit_claims
from verify.data import GRAVITY, Mission, Plan, RobotPlan, Trajectory, Vehicle, Word, load_vehicle
from verify.data.plan import Waypoint
from verify.data.sections import Agent, Box

HOOP6 = np.array([(1, 0, 0.8), (2, 1, 1), (0.5, 2, 1.3), (-1, 1, 1.1), (-0.6, -0.8, 0.9), (1, 0, 0.8)], dtype=np.float64)
"""Six points and back to the start, m. Ours. With each leg's time its length over 1 m/s the least integral of |snap|^2 is
775.1615008 (five independent solvers agree to nine digits)."""

HOOP6_SNAP = 775.1615008
HOOP6_LIMITS = Limits(speed=2.0, acceleration=8.0, thrust_max=1.9 * GRAVITY, tilt=np.pi / 4, body_rate=8.0)
HOOP6_BLEND = 7638.46
"""Least integral of |snap|^2 plus 1000 times the duration under these limits, one piece a leg, limits at 11 instants a piece."""

# The Split-S race course: Foehn, Romero, Scaramuzza, "Time-Optimal Planning for Quadrotor Waypoint Flight", Science Robotics 6
# (2021): waypoints, start, end and vehicle as published with the paper's example code. The flight starts at rest, passes
# each point within the tolerance and ends at the last with any velocity.
_LAP = [
    (-1.1, -1.6, 3.6),
    (9.2, 6.6, 1.0),
    (9.2, -4.0, 1.2),
    (-4.5, -6.0, 3.5),
    (-4.5, -6.0, 0.8),
    (4.75, -0.9, 1.2),
    (-2.8, 6.8, 1.2),
]
SPLIT_S = np.array([(-5.0, 4.5, 1.2), *_LAP, *_LAP, *_LAP[:5], (4.75, -0.9, 1.2)])
SPLIT_S_TOLERANCE = 0.3
SPLIT_S_FLOOR = 0.3
"""Lowest height, m, as the fast peers set it."""
SPLIT_S_OPTIMUM = 17.56
"""s; time-optimal, about 50 minutes of computing (the paper)."""
SPLIT_S_FAST_PEER = 17.91
"""s; the best fast method, AOS, in about 6 s (TOGT-Planner's README)."""


def racer() -> Vehicle:
    """Return the paper's vehicle; it bounds no tilt."""
    return load_vehicle("split-s-racer")


def hoop6_vehicle() -> Vehicle:
    """Return a vehicle whose limits are those of the hoop6 benchmark, with rotors that never bind."""
    return Vehicle(
        name="hoop6",
        mass=1.0,
        radius=0.1,
        arm=0.1,
        inertia=(1e-6, 1e-6, 1e-6),
        torque_to_thrust=0.1,
        rotor_thrust_min=0.0,
        rotor_thrust_max=100.0,
        thrust_min=0.1,
        thrust_max=1.9 * GRAVITY,
        speed=2.0,
        acceleration=8.0,
        tilt_deg=45.0,
        body_rate_deg=float(np.degrees(8.0)),
        yaw_rate_deg=720.0,
    )


def flown(path: Spline, yaw: Spline | None = None) -> Trajectory:
    """Return a flight in float32, as it would be exported."""
    heading = np.zeros((len(path) + 1, 4, 1)) if yaw is None else yaw.states
    return quantise(Spline(path.durations, np.concatenate([path.states, heading], axis=2)))


@np.errstate(all="ignore")  # as the judge itself does: infinities prove nothing
def limit_verdicts(flight: Trajectory, vehicle: Vehicle) -> dict[str, Claim]:
    """Return the judge's claims about the limits, for all times, by the limit's name."""
    start = tuple(float(x) for x in flight.coefficients[0, :3, 0])
    box = Box(min=(-1e3, -1e3, -1e3), max=(1e3, 1e3, 1e3))
    mission = Mission(name="benchmark", agents={"quad0": Agent(start=start)}, vehicle=vehicle, workspace=box, margin=0.0)
    robot = RobotPlan(word=Word.of([[]]), waypoints=(Waypoint(position=start, role="start"),), times=(0.0,))
    evidence = Evidence.of(Plan(mission=mission, robots={"quad0": robot}), {"quad0": flight})
    return {claim.name.removeprefix("limits."): claim for claim in limit_claims(evidence)}


def passes_points(flight: Trajectory, points: np.ndarray, tolerance: float) -> bool:
    """Tell, exactly, whether the flight's joints lie within the tolerance of the points."""
    for index in range(1, len(points) - 1):
        square = Fraction(0)
        for axis in range(3):
            end = exact_end(flight.coefficients[index - 1, axis], float(flight.durations[index - 1]))
            square += (end - Fraction(float(points[index, axis]))) ** 2
        if square > Fraction(tolerance) ** 2:
            return False
    return True
