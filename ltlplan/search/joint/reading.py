"""The states of the search for `team: joint`: the conjuncts' states, what robots hold and, for tracked conjuncts, what their words do."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import accumulate
from operator import or_

from ltlplan.logic.automaton import DEAD, Automaton
from ltlplan.logic.budget import TooLarge
from ltlplan.search.bounds.conjunct_bounds import ConjunctBounds
from ltlplan.search.bounds.conjunct_graph import ConjunctGraph
from ltlplan.search.bounds.order_bounds import OrderBounds
from ltlplan.search.joint.conjuncts import JointConjunct, WordEffects, subsets
from ltlplan.search.memoization import memoized
from ltlplan.search.numbering import Numbers
from ltlplan.search.reduced_graph import ReducedGraph
from ltlplan.search.sequential_reading import Objective, SequentialReading
from ltlplan.search.team_planning import TeamTask
from ltlplan.search.team_reading import UNREACHABLE
from ltlplan.systems.transition_systems import TransitionSystem

MAX_CONTEXTS = 4096  # sets of propositions that the others may hold
MAX_MOVES = 100_000  # moves of a conjunct's graph up to which it is walked

Seen = tuple[int, int]
"""A conjunct's state and what it sees held now."""


class JointTask(TeamTask):
    """A team and the conjuncts that its robots keep together (see `team_planning.TeamTask`), with propositions as bits.

    Args:
        systems: One for each robot.
        automata: One for each conjunct.

    Attributes:
        automata: One for each conjunct.
        parts: The conjuncts.
        masks: For each letter, its propositions as bits.
        repeats: Whether it is known of all conjuncts that reading a letter twice is the same as reading it once.
        graph: The team's graph.
        bounds: On what is left of each conjunct.
        first: What each robot holds before it flies, as bits.
        share: Of the budget, one in so many states is spent on a search by sums.
        shapes: For each conjunct its automaton without names.
    """

    share = 10
    alike = False

    def __init__(self, systems: Sequence[TransitionSystem], automata: Sequence[Automaton]) -> None:
        super().__init__(systems, automata)
        self.shapes = [automaton.shape for automaton in automata]
        self.parts = tuple(JointConjunct(automaton, self._bit) for automaton in automata)
        alike: dict[int, int] = {}
        classes = [alike.setdefault(mask, letter) for letter, mask in enumerate(self.masks)]
        self.repeats = all(part.repeats for part in self.parts)
        self.graph = ReducedGraph(self._team, [False if self.repeats else None] * len(classes), classes)
        self.bounds = ConjunctBounds([_backwards(part, self.masks) for part in self.parts], self.masks, self.graph)
        self.first = [self.masks[label[start]] for label, start in zip(self._team.label, self.graph.start, strict=True)]

    def reading(self, tracked: Collection[int] = (), objective: Objective = Objective()) -> JointReading:  # noqa: B008 - frozen
        """Return what a search walks over.

        Args:
            tracked: Conjuncts, by index, that words must keep in every order.
            objective: The order on plans, and limits on robots.
        """
        return JointReading(self, sorted(tracked), objective)

    def contexts(self, part: JointConjunct) -> list[int]:
        """Return what a conjunct may see held by robots that do not fly: unions of first and last letters.

        Raises:
            TooLarge: There are too many.
        """
        ends = {mask & part.mask for mask in self.first}
        for label, system in zip(self.graph.team.label, self.graph.team.systems, strict=True):
            ends |= {self.masks[own] & part.mask for node, own in enumerate(label) if system.ending(node) is not None}
        found = {0}
        for end in ends:
            found |= {end | other for other in found}
            if len(found) > MAX_CONTEXTS:
                raise TooLarge("What robots may hold takes", len(found), "sets of propositions", MAX_CONTEXTS)
        return sorted(found)

    def failing_orders(self, paths: Sequence[Sequence[int]]) -> dict[int, tuple[int, ...]]:
        """Return, for each conjunct that some order of flying breaks, such an order.

        Args:
            paths: The nodes of each robot's system.

        Raises:
            TooLarge: There are too many different orders.
        """
        letters = [[self.masks[letter] for letter in word] for word in self.graph.team.letters_of(paths)]
        effects = (WordEffects(part, None) for part in self.parts)
        orders = (words.failing_order([words.of(word) for word in letters]) for words in effects)
        return {index: bad for index, bad in enumerate(orders) if bad is not None}


