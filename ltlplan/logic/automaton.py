"""An automaton as a value: on finite words (2022 paper, Def. 2.2) or on infinite ones (Büchi; 2019 paper, Def. 4)."""

from __future__ import annotations

import json
from collections import Counter, deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Literal

from ltlplan.logic.budget import DEFAULT_BUDGET, Budget, TooLarge
from ltlplan.logic.decision_diagrams import FALSE, TRUE, DecisionDiagrams
from verify.data import BadInput, Letter, Word

if TYPE_CHECKING:
    import networkx

Trace = Literal["finite", "infinite"]
DEAD = -1
"""What `successor` returns where nothing can be accepted any more; no automaton lists it among its states."""


@dataclass(frozen=True, eq=False)
class Automaton:
    """An automaton with states 0, 1, ... and conditions on its edges. State 0 is the initial one.

    A finite word is accepted where it can lead to an accepting state; an infinite one where it can pass through accepting
    states for ever. Only states that can be reached and from which something is accepted are kept, so an automaton may
    be incomplete: `successor` then returns `DEAD`.

    Attributes:
        trace: "finite" for words that end, "infinite" for Büchi automata.
        propositions: Names that the conditions ask for.
        edges: For each state, pairs (condition, target); conditions are integers of `decision_diagrams`.
        accepting: The accepting states.
        diagrams: The conditions.
    """

    trace: Trace
    propositions: tuple[str, ...]
    edges: tuple[tuple[tuple[int, int], ...], ...]
    accepting: frozenset[int]
    diagrams: DecisionDiagrams = field(repr=False)
    initial: int = 0

    @property
    def states(self) -> range:
        """All states, in the order of a breadth-first walk."""
        return range(len(self.edges))

    @cached_property
    def deterministic(self) -> bool:
        """True if no letter ever meets two edges of one state."""
        for edges in self.edges:
            met = FALSE
            for guard, _ in edges:
                if self.diagrams.conjunction(met, guard) != FALSE:
                    return False
                met = self.diagrams.disjunction(met, guard)
        return True

    @cached_property
    def shape(self) -> tuple[tuple[tuple[int, ...], ...], frozenset[int]]:
        """Edges and acceptance without their conditions: the same for formulas that differ in their names alone."""
        return tuple(tuple(target for _, target in edges) for edges in self.edges), self.accepting

    @cached_property
    def letters(self) -> tuple[Letter, ...]:
        """One letter for each way in which letters act on the states; those that no edge takes are one of them."""
        return representative_letters([self])

    def successors(self, state: int, letter: Iterable[str]) -> frozenset[int]:
        """Return the states that a letter can lead to; names that are no propositions here do not matter."""
        names = _letter(letter)
        if state == DEAD:
            return frozenset()
        return frozenset(target for guard, target in self.edges[state] if self.diagrams.holds(guard, names))

    def successor(self, state: int, letter: Iterable[str]) -> int:
        """Return the state that a letter leads to, or `DEAD`.

        Raises:
            BadInput: The automaton is nondeterministic and the letter leads to several states.
        """
        found = self.successors(state, letter)
        if len(found) > 1:
            raise BadInput("This automaton is nondeterministic; use `successors`, or `determinised` for a finite one.")
        return next(iter(found), DEAD)

    def is_accepting(self, state: int) -> bool:
        """Return whether a state is accepting."""
        return state in self.accepting

    def accepts(self, word: Word) -> bool:
        """Return whether a word is accepted.

        Raises:
            BadInput: A lasso was given to an automaton on finite words, or a finite word to a Büchi automaton.
        """
        if (word.cycle is None) != (self.trace == "finite"):
            wanted = "a finite word" if self.trace == "finite" else "a word with a cycle"
            raise BadInput(f"This automaton reads {self.trace} words; {wanted} is needed.")
        at = frozenset({self.initial})
        for letter in word.prefix:
            at = frozenset(target for state in at for target in self.successors(state, letter))
        if word.cycle is None:
            return not self.accepting.isdisjoint(at)
        return self._laps_accept(at, word.cycle)

    def _laps_accept(self, at: frozenset[int], cycle: tuple[Letter, ...]) -> bool:
        """Return whether repeating the cycle from these states can pass through accepting states for ever."""
        import networkx

        graph = networkx.DiGraph()
        queue = deque((state, 0) for state in at)
        graph.add_nodes_from(queue)
        while queue:
            state, place = queue.popleft()
            for target in self.successors(state, cycle[place]):
                node = (target, (place + 1) % len(cycle))
                if node not in graph:
                    queue.append(node)
                graph.add_edge((state, place), node)
        for component in networkx.strongly_connected_components(graph):
            one = next(iter(component))
            if (len(component) > 1 or graph.has_edge(one, one)) and any(state in self.accepting for state, _ in component):
                return True
        return False

    def guard(self, source: int, target: int) -> str:
        """Return the condition on the way from one state to another as text; `false` where there is none."""
        condition = FALSE
        for guard, found in self.edges[source]:
            if found == target:
                condition = self.diagrams.disjunction(condition, guard)
        return self.diagrams.text(condition)

    def to_networkx(self) -> networkx.MultiDiGraph[int]:
        """Return the automaton as a graph; nodes carry `initial` and `accepting`, edges `guard` (text)."""
        import networkx

        graph: networkx.MultiDiGraph[int] = networkx.MultiDiGraph(trace=self.trace)
        for state in self.states:
            graph.add_node(state, initial=state == self.initial, accepting=state in self.accepting)
        for state, edges in enumerate(self.edges):
            for guard, target in edges:
                graph.add_edge(state, target, guard=self.diagrams.text(guard))
        return graph

    def to_hoa(self) -> str:
        """Return the automaton in the Hanoi omega-automata format, version 1.

        A finite automaton is written with Büchi acceptance on its final states and `finite-words` as its name.
        """
        name = "finite-words" if self.trace == "finite" else "infinite-words"
        quoted = " ".join(json.dumps(p, ensure_ascii=False) for p in self.propositions)
        lines = [
            "HOA: v1", f'name: "{name}"', f"States: {len(self.edges)}", f"Start: {self.initial}",
            f"AP: {len(self.propositions)} {quoted}".rstrip(), "acc-name: Buchi", "Acceptance: 1 Inf(0)",
            "properties: trans-labels explicit-labels state-acc" + (" deterministic" if self.deterministic else ""), "--BODY--",
        ]  # fmt: skip
        for state, edges in enumerate(self.edges):
            lines.append(f"State: {state}" + (" {0}" if state in self.accepting else ""))
            lines += [f"[{_hoa_label(self.diagrams, guard)}] {target}" for guard, target in edges]
        return "\n".join([*lines, "--END--"]) + "\n"

    def to_dot(self) -> str:
        """Return the automaton as a Graphviz drawing."""
        lines = ["digraph automaton {", '  rankdir=LR; node [shape=circle]; start [shape=point, label=""];']
        for state in self.states:
            lines.append(f"  {state}" + (" [shape=doublecircle];" if state in self.accepting else ";"))
        lines.append(f"  start -> {self.initial};")
        for state, edges in enumerate(self.edges):
            lines += [f"  {state} -> {target} [label={json.dumps(self.diagrams.text(guard))}];" for guard, target in edges]
        return "\n".join([*lines, "}"]) + "\n"


