"""An order in which robots that fly one after another break a formula, if there is one.

Only what whole words do to the states of the formula's automaton matters. States that no words can tell apart are one
class; words that act alike on the classes are one kind; words that change nothing drop out. What is left is searched
over (class, how many of each kind still wait), which is far less than all orders or all subsets.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from verify.logic.normal_form import Normal
from verify.logic.progression import Automaton, OutOfBudget, State
from verify.trace_checking.word_graph import InTurn

_Node = tuple[State, tuple[int, ...]]


def find_bad_order(normal: Normal, graph: InTurn, budget: int) -> tuple[int, ...] | None:
    """Return kinds in an order whose concatenation breaks the formula, or None where every order satisfies it.

    Among bad orders one is chosen after whose shortest beginning every continuation is bad.

    Args:
        normal: The formula, in normal form.
        graph: Kinds of robots and how many there are of each.
        budget: Configurations of waiting robots and formula that may be met.

    Raises:
        OutOfBudget: More than `budget` configurations were met.
    """
    automaton = Automaton(normal)
    return _joint(automaton, graph, budget) if graph.joint else _own(automaton, graph, budget)


def _own(automaton: Automaton, graph: InTurn, budget: int) -> tuple[int, ...] | None:
    states, images = _images(automaton, graph, budget)
    classes = _classes([automaton.accepts(state) for state in states], images)
    size = max(classes) + 1
    member = [classes.index(c) for c in range(size)]
    acts = [tuple(classes[images[member[c]][kind]] for c in range(size)) for kind in range(len(graph.kinds))]
    accepting = [automaton.accepts(states[member[c]]) for c in range(size)]
    groups: dict[tuple[int, ...], list[int]] = {}
    idle: list[int] = []
    for kind, act in enumerate(acts):
        robots = [kind] * graph.counts[kind]
        if act == tuple(range(size)):
            idle += robots
        else:
            groups.setdefault(act, []).extend(robots)
    always = _closed(list(groups), accepting)
    never = _closed(list(groups), [not good for good in accepting])
    members = list(groups.values())
    quotient = _Quotient(classes[0], list(groups), accepting, always, never)
    found = _search(quotient, [len(m) for m in members], budget)
    if found is None:
        return None
    order = [members[group].pop() for group in found]
    return (*order, *(kind for group in members for kind in group), *idle)


@dataclass(frozen=True, slots=True)
class _Quotient:
    """The formula's automaton up to what sequences of whole words can tell apart.

    Attributes:
        start: Class of the beginning.
        acts: For each group of words that act alike: the class that each class is led to.
        accepting: Of each class whether a flight may end there.
        always: Likewise whether it and all that can follow it are accepting.
        never: Likewise whether none of these is.
    """

    start: int
    acts: Sequence[tuple[int, ...]]
    accepting: Sequence[bool]
    always: Sequence[bool]
    never: Sequence[bool]


def _images(automaton: Automaton, graph: InTurn, budget: int) -> tuple[list[State], list[list[int]]]:
    """Return the states that whole words reach (the first is the beginning) and where each kind leads from each."""
    states = [automaton.initial]
    index = {automaton.initial: 0}
    images: list[list[int]] = []
    for state in states:
        row: list[int] = []
        for word in graph.kinds:
            reached = automaton.run(word, state)
            if reached not in index:
                index[reached] = len(states)
                states.append(reached)
                if len(states) * len(graph.kinds) > budget:
                    raise OutOfBudget(f"whole words lead to more than {len(states)} states of the formula")
            row.append(index[reached])
        images.append(row)
    return states, images


def _classes(accepting: Sequence[bool], images: Sequence[Sequence[int]]) -> list[int]:
    """Return the class of each state under "no sequence of words tells them apart" (Moore)."""
    classes = _numbered([(good,) for good in accepting])
    while True:
        refined = _numbered([(classes[i], *(classes[j] for j in row)) for i, row in enumerate(images)])
        if max(refined) == max(classes):
            return refined
        classes = refined


def _numbered(keys: Sequence[tuple[int, ...]]) -> list[int]:
    numbers: dict[tuple[int, ...], int] = {}
    return [numbers.setdefault(key, len(numbers)) for key in keys]


def _closed(acts: Sequence[tuple[int, ...]], wanted: Sequence[bool]) -> list[bool]:
    """Return for each class whether it and all that words can reach from it are as wanted."""
    good = list(wanted)
    changed = True
    while changed:
        changed = False
        for i, value in enumerate(good):
            if value and not all(good[act[i]] for act in acts):
                good[i] = False
                changed = True
    return good


def _search(quotient: _Quotient, counts: Sequence[int], budget: int) -> list[int] | None:
    """Breadth first over (class, how many of each group wait); return the groups flown up to where the order is lost."""
    acts, accepting, always, never = quotient.acts, quotient.accepting, quotient.always, quotient.never
    begin = (quotient.start, tuple(counts))
    came: dict[tuple[int, tuple[int, ...]], tuple[tuple[int, tuple[int, ...]], int] | None] = {begin: None}
    queue = deque([begin])
    while queue:
        node = queue.popleft()
        where, waiting = node
        if always[where]:
            continue
        if never[where] or (not any(waiting) and not accepting[where]):
            order: list[int] = []
            step = came[node]
            while step is not None:
                order.append(step[1])
                step = came[step[0]]
            return order[::-1]
        for group, count in enumerate(waiting):
            if count:
                following = (acts[group][where], (*waiting[:group], count - 1, *waiting[group + 1 :]))
                if following not in came:
                    if len(came) >= budget:
                        raise OutOfBudget(f"more than {budget} configurations of waiting robots and formula")
                    came[following] = node, group
                    queue.append(following)
    return None


def _joint(automaton: Automaton, graph: InTurn, budget: int) -> tuple[int, ...] | None:
    """Breadth first over (what remains of the formula, waiting): what a word does depends on who has flown."""
    came: dict[_Node, tuple[_Node | None, int]] = {}
    queue: deque[_Node] = deque()

    def fly(node: _Node | None, kind: int, waiting: tuple[int, ...]) -> None:
        rest = automaton.initial if node is None else node[0]
        skip = 0 if node is None else 1
        for index in range(skip, len(graph.kinds[kind])):
            rest = automaton.step(rest, automaton.cut(graph.observation(waiting, kind, index).letter))
        following = (rest, waiting)
        if following not in came:
            if len(came) >= budget:
                raise OutOfBudget(f"more than {budget} configurations of waiting robots and formula")
            came[following] = node, kind
            queue.append(following)

    for kind, waiting in graph.next(graph.counts):
        fly(None, kind, waiting)
    while queue:
        node = queue.popleft()
        if not any(node[1]) and not automaton.accepts(node[0]):
            order: list[int] = []
            at: _Node | None = node
            while at is not None:
                at, kind = came[at]
                order.append(kind)
            return tuple(reversed(order))
        for kind, waiting in graph.next(node[1]):
            fly(node, kind, waiting)
    return None
