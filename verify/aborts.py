"""Aborts: a whole team brakes to a hover at one instant, whichever it is, and stays clear of all and of one another.

Braking is that of `verify.motion.braking`: every robot comes to rest within one length, from the state that was planned for the instant.
Robots are kept apart by branch and bound over instants and shares of the braking at once (`verify.motion.braking.pairs`). For all else the
share of the braking is cut into intervals; on each, one path in the middle is judged as a flight is, at a margin that is larger by how far
the others are from it at most. Where that is not proved the interval is cut, until the middle itself is refused or nothing is left to cut: into
halves, or into more at once where the distances that were found say that halves would not do.

Nothing is claimed of words: an abort may break the formula. What is proved is of robots that are in their tubes when the braking begins,
and follow it within the margin, too.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from verify.claims.claim import Claim, claim_of
from verify.claims.distance_claims import rim_claims, workspace_claims
from verify.claims.evidence import Evidence
from verify.claims.obstacle_claims import obstacle_claims
from verify.claims.visit_claims import closed_region_claims
from verify.data.errors import BadInput
from verify.data.mission import Mission
from verify.data.trajectory import Trajectory, check_trajectories
from verify.data.vehicle import GRAVITY
from verify.motion.braking.courses import Weights, braked, greatest, left_over, weights, weights_at
from verify.motion.braking.pairs import Meeting, closest_braking
from verify.motion.membership.statuses import statuses
from verify.motion.paths import TeamPaths, read_team
from verify.motion.separation import stretch_of

FIRST = 4
"""Intervals that the braking is cut into at first."""
_TOO_LARGE = "These coefficients are too large to tell where braking leads."

KINDS = ("limits", "workspace", "rims", "obstacles", "regions")
"""What is judged."""
FINEST = Fraction(1, 256)
"""Share of the braking below which an interval is not cut."""
MOST = 8
"""Intervals that one is cut into at most."""
_ROUNDED = 1.1
"""How much more than a power of two the intervals that seem to be needed may be before the next one is taken."""


@dataclass(frozen=True, slots=True)
class AbortVerdict:
    """Whether braking to a hover is certified from every instant; true where it is.

    Attributes:
        length: s that braking takes.
        share: Share of the braking around which it is refused; None where it is certified, or was not judged.
        refused: Claims that do not hold there; times are of the instant at which braking begins.
    """

    length: float
    share: float | None = None
    refused: tuple[Claim, ...] = ()

    def __bool__(self) -> bool:
        return not self.refused

    @property
    def sentence(self) -> str:
        """What is said of it."""
        if self.refused and (self.share is None or self.refused[0].name == "separation"):
            return f"Abort not certified: {self.refused[0].sentence}"
        if self.share is None:
            return f"Abort certified: from every instant all robots brake to a hover within {self.length:g} s, apart and clear of everything."
        times = "" if self.refused[0].time is None else " (braking that begins at the time said)"
        return f"Abort not certified: {self.share * self.length:.2f} s into braking, {self.refused[0].sentence[:-1]}{times}."


@np.errstate(all="ignore")
def judge_aborts(
    mission: Mission,
    team: Mapping[str, Trajectory],
    *,
    length: float,
    margin: float | None = None,
    clock_error: float = 0.0,
) -> AbortVerdict:
    """Decide whether a team may brake to a hover at any instant: separation, walls, rims, obstacles, closed regions and limits.

    Args:
        mission: The world, and who flies.
        team: One trajectory for each of its agents, certified.
        length: s that braking takes, each robot's the same.
        margin: delta, m; None takes the mission's.
        clock_error: How far apart the robots' clocks may be, s.

    Raises:
        BadInput: Team and mission do not belong together, or an argument is out of range.
    """
    team = check_trajectories(team)
    asked = mission.margin if margin is None else margin
    for name, value, least in (("length", length, 1e-3), ("margin", asked, 0.0), ("clock_error", clock_error, 0.0)):
        if not least <= value <= 1e6:
            raise BadInput(f"{name} must be a number from {least:g} to a million, not {value:g}.")
    asking = _Asking(mission, team, read_team(mission, team), Fraction(length), Fraction(asked), Fraction(clock_error))
    open_ = [_Part(Fraction(k, FIRST), Fraction(k + 1, FIRST), KINDS) for k in reversed(range(FIRST))]
    while open_:
        part = open_.pop()
        refused, spread = asking.judge(part)
        if refused and (spread is None or part.end - part.begin <= FINEST):
            (claims, *_) = refused.values()
            return AbortVerdict(length, float(part.middle), claims)
        counts = {kind: _count(claims, spread or 0.0) for kind, claims in refused.items()}
        for count in sorted(set(counts.values())):  # what was proved of the whole holds of what it is cut into
            open_ += part.cut(count, [kind for kind in counts if counts[kind] == count])
    meeting = asking.meeting()
    return (
        AbortVerdict(length)
        if meeting is None
        else AbortVerdict(length, meeting.shares[0], (asking.separation_claim(meeting),))
    )


@dataclass(frozen=True, slots=True)
class _Part:
    """An interval of shares of the braking, and what is still to be proved of it."""

    begin: Fraction
    end: Fraction
    kinds: tuple[str, ...]

    @property
    def middle(self) -> Fraction:
        return (self.begin + self.end) / 2

    def cut(self, count: int, kinds: Sequence[str]) -> list[_Part]:
        """Return as many equal parts, none below the finest, the last one first."""
        width = max((self.end - self.begin) / count, FINEST)
        begins = [self.begin + k * width for k in range(int((self.end - self.begin) / width))]
        return [_Part(begin, begin + width, tuple(kinds)) for begin in reversed(begins)]


def _count(claims: Iterable[Claim], spread: float) -> int:
    """Return how many intervals seem to be needed: margins grow by the spread, and may grow by what is left in the middle. A guess; each is judged."""
    needed = 2.0
    for claim in claims:
        if claim.bound is not None and claim.limit is not None:
            grown = spread * (2 if claim.name == "separation" else 1)
            left = claim.bound - (claim.limit - grown)
            needed = max(needed, grown / left if left > 0 else math.inf)
    return next((count for count in (2, 4) if needed <= _ROUNDED * count), MOST)


@dataclass(frozen=True, slots=True)
class _Asking:
    """What is asked of braking, whatever the share of it."""

    mission: Mission
    team: Mapping[str, Trajectory]
    paths: TeamPaths
    length: Fraction
    margin: Fraction
    clock_error: Fraction

    def judge(self, part: _Part) -> tuple[dict[str, tuple[Claim, ...]], float | None]:
        """Return by kind what is not proved of a part of the braking, and by how much margins grew, m; None where the middle itself is refused."""
        at, kinds = weights_at(self.length, part.middle), [kind for kind in part.kinds if kind != "limits"]
        limits = tuple(claim for claim in self._limits(part) if claim.outcome != "holds") if "limits" in part.kinds else ()
        found = {"limits": limits} if limits else {}
        if not kinds:
            return found, 0.0
        middle, rounded = self._paths_at(at)
        away = [(a - at[0], b - at[1], c - at[2]) for a, b, c in weights(self.length, part.begin, part.end)]
        spread = float((greatest(self.paths, away) + left_over(self.paths, at)).max()) + rounded
        if not math.isfinite(spread):
            raise BadInput(_TOO_LARGE)
        open_ = self._distances(middle, kinds, self.margin + Fraction(math.nextafter(spread, math.inf)))
        itself = self._distances(middle, list(open_), self.margin) if open_ else {}
        broken = {kind: claims for kind, claims in itself.items() if claims[0].outcome == "fails"}
        return (broken, None) if broken else ({**found, **open_}, spread)

    def _paths_at(self, at: Weights) -> tuple[Evidence, float]:
        """Return what is known of where robots are at a share of the braking, and how far off rounding is at most, m."""
        made = {name: braked(path, at) for name, path in self.team.items()}
        agents = {
            name: agent.model_copy(update={"start": tuple(made[name][0].coefficients[0, :3, 0].tolist()), "end": None})
            for name, agent in self.mission.agents.items()
        }
        world = self.mission.model_copy(update={"agents": agents})
        return Evidence.unplanned(world, {name: path for name, (path, _) in made.items()}), max(off for _, off in made.values())

    def _distances(self, evidence: Evidence, kinds: Sequence[str], margin: Fraction) -> dict[str, tuple[Claim, ...]]:
        """Return by kind what is refused of one share of the braking, what fails first."""
        found: dict[str, tuple[Claim, ...]] = {}
        for kind in kinds:
            refused = [claim for claim in self._claims(kind, evidence, margin) if claim.outcome != "holds"]
            if refused:
                found[kind] = tuple(sorted(refused, key=lambda claim: claim.outcome != "fails"))
        return found

    def _claims(self, kind: str, evidence: Evidence, margin: Fraction) -> Iterable[Claim]:
        if kind == "regions":
            return self._closed(evidence, margin)
        judged = {"rims": rim_claims, "obstacles": obstacle_claims, "workspace": workspace_claims}[kind]
        return judged(evidence, margin)

    def _closed(self, evidence: Evidence, margin: Fraction) -> Iterator[Claim]:
        if any(not self.mission.may_enter(robot, region) for robot in self.team for region in self.mission.all_regions):
            for robot, spans in statuses(evidence.membership, margin).items():
                yield from closed_region_claims(evidence, robot, spans)

    def meeting(self) -> Meeting | None:
        """Return two robots that are not proved to keep apart, whatever the instant and the share; None where all are."""
        robots, stretch = self.paths.robots, stretch_of(self.paths)
        asked = [
            [Fraction(self.mission.least_distance(a, b)) + 2 * self.margin * stretch if a != b else Fraction(0) for b in robots]
            for a in robots
        ]
        return closest_braking(self.paths, self.length, asked, self.clock_error)

    def separation_claim(self, meeting: Meeting) -> Claim:
        """Word what is known of two robots that are not proved to keep apart."""
        one, other = (self.paths.robots[robot] for robot in meeting.robots)
        least = self.mission.least_distance(one, other)
        limit = float(Fraction(least) + 2 * self.margin * stretch_of(self.paths))
        apart = f", with clocks up to {float(self.clock_error):g} s apart" if self.clock_error else ""
        asked = f"{limit:.4f} m are asked (separation {least:g} m, margin {float(self.margin):g} m)"
        begin, end = (share * float(self.length) for share in meeting.shares)
        if meeting.fails:
            when = f"{begin:.3f} s into braking that begins at {meeting.instants[0]:.4f} s"
            sentence = f"{one} and {other} come within {meeting.high:.4f} m of one another {when}{apart}; {asked}."
        else:
            when = f"from {begin:.3f} to {end:.3f} s into braking that begins from {meeting.instants[0]:.4f} to {meeting.instants[1]:.4f} s"
            known = f"no less than {meeting.low:.4f} m is proved" + (
                f", and they come within {meeting.high:.4f} m" if math.isfinite(meeting.high) else ""
            )
            sentence = f"it could not be proved that {one} and {other} keep apart {when}{apart}: {known}; {asked}."
        return claim_of(
            "separation", "fails" if meeting.fails else "undecided", sentence, robot=one, other=other, unit="m", time=meeting.instants[0],
            bound=meeting.low, limit=limit, margin=meeting.low - limit,
        )  # fmt: skip

    def _limits(self, part: _Part) -> Iterator[Claim]:
        """Yield limits of speed, acceleration, thrust, tilt and rates, those of attitude by what acceleration and jerk allow at most."""
        velocity, acceleration, jerk = (weights(self.length, part.begin, part.end, order) for order in (1, 2, 3))
        speeds, pushes, jerks = (greatest(self.paths, rows) for rows in (velocity, acceleration, jerk))
        forces = greatest(self.paths, acceleration, gravity=True)
        for robot, speed, push, shake, force in zip(self.team, speeds, pushes, jerks, forces, strict=True):
            limits, mass = self.mission.limits_of(robot), self.mission.vehicle_of(robot).mass
            left = max(GRAVITY - push, 1e-9)  # m/s^2 of thrust at least
            rows = (
                ("speed", speed, limits.speed, "m/s"),
                ("acceleration", push, limits.acceleration, "m/s^2"),
                ("thrust_max", mass * force, limits.thrust_max, "N"),
                ("thrust_min", -mass * left, -limits.thrust_min, "N"),
                ("tilt", math.asin(min(push / GRAVITY, 1.0)), limits.tilt, "rad"),
                ("body_rate", shake / left, limits.body_rate, "rad/s"),
            )
            for name, bound, limit, unit in rows:
                above = float(bound) * (1 + 1e-12)
                outcome = "holds" if above <= limit else "undecided"
                what = name.replace("_", " ").removesuffix(" max").removesuffix(" min")
                sentence = f"{robot}'s {what} may be {abs(above):.4g} {unit}; the limit is {abs(limit):.4g} {unit}."
                yield claim_of(f"limits.{name}", outcome, sentence, robot=robot, unit=unit, bound=above, limit=float(limit))