Progress = tuple[int, tuple[int, ...], int, int, tuple[int, ...]]
"""Who flies, the conjuncts' states, what that robot and those who have landed hold, and for each tracked conjunct what words do to it, by number."""

_NOT_YET = -1  # what a robot holds whose word has not begun, and what that word does


@dataclass(frozen=True, slots=True)
class _Shown:
    """State that a letter of the team leads to, in the order in which robots are followed.

    Attributes:
        states: The conjuncts' states.
        rest: A lower bound on what is left to fly.
        each: What each tracked conjunct adds to it.
        missing: What must still be shown, as bits.
        asked: The propositions that unfinished conjuncts speak of.
    """

    states: tuple[int, ...]
    rest: float
    each: tuple[float, ...]
    missing: int
    asked: int


class JointReading(SequentialReading[Progress]):
    """Progress of a team whose robots fly one after another while the others hold their letters.

    Args:
        joint: The team and its task.
        tracked: The conjuncts, by index, for which the words must also keep the task in every order.
        objective: The order on plans, and limits on robots.
    """

    def __init__(self, joint: JointTask, tracked: Sequence[int], objective: Objective) -> None:
        self._parts, self._masks, self._bounds = joint.parts, joint.masks, joint.bounds
        self._waiting = [*accumulate(reversed(joint.first[1:]), or_, initial=0)][::-1]  # held by those still to fly
        self._tracked = [_Tracked(joint, index, self._waiting) for index in tracked]
        initial = tuple(part.initial for part in self._parts)
        begun = tuple([conjunct.begin() for conjunct in self._tracked])
        super().__init__(joint.graph, joint.bounds.tree, (0, initial, _NOT_YET, 0, begun), objective)

    def read(self, progress: Progress, letter: int) -> int:
        """Return the progress, by number, after a letter of the robot that flies; `DEAD` where the task is lost."""
        robot, states, own, held, words = progress
        letter = self._masks[letter]
        # a later robot's first letter was held, and read, all the time
        then = self._read_by_all(states, letter | held | self._waiting[robot], own != _NOT_YET or robot == 0)
        if then is None:
            return DEAD
        rest, missing, after = then.rest, then.missing, list[int]()
        for conjunct, number, plain in zip(self._tracked, words, then.each, strict=True):
            number = conjunct.read(number, letter)
            left = conjunct.left[number]
            if left > plain:
                rest += left - plain
            missing |= conjunct.needed[number]
            after.append(number)
        if rest == UNREACHABLE:
            return DEAD
        return self._number((robot, then.states, letter & then.asked, held & then.asked, tuple(after)), rest, missing)

    @memoized
    def _read_by_all(self, states: tuple[int, ...], shown: int, is_new: bool) -> _Shown | None:
        """Return what a letter of the team leads to; None where the task is lost."""
        if is_new:
            states = tuple(part.step(state, shown) for part, state in zip(self._parts, states, strict=True))
            if DEAD in states:
                return None
        seen = [(state, shown & part.mask) for part, state in zip(self._parts, states, strict=True)]
        rest, missing = self._bounds(seen)
        if rest == UNREACHABLE:
            return None
        each = tuple([self._bounds.of(conjunct.index, seen[conjunct.index]) for conjunct in self._tracked])
        masks = (part.mask for part, state in zip(self._parts, states, strict=True) if not part.finished(state))
        return _Shown(states, rest, each, missing, reduce(or_, masks, 0))

    def hand_over(self, progress: Progress, rest: float, missing: int, /) -> int:
        """Return the progress, by number, when a robot has landed and the next one has not begun; `DEAD` where some order is lost.

        Args:
            progress: When the robot has landed.
            rest: A lower bound on what is left then.
            missing: What must still be shown, as bits.
        """
        robot, states, own, held, words = progress
        after = tuple([conjunct.land(number) for conjunct, number in zip(self._tracked, words, strict=True)])
        return DEAD if DEAD in after else self._number((robot + 1, states, _NOT_YET, held | own, after), rest, missing)

    def is_accepting(self, progress: Progress) -> bool:
        """Tell whether everything is done, in the order in which the robots were followed."""
        return all(part.accepting(state) for part, state in zip(self._parts, progress[1], strict=True))

    def holds_in_every_order(self, progress: Progress) -> bool:
        """Tell whether the words keep the tracked conjuncts in every order of the robots."""
        return all(conjunct.holds(number) for conjunct, number in zip(self._tracked, progress[4], strict=True))


