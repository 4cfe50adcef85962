"""The cheapest infinite word, whichever way an automaton reads it.

A lasso of the product (see `lasso`) has to bring the automaton back to its state after one lap; a word may need fewer
metres, because several of its laps may be one round of the automaton. Here a lap is judged by what it does to all states of
each automaton, so nothing cheaper is missed. That takes more states, so it is done within a budget and with the
product's lasso as the bound to beat.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ltlplan.logic.automaton import Automaton
from ltlplan.search.label_setting import BestFirst
from ltlplan.search.lassos.lap_effects import goes_round, image
from ltlplan.search.lassos.lasso import LassoRun
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Letter

Effect = tuple[tuple[tuple[int, int], ...], ...]
"""For each automaton and state: where a lap can lead, as bits, and where passing an accepting state, as bits."""

_States = tuple[int, ...]  # for each automaton the states that it can be in, as bits
_Lap = tuple[int, Effect, bool]  # node, what the lap does so far, whether it has begun


def improve_lasso(
    system: TransitionSystem, automata: Sequence[Automaton], known: LassoRun, *, weight: float, states: int
) -> tuple[LassoRun, bool]:
    """Return the cheapest lasso word, and whether that is certain.

    Args:
        system: What the robot can do.
        automata: Büchi automata, one for each conjunct.
        known: A lasso of the product.
        weight: How many laps count.
        states: How many states may be expanded; when they are used up, the best lasso so far is returned.
    """
    search = _Search(system, automata)
    best = _Best(known, known.prefix_cost + weight * known.cycle_cost)
    left = states
    homes: dict[int, list[tuple[float, _States, tuple[int, ...]]]] = {}
    for cost, node, at, path in search.prefixes(best):
        left -= 1
        if left < 0:
            return best.run, False
        homes.setdefault(node, []).append((cost, at, path))
    for node, starts in sorted(homes.items()):
        for lap_cost, effect, lap in search.laps(node, best, starts[0][0], weight):
            left -= 1
            if left < 0:
                return best.run, False
            for cost, at, path in starts if lap else ():
                total = cost + weight * lap_cost
                if total >= best.cost - _TIE:
                    break
                if search.accepts(at, effect):
                    best.run, best.cost = LassoRun(path[:-1], (path[-1], *lap[:-1]), cost, lap_cost), total
                    break
    return best.run, True


_TIE = 1e-7  # m; differences below are tie-breaks of the product's search


@dataclass
class _Best:
    """The best lasso so far, and its cost."""

    run: LassoRun
    cost: float


class _Search:
    def __init__(self, system: TransitionSystem, automata: Sequence[Automaton]) -> None:
        self.system = system
        self.automata = automata
        self._final = [sum(1 << s for s in a.accepting) for a in automata]
        self._steps: dict[tuple[int, Letter], list[int]] = {}
        self._effects: dict[tuple[Effect, Letter], Effect] = {}

    def step(self, index: int, letter: Letter) -> list[int]:
        found = self._steps.get((index, letter))
        if found is None:
            automaton = self.automata[index]
            found = [sum(1 << t for t in automaton.successors(s, letter)) for s in automaton.states]
            self._steps[index, letter] = found
        return found

    def prefixes(self, best: _Best) -> Iterator[tuple[float, int, _States, tuple[int, ...]]]:
        """Yield (cost, node, states after its letter, path) in the order of cost."""
        first = self.system.initial
        start = tuple(image(1 << a.initial, self.step(i, self.system.labels[first])) for i, a in enumerate(self.automata))

        def successors(place: tuple[int, _States]) -> Iterator[tuple[tuple[int, _States], float]]:
            for target, more in self.system.edges[place[0]]:
                label = self.system.labels[target]
                after = tuple(image(mask, self.step(i, label)) for i, mask in enumerate(place[1]))
                if all(after):
                    yield (target, after), more

        search = BestFirst([(first, start)] if all(start) else [], successors)
        for (node, at), cost, _ in search:
            if cost >= best.cost:
                return
            yield cost, node, at, tuple(before for before, _ in search.path((node, at)))

    def laps(self, home: int, best: _Best, spent: float, weight: float) -> Iterator[tuple[float, Effect, tuple[int, ...]]]:
        """Yield (cost, effect, nodes) of ways from a node back to it in the order of cost; no nodes where not yet back."""
        identity = tuple(tuple((1 << s, 0) for s in a.states) for a in self.automata)

        def successors(place: _Lap) -> Iterator[tuple[_Lap, float]]:
            node, effect, _ = place
            hover = ((node, 0.0),) if self.system.final is None or node in self.system.final else ()
            for target, more in (*self.system.edges[node], *hover):
                yield (target, self.read(effect, self.system.labels[target]), True), more

        begin: _Lap = (home, identity, False)
        search = BestFirst([begin], successors, ties="first")
        for place, cost, _ in search:
            if spent + weight * cost >= best.cost:
                return
            nodes = tuple(node for node, _, _ in search.path(place)[1:]) if place[0] == home else ()
            yield cost, place[1], nodes

    def read(self, effect: Effect, letter: Letter) -> Effect:
        found = self._effects.get((effect, letter))
        if found is None:
            rows: list[tuple[tuple[int, int], ...]] = []
            for index, row in enumerate(effect):
                step, final = self.step(index, letter), self._final[index]
                moved = [(image(reach, step), image(marked, step)) for reach, marked in row]
                rows.append(tuple((reach, marked | (reach & final)) for reach, marked in moved))
            found = self._effects[effect, letter] = tuple(rows)
        return found

    def accepts(self, at: _States, effect: Effect) -> bool:
        """Tell whether repeating a lap from these states can pass accepting states for ever, in every automaton."""
        return all(goes_round(mask, row) for mask, row in zip(at, effect, strict=True))
