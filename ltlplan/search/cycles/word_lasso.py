"""The cheapest infinite word, whichever way an automaton reads it.

A lasso of the product (see `lasso`) has to bring the automaton back to its state after one cycle; a word may need fewer
metres, because several of its cycles may be one round of the automaton. Here a cycle is judged by what it does to all states of
each automaton, so nothing cheaper is missed. That takes more states, so it is done within a budget and with the
product's lasso as the bound to beat.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ltlplan.logic.automaton import Automaton
from ltlplan.search.cycles.cycle_effects import CycleEffects, Followers, Masks
from ltlplan.search.cycles.lasso import TIE, LassoRun
from ltlplan.search.label_setting import BestFirst
from ltlplan.systems.transition_systems import TransitionSystem

_Before = tuple[int, Masks]  # node, and the states that each automaton can be in
_Within = tuple[int, int, bool]  # node, what the cycle does so far by number, whether it has begun


def improve_lasso(
    system: TransitionSystem, automata: Sequence[Automaton], known: LassoRun, *, weight: float, states: int
) -> tuple[LassoRun, bool]:
    """Return the cheapest lasso word, and whether that is certain.

    Args:
        system: What the robot can do.
        automata: Büchi automata, one for each conjunct.
        known: A lasso of the product.
        weight: How many cycles count.
        states: How many states may be expanded; when they are used up, the best lasso so far is returned.
    """
    followers = Followers(automata)
    effects = CycleEffects(followers, [tuple((1 << len(automaton.edges)) - 1 for automaton in automata)])
    best, least, left = known, known.cost(weight), states

    def before(place: _Before) -> Iterator[tuple[_Before, float]]:
        for target, cost in system.edges[place[0]]:
            after = followers.after(place[1], system.labels[target])
            if after is not None:
                yield (target, after), cost

    def within(place: _Within) -> Iterator[tuple[_Within, float]]:
        node, effect, _ = place
        hover = ((node, 0.0),) if system.final is None or node in system.final else ()
        for target, cost in (*system.edges[node], *hover):
            yield (target, effects.after(effect, system.labels[target]), True), cost

    first = followers.after(followers.begin(), system.labels[system.initial])
    prefixes = BestFirst([] if first is None else [(system.initial, first)], before)
    homes: dict[int, list[tuple[float, Masks, tuple[int, ...]]]] = {}
    for place, cost, _ in prefixes:
        if cost >= least:
            break
        left -= 1
        if left < 0:
            return best, False
        homes.setdefault(place[0], []).append((cost, place[1], tuple(node for node, _ in prefixes.path(place))))
    for home, starts in sorted(homes.items()):
        cycles = BestFirst([(home, 0, False)], within, ties="first")
        for place, cycle_cost, _ in cycles:
            if starts[0][0] + weight * cycle_cost >= least:
                break
            left -= 1
            if left < 0:
                return best, False
            node, effect, begun = place
            for cost, masks, path in starts if begun and node == home else ():
                if cost + weight * cycle_cost >= least - TIE:
                    break
                if effects.accepts(masks, effect):
                    cycle = tuple(node for node, _, _ in cycles.path(place))
                    best = LassoRun(path[:-1], cycle[:-1], cost, cycle_cost)
                    least = best.cost(weight)
                    break
    return best, True