class _Tracked:
    """Effects of robots' words on a conjunct that every order of them has to keep, as numbers.

    A number stands for the robot that flies, what its word does so far and what the words before it did.

    Args:
        joint: The team and its task.
        index: The conjunct's.
        waiting: For each robot, what those hold that fly after it.

    Attributes:
        index: The conjunct's.
        left: For each number a lower bound on what is left in the order of the words that asks for most; 0 where nothing is known.
        needed: What must still be shown, as bits.
    """

    def __init__(self, joint: JointTask, index: int, waiting: Sequence[int]) -> None:
        part = joint.parts[index]
        self.index, self._words = index, WordEffects(part, joint.contexts(part))
        self._waiting = [held & part.mask for held in waiting]
        known = joint.repeats and joint.bounds.rest[index] is not None
        self._orders = _Orders(self._words, index, joint.bounds) if known else None
        self._numbers = Numbers[tuple[int, int, tuple[int, ...]]]()
        self.left: list[float] = []
        self.needed: list[int] = []

    def begin(self) -> int:
        """Return the number where nothing was read."""
        return self._number(0, _NOT_YET, ())

    @memoized
    def read(self, number: int, letter: int) -> int:
        """Return the number after a letter of the robot that flies.

        Args:
            number: Before it.
            letter: As bits.
        """
        robot, word, before = self._numbers.known[number]
        longer = self._words.begin(letter) if word == _NOT_YET else self._words.read(word, letter)
        return self._number(robot, longer, before)

    @memoized
    def land(self, number: int) -> int:
        """Return the number when the robot that flies has landed; `DEAD` where some order of the words is lost.

        Args:
            number: Before that.
        """
        robot, word, before = self._numbers.known[number]
        done = tuple(sorted((*before, word)))
        waiting = self._waiting[robot]
        if self._words.failing_order(done, waiting=waiting, finished=False) is not None:
            return DEAD
        return self._number(robot + 1, _NOT_YET, done)

    @memoized
    def holds(self, number: int) -> bool:
        """Tell whether the words, of all robots now, keep the conjunct in every order.

        Args:
            number: When the last robot has landed.
        """
        _, word, before = self._numbers.known[number]
        return self._words.failing_order(sorted((*before, word))) is None

    def _number(self, robot: int, word: int, before: tuple[int, ...]) -> int:
        number = self._numbers[robot, word, before]
        if number == len(self.left):
            orders = None if word == _NOT_YET else self._orders
            left, needed = (0.0, 0) if orders is None else orders.left(word, before, self._waiting[robot])
            self.left.append(left)
            self.needed.append(needed)
        return number


_Begin = tuple[int, int]
"""The conjunct's state before a word, and what others hold during it, as bits."""


