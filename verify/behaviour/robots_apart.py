"""Does some team word break a formula, where one robot is read at a time? Decided without interleaving the robots.

Robots have nothing in common but the clock and the word that they are read into. Of the word only the state of `BreakingWords`
matters, and that changes at moves alone. So once it is fixed which moves are made, by whose readings and at which time, each
robot is by itself: it has to be read in each of its letters (a whole letter, what the formula cannot see included) while that
is free, or by one of its moves. The search therefore walks over states and times, and keeps for each robot the *set* of nodes
at which it may be, instead of walking over all ways to combine such nodes:

* At one time, in one state, a robot's set is closed under what is free: its letter is read where that is free, it goes on to
  a node whose span holds the time, where its letter changes only after having been read (`_Robot.closed`).
* Time goes on to the next end of a span; nodes whose spans are over drop out, and a robot without nodes ends the branch.
* A move picks a robot and one of its letters: that robot's set becomes the nodes that show it, read now; others keep theirs.

**The answer is exact.** Given the moves, what one robot does between them neither needs nor forbids anything of another, as
free readings leave the state as it is: a choice of one node from each set is always possible together, and each team word is
followed, for its readings are free or moves. Times may be taken from the ends of spans: spans that pairwise overlap share the
greatest of their beginnings, spans of nodes that follow one another touch, and beginnings never go back. To have been read
is never worse than not to have been, so a set is its nodes and those of them that may have been read. A branch whose sets all
lie within those of another one at the same time, in a state that asks for no less, is left out: whatever it can do the other can.
Nodes from which a robot could not complete its flight even if the others moved the words on at will are left out of its set
(`_Robot.hopeful`): no branch that has them ends.

**Robots that cannot matter are left out** (`that_matter`). Where all of a robot's letters are free in every state and never
move, its set never empties and it is never picked. Where they are one letter (as the formula sees it), free in every state,
picking the robot takes nothing from its set, however often: any other robot of that kind does as well, so one stands for all.
"""

from __future__ import annotations

import bisect
import itertools
import operator
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction

from verify.behaviour.breaking_words import BreakingWords
from verify.behaviour.robot_letters import RobotBehaviour, merged
from verify.behaviour.team_graph import Ranks
from verify.data.errors import InternalError
from verify.data.language.word import Letter
from verify.logic.progression import OutOfBudget

STEPS = 20
"""Sets of one robot that may be followed, for each configuration of the budget."""

_Sets = tuple[int, ...]
"""For each robot the nodes at which it may be, and after them for each robot those at which it may have been read, as bits."""


def that_matter(robots: Sequence[RobotBehaviour], words: BreakingWords) -> list[RobotBehaviour]:
    """Return the robots on which it can depend whether a word is broken, one of those that stand for each other.

    Letters are cut down to what the formula sees; where it matters that a robot is read before its letter changes in what the
    formula does not see, a number tells its whole letters apart.

    Args:
        robots: The team, with whole letters, or with letters cut down to the formula's propositions.
        words: What breaks the formula.

    Returns:
        At least one robot: where none matters any of them does.
    """
    number = {letter: i for i, letter in enumerate(words.letters)}
    seen = words.normal.propositions
    kept: list[RobotBehaviour] = []
    constant: set[Letter] = set()
    for robot in robots:
        letters = {letter & seen for letter in robot.letters}
        if all(words.dead >> number[letter] & 1 for letter in letters):
            continue
        if len(letters) == 1 and words.idle >> number[letter := next(iter(letters))] & 1:
            if letter not in constant:
                constant.add(letter)
                kept.append(_holding(robot, letter))
            continue
        kept.append(_cut(robot, words, number))
    return kept or [_holding(robots[0], robots[0].letters[0] & seen)]


def _holding(robot: RobotBehaviour, letter: Letter) -> RobotBehaviour:
    span = min(low for low, _ in robot.spans), max(high for _, high in robot.spans)
    return RobotBehaviour(robot.robot, (letter,), (span,), ((),), (0,), frozenset({0}), actions=(0,))


def _cut(robot: RobotBehaviour, words: BreakingWords, number: dict[Letter, int]) -> RobotBehaviour:
    seen = words.normal.propositions
    others: dict[Letter, int] = {}
    letters: list[Letter] = []
    for letter in robot.letters:
        cut = letter & seen
        if not words.idle >> number[cut] & 1:  # it may be in the way to read it: tell apart what must be read by itself
            rest = letter - seen
            cut |= {f"\n{others.setdefault(rest, len(others))}"} if rest else frozenset()  # a name that no proposition has
        letters.append(cut)
    return merged(replace(robot, letters=tuple(letters), actions=(0,) * len(robot)))


