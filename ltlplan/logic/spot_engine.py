"""The one door to Spot in this package: formulas as text go in, plain numbers and names come out.

Run as a script it translates one request from standard input within limits of time and memory, so that a formula that
explodes takes a process with it that nobody misses. It imports little, because that process has to start quickly.
"""

from __future__ import annotations

import json
import sys
import warnings
from dataclasses import dataclass
from typing import Any, Literal

ALIVE = " alive "
"""Proposition for "the word has not ended yet"; no name of a mission has spaces in it."""


@dataclass(frozen=True)
class PlainAutomaton:
    """An automaton without any of Spot's values in it.

    Attributes:
        names: Propositions, sorted.
        size: Number of states.
        initial: The initial state.
        accepting: The accepting states.
        conditions: Decision nodes (name, index where false, index where true); indices count from 2, 0 is false, 1 true.
        edges: (source, target, index of a condition).
    """

    names: tuple[str, ...]
    size: int
    initial: int
    accepting: frozenset[int]
    conditions: tuple[tuple[str, int, int], ...]
    edges: tuple[tuple[int, int, int], ...]


def engine() -> Any:  # Spot has no types
    """Return Spot.

    Raises:
        MissingEngine: It is not installed.
    """
    try:
        with warnings.catch_warnings():  # its SWIG types warn when they are made, and crash where warnings are errors
            warnings.simplefilter("ignore", DeprecationWarning)
            import spot
    except ImportError:
        from verify.data import MissingEngine

        raise MissingEngine(
            "Planning from formulas needs Spot: `pip install spottl` (Linux x86-64) or `conda install -c conda-forge spot`."
        ) from None
    return spot


def translate(text: str, trace: Literal["finite", "infinite"]) -> str:
    """Translate a fully quoted formula; return HOA with state-based Büchi acceptance.

    For finite words it reads infinite ones in which the proposition `ALIVE` holds until the word ends, and then never again.
    """
    spot = engine()
    formula = spot.formula(text)
    private = spot.make_bdd_dict()  # so that the order of propositions does not depend on what was translated before
    if trace == "finite":
        # Spot's own `to_finite` overlooks final states of automata that were simplified no further than "low"
        return str(spot.translate(spot.from_ltlf(formula, ALIVE), "small", "buchi", "sbacc", "low", dict=private).to_str("hoa"))
    return str(spot.translate(formula, "deterministic", "buchi", "sbacc", dict=private).to_str("hoa"))


def read_hoa(text: str, trace: Literal["finite", "infinite"]) -> PlainAutomaton:
    """Read one automaton in HOA format.

    Raises:
        BadInput: It is not in that format; for finite words: acceptance is not on states.
    """
    from verify.data import BadInput

    spot = engine()
    try:
        automaton = spot.automaton(text if text.endswith("\n") else text + "\n")
    except (SyntaxError, RuntimeError, StopIteration, ValueError) as error:
        reason = (str(error).splitlines() or ["there is no automaton in it"])[0]
        raise BadInput(f"This is no automaton in HOA format: {reason}") from None
    if trace == "infinite":
        automaton = spot.postprocess(automaton, "buchi", "sbacc", "any", "low")
    acceptance = automaton.acc()
    if acceptance.is_t():
        accepting = frozenset(range(automaton.num_states()))
    elif acceptance.is_buchi() and automaton.prop_state_acc().is_true():
        accepting = frozenset(s for s in range(automaton.num_states()) if automaton.state_is_accepting(s))
    else:
        raise BadInput(
            f"Its acceptance is {automaton.get_acceptance()}; an automaton on finite words needs `Inf(0)`, on states."
        )
    by_variable = {int(automaton.register_ap(p)): str(p.ap_name()) for p in automaton.ap()}
    conditions: list[tuple[str, int, int]] = []
    memo: dict[int, int] = {}
    edges = tuple(
        (int(edge.src), int(edge.dst), _condition(edge.cond, by_variable, conditions, memo)) for edge in automaton.edges()
    )
    initial = int(automaton.get_init_state_number())
    names = tuple(sorted(by_variable.values()))
    return PlainAutomaton(names, int(automaton.num_states()), initial, accepting, tuple(conditions), edges)


def _condition(bdd: Any, names: dict[int, str], nodes: list[tuple[str, int, int]], memo: dict[int, int]) -> int:
    """Copy one of Spot's decision diagrams; return its index."""
    import buddy  # type: ignore[import-not-found]  # comes with Spot, without types

    key = int(bdd.id())
    if key <= 1:
        return key
    found = memo.get(key)
    if found is None:
        low = _condition(buddy.bdd_low(bdd), names, nodes, memo)
        high = _condition(buddy.bdd_high(bdd), names, nodes, memo)
        found = memo[key] = len(nodes) + 2
        nodes.append((names[int(buddy.bdd_var(bdd))], low, high))
    return found


def _serve() -> None:
    """Translate the request on standard input within its budget."""
    import resource

    request = json.load(sys.stdin)
    resource.setrlimit(resource.RLIMIT_AS, (request["bytes"], request["bytes"]))
    seconds = int(request["seconds"]) + 1
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 1))  # a hard limit that is the same would end it as a kill does
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    sys.stdout.write(translate(request["formula"], request["trace"]))


if __name__ == "__main__":
    _serve()
