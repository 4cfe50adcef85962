"""Planning of the next flight segment: a query that another process can answer, and pure functions that answer it.

What is left is a mission of its own (`Left`), which is planned, refined and certified by `find_piece`. The piece that comes of it is then put behind all
that was flown before, beginning at an instant that is chosen first, and the whole is checked (`require_proved`). Robots hover between the two, so a
piece may be found before it is known when it begins; it is flown from the very instant with which it was checked.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction

from ltlplan.online.segments.braking import Ways
from ltlplan.pipeline import Certified, certified_team, plan
from verify.data import Mission, NotCertified
from verify.data.mission import check_mission
from verify.data.sections import Limits
from verify.flight_segments import Piece, approaches, judge_pieces


@dataclass(frozen=True, eq=False, slots=True)
class Left:
    """The rest of a flight, as a query.

    Attributes:
        mission: Begins where the robots hover, or will.
        seed: Of every draw.
        latest: Flight time at which the piece begins at the latest, exact, in s: endurances are counted as if it began then.
    """

    mission: Mission
    seed: int
    latest: Fraction


@dataclass(frozen=True, eq=False, slots=True)
class Found:
    """A certified flight of what is left; it says nothing of what was flown before.

    Attributes:
        certified: Plan, trajectories and certificate.
        ways: When robots are on their way to which regions, where limits of legs depend on it.
    """

    certified: Certified
    ways: Ways


@dataclass(frozen=True, eq=False, slots=True)
class WholeFlight:
    """All that was flown and one more piece, to be checked together.

    Attributes:
        mission: The whole formula, and every robot that ever was in the air, as it began.
        pieces: In order; the last one is new.
    """

    mission: Mission
    pieces: tuple[Piece, ...]

    @property
    def last(self) -> Piece:
        """The new piece."""
        return self.pieces[-1]


def with_endurance_left(mission: Mission, flown: Fraction) -> Mission:
    """Return a mission with endurances that are shorter by what was flown: a piece is proved to end before they do.

    Args:
        mission: Where robots hover.
        flown: s.
    """
    if mission.longest_flight is None:
        return mission
    agents = dict(mission.agents)
    for name, agent in mission.agents.items():
        endurance = mission.limits_of(name).endurance
        if endurance is not None:
            own = (agent.limits or Limits()).model_copy(update={"endurance": endurance - float(flown)})
            agents[name] = agent.model_copy(update={"limits": own})
    return mission.model_copy(update={"agents": agents})


def find_piece(left: Left) -> Found:
    """Plan, refine and certify what is left.

    Args:
        left: The question.

    Raises:
        BadInput: What is left is no sound mission.
        Unsatisfiable: Nothing that is left satisfies the formula.
        Infeasible: No trajectory keeps the limits.
        NotCertified: A proof was rejected.
    """
    certified = certified_team(plan(check_mission(left.mission), seed=left.seed), effort="soon" if left.latest else "full")
    limited = any(left.mission.leg_limits_of(name) for name in left.mission.agents)
    return Found(certified, approaches(certified.plan, certified.team) if limited else {})


def require_proved(flight: WholeFlight) -> None:
    """Reject a new piece with which the whole flight does not keep the whole formula for sure; a first piece is its own certificate.

    Args:
        flight: The new piece behind what was flown.

    Raises:
        NotCertified: The whole formula is not proved.
    """
    if len(flight.pieces) == 1:
        return
    for verdict in judge_pieces(flight.mission, flight.pieces):
        if verdict.outcome != "holds":
            raise NotCertified(f"with what was flown before: {verdict.sentence}", [verdict.witness()])


def piece_of(left: Mission, certified: Certified, start: Fraction) -> Piece:
    """Return a certified flight as a piece of a longer one.

    Args:
        left: What it was certified for.
        certified: The flight.
        start: Flight time at which it begins, exact, in s.
    """
    actions = {name: timeline.actions for name, timeline in certified.certificate.timelines.items()}
    return Piece(start, start, left, certified.team, actions)
