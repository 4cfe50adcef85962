"""The checker's second opinion: Spot, spoken to nowhere else in `verify`.

Nothing of Spot leaks out of here. Formulas reach it with quoted names, and never through a shell.
"""

from __future__ import annotations

import importlib
import os
import pickle
import sys
import warnings
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from verify.data.errors import MissingEngine
from verify.data.helper_process import ask_process
from verify.data.language.word import Letter
from verify.logic.normal_form import Normal, normal_form, to_formula
from verify.logic.progression import OutOfBudget
from verify.logic.tableau_size import tableau_states

MAX_FORMULA = 400
"""Entries of one conjunct that Spot is still asked to translate."""

MAX_PRODUCT = 1_000_000
"""States of the team times states of the formula's automaton that Spot is still asked to search."""

EASY = 8
"""Temporal operators up to which Spot is asked in this process."""

CPU_SECONDS = 20
MEMORY = 2 * 2**30

_ALIVE = "alive"


@dataclass(frozen=True, slots=True)
class LetterGraph:
    """Words as a graph: state 0 is where they begin, each edge reads one letter.

    Attributes:
        states: How many; they are numbered from 0.
        edges: (from, letter, to).
        final: Where a finite word may end; for infinite words unused.
        marked: Numbers of edges of which an infinite word must take some infinitely often.
    """

    states: int
    edges: tuple[tuple[int, Letter, int], ...]
    final: frozenset[int] = frozenset()
    marked: frozenset[int] = frozenset()


def some_word_breaks(graph: LetterGraph, normal: Normal) -> bool:
    """Return whether some finite word of the graph breaks the formula (LTLf), according to Spot.

    Raises:
        MissingEngine: Spot is not installed.
        OutOfBudget: The formula is too large for it.
    """
    _require_small(graph, normal)
    return _in_a_process(graph, normal, finite=True) if _is_hard(normal) else _some_word_breaks(graph, normal)


def some_run_breaks(graph: LetterGraph, normal: Normal) -> bool:
    """Return whether some infinite word of the graph that takes marked edges for ever breaks the formula (LTL).

    Raises:
        MissingEngine: Spot is not installed.
        OutOfBudget: The formula is too large for it.
    """
    _require_small(graph, normal)
    return _in_a_process(graph, normal, finite=False) if _is_hard(normal) else _some_run_breaks(graph, normal)


def _require_small(graph: LetterGraph, normal: Normal) -> None:
    """Reject what Spot would take long for, by its size and before it is asked: Spot cannot be stopped."""
    if len(normal.kinds) > MAX_FORMULA:
        raise OutOfBudget(f"one part of the formula has {len(normal.kinds)} subformulas; Spot is asked up to {MAX_FORMULA}")
    try:
        states = tableau_states(normal_form(to_formula(normal), negated=True)) * graph.states
    except OutOfBudget as error:
        raise OutOfBudget(f"Spot is not asked for the second opinion: {error}") from None
    if states > MAX_PRODUCT:
        raise OutOfBudget(
            f"Spot is not asked for the second opinion: team and formula have about {states} states together; {MAX_PRODUCT} is the most"
        )


def _is_hard(normal: Normal) -> bool:
    """Return whether Spot's translation might explode: it can take exponential time and memory and cannot be stopped."""
    return sum(kind in ("F", "G", "U", "W", "R", "M", "X", "X[!]") for kind in normal.kinds) > EASY


def _in_a_process(graph: LetterGraph, normal: Normal, *, finite: bool) -> bool:
    """Ask in a process of its own, with limits on its time and memory."""
    _engine()  # its absence is reported from here
    path = os.pathsep.join(part or str(Path.cwd()) for part in sys.path)
    done = ask_process(
        [sys.executable, "-m", "verify.logic.spot_opinion"],
        pickle.dumps((graph, normal, finite)),
        environment={**os.environ, "PYTHONPATH": path},
    )
    if done.stdout not in (b"yes", b"no"):
        raise OutOfBudget(f"Spot, asked for the second opinion, needs more than {CPU_SECONDS} s or {MEMORY // 2**20} MB")
    return done.stdout == b"yes"


