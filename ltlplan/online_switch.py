"""The switch condition of online MTAC-E: which part should change hands, from whom, to whom (Algorithm 5, lines 15 to 17).

A part may go to another robot when nobody has begun it, its beginning is in the decomposition set, the taker is idle and
carries what the part needs, the environment lets it go there, it is clearly cheaper, and the team can finish afterwards.
This only tells; `online.OnlineTeam` lets the giver stop and gives both robots their new courses.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from ltlplan.allocation import Itinerary, Metric, Move, World
from ltlplan.mtac import metric
from ltlplan.online_pilot import Pilot
from ltlplan.online_progress import Standing, State, can_finish
from ltlplan.team_reader import Reader
from verify.data import Letter, Mission
from verify.data.mission import Point

SWITCH_GAIN = 0.1
"""A part changes hands when that is cheaper by this share of its cost."""


@dataclass(frozen=True, slots=True)
class Handover:
    """A part that should change hands.

    Attributes:
        giver: Who has it.
        taker: Who gets it.
        kept: Visits that the giver still makes itself; the taker makes all later ones.
    """

    giver: str
    taker: str
    kept: int

    def parts(self, pilots: Mapping[str, Pilot]) -> dict[str, Itinerary]:
        """Return what both have to do afterwards, from where they are."""
        one, other = pilots[self.giver], pilots[self.taker]
        return {
            self.giver: Itinerary(one.where, one.moves[: self.kept], True),
            self.taker: Itinerary(other.where, one.moves[self.kept :], one.leaves),
        }


def better_hands(
    mission: Mission, world: World, reader: Reader, standing: Standing, pilots: Mapping[str, Pilot]
) -> Handover | None:
    """Return the hand-over that the decomposition set allows and that saves most, or None."""
    leg = metric(mission)
    best: tuple[float, Handover] | None = None
    idle = [name for name, pilot in pilots.items() if pilot.done and pilot.arrived]
    for giver, pilot in pilots.items():
        if pilot.entered or pilot.detour or not idle:
            continue
        position, letters = pilot.where.position, []
        for kept in range(len(pilot.moves)):
            rest = pilot.moves[kept:]
            own = _length(world, leg, giver, position, rest)
            divided = kept >= (1 if pilot.shown else 0) and reader.divides(frozenset(_read(reader, standing.settled, letters)))
            for taker in idle if divided else ():
                if pilots[taker].where.internal != _internal_at(pilot, kept):
                    continue  # it does not carry what the part needs
                gain = own - _length(world, leg, taker, pilots[taker].where.position, rest)
                if gain > SWITCH_GAIN * own and (best is None or gain > best[0]):
                    handover = Handover(giver, taker, kept)
                    if _may_switch(world, standing, pilots, handover):
                        best = (gain, handover)
            position = world.after(pilot.moves[kept]).position
            letters += [*pilot.moves[kept].letters, world.free_letter(pilot.moves[kept].internal)]
    return None if best is None else best[1]


def _internal_at(pilot: Pilot, kept: int) -> str:
    return pilot.moves[kept - 1].internal if kept else pilot.where.internal


def _length(world: World, leg: Metric, robot: str, position: Point, moves: tuple[Move, ...]) -> float:
    total = 0.0
    for move in moves:
        total += leg(robot, position, move.visit.region)
        position = world.after(move).position
    return total


def _may_switch(world: World, standing: Standing, pilots: Mapping[str, Pilot], handover: Handover) -> bool:
    """Tell whether the environment lets the taker go there, and whether the team can finish after the switch."""
    first = pilots[handover.giver].moves[handover.kept].visit.region
    if first not in world.neighbours.get(pilots[handover.taker].where.vertex, ()):
        return False
    ahead = {name: pilot.ahead for name, pilot in pilots.items()}
    ahead.update((name, part.ahead(world)) for name, part in handover.parts(pilots).items())
    return can_finish(standing, ahead)


def _read(reader: Reader, states: Iterable[State], letters: Iterable[Letter]) -> set[State]:
    found = set(states)
    for letter in letters:
        found = {reader.successor(state, letter) for state in found}
    return found