def trimmed(
    trace: Trace, diagrams: DecisionDiagrams, edges: list[list[tuple[int, int]]], initial: int, accepting: Iterable[int]
) -> Automaton:
    """Return the automaton without states that are useless, numbered breadth-first from the initial one.

    Args:
        trace: Whether words end.
        diagrams: The conditions.
        edges: For each state, pairs (condition, target).
        initial: The initial state.
        accepting: The accepting states.
    """
    live = live_states(trace, edges, set(accepting))
    order: dict[int, int] = {initial: 0}
    queue = deque([initial])
    kept: list[tuple[tuple[int, int], ...]] = []
    while queue:
        state = queue.popleft()
        merged: dict[int, int] = {}
        for guard, target in edges[state]:
            if guard != FALSE and target in live:
                merged[target] = diagrams.disjunction(merged.get(target, FALSE), guard)
                if target not in order:
                    order[target] = len(order)
                    queue.append(target)
        kept.append(tuple((guard, order[target]) for target, guard in merged.items()))
    return Automaton(trace, diagrams.propositions, tuple(kept), frozenset(order[s] for s in accepting if s in order), diagrams)


def live_states(trace: Trace, edges: list[list[tuple[int, int]]], accepting: set[int]) -> set[int]:
    """Return the states from which something is accepted.

    Args:
        trace: Whether words end.
        edges: For each state, pairs (condition, target).
        accepting: The accepting states.
    """
    back: list[list[int]] = [[] for _ in edges]
    for state, outgoing in enumerate(edges):
        for guard, target in outgoing:
            if guard != FALSE:
                back[target].append(state)
    if trace == "infinite":
        from scipy.sparse import csr_matrix  # loaded by planning anyway, unlike networkx
        from scipy.sparse.csgraph import connected_components

        sources = [source for before in back for source in before]
        targets = [target for target, before in enumerate(back) for _ in before]
        graph = csr_matrix(([True] * len(sources), (sources, targets)), shape=(len(edges), len(edges)))
        component = connected_components(graph, connection="strong")[1].tolist()
        sizes = Counter(component)
        accepting = {state for state in accepting if sizes[component[state]] > 1 or state in back[state]}
    live, queue = set(accepting), deque(accepting)
    while queue:
        for state in back[queue.popleft()]:
            if state not in live:
                live.add(state)
                queue.append(state)
    return live


