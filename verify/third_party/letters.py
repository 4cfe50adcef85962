"""Claims on a mission's formula over its regions, its obstacles and rims, for flights that others planned.

The flights are handed to the rooms that judge ours, as paths of the same kind. What they planned is not known, so that internal states stay
what they are at the start, and no visits or passages are claimed.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np
from flint import fmpq_poly

from verify.arithmetic.balls import Balls, raised
from verify.claims.claim import Claim, claim_of_verdict
from verify.claims.distance_claims import rim_claims
from verify.claims.evidence import Evidence
from verify.claims.obstacle_claims import obstacle_claims
from verify.data.errors import BadInput
from verify.data.language.word import Word
from verify.data.mission import Mission
from verify.data.plan import Plan, RobotPlan, Waypoint
from verify.data.trajectory import DEGREE
from verify.data.validation.clocks import clock_error_of
from verify.model_checking.timeline import Timeline
from verify.model_checking.word_claims import judge_formula
from verify.motion.membership.statuses import changes, statuses
from verify.motion.paths import Segment, TeamPaths
from verify.third_party.audit_requirements import Asked
from verify.third_party.fleet import Fleet


@dataclass(frozen=True, eq=False)
class FleetPaths(TeamPaths):
    """A fleet's flights as a mission's team: its pieces, and a step wherever two do not join exactly.

    Attributes:
        fleet: The drones, named as the mission's agents.
    """

    fleet: Fleet

    @classmethod
    def of(cls, mission: Mission, fleet: Fleet) -> FleetPaths:
        """Read a fleet as a team.

        Args:
            mission: Whose agents the drones are.
            fleet: The drones.
        """
        segments: list[Segment] = []
        for robot, name in enumerate(mission.agents):
            drone = fleet.names.index(name)
            rows = range(int(fleet.first[drone]), int(fleet.first[drone + 1]))
            for row in rows:
                if row > rows.start and not _joins(fleet, row):
                    segments.append(Segment(robot, "step", row - 1, row, fleet.start(row), fleet.start(row)))
                segments.append(Segment(robot, "piece", row, row, fleet.start(row), fleet.stop(row)))
        return cls(mission, tuple(mission.agents), (), (), fleet.end, tuple(segments), fleet)

    @cached_property
    def positions(self) -> Balls:
        """x, y and z on every segment. Shape (segments, 3, 8)."""
        table = self.fleet.positions(np.array([segment.piece for segment in self.segments], dtype=np.intp))
        steps = np.flatnonzero([segment.kind == "step" for segment in self.segments])
        found = raised(table, DEGREE)
        share = np.arange(DEGREE + 1) / DEGREE
        for index in steps.tolist():
            ends = [self.fleet.positions(np.array([row])) for row in (self.segments[index].piece, self.segments[index].after)]
            start, stop = ends[0].mid[0, :, -1:], ends[1].mid[0, :, :1]
            found.mid[index] = start + (stop - start) * share
            error = ends[0].rad[0, :, -1:] + ends[1].rad[0, :, :1] + 8 * 2.0**-53 * (np.abs(start) + np.abs(stop))
            found.rad[index] = error * (1 + 2.0**-40) + 1e-290
        return found

    def exact_position(self, index: int) -> tuple[fmpq_poly, fmpq_poly, fmpq_poly]:
        """Return x, y and z on a segment as exact polynomials in u, from 0 to 1."""
        segment = self.segments[index]
        x, y, z = self.fleet.exactly(segment.piece)
        if segment.kind == "step":
            then = self.fleet.exactly(segment.after)
            x, y, z = (fmpq_poly([p(1), q(0) - p(1)]) for p, q in zip((x, y, z), then, strict=True))
        return x, y, z


def check_words(mission: Mission) -> None:
    """Reject a mission whose formula no flight with an end can be checked against.

    Args:
        mission: The mission.

    Raises:
        BadInput: Its trace is infinite.
    """
    if mission.spec.formula is not None and mission.spec.trace == "infinite":
        raise BadInput(
            f"Mission '{mission.name}' asks for an infinite trace, and these flights end; ask for a formula of finite traces."
        )


@np.errstate(all="ignore")
def word_claims(mission: Mission, fleet: Fleet, asked: Asked) -> Iterator[Claim]:
    """Yield the claims of obstacles, rims and, where the mission has a formula, of that.

    Args:
        mission: Whose agents the drones are.
        fleet: The drones.
        asked: Says the margin.
    """
    evidence = _evidence(mission, fleet)
    yield from obstacle_claims(evidence, asked.margin)
    yield from rim_claims(evidence, asked.margin)
    if mission.spec.formula is None:
        return
    timelines = _timelines(evidence, asked.margin)
    apart = Fraction(str(clock_error_of(mission, evidence.paths.end))) if mission.timed_parts else Fraction(0)
    for verdict in judge_formula(mission, timelines, evidence.relations, clock_error=apart):
        yield claim_of_verdict(verdict)


def _evidence(mission: Mission, fleet: Fleet) -> Evidence:
    idle = {
        name: RobotPlan(word=Word((frozenset(),)), waypoints=(Waypoint(position=agent.start, role="start"),), times=(0.0,))
        for name, agent in mission.agents.items()
    }
    return Evidence(Plan(mission=mission, robots=idle), FleetPaths.of(mission, fleet))


def _timelines(evidence: Evidence, margin: Fraction) -> dict[str, Timeline]:
    found: dict[str, Timeline] = {}
    for robot, spans in statuses(evidence.membership, margin).items():
        initial, switches = changes(spans)
        letter = evidence.plan.mission.initial_letter(robot)
        found[robot] = Timeline(robot, initial, switches, evidence.paths.end, letter)
    return found


@np.errstate(all="ignore")
def stays(mission: Mission, fleet: Fleet, margin: Fraction) -> dict[str, list[str]]:
    """Return the regions in which each drone stays, wherever it is within the margin, in the order in which its stays begin.

    Args:
        mission: Whose agents the drones are.
        fleet: The drones.
        margin: In m, exact.
    """
    found: dict[str, list[str]] = {}
    for robot, line in _timelines(_evidence(mission, fleet), margin).items():
        begun = [(Fraction(0), region) for region, status in line.initial.items() if status != "no"]
        last = dict(line.initial)
        for change in line.changes:
            if last[change.region] == "no":
                begun.append((change.time.low, change.region))
            last[change.region] = change.status
        found[robot] = [region for _, region in sorted(begun, key=lambda each: each[0])]
    return found


def _joins(fleet: Fleet, row: int) -> bool:
    """Return whether a piece begins exactly where the one before it ends."""
    if fleet.basis == "bernstein":
        return np.array_equal(fleet.values[row - 1, :, fleet.degrees[row - 1]], fleet.values[row, :, 0])
    return all(a(1) == b(0) for a, b in zip(fleet.exactly(row - 1), fleet.exactly(row), strict=True))
