"""One formula's automaton by Spot: small, quickly made, and perhaps nondeterministic; and automata read from text.

A large formula is translated in a process of its own, so that it can be ended when it takes too long or too much memory.
"""

from __future__ import annotations

import json
import subprocess
import sys
from functools import lru_cache

from ltlplan.logic import spot_engine
from ltlplan.logic.automaton import Automaton, Trace, live_states, trimmed
from ltlplan.logic.budget import DEFAULT_BUDGET, Budget, TooLarge
from ltlplan.logic.decision_diagrams import FALSE, TRUE, DecisionDiagrams
from verify.data import Formula
from verify.data.helper_process import ask_process

SMALL_FORMULA = 10  # weight of a formula up to which Spot translates it in this process


@lru_cache(maxsize=512)
def small_automaton(formula: Formula, trace: Trace, *, budget: Budget = DEFAULT_BUDGET) -> Automaton:
    """Return a small automaton for one formula; it may be nondeterministic.

    A large formula is translated in a process of its own, which is ended when its budget of time or memory is used up.

    Args:
        formula: What is asked.
        trace: "finite" for an automaton on finite words, "infinite" for a Büchi automaton.
        budget: Bounds on the time and memory of a translation in a process of its own.

    Raises:
        TooLarge: The budget did not suffice.
        MissingEngine: Spot is not installed.
    """
    text = formula.quoted()
    if _weight(formula) <= SMALL_FORMULA and len(formula.names()) <= 2 * SMALL_FORMULA:
        hoa = spot_engine.translate(text, trace)
    else:
        hoa = _translate_in_own_process(text, trace, budget)
    plain = spot_engine.read_hoa(hoa, "infinite")
    return _ending(plain) if trace == "finite" else _automaton(plain, "infinite")


def _weight(formula: Formula) -> int:
    """Return the number of temporal operators, those below `<->` and `xor` twice: both they and their opposites matter."""
    below = sum(map(_weight, formula.arguments))
    if formula.operator in ("<->", "xor"):
        return 2 * below
    return below + (formula.operator in ("F", "G", "U", "W", "R", "M", "X", "X[!]"))


_PATIENCE = 30  # the process ends itself by its own processor time; by the clock it may wait for others for so much longer


def _translate_in_own_process(text: str, trace: Trace, budget: Budget) -> str:
    """Translate in a process that can be ended."""
    request = json.dumps({"formula": text, "trace": trace, "bytes": budget.megabytes * 2**20, "seconds": budget.seconds})
    command = [sys.executable, "-I", spot_engine.__file__]
    try:
        done = ask_process(command, request.encode(), seconds=_PATIENCE * budget.seconds)
    except subprocess.TimeoutExpired:
        raise TooLarge("Translating the formula takes", int(budget.seconds), "s", int(budget.seconds)) from None
    if done.returncode != 0 or not done.stdout.startswith(b"HOA"):
        spot_engine.engine()  # says so if Spot itself is missing
        raise TooLarge("Translating the formula takes", budget.megabytes, f"MB or {budget.seconds:g} s", budget.megabytes)
    return done.stdout.decode()


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
    diagrams, edges = _copied(plain)
    return trimmed(trace, diagrams, edges, plain.initial, plain.accepting)


def _ending(plain: spot_engine.PlainAutomaton) -> Automaton:
    """Return the automaton on finite words: final where the rest, with no letter alive, is accepted."""
    table, edges = _copied(plain)
    diagrams = DecisionDiagrams([name for name in plain.names if name != spot_engine.ALIVE])
    memo: dict[int, int] = {}
    alive: list[list[tuple[int, int]]] = []
    ended: list[list[tuple[int, int]]] = []
    for outgoing in edges:
        before = [(table.given(guard, spot_engine.ALIVE, holds=True), target) for guard, target in outgoing]
        alive.append([(diagrams.copy_from(table, guard, memo), target) for guard, target in before])
        ended.append([(table.given(guard, spot_engine.ALIVE, holds=False), target) for guard, target in outgoing])
    final = live_states("infinite", ended, set(plain.accepting))
    return trimmed("finite", diagrams, alive, plain.initial, final)


def _copied(plain: spot_engine.PlainAutomaton) -> tuple[DecisionDiagrams, list[list[tuple[int, int]]]]:
    """Return the conditions and edges of an automaton from Spot as our own."""
    diagrams = DecisionDiagrams(plain.names)
    conditions = [FALSE, TRUE]
    for name, low, high in plain.conditions:
        conditions.append(diagrams.condition(name, conditions[low], conditions[high]))
    edges: list[list[tuple[int, int]]] = [[] for _ in range(plain.size)]
    for source, target, condition in plain.edges:
        edges[source].append((conditions[condition], target))
    return diagrams, edges