def representative_letters(automata: Sequence[Automaton], *, budget: Budget = DEFAULT_BUDGET) -> tuple[Letter, ...]:
    """Return letters such that every letter acts on all these automata as one of them does.

    Raises:
        TooLarge: There are more than the budget allows.
    """
    diagrams = DecisionDiagrams(sorted({name for automaton in automata for name in automaton.propositions}))
    pieces = {TRUE}
    for automaton in automata:
        memo: dict[int, int] = {}
        conditions = {guard for edges in automaton.edges for guard, _ in edges}
        for condition in sorted(diagrams.copy_from(automaton.diagrams, guard, memo) for guard in conditions):
            outside = diagrams.negation(condition)
            pieces = {
                p for piece in pieces for p in (diagrams.conjunction(piece, condition), diagrams.conjunction(piece, outside))
            }
            pieces.discard(FALSE)
            if len(pieces) > budget.automaton:
                raise TooLarge("The automaton tells apart", len(pieces), "letters", budget.automaton)
    return tuple(sorted((diagrams.example(piece) for piece in pieces), key=lambda letter: (len(letter), sorted(letter))))


def _letter(letter: Iterable[str]) -> Letter:
    if isinstance(letter, str):
        raise BadInput(f"A letter is a set of names, such as {{{letter!r}}}, not the string {letter!r}.")
    return letter if isinstance(letter, frozenset) else frozenset(letter)


def _hoa_label(diagrams: DecisionDiagrams, guard: int) -> str:
    """Return a condition with propositions by number, as HOA wants it."""
    numbers = DecisionDiagrams([str(i) for i in range(len(diagrams.propositions))])
    memo: dict[int, int] = {}

    def copied(at: int) -> int:
        if at > 1 and at not in memo:
            variable, low, high = diagrams.parts(at)
            memo[at] = numbers.node(variable, copied(low), copied(high))
        return memo.get(at, at)

    text = numbers.text(copied(guard))
    return {"true": "t", "false": "f"}.get(text, text)
