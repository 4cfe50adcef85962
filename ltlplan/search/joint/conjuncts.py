"""One conjunct under `team: joint`: its automaton reads unions of letters, as bits, and words are read while others hold some.

A robot that flies while the others stand still shows them its word, each letter joined with what they hold (the context).
What that does to a conjunct is all that a search need remember of the word, besides its first and its last letter: what
the robot holds before and after.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property, reduce
from operator import or_

from ltlplan.logic.automaton import DEAD, Automaton
from ltlplan.logic.budget import TooLarge
from ltlplan.logic.conjunct_automata import bits
from ltlplan.logic.decision_diagrams import TRUE
from ltlplan.logic.transition_monoid import breaking_order, robots_in_order
from ltlplan.search.memoization import memoized
from ltlplan.search.numbering import Numbers

MAX_IMAGES = 4096
"""States times contexts of a conjunct up to which what words do to it is tracked."""

MAX_REPEATS = 50_000
"""States times letters of a conjunct up to which it is found out whether repeating letters matters."""

MAX_STEPS = 200_000
"""Steps of trying one conjunct in every order of the robots."""


class JointConjunct:
    """A conjunct's automaton, made deterministic where it is walked; letters are sets of propositions as bits.

    Attributes:
        mask: The propositions that matter.
        initial: The state before anything was read.
        domain: States such that what a word does to them says what it does to all: all states, or for a nondeterministic
            automaton the sets of one state. States are then such sets, as bits.
    """

    def __init__(self, automaton: Automaton, bit: Mapping[str, int]) -> None:
        self.automaton = automaton
        self._bit = {name: bit[name] for name in automaton.propositions}
        self.mask = reduce(or_, self._bit.values(), 0)
        self.deterministic = automaton.deterministic
        one = (lambda state: state) if self.deterministic else (lambda state: 1 << state)
        self.domain: tuple[int, ...] = tuple(map(one, automaton.states))
        self.initial = one(automaton.initial)
        self._final = sum(1 << state for state in automaton.accepting)
        self._done = {s for s in automaton.states if s in automaton.accepting and automaton.edges[s] == ((TRUE, s),)}

    def step(self, state: int, letter: int) -> int:
        """Return the state after a letter, or `DEAD`."""
        return DEAD if state == DEAD else self._after(state, letter & self.mask)

    @memoized
    def _after(self, state: int, seen: int) -> int:
        names = frozenset(name for name, bit in self._bit.items() if seen & bit)
        if self.deterministic:
            return next(iter(self.automaton.successors(state, names)), DEAD)
        targets = {t for at in bits(state) for t in self.automaton.successors(at, names)}
        done = targets & self._done  # accepts whatever comes, so the other states do not matter
        return sum(1 << target for target in (sorted(done)[:1] or targets)) or DEAD

    def accepting(self, state: int) -> bool:
        """Tell whether a state is accepting."""
        return state != DEAD and bool((1 << state if self.deterministic else state) & self._final)

    def finished(self, state: int) -> bool:
        """Tell whether a state accepts whatever comes."""
        return state in self._done if self.deterministic else any(state == 1 << done for done in self._done)

    def image(self, images: Sequence[int], state: int) -> int:
        """Return where a state is taken by what takes the domain to `images`."""
        if state == DEAD or self.deterministic:
            return DEAD if state == DEAD else images[state]
        return reduce(or_, (images[at] for at in bits(state) if images[at] != DEAD), 0) or DEAD

    @cached_property
    def repeats(self) -> bool:
        """Return whether reading any letter twice is the same as reading it once; False where there are too many to try."""
        if len(self.domain) << len(self._bit) > MAX_REPEATS and self._bit:
            return False
        once = ((letter, self.step(state, letter)) for letter in subsets(self.mask) for state in self.domain)
        return all(self.step(after, letter) == after for letter, after in once)


class WordEffects:
    """Effects of robots' words on one conjunct, as numbers: words with equal numbers act alike, whatever others hold.

    Args:
        part: The conjunct.
        contexts: What others may hold. None: anything; words are then told apart letter by letter.

    Attributes:
        contexts: What others may hold; empty for anything.
        first: For each number, what the robot holds before it flies.
        last: What it holds afterwards.
        moved: Whether its letter ever changes.
    """

    def __init__(self, part: JointConjunct, contexts: Sequence[int] | None) -> None:
        if contexts is not None and len(contexts) * len(part.domain) > MAX_IMAGES:
            used = len(contexts) * len(part.domain)
            raise TooLarge("Telling apart what words do to the formula takes", used, "states", MAX_IMAGES)
        self.part = part
        self.first: list[int] = []
        self.last: list[int] = []
        self.moved: list[bool] = []
        self.contexts = tuple(contexts or ())
        self._contexts = None if contexts is None else {context: i for i, context in enumerate(contexts)}
        self._acts: list[tuple[tuple[int, ...], ...]] = []  # without contexts: the word, as one tuple
        self._numbers = Numbers[tuple[int, int, bool, tuple[tuple[int, ...], ...]]]()

    @memoized
    def begin(self, letter: int) -> int:
        """Return the number of the word that is one letter."""
        letter &= self.part.mask
        return self._number(letter, letter, False, ((letter,),) if self._contexts is None else self._after(letter, None))

    def read(self, number: int, letter: int) -> int:
        """Return the number of a word with one more letter."""
        letter &= self.part.mask
        return number if letter == self.last[number] else self._longer(number, letter)

    @memoized
    def _longer(self, number: int, letter: int) -> int:
        act = self._acts[number]
        longer = ((*act[0], letter),) if self._contexts is None else self._after(letter, act)
        return self._number(self.first[number], letter, True, longer)

    def of(self, letters: Sequence[int]) -> int:
        """Return the number of a word."""
        return reduce(self.read, letters[1:], self.begin(letters[0]))

    def apply(self, number: int, state: int, context: int) -> int:
        """Return where a state is taken by a word while others hold `context`.

        Args:
            number: The word.
            state: The conjunct's state before it.
            context: What others hold meanwhile, as bits.
        """
        act = self._acts[number]
        if self._contexts is None:
            for letter in act[0]:
                state = self.part.step(state, letter | context)
            return state
        return self.part.image(act[self._contexts[context]], state)

    def failing_order(self, numbers: Sequence[int], *, waiting: int = 0, finished: bool = True) -> tuple[int, ...] | None:
        """Return an order of flying (indices into `numbers`) in which the words break the conjunct; None if every order keeps it.

        Robots whose letter never changes only hold it.

        Args:
            numbers: One word for each robot.
            waiting: What further robots hold, which have not flown yet.
            finished: Whether the conjunct must be accepted at the end, or only not be lost already.

        Raises:
            TooLarge: There are too many different orders to try them all.
        """
        part, still = self.part, waiting & self.part.mask
        counts = Counter(number for number in numbers if self.moved[number])
        for number in numbers:
            still |= 0 if self.moved[number] else self.first[number]
        elements = sorted(counts)
        begun = part.step(part.initial, reduce(or_, (self.first[element] for element in elements), still))
        if begun == DEAD:
            return tuple(range(len(numbers)))

        def apply(index: int, state: int, used: Sequence[int]) -> int:
            context = still
            for other, (element, gone) in enumerate(zip(elements, used, strict=True)):
                if gone:
                    context |= self.last[element]
                if counts[element] - gone > (index == other):
                    context |= self.first[element]
            return self.apply(elements[index], state, context)

        many = [counts[element] for element in elements]
        order = breaking_order(many, begun, apply, part.accepting if finished else None, MAX_STEPS)
        return None if order is None else robots_in_order([elements[index] for index in order], numbers)

    def _after(self, letter: int, act: tuple[tuple[int, ...], ...] | None) -> tuple[tuple[int, ...], ...]:
        """Return where the domain is taken by one more letter, for each context."""
        part, contexts = self.part, self._contexts
        assert contexts is not None
        before = (part.domain,) * len(contexts) if act is None else act
        pairs = zip(contexts, before, strict=True)
        return tuple(tuple(part.step(state, letter | context) for state in images) for context, images in pairs)

    def _number(self, first: int, last: int, moved: bool, act: tuple[tuple[int, ...], ...]) -> int:
        found = self._numbers[first, last, moved, act]
        if found == len(self._acts):
            self.first.append(first)
            self.last.append(last)
            self.moved.append(moved)
            self._acts.append(act)
        return found


def subsets(mask: int) -> Iterator[int]:
    """Yield all sets of bits within a mask."""
    at = mask
    while True:
        yield at
        if not at:
            return
        at = (at - 1) & mask
