"""Cheapest runs of one robot's system through one automaton: the shortest, the k best, and prefix and suffix.

These take any transition system and any automaton, with `X` or without, from a mission or not. `search.assign` plans whole
missions.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from ltlplan.logic.automaton import Automaton
from ltlplan.logic.budget import DEFAULT_BUDGET, Budget
from ltlplan.logic.conjunction import Conjunction
from ltlplan.logic.task import Task
from ltlplan.logic.transition_monoid import Element, TransitionMonoid
from ltlplan.search.best_first import best_paths
from ltlplan.search.lassos.lasso import LassoRun, cheapest_lasso
from ltlplan.systems.products import PlanningAutomaton
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import BadInput, Word

__all__ = ["LassoRun", "Run", "cheapest_lasso", "cheapest_repeated", "cheapest_run", "k_best"]


@dataclass(frozen=True, slots=True)
class Run:
    """A finite path.

    Attributes:
        nodes: Nodes of the system.
        word: Their labels, one letter a node.
        cost: Sum of the edges' costs.
    """

    nodes: tuple[int, ...]
    word: Word
    cost: float


def cheapest_run(
    system: TransitionSystem, automaton: Automaton | Conjunction, *, budget: Budget = DEFAULT_BUDGET
) -> Run | None:
    """Return a cheapest path whose word a finite automaton accepts, or None.

    Raises:
        TooLarge: The budget of states was used up.
    """
    return next(iter(k_best(system, automaton, 1, budget=budget)), None)


def k_best(
    system: TransitionSystem, automaton: Automaton | Conjunction, k: int, *, budget: Budget = DEFAULT_BUDGET
) -> list[Run]:
    """Return the k cheapest paths whose words a finite automaton accepts, cheapest first; fewer where there are fewer.

    Paths may come back to where they were, so there can be many that differ by a detour only.

    Raises:
        BadInput: The automaton reads infinite words; see `cheapest_lasso`.
        TooLarge: The budget of states was used up.
    """
    if automaton.trace != "finite":
        raise BadInput("An automaton on finite words is needed; for infinite words see `cheapest_lasso`.")
    if k < 1:
        raise BadInput(f"k must be at least 1, not {k}.")
    if isinstance(automaton, Automaton) and not automaton.deterministic:
        automaton = Conjunction((automaton,), budget)  # one run a path, so that no path comes twice
    product = PlanningAutomaton(system, automaton)
    final = system.final

    def ending(state: tuple[object, int]) -> float | None:
        return (0.0 if final is None else final[state[1]]) if product.is_accepting(state) else None

    found: list[Run] = []
    for path in best_paths(product.initial(), product.successors, ending, each=k, states=budget.states):
        found.append(_run(system, tuple(node for _, node in path.keys)))
        if len(found) == k:
            break
    return found


def cheapest_repeated(
    system: TransitionSystem, automaton: Automaton, repeats: int, *, budget: Budget = DEFAULT_BUDGET
) -> LassoRun | None:
    """Return the cheapest finite path of the form prefix, then `repeats` times the same suffix (2022 paper, Section 2.1).

    The suffix comes back to its first node; the automaton accepts at the end of the last repetition.

    Args:
        system: What the robot can do.
        automaton: On finite words.
        repeats: How often the suffix is flown, at least once.
        budget: Bound on the states expanded.

    Returns:
        The prefix and one lap of the suffix, or None where there is no such path.

    Raises:
        TooLarge: The budget of states was used up.
    """
    if automaton.trace != "finite" or repeats < 1:
        raise BadInput("An automaton on finite words and at least one repetition are needed.")
    numbers = {label: i for i, label in enumerate(dict.fromkeys(system.labels))}
    label = [numbers[letter] for letter in system.labels]
    task = Task([automaton], list(numbers))
    monoid = TransitionMonoid(task)

    def from_start(key: tuple[int, int]) -> Iterator[tuple[tuple[int, int], float]]:
        for target, cost in system.edges[key[1]]:
            after = task.row(key[0])[label[target]]
            if after >= 0:
                yield (after, target), cost

    def lap(key: _Lap) -> Iterator[tuple[_Lap, float]]:
        node, element, _ = key
        for target, cost in [*system.edges[node], *(((node, 0.0),) if _may_hover(system, node) else ())]:
            yield (target, monoid.read(element, label[target]), True), cost

    begin = task.row(task.initial)[label[system.initial]]
    if begin < 0:
        return None
    best: LassoRun | None = None
    laps: dict[int, list[tuple[float, Element, tuple[int, ...]]]] = {}
    everywhere = best_paths([(begin, system.initial)], from_start, lambda _: 0.0, each=1, states=budget.states)
    for prefix in everywhere:
        state, home = prefix.keys[-1]
        if best is not None and prefix.cost >= best.prefix_cost + repeats * best.cycle_cost:
            break
        if home not in laps:
            ends = best_paths([(home, monoid.identity, False)], lap, _back_at(home), each=1, states=budget.states)
            laps[home] = [(path.cost, path.keys[-1][1], tuple(node for node, _, _ in path.keys[1:])) for path in ends]
        for cost, element, nodes in laps[home]:
            total = prefix.cost + repeats * cost
            if best is not None and total >= best.prefix_cost + repeats * best.cycle_cost:
                break
            at = task.state(state)[0]
            for _ in range(repeats):
                at = -1 if at < 0 else task.parts[0].apply(element[0], at)
            if at >= 0 and task.parts[0].accepting(at):
                best = LassoRun(tuple(n for _, n in prefix.keys), nodes, prefix.cost, cost)
                break
    return best


_Lap = tuple[int, Element, bool]  # node, what the lap does so far, whether it has begun


def _back_at(home: int) -> Callable[[_Lap], float | None]:
    return lambda key: 0.0 if key[0] == home and key[2] else None


def _may_hover(system: TransitionSystem, node: int) -> bool:
    return system.final is None or node in system.final


def _run(system: TransitionSystem, nodes: tuple[int, ...]) -> Run:
    cost = 0.0
    for source, target in itertools.pairwise(nodes):
        cost += min(step for node, step in system.edges[source] if node == target)
    return Run(nodes, Word(tuple(system.labels[node] for node in nodes)), cost)
