"""Does every team word satisfy the formula? Decided twice: by our progression and by Spot.

Our search walks graph and automaton together, breadth first in the number of readings, so that the first word found
that ends badly is a shortest one. Spot gets the same graph as an automaton and intersects it with its own translation
of the negated formula. The two must agree.
"""

from __future__ import annotations

import itertools
from collections import OrderedDict
from collections.abc import Hashable, Iterable
from dataclasses import dataclass

from verify.data.errors import InternalError
from verify.data.language.word import Letter
from verify.logic.normal_form import Normal
from verify.logic.progression import SETTLED, Automaton, OutOfBudget
from verify.logic.spot_opinion import LetterGraph, some_word_breaks
from verify.model_checking.team_graph import JointGraph, Observation, OwnGraph, TeamGraph

DEFAULT_BUDGET = 100_000
"""Configurations (of team and formula together) that one conjunct of a formula may take."""

READINGS = 20
"""Readings that may be followed, for each configuration of the budget: where many robots can move at once they are far more."""


_Node = tuple[Hashable, int]
_Parents = dict[_Node, tuple[_Node | None, Observation | None]]


@dataclass(frozen=True, slots=True)
class Broken:
    """A shortest team word that does not satisfy the formula."""

    observations: tuple[Observation, ...]


def find_broken(graph: TeamGraph, normal: Normal, budget: int = DEFAULT_BUDGET) -> Broken | None:
    """Search for a shortest team word that breaks the formula; None where all words satisfy it.

    Where the budget does not suffice for that, words are tried in depth, which often finds a longer one.

    Args:
        graph: The team's words.
        normal: The formula, in normal form.
        budget: Configurations that may be met in breadth; a quarter of them each time in depth.

    Raises:
        OutOfBudget: More than `budget` configurations were met, and none of them breaks the formula.
    """
    automaton = Automaton(normal)
    try:
        return _in_breadth(graph, automaton, budget)
    except OutOfBudget:
        for backwards in (False, True):
            broken = _in_depth(graph, automaton, budget // 4, backwards=backwards)
            if broken is not None:
                return broken
        raise


def _in_breadth(graph: TeamGraph, automaton: Automaton, budget: int) -> Broken | None:
    cut = _Cutter(automaton.propositions)
    parents: _Parents = {}
    best: dict[tuple[Hashable, int], list[int]] = {}

    def visit(state: Hashable, rest: int, parent: _Node | None, observation: Observation | None, layer: list[_Node]) -> None:
        node = (state, rest)
        if node in parents:
            return
        key, bits = graph.stronger(state)
        known = best.setdefault((key, rest), [])
        if any(bits & other == bits for other in known):
            return  # whatever can follow here can follow a state that was reached with no more readings
        known[:] = [other for other in known if bits & other != other]
        known.append(bits)
        if len(parents) >= budget:
            raise OutOfBudget(f"more than {budget} configurations of team and formula")
        parents[node] = parent, observation
        layer.append(node)

    layer: list[_Node] = []
    readings: list[tuple[_Node | None, Observation, Hashable]] = []
    followed = 0
    for observation, state in graph.initial():
        if observation is None:
            visit(state, automaton.initial, None, None, layer)
        else:
            readings.append((None, observation, state))
    while layer or readings:
        for node in layer:  # grows: silent steps stay in the layer
            state, rest = node
            if rest == SETTLED:
                continue
            if graph.is_final(state) and not automaton.accepts(rest):
                return Broken(_path(parents, node))
            for observation, following in graph.steps(state):
                followed += 1
                if followed > READINGS * budget:
                    raise OutOfBudget(f"more than {READINGS * budget} readings of the team")
                if observation is None:
                    visit(following, rest, node, None, layer)
                else:
                    readings.append((node, observation, following))
        layer = []
        for parent, observation, following in readings:
            before = automaton.initial if parent is None else parent[1]
            visit(following, automaton.step(before, cut(observation.letter)), parent, observation, layer)
        readings = []
    return None


def _in_depth(graph: TeamGraph, automaton: Automaton, budget: int, *, backwards: bool) -> Broken | None:
    """Follow words to their ends, one after another; no answer where none of `budget` configurations breaks the formula."""
    cut = _Cutter(automaton.propositions)
    parents: _Parents = {}
    stack: list[_Node] = []
    followed = 0

    def visit(steps: Iterable[tuple[Observation | None, Hashable]], parent: _Node | None) -> None:
        nonlocal followed
        rest = automaton.initial if parent is None else parent[1]
        ordered = list(itertools.islice(steps, READINGS * budget))
        followed += len(ordered)
        for observation, state in reversed(ordered) if backwards else ordered:
            node = (state, rest if observation is None else automaton.step(rest, cut(observation.letter)))
            if node not in parents and node[1] != SETTLED:
                parents[node] = parent, observation
                stack.append(node)

    visit(graph.initial(), None)
    while stack and len(parents) < budget and followed < READINGS * budget:
        node = stack.pop()
        if graph.is_final(node[0]) and not automaton.accepts(node[1]):
            return Broken(_path(parents, node))
        visit(graph.steps(node[0]), node)
    return None


def holds_for_all(graph: OwnGraph | JointGraph, normal: Normal, budget: int = DEFAULT_BUDGET) -> Broken | None:
    """Return a shortest team word that breaks the formula, or None, with Spot's agreement.

    Flights whose times differ but whose events can come in the same orders have the same team words: an answer is
    kept for them, which is what makes the search for the largest margin quick.

    Args:
        graph: The team's words, under either reading.
        normal: The formula, in normal form.
        budget: Configurations that may be met.

    Raises:
        OutOfBudget: More than `budget` configurations were met.
        InternalError: The two answers differ, or there is no word at all: a bug of ours.
        MissingEngine: Spot is not there to be asked.
    """
    signature = graph.signature()
    if signature is None:
        return _decided(graph, normal, budget)
    key = (normal, signature, budget)
    if key in _ANSWERS:
        _ANSWERS.move_to_end(key)
        return _ANSWERS[key]
    answer = _ANSWERS[key] = _decided(graph, normal, budget)
    while len(_ANSWERS) > _KEPT:
        _ANSWERS.popitem(last=False)
    return answer


def holds_loosely(graph: TeamGraph, normal: Normal) -> bool:
    """Return whether all words of a (larger, simpler) graph satisfy the formula, with Spot's agreement; no is no answer."""
    try:
        return find_broken(graph, normal, LOOSE_BUDGET) is None and _decided(graph, normal, LOOSE_BUDGET) is None
    except OutOfBudget:
        return False


LOOSE_BUDGET = 3_000
_KEPT = 256
_ANSWERS: OrderedDict[Hashable, Broken | None] = OrderedDict()


def _decided(graph: TeamGraph, normal: Normal, budget: int) -> Broken | None:
    broken = find_broken(graph, normal, budget)
    try:
        theirs = some_word_breaks(letter_graph(graph, normal.propositions, budget), normal)
    except OutOfBudget:
        if broken is None:
            raise
        return broken  # direct semantics will tell that the word breaks the formula: that needs no second opinion
    if theirs != (broken is not None):
        raise InternalError(
            "Two independent answers about one formula disagree: progression says that it "
            f"{'fails' if broken else 'holds'}, Spot that it {'fails' if theirs else 'holds'}. This is a bug of ltlplan's."
        )
    return broken


def letter_graph(graph: TeamGraph, propositions: Iterable[str], budget: int = DEFAULT_BUDGET) -> LetterGraph:
    """Return the graph with silent steps removed and letters cut down to some propositions.

    State 0 is the beginning, before any reading. A final state is one from which silent steps alone lead to an end.

    Args:
        graph: The team's words.
        propositions: Names that letters are cut down to.
        budget: Configurations of the team that may be met; readings and silent steps may be 20 times as many.

    Raises:
        OutOfBudget: There are more than `budget` configurations, or more than 20 times as many readings.
        InternalError: There is no team word at all: a bug of ours.
    """
    cut = _Cutter(frozenset(propositions))
    index: dict[Hashable, int] = {}
    order: list[Hashable] = []
    edges: list[tuple[int, Letter, int]] = []
    final: set[int] = set()
    known: dict[Hashable, tuple[list[Hashable], set[tuple[Letter, int]], bool]] = {}
    visits = 0

    def number(state: Hashable) -> int:
        if state not in index:
            index[state] = len(order) + 1
            order.append(state)
            if len(order) > budget:
                raise OutOfBudget(f"more than {budget} configurations of the team")
        return index[state]

    def sorted_out(steps: Iterable[tuple[Observation | None, Hashable]]) -> tuple[list[Hashable], set[tuple[Letter, int]]]:
        silent: list[Hashable] = []
        read: set[tuple[Letter, int]] = set()
        for observation, state in steps:
            if observation is None:
                silent.append(state)
            else:
                read.add((cut(observation.letter), number(state)))
        return silent, read

    def spread(source: int, silent: list[Hashable], found: set[tuple[Letter, int]]) -> None:
        nonlocal visits
        seen: set[Hashable] = set()
        stack = list(silent)
        while stack:
            state = stack.pop()
            if state in seen:
                continue
            seen.add(state)
            visits += 1
            if state not in known:
                known[state] = (*sorted_out(graph.steps(state)), graph.is_final(state))
            further, read, ends = known[state]
            stack.extend(further)
            found |= read
            if ends:
                final.add(source)
        if visits > 20 * budget or len(edges) > 20 * budget:
            raise OutOfBudget(f"more than {20 * budget} readings of the team")
        edges.extend((source, letter, target) for letter, target in sorted(found, key=lambda e: (sorted(e[0]), e[1])))

    spread(0, *sorted_out(graph.initial()))
    final.discard(0)  # a team word has at least one reading
    for position, state in enumerate(order, start=1):
        spread(position, [state], set())
    if not final:
        raise InternalError("The robots' labels contradict each other: there is no team word at all.")
    return LetterGraph(len(order) + 1, tuple(edges), frozenset(final))


def _path(parents: _Parents, node: _Node | None) -> tuple[Observation, ...]:
    observations: list[Observation] = []
    while node is not None:
        node, observation = parents[node]
        if observation is not None:
            observations.append(observation)
    return tuple(reversed(observations))


class _Cutter:
    """Letters cut down to a formula's propositions, each cut once."""

    def __init__(self, propositions: frozenset[str]) -> None:
        self.propositions = propositions
        self.known: dict[Letter, Letter] = {}

    def __call__(self, letter: Letter) -> Letter:
        found = self.known.get(letter)
        if found is None:
            found = self.known[letter] = letter & self.propositions
        return found
