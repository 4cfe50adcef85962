"""Reasons that no precedences help where single interleavings would do: a letter that a robot holds may be read at any time.

In a single team word of `own` each letter is read when it helps, so that this is what an interleaving can do at best. That is a sentence for a
person, and no plan: a robot cannot choose when a letter that it holds is looked at.
"""

from __future__ import annotations

import itertools
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence

from ltlplan.logic.automaton import DEAD
from ltlplan.logic.budget import Budget, TooLarge
from ltlplan.logic.conjunct_automata import bits
from ltlplan.logic.conjunction import conjunct_automata, conjuncts
from ltlplan.search.counting.counting_propositions import Marks
from ltlplan.search.label_setting import distances
from ltlplan.search.numbering import Numbers
from ltlplan.search.orders.linearisations import Linearisations
from ltlplan.search.orders.planning import words_and_order
from ltlplan.search.orders.reading import Nodes, is_event, shown_by, steps_along
from ltlplan.search.team_reading import UNREACHABLE, Step, TeamReading, complete, least_sum
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Formula, Mission
from verify.data.language.word import show_letter

_BUDGET = Budget(states=4_000)
"""Of the search for a single interleaving."""


def held_letter(
    mission: Mission, systems: Sequence[TransitionSystem], asked: Formula, possible: Callable[[Mission], bool]
) -> list[str]:
    """Return what breaks a formula of `own` that a single interleaving satisfies, but no words under any precedences.

    Args:
        mission: Whose formula it is.
        systems: One for each robot.
        asked: The formula that was planned.
        possible: Whether another mission can be planned.

    Returns:
        Sentences; none where no interleaving was found, within a budget of states.
    """
    owned = [(part, own) for part in dict.fromkeys(conjuncts(asked)) for own in conjunct_automata(part, "finite")]
    marks = Marks([automaton for _, automaton in owned], {})
    letters = _LetterReading(systems, marks)
    path = [letters.places.known[state] for state in least_sum(letters, _BUDGET).states]
    if not path:
        return []
    words, order = words_and_order(marks, systems, steps_along([nodes for nodes, _, _ in path]))
    chain = [(first, then) for i, first in enumerate(order) for then in order[i + 1 :] if first[0] != then[0]]
    try:
        broken = Linearisations(marks, words, joint=False).broken(chain)
    except TooLarge:
        return []
    if broken is None:
        return []
    robot, at = broken.reader, broken.way[-1]
    shown = itertools.groupby((nodes[robot] for nodes, _, _ in path), key=systems[robot].labels.__getitem__)
    node = [next(group) for _, group in shown][at[robot]]
    letter = show_letter(systems[robot].labels[node])
    if node in systems[robot].walls:  # where it is in neither room for sure
        letter = f"{{}}, which may stand for {letter} at a wall,"
    reasons = [
        f"A single interleaving satisfies it ({_shown(systems, path)}), but no precedences make every one do so: a letter that is held "
        f"may be read at any time, again and again. {systems[robot].robot}'s letter {letter} breaks `{owned[broken.part][0]}` there."
    ]
    if possible(mission.model_copy(update={"spec": mission.spec.model_copy(update={"team": "joint"})})):
        reasons.append("Under `team: joint`, where the letters of all robots are read together, a plan exists.")
    return reasons


def _shown(systems: Sequence[TransitionSystem], path: Sequence[_Place]) -> str:
    """Return which letters are read, one after another."""
    read = [
        (robot, nodes[robot]) for (nodes, _, unread), (_, _, left) in itertools.pairwise(path) for robot in bits(unread & ~left)
    ]
    said = (f"{systems[robot].robot} {show_letter(systems[robot].labels[node])}" for robot, node in read)
    return ", ".join(text for text, _ in itertools.groupby(said))


def _steps_to_an_end(system: TransitionSystem) -> dict[int, float]:
    """Return for each node of a robot how many steps and readings lead to where it may end; none from where nothing does."""
    back: dict[int, list[tuple[int, float]]] = defaultdict(list)
    for node, edges in enumerate(system.edges):
        for target, _ in edges:
            back[target].append((node, 2.0 if is_event(system, node, target) else 1.0))
    ends = [node for node in range(len(system.labels)) if system.ending(node) is not None]
    return distances(ends, lambda node: back.get(node, ()))


_Place = tuple[Nodes, tuple[int, ...], int]
"""Where robots are, the conjuncts' states, and the robots not yet read, as bits."""


class _LetterReading(TeamReading):
    """Words whose letters are read one by one: steps of robots, and readings of what one of them shows, of which each counts 1.

    At least as much is left as each robot takes to where it may end, each letter on its way read once.
    """

    ties = "farthest"

    def __init__(self, systems: Sequence[TransitionSystem], marks: Marks) -> None:
        self._systems, self._marks = systems, marks
        self._ends = [_steps_to_an_end(system) for system in systems]
        self._letters = [[marks.letter(own[0]) for own in each] for each in shown_by(marks, systems)]
        self.places: Numbers[_Place] = Numbers()

    def begin(self) -> int:
        initial = tuple(system.initial for system in self._systems)
        return self.places[initial, self._marks.initial, (1 << len(initial)) - 1]

    def left(self, state: int) -> float:
        nodes, _, unread = self.places.known[state]
        return sum(own.get(node, UNREACHABLE) for own, node in zip(self._ends, nodes, strict=True)) + unread.bit_count()

    def steps(self, state: int) -> Iterator[Step]:
        nodes, states, unread = self.places.known[state]
        ends = all(s.ending(n) is not None for s, n in zip(self._systems, nodes, strict=True))
        if not unread and ends and self._marks.accepting(states):
            yield complete(state), 0.0, None
        for robot, system in enumerate(self._systems):
            bit, letter = 1 << robot, self._letters[robot][nodes[robot]]
            after = tuple(part.step(at, letter) for part, at in zip(self._marks.parts, states, strict=True))
            if DEAD not in after:
                yield self.places[nodes, after, unread & ~bit], 1.0, None
            for target, _ in system.edges[nodes[robot]]:
                event = is_event(system, nodes[robot], target)
                if not (event and unread & bit):
                    moved = (*nodes[:robot], target, *nodes[robot + 1 :])
                    yield self.places[moved, states, unread | bit if event else unread], 1.0, None