class _Orders(OrderBounds[int, _Begin, Seen]):
    """Bounds for a conjunct that is read while others hold something.

    It has to be one for which reading a letter twice changes nothing. What each robot holds is known but for where robots come to rest
    that are still to fly, and there anything that may be held counts as held.
    """

    def __init__(self, words: WordEffects, index: int, bounds: ConjunctBounds[Seen]) -> None:
        super().__init__(index, bounds)
        self._words = words

    def moves(self, word: int) -> bool:
        return self._words.moved[word]

    def first(self, own: int, /) -> int:
        return self._words.first[own]

    def begin(
        self, first: int, before: Sequence[int], after: Sequence[int], done: Sequence[int], waiting: int, /
    ) -> tuple[_Begin, frozenset[Seen]]:
        words = self._words
        later = self._union(words.first, after, self._union(words.last, [w for w in done if not words.moved[w]], waiting))
        landed = self._union(words.last, before, 0)
        return (self._after(tuple(before), later | first), landed | later), self._goals_before(tuple(after), landed)

    @memoized
    def _after(self, before: tuple[int, ...], later: int) -> int:
        """Return the conjunct's state after some words, while those that are read later hold `later`."""
        words = self._words
        if not before:
            return words.part.step(words.part.initial, later)
        *earlier, word = before
        state = self._after(tuple(earlier), later | words.first[word])
        return words.apply(word, state, self._union(words.last, earlier, later))

    def read(self, own: int, begin: _Begin, /) -> Seen | None:
        words, (state, held) = self._words, begin
        after = words.apply(own, state, held)
        return None if after == DEAD else (after, held | words.last[own])

    @memoized
    def _goals_before(self, after: tuple[int, ...], landed: int) -> frozenset[Seen]:
        """Return from where some words lead to a goal, while those that flew before hold `landed`, or up to what is held in all."""
        return frozenset(
            (state, held) for held in subsets(self._words.part.mask) for state in self._states_before(after, landed, held)
        )

    @memoized
    def _states_before(self, after: tuple[int, ...], least: int, most: int) -> frozenset[int]:
        """Return the states from which some words may lead to a goal, while others hold what they hold at the least and at the most."""
        if not after:
            return frozenset(filter(self._words.part.accepting, self._words.part.domain))
        (word, *later), words = after, self._words
        sure = self._union(words.first, later, least)
        if sure & ~most:
            return frozenset()
        last = words.last[word]
        return self._leading_to(word, sure, most, self._states_before(tuple(later), least | last, most | last))

    @memoized
    def _leading_to(self, word: int, least: int, most: int, goals: frozenset[int]) -> frozenset[int]:
        """Return the states from which a word may lead to one of some, while others hold what they hold at the least and at the most."""
        words = self._words
        contexts = [context for context in words.contexts if not (least & ~context or context & ~most)]
        return frozenset(
            state for state in words.part.domain if any(words.apply(word, state, context) in goals for context in contexts)
        )

    @staticmethod
    def _union(held: Sequence[int], words: Sequence[int], others: int) -> int:
        return reduce(or_, (held[word] for word in words), others)


def _backwards(part: JointConjunct, masks: Sequence[int]) -> ConjunctGraph[Seen] | None:
    """Return a conjunct's graph: of what is held, any part may stay, and one robot's letter is added; None where there are too many moves."""
    letters = sorted({mask & part.mask for mask in masks})
    if not part.deterministic or len(part.domain) * len(letters) * 4 ** part.mask.bit_count() > MAX_MOVES:
        return None
    back: dict[Seen, list[tuple[Seen, int]]] = defaultdict(list)
    for held in subsets(part.mask):
        for state in part.domain:
            for letter in letters:
                for stays in subsets(held):
                    after = part.step(state, letter | stays)
                    if after != DEAD:
                        back[after, letter | stays].append(((state, held), letter))
    nodes = [(state, held) for state in part.domain for held in subsets(part.mask)]
    goals = frozenset(node for node in nodes if part.accepting(node[0]))
    return ConjunctGraph(nodes, back, goals, part.mask, {letter for letter in letters if letter})
