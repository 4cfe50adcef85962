"""Climb and landing of an export: straight up to the starts and straight down from the ends, proved for all times.

A robot's column is the upright line between the ground (z = 0 of the laboratory) and where its flight begins, or ends. It is proved that
robots which stay within the margin of their own columns keep apart, clear of rims and obstacles, and within the workspace's walls, whoever is how
high at whatever time: nothing is said of clocks, so nothing depends on them. Who has not climbed yet, or has come down already, is in its column.

Robots are kept apart by their distance seen from above, compared without rounding. Everything else is asked of the checker, of one upright
piece a robot: what it proves for all times of that piece is proved of all places of the column. Its walls are those of the workspace but for the
lower one, which is moved below the ground. It takes as long as judging a flight of one piece.

That vehicles keep within their margin of the columns is watched in flight by who flies them. Ground effect, downwash and what lies on the ground unnamed
are not in it.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal

import numpy as np

from flight.frames import NEAR
from verify.claims.claim import Claim
from verify.claims.distance_claims import rim_claims, workspace_claims
from verify.claims.evidence import Evidence
from verify.claims.obstacle_claims import obstacle_claims
from verify.data import Mission, Trajectory
from verify.data.sections import Box
from verify.data.shapes.inequalities import Point

Name = Literal["climb", "landing"]

_AT_REST = 1e-4
"""m/s and m/s^2 that a robot may move with where its flight begins or ends."""
_BELOW = 0.01
"""m that the workspace reaches below the ground, beyond the margin."""
_WHERE = {"climb": ("start", "below its start"), "landing": ("end", "below its end")}


@dataclass(frozen=True, slots=True)
class Columns:
    """Proof of a team's climb or landing.

    Attributes:
        name: Which of them.
        faults: Why it is not certified, a sentence each; none where it is.
    """

    name: Name
    faults: tuple[str, ...]

    @property
    def certified(self) -> bool:
        """True if it is proved."""
        return not self.faults

    @property
    def sentence(self) -> str:
        """The proof's outcome as a sentence."""
        start, _ = _WHERE[self.name]
        if self.faults:
            return f"{self.name.capitalize()} not certified: {'; '.join(self.faults)}."
        way = "up from the ground (z = 0) to the starts" if start == "start" else "down from the ends to the ground (z = 0)"
        return (
            f"{self.name.capitalize()} certified: straight {way}, whoever is how high at whatever time. Robots that stay within the margin of the "
            f"upright line through their own {start} keep apart, clear of rims and obstacles, and within the workspace's walls."
        )


def columns(mission: Mission, team: Mapping[str, Trajectory], name: Name, margin: float) -> Columns:
    """Check a team's climb to its starts, or its landing from its ends.

    Args:
        mission: The world; carries the frame, by which the ground lies.
        team: What every robot of the mission flies, finite, in the mission's frame.
        name: Which of the two.
        margin: delta, m.
    """
    ground = 0.0 if mission.frame is None else -mission.frame.offset[2]
    tops: dict[str, Point] = {}
    faults: list[str] = []
    for robot in mission.agents:
        path = team[robot]
        time = 0.0 if name == "climb" else path.duration
        x, y, z = path.evaluate(time)[:3].tolist()
        tops[robot] = (x, y, z)
        speed = float(np.abs([path.evaluate(time, order)[:3] for order in (1, 2)]).max())
        if not speed <= _AT_REST:
            faults.append(f"{robot} does not hover at its {_WHERE[name][0]}")
        elif not z > ground:
            faults.append(f"{robot}'s {_WHERE[name][0]} is not above the ground")
    faults += [
        f"{one} and {other} {_WHERE[name][0]} too near to each other, seen from above"
        for one, other in _near(mission, tops, margin + 2 * NEAR)
    ]
    if not faults:
        faults += [
            _worded(claim, name) for claim in _claims(mission, tops, ground, margin + 2 * NEAR) if claim.outcome != "holds"
        ]
    return Columns(name, tuple(faults))


def _near(mission: Mission, tops: Mapping[str, Point], margin: float) -> Iterator[tuple[str, str]]:
    """Yield pairs that are too near to each other, seen from above, to be at any heights beside each other.

    A distance in z only adds to theirs, however it counts.
    """
    for one, other in itertools.combinations(tops, 2):
        squares = sum((Fraction(a) - Fraction(b)) ** 2 for a, b in zip(tops[one][:2], tops[other][:2], strict=True))
        if squares < (Fraction(mission.least_distance(one, other)) + 2 * Fraction(margin)) ** 2:
            yield one, other


@np.errstate(all="ignore")
def _claims(mission: Mission, tops: Mapping[str, Point], ground: float, margin: float) -> list[Claim]:
    """Return what the checker says of upright pieces from the ground to the tops."""
    agents = {
        robot: mission.agents[robot].model_copy(update={"start": (x, y, ground), "end": None})
        for robot, (x, y, _) in tops.items()
    }
    low = min(ground - margin - _BELOW, mission.workspace.min[2])
    world = mission.model_copy(
        update={
            "agents": agents,
            "workspace": Box(min=(*mission.workspace.min[:2], low), max=mission.workspace.max),
            "spec": mission.spec.model_copy(update={"trace": "finite", "repeat": 1}),
            "margin": margin,
        }
    )
    evidence = Evidence.unplanned(world, {robot: _upright(top, ground) for robot, top in tops.items()})
    exact = Fraction(margin)
    return [*workspace_claims(evidence, exact), *rim_claims(evidence, exact), *obstacle_claims(evidence, exact)]


def _upright(top: Point, ground: float) -> Trajectory:
    """Return a piece of one second from a place straight down to the ground; where that is rounded, it reaches below it."""
    coefficients = np.zeros((1, 4, 8))
    coefficients[0, :3, 0] = top
    coefficients[0, 2, 1] = np.nextafter(ground - top[2], -np.inf)
    return Trajectory([1.0], coefficients)


def _worded(claim: Claim, name: Name) -> str:
    """Return why a claim of a column does not hold; its times are heights, and say nothing to a person."""
    region, wall = (claim.witness.region, claim.witness.what) if claim.witness is not None else (None, "")
    what = {"workspace": f"the workspace's {wall}", "rims": f"the rim of '{region}'"}.get(claim.name, f"obstacle '{region}'")
    if claim.outcome == "undecided":
        return f"{claim.robot}, {_WHERE[name][1]}, cannot be shown to stay clear of {what}"
    found = f"{claim.bound:.3f}" if claim.bound is not None and claim.bound > 0 else "0.000"
    return f"{claim.robot}, {_WHERE[name][1]}, comes within {found} m of {what}, and {claim.limit or 0.0:.3f} m are needed"
