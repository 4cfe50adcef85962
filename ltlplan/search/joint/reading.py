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
        found: dict[int, tuple[int, ...]] = {}
        letters = [[self.masks[letter] for letter in word] for word in self.graph.team.letters_of(paths)]
        for index, part in enumerate(self.parts):
            words = WordEffects(part, None)
            bad = words.failing_order([words.of(word) for word in letters])
            if bad is not None:
                found[index] = bad
        return found


Progress = tuple[int, tuple[int, ...], int, int, tuple[int, ...], tuple[tuple[int, ...], ...]]
"""Who flies, the conjuncts' states, what that robot and those who have landed hold, and for each tracked conjunct what the
flying robot's word does so far and what the words before it did."""

_NOT_YET = -1  # what a robot holds whose word has not begun


@dataclass(frozen=True, slots=True)
class _Shown:
    """State that a letter of the team leads to, in the order in which robots are followed.

    Attributes:
        states: The conjuncts' states.
        rest: A lower bound on what is left to fly.
        missing: What must still be shown, as bits.
        asked: The propositions that unfinished conjuncts speak of.
    """

    states: tuple[int, ...]
    rest: float
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
        self._words = [WordEffects(joint.parts[index], joint.contexts(joint.parts[index])) for index in tracked]
        self._orders = [
            (place, _Orders(words, index, joint.bounds))
            for place, (index, words) in enumerate(zip(tracked, self._words, strict=True))
            if joint.repeats and joint.bounds.rest[index] is not None
        ]
        initial = tuple(part.initial for part in self._parts)
        super().__init__(joint.graph, joint.bounds.tree, (0, initial, _NOT_YET, 0, (), ((),) * len(tracked)), objective)

    def read(self, progress: Progress, letter: int) -> int:
        """Return the progress, by number, after a letter of the robot that flies; `DEAD` where the task is lost."""
        robot, states, own, held, elements, before = progress
        letter, waiting = self._masks[letter], self._waiting[robot]
        shown = letter | held | waiting
        # a later robot's first letter was held, and read, all the time
        then = self._read_by_all(states, shown, own != _NOT_YET or robot == 0)
        if then is None:
            return DEAD
        if own == _NOT_YET:
            elements = tuple([words.begin(letter) for words in self._words])
        else:
            elements = tuple([words.read(element, letter) for words, element in zip(self._words, elements, strict=True)])
        rest, missing = then.rest, then.missing
        for place, bound in self._orders:
            node = then.states[bound.index], shown & self._parts[bound.index].mask
            more, needed = bound.more(elements[place], before[place], waiting & self._parts[bound.index].mask, node)
            rest, missing = rest + more, missing | needed
        if rest == UNREACHABLE:
            return DEAD
        return self._number((robot, then.states, letter & then.asked, held & then.asked, elements, before), rest, missing)

    @memoized
    def _read_by_all(self, states: tuple[int, ...], shown: int, is_new: bool) -> _Shown | None:
        """Return what a letter of the team leads to; None where the task is lost."""
        if is_new:
            states = tuple(part.step(state, shown) for part, state in zip(self._parts, states, strict=True))
            if DEAD in states:
                return None
        seen = [(state, shown & part.mask) for part, state in zip(self._parts, states, strict=True)]
        rest, missing = self._bounds(seen)
        masks = (part.mask for part, state in zip(self._parts, states, strict=True) if not part.finished(state))
        return None if rest == UNREACHABLE else _Shown(states, rest, missing, reduce(or_, masks, 0))

    def hand_over(self, progress: Progress, rest: float, missing: int, /) -> int:
        """Return the progress, by number, when a robot has landed and the next one has not begun; `DEAD` where some order is lost.

        Args:
            progress: When the robot has landed.
            rest: A lower bound on what is left then.
            missing: What must still be shown, as bits.
        """
        robot, states, own, held, elements, before = progress
        done = tuple(tuple(sorted((*those, element))) for those, element in zip(before, elements, strict=True))
        for index, (words, numbers) in enumerate(zip(self._words, done, strict=True)):
            if self._breaks(index, numbers, self._waiting[robot] & words.part.mask, False):
                return DEAD
        return self._number((robot + 1, states, _NOT_YET, held | own, (), done), rest, missing)

    def is_accepting(self, progress: Progress) -> bool:
        """Tell whether everything is done, in the order in which the robots were followed."""
        return all(part.accepting(state) for part, state in zip(self._parts, progress[1], strict=True))

    def holds_in_every_order(self, progress: Progress) -> bool:
        """Tell whether the words keep the tracked conjuncts in every order of the robots."""
        pairs = enumerate(zip(progress[5], progress[4], strict=True))
        return not any(self._breaks(i, tuple(sorted((*those, element))), 0, True) for i, (those, element) in pairs)

    @memoized
    def _breaks(self, index: int, numbers: tuple[int, ...], waiting: int, finished: bool) -> bool:
        """Tell whether some order of words breaks a tracked conjunct."""
        return self._words[index].failing_order(numbers, waiting=waiting, finished=finished) is not None


class _Orders(OrderBounds[int, Seen]):
    """Bounds for a conjunct that is read while others hold something.

    It has to be one for which reading a letter twice changes nothing. What each robot holds is known but for where robots come to rest
    that are still to fly, and there anything that may be held counts as held.
    """

    def __init__(self, words: WordEffects, index: int, bounds: ConjunctBounds[Seen]) -> None:
        super().__init__(index, bounds)
        self._words = words

    def moves(self, word: int) -> bool:
        return self._words.moved[word]

    def between(
        self, before: Sequence[int], after: Sequence[int], done: Sequence[int], waiting: int, /
    ) -> tuple[Seen, frozenset[Seen]] | None:
        words = self._words
        still = self._union(words.last, [word for word in done if not words.moved[word]], waiting)
        later = self._union(words.first, after, still)
        state = words.part.step(words.part.initial, self._union(words.first, before, later))
        for place, word in enumerate(before):
            context = self._union(words.last, before[:place], self._union(words.first, before[place + 1 :], later))
            state = words.apply(word, state, context)
        seen = state, self._union(words.last, before, later) & words.part.mask
        landed = self._union(words.last, before[:-1], 0)  # the last one is still to fly on
        return None if state == DEAD else (seen, self._goals_before(tuple(after), landed))

    @memoized
    def _goals_before(self, after: tuple[int, ...], landed: int) -> frozenset[Seen]:
        """Return from where some words lead to a goal, while those that flew before hold `landed`, or up to what is held in all."""
        words, part = self._words, self._words.part
        flown = [self._union(words.last, after[:place], 0) for place in range(len(after))]
        sure = [self._union(words.first, after[place + 1 :], own | landed) for place, own in enumerate(flown)]
        found: set[Seen] = set()
        for held in subsets(part.mask):
            states = frozenset(filter(part.accepting, part.domain))
            for word, least, own in reversed([*zip(after, sure, flown, strict=True)]):
                states = self._leading_to(word, least, own | held, states)
            found.update((state, held) for state in states)
        return frozenset(found)

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
