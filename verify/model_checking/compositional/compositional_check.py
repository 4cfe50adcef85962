"""Does some team word break a formula, where one robot is read at a time? Decided without interleaving the robots.

Robots have nothing in common but the clock and the word that they are read into. Of the word only the state of `BreakingWords`
matters, and that changes at moves alone. So once it is fixed which moves are made, by whose readings and at which time, each
robot is by itself: it has to be read in each of its letters (a whole letter, what the formula cannot see included) while that
is free, or by one of its moves. The search therefore walks over states and times, and keeps for each robot the *set* of nodes
at which it may be, instead of walking over all ways to combine such nodes:

* At one time, in one state, a robot's set is closed under what is free: its letter is read where that is free, it goes on to
  a node whose span holds the time, where its letter changes only after having been read (`RobotNodes.closed`).
* Time goes on to the next end of a span; nodes whose spans are over drop out, and a robot without nodes ends the branch.
* A move picks a robot and one of its letters: that robot's set becomes the nodes that show it, read now; others keep theirs.

**The answer is exact.** Given the moves, what one robot does between them neither needs nor forbids anything of another, as
free readings leave the state as it is: a choice of one node from each set is always possible together, and each team word is
followed, for its readings are free or moves. Times may be taken from the ends of spans: spans that pairwise overlap share the
greatest of their beginnings, spans of nodes that follow one another touch, and beginnings never go back. To have been read
is never worse than not to have been, so a set is its nodes and those of them that may have been read. A branch whose sets all
lie within those of another one at the same time, in a state that asks for no less, is left out: whatever it can do the other can.
Nodes from which a robot could not complete its flight even if the others moved the words on at will are left out of its set
(`RobotNodes.hopeful`): no branch that has them ends.

Robots that cannot matter are left out (`mattering`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from verify.logic.progression import OutOfBudget
from verify.model_checking.compositional.robot_nodes import RobotNodes
from verify.model_checking.compositional.violation_automaton import BreakingWords
from verify.model_checking.robot_letters import RobotBehaviour
from verify.model_checking.team_graph import Ranks

STEPS = 20
"""Sets of one robot that may be followed, for each configuration of the budget."""

_Sets = tuple[int, ...]
"""For each robot the nodes at which it may be, and after them for each robot those at which it may have been read, as bits."""


def some_word_breaks_apart(
    robots: Sequence[RobotBehaviour], words: BreakingWords, *, timed: bool, clock_error: Fraction = Fraction(0), budget: int
) -> bool:
    """Return whether some team word of the robots, read one at a time, breaks the formula.

    Args:
        robots: The team (or the robots of it that matter).
        words: What breaks the formula; has all letters of the robots, cut down to its propositions.
        timed: Whether the spans bind; otherwise only each robot's own order does.
        clock_error: How far each robot's clock may be off, in s.
        budget: Configurations (of a state, a time and sets of nodes) that may be met.

    Raises:
        OutOfBudget: More were met.
    """
    return find_schedule(robots, words, timed=timed, clock_error=clock_error, budget=budget) is not None


@dataclass(frozen=True, slots=True)
class Moment:
    """One step of how a word comes to be broken: time goes on, or a robot's reading makes a move.

    Attributes:
        rank: The time, as a number among the ends of spans.
        state: Of the words, from here on.
        mover: Index of the robot whose reading leads to the state; None where time goes on, or words begin.
        letter: What it shows then, as a number; -1 where none is read.
    """

    rank: int
    state: int
    mover: int | None = None
    letter: int = -1


def find_schedule(
    robots: Sequence[RobotBehaviour], words: BreakingWords, *, timed: bool, clock_error: Fraction = Fraction(0), budget: int
) -> list[Moment] | None:
    """Return the moves with which some team word breaks the formula, and all times up to the end; None where none does.

    Args:
        robots: The team (or the robots of it that matter).
        words: What breaks the formula; has all letters of the robots, cut down to its propositions.
        timed: Whether the spans bind; otherwise only each robot's own order does.
        clock_error: How far each robot's clock may be off, in s.
        budget: Configurations that may be met.

    Raises:
        OutOfBudget: More were met.
    """
    return _Search(robots, words, clock_of(robots, timed=timed, clock_error=clock_error), budget).run()


def clock_of(robots: Sequence[RobotBehaviour], *, timed: bool, clock_error: Fraction) -> Ranks:
    """Return the times that bind robots to each other: none where there is only one.

    Args:
        robots: The team.
        timed: Whether the spans bind at all.
        clock_error: How far each robot's clock may be off, in s.
    """
    return Ranks.of(robots, clock_error) if timed and len(robots) > 1 else Ranks.timeless(robots)


class _Search:
    """In depth, so that what can be broken is found soon; what was met at each time is kept."""

    def __init__(self, robots: Sequence[RobotBehaviour], words: BreakingWords, clock: Ranks, budget: int) -> None:
        self.words = words
        self.budget = budget
        self.followed = 0
        self.robots = [RobotNodes(robot, words, spans, clock.last) for robot, spans in zip(robots, clock.spans, strict=True)]
        self.last = clock.last
        self.size = len(robots)
        self.changes: list[list[int]] = [[] for _ in range(clock.last + 1)]
        for index, robot in enumerate(self.robots):
            for rank in robot.starts:
                self.changes[rank].append(index)
        self.known: list[dict[int, list[_Sets]]] = [{} for _ in range(clock.last + 1)]
        self.came: list[tuple[int, Moment]] = []  # where each configuration came from
        self.work: list[tuple[int, _Sets]] = []

    def run(self) -> list[Moment] | None:
        """Follow each configuration to the next time, and first by its moves."""
        for state in self.words.initial:
            self._meet(-1, Moment(0, state), (*(robot.initial for robot in self.robots), *([0] * self.size)), range(self.size))
        while self.work:
            number, sets = self.work.pop()
            here = self.came[number][1]
            if here.state == self.words.settled or (here.rank == self.last and self._ends(here.state, sets)):
                return self._schedule(number)
            if here.rank < self.last:
                self._meet(number, Moment(here.rank + 1, here.state), sets, self.changes[here.rank + 1])
            self._move(number, here, sets)
        return None

    def _meet(self, origin: int, here: Moment, sets: _Sets, changed: Sequence[int]) -> None:
        """Keep a configuration whose sets are closed but for the robots in `changed`, unless it is known or impossible."""
        found = list(sets)
        self.followed += len(changed)
        for index in changed:
            robot = self.robots[index]
            nodes, read = robot.closed(here.state, robot.epoch(here.rank), sets[index], sets[index + self.size])
            if not nodes:
                return
            found[index], found[index + self.size] = nodes, read
        sets = tuple(found)
        layers = self.known[here.rank]
        for other in self.words.easier[here.state]:
            known = layers.get(other, ())
            self.followed += len(known)
            if any(not any(map(_beyond, sets, one)) for one in known):
                return
        if len(self.came) >= self.budget:
            raise OutOfBudget(f"more than {self.budget} configurations of team and formula")
        if self.followed > STEPS * self.budget:
            raise OutOfBudget(f"more than {STEPS * self.budget} steps of the team")
        layer = layers.setdefault(here.state, [])
        layer[:] = [one for one in layer if any(map(_beyond, one, sets))]
        layer.append(sets)
        self.work.append((len(self.came), sets))
        self.came.append((origin, here))

    def _move(self, number: int, here: Moment, sets: _Sets) -> None:
        """Make every move that is possible now."""
        for letter, targets in self.words.moves[here.state].items():
            for index, robot in enumerate(self.robots):
                picked = sets[index] & robot.showing[letter]
                if not picked:
                    continue
                after = list(sets)
                after[index] = after[index + self.size] = picked
                for target in targets:
                    self._meet(number, Moment(here.rank, target, index, letter), tuple(after), range(self.size))
                if picked == sets[index] == sets[index + self.size]:
                    break  # it takes nothing away: whatever another one's reading allows is allowed after this one's

    def _schedule(self, number: int) -> list[Moment]:
        end = self.came[number][1]
        found = [Moment(rank, end.state) for rank in range(self.last, end.rank, -1)]
        while number >= 0:
            number, moment = self.came[number]
            found.append(moment)
        return found[::-1]

    def _ends(self, state: int, sets: _Sets) -> bool:
        return self.words.ends[state] and all(
            read & robot.final for robot, read in zip(self.robots, sets[self.size :], strict=True)
        )


def _beyond(mine: int, others: int) -> int:
    return mine & ~others
