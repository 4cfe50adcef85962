"""Effects of words on a task, and whether they satisfy it in every order of the robots: the property `sequential`.

A word takes each state of a conjunct's automaton to another one. Words that do the same to all states are one element of the
automaton's transition monoid, and words after one another compose as maps do. So every order of the robots is tried on
elements: by dynamic programming over how many words of each element were read, not over all permutations.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Sequence

from ltlplan.logic.automaton import DEAD
from ltlplan.logic.budget import TooLarge
from ltlplan.logic.conjunct_automata import Part
from ltlplan.logic.product_automaton import Task

Element = tuple[tuple[int, ...], ...]
"""What a word does, for each conjunct: the state (or set of states, as bits) that each state is taken to."""


class TransitionMonoid:
    """Effects of words on a task's states. Words with the same effect are one element.

    Args:
        task: Whose states.
        parts: Conjuncts to look at, by index; all where None.
    """

    def __init__(self, task: Task, parts: Iterable[int] | None = None) -> None:
        self.parts = task.parts if parts is None else tuple(task.parts[index] for index in parts)
        self.identity: Element = tuple(part.identity for part in self.parts)
        self._read: dict[tuple[Element, int], Element] = {}
        self._dead: dict[Element, bool] = {}

    def is_dead(self, element: Element) -> bool:
        """Return whether words of an element lose the task when they come first."""
        found = self._dead.get(element)
        if found is None:
            found = any(part.apply(k, part.initial) == DEAD for part, k in zip(self.parts, element, strict=True))
            self._dead[element] = found
        return found

    def read(self, element: Element, letter: int) -> Element:
        """Return the element of a word with one more letter."""
        found = self._read.get((element, letter))
        if found is None:
            found = self._read[element, letter] = tuple(p.read(k, letter) for p, k in zip(self.parts, element, strict=True))
        return found

    def compose(self, first: Element, second: Element) -> Element:
        """Return the element of a word of one element followed by one of another."""
        return tuple(part.compose(a, b) for part, a, b in zip(self.parts, first, second, strict=True))

    def of(self, letters: Iterable[int]) -> Element:
        """Return the element of a word."""
        element = self.identity
        for letter in letters:
            element = self.read(element, letter)
        return element


class OrderCheck:
    """Check of the property `sequential`, conjunct by conjunct: words satisfy a task in every order.

    Args:
        task: What is to be kept.
        parts: Conjuncts to look at, by index; all where None. Elements must be of the same.
        limit: Bound on the steps of trying orders.
    """

    def __init__(self, task: Task, parts: Iterable[int] | None = None, *, limit: int = 200_000) -> None:
        self.parts = task.parts if parts is None else tuple(task.parts[index] for index in parts)
        self.limit = limit
        self._known: dict[tuple[int, tuple[tuple[tuple[int, ...], int], ...]], tuple[tuple[int, ...], ...] | None] = {}

    def failing_orders(self, elements: Sequence[Element]) -> dict[int, tuple[int, ...]]:
        """Return, for each conjunct, by index, that some order of the words breaks, such an order (indices into `elements`)."""
        found = {i: self._failing(i, part, [element[i] for element in elements], True) for i, part in enumerate(self.parts)}
        return {index: order for index, order in found.items() if order is not None}

    def failing_order(self, elements: Sequence[Element], *, finished: bool = True) -> tuple[int, ...] | None:
        """Return an order (indices into `elements`) in which the words break the task; None where every order keeps it.

        Args:
            elements: One element for each robot.
            finished: Whether the task must be accepted at the end, or only not be dead already.

        Raises:
            TooLarge: There are too many different orders to try them all.
        """
        for index, part in enumerate(self.parts):
            own = [element[index] for element in elements]
            bad = self._failing(index, part, own, finished)
            if bad is not None:
                return bad
        return None

    def _failing(self, index: int, part: Part, elements: list[tuple[int, ...]], finished: bool) -> tuple[int, ...] | None:
        counts = Counter(element for element in elements if element != part.identity)
        kept = tuple(sorted(counts.items()))
        key = (index * 2 + finished, kept)
        if key not in self._known:
            self._known[key] = self._search(part, [k for k, _ in kept], [n for _, n in kept], finished)
        bad = self._known[key]
        if bad is None:
            return None
        return robots_in_order(bad, elements)

    def _search(
        self, part: Part, elements: list[tuple[int, ...]], counts: list[int], finished: bool
    ) -> tuple[tuple[int, ...], ...] | None:
        """Walk over how many words of each element were read, keeping the states that this can lead to."""
        if all(
            part.compose(a, b) == part.compose(b, a) for i, a in enumerate(elements) for b in elements[:i]
        ):  # one order stands for all
            order = tuple(element for element, count in zip(elements, counts, strict=True) for _ in range(count))
            at = part.initial
            for element in order:
                at = DEAD if at == DEAD else part.apply(element, at)
            good = at != DEAD and (not finished or part.accepting(at))
            return None if good else order

        def apply(index: int, state: int, _: Sequence[int]) -> int:
            return part.apply(elements[index], state)

        accepting = part.accepting if finished else None
        order = breaking_order(counts, part.initial, apply, accepting, self.limit)
        return None if order is None else tuple(elements[index] for index in order)


def breaking_order(
    counts: Sequence[int],
    initial: int,
    apply: Callable[[int, int, Sequence[int]], int],
    accepting: Callable[[int], bool] | None,
    limit: int,
) -> tuple[int, ...] | None:
    """Return an order of words that breaks a conjunct, or begins one; None where every order keeps it.

    That walks over how many words of each kind were read, keeping the states that this can lead to.

    Args:
        counts: How many words there are of each kind; words of a kind do the same.
        initial: The conjunct's state before the first word.
        apply: From a kind, a state and how many words of each kind were read, to the state after one more word; `DEAD` where it is lost.
        accepting: Whether a state is accepting; None where it need not be in the end.
        limit: Bound on the steps.

    Returns:
        Indices of kinds.

    Raises:
        TooLarge: There are too many different orders to try them all.
    """
    layer: dict[tuple[tuple[int, ...], int], tuple[int, ...]] = {((0,) * len(counts), initial): ()}
    seen = 0
    for _ in range(sum(counts)):
        following: dict[tuple[tuple[int, ...], int], tuple[int, ...]] = {}
        for (used, state), order in layer.items():
            for kind, count in enumerate(counts):
                if used[kind] < count:
                    after = apply(kind, state, used)
                    if after == DEAD:
                        return (*order, kind)
                    following.setdefault(((*used[:kind], used[kind] + 1, *used[kind + 1 :]), after), (*order, kind))
        layer = following
        seen += len(layer)
        if seen > limit:
            raise TooLarge("Trying the words in every order needs", seen, "steps", limit)
    wrong = (order for (_, state), order in layer.items() if accepting is not None and not accepting(state))
    return next(wrong, None)


def robots_in_order(order: Iterable[Hashable], elements: Sequence[Hashable]) -> tuple[int, ...]:
    """Return robots (indices into `elements`, what their words do) whose elements come in this order, then all others."""
    left = list(range(len(elements)))
    found: list[int] = []
    for element in order:
        at = next(i for i in left if elements[i] == element)
        left.remove(at)
        found.append(at)
    return (*found, *left)
