"""The switch condition of online MTAC-E: which task should change hands, from whom, to whom (Algorithm 5, lines 15 to 17).

A task may go to another robot when nobody has begun it, its beginning is in the decomposition set, the taker is idle and
carries what the task needs, the environment lets it go there, it is clearly cheaper, and the team can finish afterwards.
This only tells; `online_team.OnlineTeam` lets the giver stop and gives both robots their new courses.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from operator import itemgetter

from ltlplan.mtac.admissible_heuristic import Metric
from ltlplan.mtac.agent_moves import Move, RobotTask, World
from ltlplan.mtac.decomposable_task import Reader
from ltlplan.mtac.optimality_gap import straight_line_costs
from ltlplan.online_mtac.pilot import Pilot
from ltlplan.online_mtac.possible_states import Belief, can_finish
from verify.data import Mission
from verify.data.shapes.inequalities import Point

SWITCH_GAIN = 0.1
"""A task changes hands when that is cheaper by this share of its cost."""


@dataclass(frozen=True, slots=True)
class Handover:
    """A task that should change hands.

    Attributes:
        giver: Who has it.
        taker: Who gets it.
        kept: Visits that the giver still makes itself; the taker makes all later ones.
    """

    giver: str
    taker: str
    kept: int

    def tasks(self, world: World, pilots: Mapping[str, Pilot]) -> dict[str, RobotTask]:
        """Return what both have to do afterwards, from where they are; nothing where one of them cannot do it."""
        moves = pilots[self.giver].moves
        kept = world.retraced(pilots[self.giver].where, moves[: self.kept])
        given = world.retraced(pilots[self.taker].where, moves[self.kept :])
        if kept is None or given is None:
            return {}
        return {
            self.giver: _part(world, self.giver, pilots[self.giver], kept),
            self.taker: _part(world, self.taker, pilots[self.taker], given),
        }


def _part(world: World, robot: str, pilot: Pilot, moves: tuple[Move, ...]) -> RobotTask:
    """Return a task that ends where courses end: past a hoop, at the robot's end point, or else inside the last region."""
    mission = world.mission
    leaves = True
    if moves and moves[-1].visit.region not in mission.hoops:
        end = mission.agents[robot].end
        leaves = end is not None and moves[-1].visit.region not in world.graph.layout.at(end).inside
    return RobotTask(pilot.where, moves, leaves)


def better_hands(mission: Mission, pilots: Mapping[str, Pilot], allowed: Callable[[Handover], bool]) -> Handover | None:
    """Return the hand-over that saves most of those that are allowed (see `may_change`), or None.

    Args:
        mission: Gives the costs.
        pilots: The robots in the air.
        allowed: Whether a hand-over may be.
    """
    idle = [name for name, pilot in pilots.items() if pilot.done and pilot.way.arrived]
    if not idle:
        return None
    leg = straight_line_costs(mission)
    gains: list[tuple[float, Handover]] = []
    for giver, pilot in pilots.items():
        places = [pilot.where.position, *(move.end.position for move in pilot.moves)]
        for kept, taker in itertools.product(range(len(pilot.moves)), idle):
            rest = pilot.moves[kept:]
            own = _length(leg, giver, places[kept], rest)
            gain = own - _length(leg, taker, pilots[taker].where.position, rest)
            gains += [(gain, Handover(giver, taker, kept))] if gain > SWITCH_GAIN * own else []
    gains.sort(key=itemgetter(0), reverse=True)
    return next((handover for _, handover in gains if allowed(handover)), None)


def may_change(world: World, reader: Reader, belief: Belief, pilots: Mapping[str, Pilot], handover: Handover) -> bool:
    """Tell whether a task may change hands as things are now, whatever that would cost.

    Nobody has begun it; its beginning is in the decomposition set of the automaton's present states; the taker carries what
    it needs and can go there; and the team can finish afterwards.

    Args:
        world: Moves.
        reader: The formula.
        belief: What was shown so far, and what it has led to.
        pilots: The robots in the air.
        handover: What would change hands.
    """
    giver, taker, kept = pilots[handover.giver], pilots[handover.taker], handover.kept
    if giver.entered or giver.detour or (giver.shown and not kept) or kept >= len(giver.moves):
        return False
    if taker.where.internal != (giver.moves[kept - 1].end.internal if kept else giver.where.internal):
        return False
    tasks = handover.tasks(world, pilots)
    if not tasks:
        return False
    states = reader.read(belief.settled, RobotTask(giver.where, tasks[handover.giver].moves).ahead)
    if not reader.in_decomposition_set(states, begun=belief.settled):
        return False
    ahead = {name: pilot.ahead for name, pilot in pilots.items()}
    ahead.update((name, task.ahead) for name, task in tasks.items())
    return can_finish(belief, ahead)


def _length(leg: Metric, robot: str, position: Point, moves: tuple[Move, ...]) -> float:
    places = (position, *(move.end.position for move in moves))
    return sum((leg(robot, place, move.visit.region) for place, move in zip(places, moves, strict=False)), 0.0)
