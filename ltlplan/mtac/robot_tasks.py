"""A robot's share of the formula: the visits that it is given, in order, and what it shows by them."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ltlplan.allocation import Itinerary
from ltlplan.mtac.agent_moves import AgentState, Move, World
from ltlplan.systems.visit_log import VisitLog
from verify.data import Letter, Visit, Word


@dataclass(frozen=True, slots=True)
class RobotTask:
    """A robot's share of the formula as visits, from where it is; MTAC-E walks and hands over tasks.

    Attributes:
        where: Where it begins.
        moves: Its visits, in order.
        leaves: Whether it flies out of the last region; False where the formula wants it to end inside.
    """

    where: AgentState
    moves: tuple[Move, ...] = ()
    leaves: bool = True

    @property
    def visits(self) -> tuple[Visit, ...]:
        """Regions as they are entered, with actions; a robot that begins inside regions begins with visits of them."""
        return self._log().visits

    @property
    def end(self) -> AgentState:
        """Where the robot is after its last visit's actions, still inside."""
        return self.moves[-1].end if self.moves else self.where

    @property
    def ahead(self) -> tuple[Letter, ...]:
        """The letters after the present one."""
        letters = [letter for move in self.moves for letter in move.shown]
        if self.moves and self.leaves and self.moves[-1].left is not None:
            letters.append(self.moves[-1].left)
        return tuple(letters)

    def itinerary(self, world: World) -> Itinerary:
        """Return what the robot does, with the word that it shows."""
        log = self._log()
        word = Word((world.letter(self.where), *self.ahead)).compressed()
        return Itinerary(log.visits, word, stops=log.stops)

    def then(self, move: Move, leaves: bool) -> RobotTask:
        """Return the task with one more visit."""
        return replace(self, moves=(*self.moves, move), leaves=leaves)

    def _log(self) -> VisitLog:
        log = self.where.log()
        for move in self.moves:
            for regions in move.regions:
                log.enter(regions)
            if not move.in_place:
                log.stop(move.visit.region)
            for action in move.visit.actions:
                log.act(action)
        if self.moves and self.leaves and (left := self.moves[-1].left) is not None:
            log.enter(left & self.end.inside)
        return log
