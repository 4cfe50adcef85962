"""Aborts: a whole team brakes to a hover at one instant, whichever it is, and stays clear of all and of one another.

Braking is that of `verify.motion.braking`: every robot comes to rest within one length, from the state that was planned for the instant. Distances
are proved by branch and bound over instants and shares of the braking at once (`verify.claims.braking_claims`). For limits the share is cut
into intervals, on each of which velocity, acceleration, jerk, yaw rate and rotor thrusts are bounded for all instants; where that does not do
it is cut again. Limits of single legs and endurance are no part of it.

Nothing is claimed of words: an abort may break the formula. What is proved is of robots that are in their tubes when the braking begins,
and follow it within the margin, too.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from verify.claims.braking_claims import BrakingClaims
from verify.claims.claim import Claim, claim_of, told_apart
from verify.data.errors import BadInput
from verify.data.mission import Mission
from verify.data.trajectory import Trajectory, check_trajectories
from verify.data.vehicle import GRAVITY
from verify.motion.braking.braking_polynomials import braking_motion, greatest, weights
from verify.motion.braking.surroundings import Braking
from verify.motion.paths import read_team
from verify.motion.rotors import turning_bounds

FIRST = 4
"""Intervals that the braking is cut into at first, for limits."""
FINEST = Fraction(1, 256)
"""Share of the braking below which an interval is not cut."""
COVERED = "speed, acceleration, thrust, tilt, body rate, yaw rate and rotor thrust"
"""Limits that braking is proved to keep."""
_HALVINGS = 8
"""How often a piece is halved at most for yaw rates and rotor thrusts."""


@dataclass(frozen=True, slots=True)
class AbortVerdict:
    """Verdict on braking to a hover from every instant; true where it is certified.

    Attributes:
        length: s that braking takes.
        refused: Claims that are not proved; times are of the instant at which braking begins.
    """

    length: float
    refused: tuple[Claim, ...] = ()

    def __bool__(self) -> bool:
        return not self.refused

    @property
    def sentence(self) -> str:
        """The verdict as a sentence: on what is refuted, where there is something."""
        if self.refused:
            return f"Abort not certified: {self.refused[0].sentence}"
        return (
            f"Abort certified: from every instant all robots brake to a hover within {self.length:g} s, apart and clear of everything, "
            f"within their limits of {COVERED}; limits of single legs and endurance are not covered."
        )


@np.errstate(all="ignore")
def judge_aborts(
    mission: Mission,
    team: Mapping[str, Trajectory],
    *,
    length: float,
    margin: float | None = None,
    clock_error: float = 0.0,
) -> AbortVerdict:
    """Decide whether a team may brake to a hover at any instant: separation, walls, rims, obstacles, closed regions, and limits but those of legs and endurance.

    Args:
        mission: The world, and who flies.
        team: One trajectory for each of its agents, certified.
        length: s that braking takes, each robot's the same.
        margin: delta, m; None takes the mission's.
        clock_error: How far apart the robots' clocks may be, s.

    Raises:
        BadInput: Team and mission do not belong together, an argument is out of range, or coefficients are too large to tell where
            braking leads.
    """
    team = check_trajectories(team)
    asked = mission.margin if margin is None else margin
    for name, value, least in (("length", length, 1e-3), ("margin", asked, 0.0), ("clock_error", clock_error, 0.0)):
        if not least <= value <= 1e6:
            raise BadInput(f"{name} must be a number from {least:g} to a million, not {value:g}.")
    braking = Braking(read_team(_from_its_starts(mission, team), team), Fraction(length))
    refused = [*BrakingClaims(braking, Fraction(asked), Fraction(clock_error)).refused(), *_limits(braking)]
    return AbortVerdict(length, tuple(sorted(refused, key=lambda claim: claim.outcome != "fails")))


def _from_its_starts(mission: Mission, team: Mapping[str, Trajectory]) -> Mission:
    """Return the mission with agents that begin where their flights do: that they stand there is for the certificate to say."""
    starts = {name: path.coefficients[0, :3, 0].tolist() for name, path in team.items()}
    agents = {
        name: agent.model_copy(update={"start": tuple(starts.get(name, agent.start))}) for name, agent in mission.agents.items()
    }
    return mission.model_copy(update={"agents": agents})


def _limits(braking: Braking) -> tuple[Claim, ...]:
    """Return the limits that are not proved in the first interval of the braking of which some are not, however finely it is cut."""
    open_ = [(Fraction(k, FIRST), Fraction(k + 1, FIRST)) for k in reversed(range(FIRST))]
    while open_:
        begin, end = open_.pop()
        refused = tuple(_limits_between(braking, begin, end))
        if refused and end - begin <= FINEST:
            return refused
        if refused:
            middle = (begin + end) / 2
            open_ += [(middle, end), (begin, middle)]
    return ()


def _limits_between(braking: Braking, begin: Fraction, end: Fraction) -> Iterator[Claim]:
    """Yield limits that are not proved between two shares of the braking, those of attitude by what acceleration and jerk allow at most."""
    paths, length, mission = braking.paths, braking.length, braking.paths.mission
    velocity, acceleration, jerk = (weights(length, begin, end, order) for order in (1, 2, 3))
    speeds, pushes, jerks = (greatest(paths, rows) for rows in (velocity, acceleration, jerk))
    forces = greatest(paths, acceleration, gravity=True)
    asked = [mission.limits_of(robot) for robot in paths.robots]
    turning = turning_bounds(
        paths, braking_motion(paths, length, begin, end),
        [(limits.yaw_rate, limits.rotor_thrust_min, limits.rotor_thrust_max) for limits in asked], _HALVINGS,
    )  # fmt: skip
    when = f"from {float(begin * length):.3f} to {float(end * length):.3f} s into braking"
    for index, (robot, speed, push, shake, force) in enumerate(zip(paths.robots, speeds, pushes, jerks, forces, strict=True)):
        limits, mass = asked[index], mission.vehicle_of(robot).mass
        left = max(GRAVITY - push, 1e-9)  # m/s^2 of thrust at least
        rows = (
            ("speed", speed, limits.speed, "m/s"),
            ("acceleration", push, limits.acceleration, "m/s^2"),
            ("thrust_max", mass * force, limits.thrust_max, "N"),
            ("thrust_min", -mass * left, -limits.thrust_min, "N"),
            ("tilt", math.asin(min(push / GRAVITY, 1.0)), limits.tilt, "rad"),
            ("body_rate", shake / left, limits.body_rate, "rad/s"),
            ("yaw_rate", turning.yaw_rate[index], limits.yaw_rate, "rad/s"),
            ("rotor_thrust_max", turning.greatest[index], limits.rotor_thrust_max, "N"),
            ("rotor_thrust_min", -turning.least[index], -limits.rotor_thrust_min, "N"),
        )
        for name, bound, limit, unit in rows:
            above = float(bound) + abs(float(bound)) * 1e-12
            if above <= limit:
                continue
            what, side = (
                name.replace("_", " ").removesuffix(" max").removesuffix(" min"),
                "least" if name.endswith("min") else "most",
            )
            sentence = (
                f"it could not be proved that {robot} keeps to its limit of {what} {when}: {told_apart(abs(above), abs(limit))} {unit} "
                f"at {side} is proved; the limit is {abs(limit):.5g} {unit}."
            )
            yield claim_of(f"limits.{name}", "undecided", sentence, robot=robot, unit=unit, bound=above, limit=float(limit))
