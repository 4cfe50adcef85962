"""Recordings of hand-made flights, and continuous paths that agree with them: what a judge of samples is held against."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

from tests.helpers.motion.flights import firefighting, legs, plan_of, through
from verify import Certificate, FlightReference, FlightVerdict, Samples, certify, check_flight
from verify.data import Mission, Plan, Trajectory
from verify.data.files.mission_file import parse_mission
from verify.data.plan import Visit
from verify.recordings.planned_paths import PlannedPath

SEQUENCE = """
format: 1
name: sequence
sequence: gate0F gate1R
hoops:
  gate0: {center: [0.0, 0.0, 1.0], radii: [0.25, 0.25, 0.25], opening: 0.25, rim: 0.03}
  gate1: {center: [1.2, 0.0, 1.0], radii: [0.25, 0.25, 0.25], opening: 0.25, rim: 0.03, yaw_deg: 180}
agents: {quad0: {start: [-0.8, 0.0, 1.0]}}
vehicle: crazyflie-2.1
workspace: {min: [-1.6, -1.6, 0.2], max: [2.2, 1.6, 1.8]}
margin: 0.05
"""


def along_x(end: float = 10.0) -> PlannedPath:
    """Return a plan that goes along x at 1 m/s, at once, and stops."""
    coefficients = np.zeros((1, 3, 8))
    coefficients[0, 0, 1] = 1.0
    knots = np.array([0.0, end])
    return PlannedPath("r0", knots, coefficients, 1.0, 0.0, knots, np.zeros(2), np.ones(2))


@cache
def fires() -> tuple[Plan, dict[str, Trajectory], Certificate]:
    """The fire-fighting flight by hand, certified."""
    plan, team = firefighting()
    return plan, team, certify(plan, team)


@cache
def gates() -> tuple[Plan, dict[str, Trajectory], Certificate]:
    """A flight of a sequence of two passages through gates that stand behind each other, certified; it has no formula."""
    mission: Mission = parse_mission(SEQUENCE)
    points = [mission.agents["quad0"].start, *through(mission, "gate0"), *through(mission, "gate1", "R")]
    visits = (Visit(region="gate0", direction="F"), Visit(region="gate1", direction="R"))
    plan, team = plan_of(mission, {"quad0": visits}), {"quad0": legs(points)}
    return plan, team, certify(plan, team)


def asked(made: tuple[Plan, dict[str, Trajectory], Certificate]) -> FlightReference:
    """Ask everything that a certified flight claims of paths."""
    plan, team, certificate = made
    return FlightReference.of_certificate(certificate, team, plan)


def recorded(
    made: tuple[Plan, dict[str, Trajectory], Certificate],
    change: Callable[[str, np.ndarray, np.ndarray], np.ndarray] = lambda robot, times, places: places,
    *,
    rate: float = 100.0,
    begin: float = 0.0,
    end: float | None = None,
) -> Samples:
    """Return the planned flight as if it had been recorded, changed by robot."""
    plan, team, certificate = made
    times = np.arange(begin, (certificate.duration if end is None else end) + 0.5 / rate, 1 / rate)
    places = {name: change(name, times, team[name].evaluate(times)[:, :3]) for name in plan.mission.agents}
    return Samples(times, places)


def claims(verdict: FlightVerdict) -> dict[str, set[str]]:
    """Return for each kind of claim the outcomes that robots have."""
    found: dict[str, set[str]] = {}
    for claim in verdict.claims:
        found.setdefault(claim.name, set()).add(claim.outcome)
    return found


def refused(verdict: FlightVerdict, name: str):
    """Return the witness of the first claim of a kind that is broken."""
    return next(claim.witness for claim in verdict.claims if claim.name == name and claim.outcome == "fails")


def judged(made, samples: Samples, *, max_speed: float = 1.2, start: float | None = 0.0, error: float = 0.0) -> FlightVerdict:
    """Judge a recording of a certified flight."""
    return check_flight(samples, asked(made), max_speed=max_speed, start=start, error=error)


def darting(
    times: np.ndarray, places: np.ndarray, speed: float, rng: np.random.Generator, share: float = 0.5
) -> tuple[np.ndarray, np.ndarray]:
    """Return a continuous path through samples that is never faster than `speed`: times and corners of straight lines.

    In a share of the gaps it goes as far aside as the speed allows and comes back: to a point of the ellipsoid around the chord.
    """
    at, corners = [times[0]], [places[0]]
    for k in range(len(times) - 1):
        first, last, length = places[k], places[k + 1], speed * (times[k + 1] - times[k]) * (1 - 1e-9)
        chord = last - first
        if rng.random() < share and np.linalg.norm(chord) < length:
            wide = np.sqrt(length**2 - chord @ chord) / 2
            along = rng.uniform(-0.99, 0.99)
            aside = rng.normal(size=3)
            direction = chord / max(np.linalg.norm(chord), 1e-12)
            aside -= (aside @ direction) * direction
            aside /= np.linalg.norm(aside)
            via = (first + last) / 2 + along * length / 2 * direction + np.sqrt(1 - along**2) * wide * aside
            there, back = np.linalg.norm(via - first), np.linalg.norm(last - via)
            at.append(times[k] + (times[k + 1] - times[k]) * there / (there + back))
            corners.append(via)
        at.append(times[k + 1])
        corners.append(last)
    return np.array(at), np.array(corners)


def dense(times: np.ndarray, at: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return positions of such a path at many times."""
    return np.stack([np.interp(times, at, corners[:, i]) for i in range(3)], axis=1)


def aside(by, middle, *, robot="quad0", width=0.6):
    """Return a change that moves a robot aside smoothly, most of all in the middle."""

    def change(name, times, places):
        bump = np.exp(-(((times - middle) / width) ** 2))
        return places + bump[:, None] * np.array(by) if name == robot else places

    return change