def _answer() -> None:
    """Answer one question from standard input within the limits."""
    resource = importlib.import_module("resource")
    resource.setrlimit(
        resource.RLIMIT_CPU, (CPU_SECONDS, CPU_SECONDS + 1)
    )  # a hard limit that is the same would end it as a kill does
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    graph, normal, finite = pickle.loads(sys.stdin.buffer.read())  # from our own parent process
    breaks = _some_word_breaks(graph, normal) if finite else _some_run_breaks(graph, normal)
    sys.stdout.write("yes" if breaks else "no")


def _some_word_breaks(graph: LetterGraph, normal: Normal) -> bool:
    spot, buddy = _engine()
    names = _renamed(normal)
    bad = _negation(normal, finite=True)
    team = spot.make_twa_graph(bad.get_dict())
    variables = {name: buddy.bdd_ithvar(team.register_ap(text)) for name, text in names.items()}
    living = buddy.bdd_ithvar(team.register_ap(_ALIVE))
    team.set_buchi()
    team.new_states(graph.states + 1)
    team.set_init_state(0)
    labels: dict[Letter, Any] = {}
    for source, letter, target in graph.edges:
        label = labels.get(letter)
        if label is None:
            label = labels[letter] = _label(buddy, letter, variables) & living
        team.new_edge(source, target, label)
    over, dead = graph.states, buddy.bdd_not(living)
    for state in sorted(graph.final):
        team.new_edge(state, over, dead)
    team.new_edge(over, over, dead, [0])
    return bool(team.intersects(bad))


def _some_run_breaks(graph: LetterGraph, normal: Normal) -> bool:
    spot, buddy = _engine()
    names = _renamed(normal)
    bad = _negation(normal, finite=False)
    team = spot.make_twa_graph(bad.get_dict())
    variables = {name: buddy.bdd_ithvar(team.register_ap(text)) for name, text in names.items()}
    team.set_buchi()
    team.new_states(graph.states)
    team.set_init_state(0)
    for number, (source, letter, target) in enumerate(graph.edges):
        team.new_edge(source, target, _label(buddy, letter, variables), [0] if number in graph.marked else [])
    return bool(team.intersects(bad))


def _engine() -> tuple[Any, Any]:
    try:
        with warnings.catch_warnings():  # its SWIG types warn when they are made, and crash where warnings are errors
            warnings.simplefilter("ignore", DeprecationWarning)
            spot = importlib.import_module("spot")
            buddy = importlib.import_module("buddy")  # Spot brings it, so it comes second
    except ImportError:
        raise MissingEngine(
            "The checker's second opinion needs Spot, which is not installed: `pip install spottl` on Linux x86-64, "
            "`conda install -c conda-forge spot` elsewhere."
        ) from None
    return spot, buddy


@lru_cache(maxsize=128)
def _negation(normal: Normal, *, finite: bool) -> Any:
    """Return Spot's automaton for the words that break the formula."""
    spot, _ = _engine()
    negation = spot.formula.Not(_formula(spot, normal, _renamed(normal)))
    return spot.translate(spot.from_ltlf(negation, _ALIVE) if finite else negation, "any", "low")


def _renamed(normal: Normal) -> dict[str, str]:
    """Give propositions names that collide with nothing."""
    return {name: f"p{i}" for i, name in enumerate(sorted(normal.propositions))}


def _formula(spot: Any, normal: Normal, names: dict[str, str]) -> Any:
    return spot.formula(to_formula(normal, names).quoted())


def _label(buddy: Any, letter: Letter, variables: dict[str, Any]) -> Any:
    label = buddy.bddtrue
    for name, variable in variables.items():
        label &= variable if name in letter else buddy.bdd_not(variable)
    return label


if __name__ == "__main__":
    _answer()
