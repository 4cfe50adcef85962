"""Plans for `team: joint`, where a formula speaks of what all robots show together.

A plan must hold when one robot flies at a time, in every order, while the others hold their first or last letters. So the
robots' product is walked along one order of the robots only (who flies, where, what the others hold), which is far
smaller than all their positions at once; each complete plan is then checked in all other orders, cheapest plan first.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from ltlplan.automata import DEAD, Automaton
from ltlplan.best_paths import best_paths
from ltlplan.budget import Budget, TooLarge
from ltlplan.conjunction import Conjunction, State
from ltlplan.systems import TransitionSystem
from ltlplan.team_search import Checked, TeamRun
from verify.data import Letter

_Key = tuple[int, int, State, Letter]  # who flies, at which node, what is done, what those who have landed hold

MAX_ACTIVE = 12  # robots that fly, up to which all orders are checked


def plan_joint(systems: Sequence[TransitionSystem], automata: Sequence[Automaton], budget: Budget) -> Checked:
    """Return the cheapest plan that keeps the formula, read over unions of letters, in every order of the robots.

    Raises:
        TooLarge: A budget was used up; nothing is known then.
    """
    team = _Joint(systems, automata)
    if next(best_paths(team.begin(), team.moves, team.ending, each=1, states=budget.states), None) is None:
        return Checked(None, None, 0, None)
    run: TeamRun | None = None
    tried = 0
    first: TeamRun | None = None
    refused: tuple[int, ...] | None = None
    seen: set[tuple[tuple[Letter, ...], ...]] = set()
    for path in best_paths(team.begin(), team.moves, team.ending, each=budget.candidates, states=budget.states // 10):
        found = TeamRun(team.paths(path.keys), path.cost, path.explored, path.explored)
        words = tuple(_word(system, nodes) for system, nodes in zip(systems, found.paths, strict=True))
        if words in seen:
            continue
        seen.add(words)
        tried += 1
        first = first or found
        bad = team.failing_order(words)
        if bad is None:
            run = found
            break
        refused = refused or bad
        if tried >= budget.candidates:
            raise TooLarge("Finding a plan that holds in every order takes", tried + 1, "complete plans", budget.candidates)
    return Checked(run, first, tried, refused)


def joint_possible(systems: Sequence[TransitionSystem], automata: Sequence[Automaton], budget: Budget) -> bool:
    """Tell whether any plan keeps the formula in the systems' order."""
    team = _Joint(systems, automata)
    return next(best_paths(team.begin(), team.moves, team.ending, each=1, states=budget.states), None) is not None


class _Joint:
    def __init__(self, systems: Sequence[TransitionSystem], automata: Sequence[Automaton]) -> None:
        self.systems = systems
        self.task = Conjunction(automata)
        firsts = [system.labels[system.initial] for system in systems]
        self.waiting = [frozenset().union(*firsts[i + 1 :]) for i in range(len(systems))]  # held by those still to fly
        self._after: dict[tuple[State, Letter], State] = {}

    def read(self, state: State, letter: Letter) -> State:
        key = (state, letter)
        found = self._after.get(key)
        if found is None:
            found = self._after[key] = self.task.successor(state, letter)
        return found

    def begin(self) -> Iterator[_Key]:
        letter = self.systems[0].labels[self.systems[0].initial] | self.waiting[0]
        state = self.read(self.task.initial, letter)
        if state != DEAD:
            yield 0, self.systems[0].initial, state, frozenset()

    def moves(self, key: _Key) -> Iterator[tuple[_Key, float]]:
        robot, node, state, held = key
        system = self.systems[robot]
        around = held | self.waiting[robot]
        for target, cost in system.edges[node]:
            after = self.read(state, system.labels[target] | around)
            if after != DEAD:
                yield (robot, target, after, held), cost + 1e-10
        extra = self._preference(system, node)
        if extra is not None and robot + 1 < len(self.systems):
            yield (robot + 1, self.systems[robot + 1].initial, state, held | system.labels[node]), extra

    def ending(self, key: _Key) -> float | None:
        robot, node, state, _ = key
        if robot + 1 < len(self.systems) or not self.task.is_accepting(state):
            return None
        return self._preference(self.systems[robot], node)

    @staticmethod
    def _preference(system: TransitionSystem, node: int) -> float | None:
        return 0.0 if system.final is None else system.final.get(node)

    def paths(self, keys: Sequence[_Key]) -> tuple[tuple[int, ...], ...]:
        return tuple(tuple(node for robot, node, _, _ in keys if robot == i) for i in range(len(self.systems)))

    def failing_order(self, words: Sequence[tuple[Letter, ...]]) -> tuple[int, ...] | None:
        """Return an order of flying in which the words break the formula, or None; robots that stay put fly last."""
        active = [i for i, word in enumerate(words) if len(word) > 1]
        if len(active) > MAX_ACTIVE:
            raise TooLarge("Checking all orders takes", len(active), "robots that fly at a time", MAX_ACTIVE)
        start = self.read(self.task.initial, frozenset().union(*(word[0] for word in words)))
        layer: dict[tuple[frozenset[int], State], tuple[int, ...]] = {(frozenset(), start): ()}
        idle = tuple(i for i in range(len(words)) if i not in active)
        for _ in active:
            following: dict[tuple[frozenset[int], State], tuple[int, ...]] = {}
            for (done, state), order in layer.items():
                for robot in active:
                    if robot not in done:
                        held = frozenset().union(*(w[-1] if i in done else w[0] for i, w in enumerate(words) if i != robot))
                        after = state
                        for letter in words[robot]:
                            after = self.read(after, letter | held)
                        if after == DEAD:
                            return (*order, robot, *(i for i in active if i != robot and i not in done), *idle)
                        following.setdefault((done | {robot}, after), (*order, robot))
            layer = following
        for (_, state), order in layer.items():
            if not self.task.is_accepting(state):
                return (*order, *idle)
        return None


def _word(system: TransitionSystem, path: Sequence[int]) -> tuple[Letter, ...]:
    letters = [system.labels[node] for node in path]
    return tuple(letter for i, letter in enumerate(letters) if i == 0 or letter != letters[i - 1])
