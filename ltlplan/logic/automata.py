"""Automata for formulas: finite ones for LTLf (2022 paper, Def. 2.2), Büchi ones for LTL (2019 paper, Def. 4).

Spot, behind its door in `spot_engine`, makes a small nondeterministic automaton, quickly; what must be deterministic is made so
here, in `determinisation`, because Spot's own way can take minutes on a formula of twenty nested operators.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Literal

from ltlplan.logic import spot_engine
from ltlplan.logic.budget import DEFAULT_BUDGET, Budget, TooLarge
from ltlplan.logic.decision_diagrams import FALSE, TRUE, Guards
from verify.data import BadInput, Formula, Letter, Word, parse_formula
from verify.data.formula import check_formula

if TYPE_CHECKING:
    import networkx

    from ltlplan.logic.conjunction import Conjunction

Trace = Literal["finite", "infinite"]
DEAD = -1
"""What `successor` returns where nothing can be accepted any more; no automaton lists it among its states."""

EXPLICIT_STATES = 1024  # products of conjuncts up to which `translate` writes one automaton down
SMALL_FORMULA = 10  # weight of a formula up to which Spot translates it in this process


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
        guards: The conditions.
    """

    trace: Trace
    propositions: tuple[str, ...]
    edges: tuple[tuple[tuple[int, int], ...], ...]
    accepting: frozenset[int]
    guards: Guards = field(repr=False)
    initial: int = 0

    @property
    def states(self) -> range:
        """All states, in the order of a breadth-first walk."""
        return range(len(self.edges))

    @cached_property
    def deterministic(self) -> bool:
        """Whether no letter ever meets two edges of one state."""
        for edges in self.edges:
            met = FALSE
            for guard, _ in edges:
                if self.guards.conjunction(met, guard) != FALSE:
                    return False
                met = self.guards.disjunction(met, guard)
        return True

    @cached_property
    def letters(self) -> tuple[Letter, ...]:
        """One letter for each way in which letters act on the states; those that no edge takes are one of them."""
        return representative_letters([self])

    def successors(self, state: int, letter: Iterable[str]) -> frozenset[int]:
        """Return the states that a letter can lead to; names that are no propositions here do not matter."""
        names = _letter(letter)
        if state == DEAD:
            return frozenset()
        return frozenset(target for guard, target in self.edges[state] if self.guards.holds(guard, names))

    def successor(self, state: int, letter: Iterable[str]) -> int:
        """Return the state that a letter leads to, or `DEAD`.

        Raises:
            BadInput: The automaton is nondeterministic and the letter leads to several states.
        """
        found = self.successors(state, letter)
        if len(found) > 1:
            raise BadInput("This automaton is nondeterministic; use `successors`, or `determinised()` for a finite one.")
        return next(iter(found), DEAD)

    def is_accepting(self, state: int) -> bool:
        """Tell whether a state is accepting."""
        return state in self.accepting

    def accepts(self, word: Word) -> bool:
        """Tell whether a word is accepted.

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
        """Tell whether repeating the cycle from these states can pass through accepting states for ever."""
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
                condition = self.guards.disjunction(condition, guard)
        return self.guards.text(condition)

    def to_networkx(self) -> networkx.MultiDiGraph[int]:
        """Return the automaton as a graph; nodes carry `initial` and `accepting`, edges `guard` (text)."""
        import networkx

        graph: networkx.MultiDiGraph[int] = networkx.MultiDiGraph(trace=self.trace)
        for state in self.states:
            graph.add_node(state, initial=state == self.initial, accepting=state in self.accepting)
        for state, edges in enumerate(self.edges):
            for guard, target in edges:
                graph.add_edge(state, target, guard=self.guards.text(guard))
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
            lines += [f"[{_hoa_label(self.guards, guard)}] {target}" for guard, target in edges]
        return "\n".join([*lines, "--END--"]) + "\n"

    def to_dot(self) -> str:
        """Return the automaton as a Graphviz drawing."""
        lines = ["digraph automaton {", '  rankdir=LR; node [shape=circle]; start [shape=point, label=""];']
        for state in self.states:
            lines.append(f"  {state}" + (" [shape=doublecircle];" if state in self.accepting else ";"))
        lines.append(f"  start -> {self.initial};")
        for state, edges in enumerate(self.edges):
            lines += [f"  {state} -> {target} [label={json.dumps(self.guards.text(guard))}];" for guard, target in edges]
        return "\n".join([*lines, "}"]) + "\n"

    def determinised(self, *, budget: Budget = DEFAULT_BUDGET) -> Automaton:
        """Return the smallest deterministic automaton of a finite automaton's language.

        Raises:
            BadInput: It is a Büchi automaton; these are made deterministic by Spot, where it can, in `translate`.
            TooLarge: It has more states than the budget allows.
        """
        from ltlplan.logic.determinisation import determinise, minimise

        if self.trace == "infinite":
            raise BadInput("A Büchi automaton is not made deterministic by this; many have no deterministic equal.")
        return minimise(determinise(self, budget=budget))


def translate(
    formula: str | Formula,
    trace: Trace = "finite",
    *,
    form: Literal["deterministic", "small"] = "deterministic",
    budget: Budget = DEFAULT_BUDGET,
) -> Automaton | Conjunction:
    """Return an automaton that accepts just the words that satisfy a formula.

    Args:
        formula: LTL, as text or value; `X` and `X[!]` are accepted.
        trace: "finite": the words are finite and not empty (LTLf). "infinite": a Büchi automaton, deterministic
            where Spot can make it so.
        form: For finite words: the smallest deterministic automaton, or a small nondeterministic one (2022 paper, Def. 2.2).
        budget: Bounds on states, time and memory.

    Returns:
        An automaton with all its states; for a large conjunction on finite words a `Conjunction`, which is used in the
        same way and makes its states as they are asked for.

    Raises:
        FormulaError: The text is no formula.
        TooLarge: A budget did not suffice.
    """
    from ltlplan.logic.conjunction import Conjunction, conjunct_automata
    from ltlplan.logic.determinisation import intersection, minimise

    value = as_formula(formula)
    if trace not in ("finite", "infinite"):
        raise BadInput(f"trace must be 'finite' or 'infinite', not {trace!r}.")
    if form not in ("deterministic", "small"):
        raise BadInput(f"form must be 'deterministic' or 'small', not {form!r}.")
    if trace == "infinite" or form == "small":
        return small_automaton(value, trace, budget=budget)
    parts = conjunct_automata(value, trace, budget=budget)
    size = math.prod(len(part.states) for part in parts)
    if size > EXPLICIT_STATES or not all(part.deterministic for part in parts):
        return Conjunction(parts, budget)
    whole = parts[0]
    for part in parts[1:]:
        whole = minimise(intersection(whole, part, budget=budget))
    return whole


@lru_cache(maxsize=512)
def small_automaton(formula: Formula, trace: Trace, *, budget: Budget = DEFAULT_BUDGET) -> Automaton:
    """Return a small automaton for one formula; it may be nondeterministic.

    A large formula is translated in a process of its own, which is ended when its budget of time or memory is used up.

    Raises:
        TooLarge: The budget did not suffice.
        MissingEngine: Spot is not installed.
    """
    text = formula.quoted()
    if _weight(formula) <= SMALL_FORMULA and len(formula.names()) <= 2 * SMALL_FORMULA:
        hoa = spot_engine.translate(text, trace)
    else:
        hoa = _translate_elsewhere(text, trace, budget)
    plain = spot_engine.read_hoa(hoa, "infinite")
    return _ending(plain) if trace == "finite" else _automaton(plain, "infinite")


def _weight(formula: Formula) -> int:
    """Return the number of temporal operators, those below `<->` and `xor` twice: both they and their opposites matter."""
    below = sum(map(_weight, formula.arguments))
    if formula.operator in ("<->", "xor"):
        return 2 * below
    return below + (formula.operator in ("F", "G", "U", "W", "R", "M", "X", "X[!]"))


def _translate_elsewhere(text: str, trace: Trace, budget: Budget) -> str:
    """Translate in a process that can be ended."""
    request = json.dumps({"formula": text, "trace": trace, "bytes": budget.megabytes * 2**20, "seconds": budget.seconds})
    command = [sys.executable, "-I", spot_engine.__file__]
    try:
        done = subprocess.run(command, input=request, capture_output=True, text=True, timeout=budget.seconds + 2, check=False)
    except subprocess.TimeoutExpired:
        raise TooLarge("Translating the formula takes", int(budget.seconds), "s", int(budget.seconds)) from None
    if done.returncode != 0 or not done.stdout.startswith("HOA"):
        spot_engine.engine()  # says so if Spot itself is missing
        raise TooLarge("Translating the formula takes", budget.megabytes, f"MB or {budget.seconds:g} s", budget.megabytes)
    return done.stdout


def read_hoa(text: str, *, trace: Trace) -> Automaton:
    """Read an automaton in the Hanoi omega-automata format.

    Args:
        text: One automaton. For finite words its accepting states are the final ones.
        trace: Whether it reads finite or infinite words.

    Raises:
        BadInput: It is not in that format; for finite words: acceptance is not on states.
    """
    return _automaton(spot_engine.read_hoa(text, trace), trace)


def _automaton(plain: spot_engine.PlainAutomaton, trace: Trace) -> Automaton:
    guards, edges = _copied(plain)
    return trimmed(trace, guards, edges, plain.initial, plain.accepting)


def _ending(plain: spot_engine.PlainAutomaton) -> Automaton:
    """Return the automaton on finite words: final where the rest, with no letter alive, is accepted."""
    table, edges = _copied(plain)
    guards = Guards([name for name in plain.names if name != spot_engine.ALIVE])
    memo: dict[int, int] = {}
    alive: list[list[tuple[int, int]]] = []
    ended: list[list[tuple[int, int]]] = []
    for outgoing in edges:
        before = [(table.given(guard, spot_engine.ALIVE, holds=True), target) for guard, target in outgoing]
        alive.append([(guards.copy_from(table, guard, memo), target) for guard, target in before])
        ended.append([(table.given(guard, spot_engine.ALIVE, holds=False), target) for guard, target in outgoing])
    final = _live("infinite", ended, set(plain.accepting))
    return trimmed("finite", guards, alive, plain.initial, final)


def _copied(plain: spot_engine.PlainAutomaton) -> tuple[Guards, list[list[tuple[int, int]]]]:
    """Return the conditions and edges of an automaton from Spot as our own."""
    guards = Guards(plain.names)
    conditions = [FALSE, TRUE]
    for name, low, high in plain.conditions:
        conditions.append(guards.condition(name, conditions[low], conditions[high]))
    edges: list[list[tuple[int, int]]] = [[] for _ in range(plain.size)]
    for source, target, condition in plain.edges:
        edges[source].append((conditions[condition], target))
    return guards, edges


def trimmed(
    trace: Trace, guards: Guards, edges: list[list[tuple[int, int]]], initial: int, accepting: Iterable[int]
) -> Automaton:
    """Return the automaton without states that are useless, numbered breadth-first from the initial one."""
    live = _live(trace, edges, set(accepting))
    order: dict[int, int] = {initial: 0}
    queue = deque([initial])
    kept: list[tuple[tuple[int, int], ...]] = []
    while queue:
        state = queue.popleft()
        merged: dict[int, int] = {}
        for guard, target in edges[state]:
            if guard != FALSE and target in live:
                merged[target] = guards.disjunction(merged.get(target, FALSE), guard)
                if target not in order:
                    order[target] = len(order)
                    queue.append(target)
        kept.append(tuple((guard, order[target]) for target, guard in merged.items()))
    return Automaton(trace, guards.propositions, tuple(kept), frozenset(order[s] for s in accepting if s in order), guards)


def _live(trace: Trace, edges: list[list[tuple[int, int]]], accepting: set[int]) -> set[int]:
    """Return the states from which something is accepted."""
    back: list[list[int]] = [[] for _ in edges]
    for state, outgoing in enumerate(edges):
        for guard, target in outgoing:
            if guard != FALSE:
                back[target].append(state)
    if trace == "infinite":
        import networkx

        graph = networkx.DiGraph((s, t) for s, outgoing in enumerate(edges) for g, t in outgoing if g != FALSE)
        rounds = [
            c for c in networkx.strongly_connected_components(graph) if len(c) > 1 or graph.has_edge(*[next(iter(c))] * 2)
        ]
        accepting = {state for component in rounds for state in component if state in accepting}
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
    guards = Guards(sorted({name for automaton in automata for name in automaton.propositions}))
    pieces = {TRUE}
    for automaton in automata:
        memo: dict[int, int] = {}
        conditions = {guard for edges in automaton.edges for guard, _ in edges}
        for condition in sorted(guards.copy_from(automaton.guards, guard, memo) for guard in conditions):
            outside = guards.negation(condition)
            pieces = {p for piece in pieces for p in (guards.conjunction(piece, condition), guards.conjunction(piece, outside))}
            pieces.discard(FALSE)
            if len(pieces) > budget.automaton:
                raise TooLarge("The automaton tells apart", len(pieces), "letters", budget.automaton)
    return tuple(sorted((guards.example(piece) for piece in pieces), key=lambda letter: (len(letter), sorted(letter))))


def as_formula(formula: str | Formula) -> Formula:
    """Return a formula that was given as text or as a value."""
    return parse_formula(formula) if isinstance(formula, str) else check_formula(formula)


def _letter(letter: Iterable[str]) -> Letter:
    if isinstance(letter, str):
        raise BadInput(f"A letter is a set of names, such as {{{letter!r}}}, not the string {letter!r}.")
    return letter if isinstance(letter, frozenset) else frozenset(letter)


def _hoa_label(guards: Guards, guard: int) -> str:
    """Return a condition with propositions by number, as HOA wants it."""
    numbers = Guards([str(i) for i in range(len(guards.propositions))])
    memo: dict[int, int] = {}

    def copied(at: int) -> int:
        if at > 1 and at not in memo:
            variable, low, high = guards.parts(at)
            memo[at] = numbers.node(variable, copied(low), copied(high))
        return memo.get(at, at)

    text = numbers.text(copied(guard))
    return {"true": "t", "false": "f"}.get(text, text)