def some_word_breaks_apart(
    robots: Sequence[RobotBehaviour], words: BreakingWords, *, timed: bool, clock_error: Fraction = Fraction(0), budget: int
) -> bool:
    """Tell whether some team word of the robots, read one at a time, breaks the formula.

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


class _Robot:
    """One robot's nodes as bits, from each rank at which a span of its own begins, or has just ended, to the next.

    Attributes:
        starts: Those ranks; *epochs* are what lies between them, numbered as they are.
        present: For each epoch the nodes whose spans hold its times.
        hopeful: For each epoch and state of the words where the robot can be so that it can complete its flight while the
            others move the words on at their will, not having been read and having been read.
    """

    def __init__(self, robot: RobotBehaviour, words: BreakingWords, ranks: list[tuple[int, int]], last: int) -> None:
        number = {letter: i for i, letter in enumerate(words.letters)}
        seen = words.normal.propositions
        self.words = words
        self.initial = sum(1 << node for node in robot.initial)
        self.final = sum(1 << node for node in robot.final)
        self.showing = [0] * len(words.letters)
        for node, letter in enumerate(robot.letters):
            self.showing[number[letter & seen]] |= 1 << node
        self.silent = [0] * len(robot)  # targets whose letter is the same
        self.changing = [0] * len(robot)
        self.silent_before = [0] * len(robot)
        self.changing_before = [0] * len(robot)
        for node, targets in enumerate(robot.following):
            for target in targets:
                if ranks[target][0] > ranks[node][1]:
                    raise InternalError(f"{robot.robot}'s spans do not follow one another. This is a bug of ltlplan's.")
                same = robot.letters[target] == robot.letters[node]
                (self.silent if same else self.changing)[node] |= 1 << target
                (self.silent_before if same else self.changing_before)[target] |= 1 << node
        self.free = [sum(nodes for i, nodes in enumerate(self.showing) if free >> i & 1) for free in words.free]
        toggled: dict[int, int] = {}
        for node, (low, high) in enumerate(ranks):
            toggled[low] = toggled.get(low, 0) ^ 1 << node
            toggled[high + 1] = toggled.get(high + 1, 0) ^ 1 << node
        self.starts = sorted(rank for rank in toggled if rank <= last)
        self.present = list(itertools.accumulate((toggled[rank] for rank in self.starts), operator.xor))
        self.hopeful = self._hopeful()
        self.known: dict[tuple[int, int, int, int], tuple[int, int]] = {}

    def epoch(self, rank: int) -> int:
        """Return in which epoch a rank lies."""
        return bisect.bisect_right(self.starts, rank) - 1

    def closed(self, state: int, epoch: int, nodes: int, read: int) -> tuple[int, int]:
        """Return where it may be, and where it may have been read, once all that is free has been done; what has no hope left out.

        Args:
            state: Of the words; says what is free.
            epoch: Says which nodes can be held at the present time.
            nodes: Where it may be.
            read: Those of them at which it may have been read.
        """
        key = (state, epoch, nodes, read)
        found = self.known.get(key)
        if found is not None:
            return found
        present, free = self.present[epoch], self.free[state]
        nodes &= present
        read = (read | free) & nodes
        left_nodes, left_read = nodes, read  # what has come in and was not followed yet
        while left_nodes or left_read:
            more_nodes = more_read = 0
            for node in _bits(left_nodes):
                more_nodes |= self.silent[node]
            for node in _bits(left_read):
                more_nodes |= self.changing[node]
                more_read |= self.silent[node]
            more_nodes = (more_nodes | more_read) & present
            more_read = (more_read & present) | more_nodes & free
            left_nodes, left_read = more_nodes & ~nodes, more_read & ~read
            nodes |= more_nodes
            read |= more_read
        hopeful, hopeful_read = self.hopeful[epoch][state]
        read &= hopeful_read
        found = self.known[key] = nodes & hopeful | read, read
        return found

    def _hopeful(self) -> list[list[tuple[int, int]]]:
        """Go back from the end, over epochs, with what every state's moves (by whomever) leave possible."""
        words = self.words
        found: list[list[tuple[int, int]]] = []
        after = [(0, self.final if ends else 0) for ends in words.ends]
        for present in reversed(self.present):
            here = [(nodes & present, read & present) for nodes, read in after]
            work = list(range(len(here)))
            while work:
                state = work.pop()
                nodes, read = here[state]
                for letter, targets in words.moves[state].items():
                    for target in targets:
                        nodes |= here[target][0] | here[target][1] & self.showing[letter]
                        read |= here[target][1]
                nodes, read = self._completed(state, present, nodes, read)
                if (nodes, read) != here[state]:
                    here[state] = nodes, read
                    work += [state, *words.before[state]]
            found.append(here)
            after = here
        return found[::-1]

    def _completed(self, state: int, present: int, nodes: int, read: int) -> tuple[int, int]:
        """Add the nodes from which what is free leads to the given ones."""
        while True:
            more_nodes, more_read = nodes | read & self.free[state], read | nodes
            for node in _bits(more_nodes):
                more_nodes |= self.silent_before[node]
                more_read |= self.changing_before[node]
            for node in _bits(more_read):
                more_read |= self.silent_before[node]
            more_nodes &= present
            more_read &= present
            if (more_nodes, more_read) == (nodes, read):
                return nodes, read
            nodes, read = more_nodes, more_read


class _Search:
    """In depth, so that what can be broken is found soon; what was met at each time is kept."""

    def __init__(self, robots: Sequence[RobotBehaviour], words: BreakingWords, clock: Ranks, budget: int) -> None:
        self.words = words
        self.budget = budget
        self.followed = 0
        self.robots = [_Robot(robot, words, spans, clock.last) for robot, spans in zip(robots, clock.spans, strict=True)]
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


def _bits(mask: int) -> Iterator[int]:
    while mask:
        low = mask & -mask
        yield low.bit_length() - 1
        mask ^= low


def letters_of(robots: Sequence[RobotBehaviour], names: frozenset[str]) -> list[Letter]:
    """Return all that robots show of some names, in a fixed order."""
    shown = {letter & names for letter in itertools.chain.from_iterable(robot.letters for robot in robots)}
    return sorted(shown, key=sorted)
