"""How far a team under `team: joint` is, as one number: the states of the search in `team_words`."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from ltlplan.logic.automaton import DEAD, Automaton
from ltlplan.logic.budget import TooLarge
from ltlplan.search.heuristics.heuristic import UNREACHABLE
from ltlplan.search.joint.conjuncts import JointConjunct, WordEffects
from ltlplan.search.joint.heuristic import JointHeuristic
from ltlplan.search.joint.order_bounds import JointOrderBounds
from ltlplan.search.reduced_graph import ReducedGraph, Team
from ltlplan.search.team_search import TeamRun
from ltlplan.systems.transition_systems import TransitionSystem

MAX_REPEATS = 50_000  # states times letters of a conjunct up to which it is found out whether repeating letters matters
MAX_CONTEXTS = 4096  # sets of propositions that the others may hold


class JointTask:
    """The robots' graph and the conjuncts, with propositions as bits.

    Args:
        systems: One for each robot.
        automata: One for each conjunct.

    Attributes:
        automata: One for each conjunct.
        team: The robots.
        parts: The conjuncts.
        masks: For each letter, its propositions as bits.
        repeats: Whether it is known of all conjuncts that reading a letter twice is the same as reading it once.
        graph: The team's graph.
        heuristic: Bounds on what is left to fly.
        first: What each robot holds before it flies, as bits.
    """

    def __init__(self, systems: Sequence[TransitionSystem], automata: Sequence[Automaton]) -> None:
        self.automata = tuple(automata)
        team = Team(systems)
        names = sorted({name for automaton in automata for name in automaton.propositions})
        bit = {name: 1 << i for i, name in enumerate(names)}
        self.team = team
        self.parts = tuple(JointConjunct(automaton, bit) for automaton in automata)
        self.masks = [sum(bit.get(name, 0) for name in letter) for letter in team.letters]
        alike: dict[int, int] = {}
        classes = [alike.setdefault(mask, letter) for letter, mask in enumerate(self.masks)]
        silent = False if all(part.repeats(MAX_REPEATS) for part in self.parts) else None
        self.repeats = silent is not None
        self.graph = ReducedGraph(team, [silent] * len(classes), classes)
        self.heuristic = JointHeuristic(self.parts, self.masks, self.graph)
        self.first = [self.masks[label[start]] for label, start in zip(team.label, self.graph.start, strict=True)]

    def flown_by(self, robots: Collection[int]) -> JointTask:
        """Return the task of the team with all but these robots, by index, staying where they start."""
        within = self.team.flown_by(robots)
        return self if within is self.team else JointTask(within.systems, self.automata)

    def search_states(self, tracked: Sequence[int]) -> JointStates:
        """Return the states of a search in which these conjuncts, by index, are tracked."""
        return JointStates(self, tracked)

    def contexts(self, part: JointConjunct) -> list[int]:
        """Return what a conjunct may see held by robots that do not fly: unions of first and last letters.

        Raises:
            TooLarge: There are too many.
        """
        ends = {mask & part.mask for mask in self.first}
        for label, system in zip(self.team.label, self.team.systems, strict=True):
            final = range(len(label)) if system.final is None else system.final
            ends |= {self.masks[label[node]] & part.mask for node in final}
        found = {0}
        for end in ends:
            found |= {end | other for other in found}
            if len(found) > MAX_CONTEXTS:
                raise TooLarge("What robots may hold takes", len(found), "sets of propositions", MAX_CONTEXTS)
        return sorted(found)

    def failing_orders(self, run: TeamRun) -> dict[int, tuple[int, ...]]:
        """Return, for each conjunct that some order of flying breaks, such an order.

        Raises:
            TooLarge: There are too many different orders.
        """
        found: dict[int, tuple[int, ...]] = {}
        letters = [[self.masks[letter] for letter in word] for word in self.team.letters_of(run.paths)]
        for index, part in enumerate(self.parts):
            words = WordEffects(part, None)
            bad = words.failing_order([words.of(word) for word in letters])
            if bad is not None:
                found[index] = bad
        return found

    def broken(self, run: TeamRun) -> tuple[int, ...]:
        """Return the conjuncts, by index, that some order of flying breaks."""
        return tuple(self.failing_orders(run))

    def failing_order(self, run: TeamRun) -> tuple[int, ...] | None:
        """Return an order of flying in which a run breaks the formula, or None."""
        return next(iter(self.failing_orders(run).values()), None)


_Place = tuple[int, tuple[int, ...], int, int, tuple[int, ...], tuple[tuple[int, ...], ...]]
"""Who flies, the conjuncts' states, what that robot and those who have landed hold, and for each tracked conjunct what the
flying robot's word does so far and what the words before it did."""

_NOT_YET = -1  # what a robot holds whose word has not begun


@dataclass(frozen=True, slots=True)
class _Shown:
    """What a letter of the team leads to, in the order in which robots are followed.

    Attributes:
        states: The conjuncts' states.
        rest: A lower bound on what is left to fly.
        missing: What must still be shown, as bits.
        asked: The propositions that unfinished conjuncts speak of.
    """

    states: tuple[int, ...]
    rest: float
    missing: int
    asked: int


class JointStates:
    """How far the team is (see `team_states.SearchStates`)."""

    def __init__(self, joint: JointTask, tracked: Sequence[int]) -> None:
        self._parts = joint.parts
        self._masks = joint.masks
        self._heuristic = joint.heuristic
        robots = len(joint.first)
        self._waiting = [0] * robots  # held by those still to fly
        for robot in range(robots - 1, 0, -1):
            self._waiting[robot - 1] = self._waiting[robot] | joint.first[robot]
        self._words = [WordEffects(joint.parts[index], joint.contexts(joint.parts[index])) for index in tracked]
        self._orders = [
            (place, index, JointOrderBounds(words, index, joint.heuristic))
            for place, (index, words) in enumerate(zip(tracked, self._words, strict=True))
            if joint.repeats and joint.heuristic.knows(index)
        ]
        self._numbers: dict[_Place, int] = {}
        self._places: list[_Place] = []
        self._after: list[dict[int, int]] = []
        self._handed_over: dict[int, int] = {}
        self._kept: dict[tuple[int, tuple[int, ...], int, bool], bool] = {}
        self._shown: dict[tuple[tuple[int, ...], int, bool], _Shown | None] = {}
        self._rest: list[float] = []
        self._missing: list[int] = []
        self.initial = self._number(
            (0, tuple(part.initial for part in self._parts), _NOT_YET, 0, (), ((),) * len(tracked)), 0.0, 0
        )

    def after(self, number: int, letter: int) -> int:
        """Return the state after a letter of the robot that flies; `DEAD` where the task is lost."""
        found = self._after[number].get(letter)
        if found is None:
            found = self._after[number][letter] = self._read(self._places[number], self._masks[letter])
        return found

    def _read(self, place: _Place, letter: int) -> int:
        robot, states, own, held, elements, before = place
        shown = letter | held | self._waiting[robot]
        # the first letter of a later robot was held, and read, all the time
        key = states, shown, own != _NOT_YET or robot == 0
        then = self._shown.get(key)
        if then is None:
            if key not in self._shown:
                then = self._shown[key] = self._read_by_all(*key)
            if then is None:
                return DEAD
        if own == _NOT_YET:
            elements = tuple([words.begin(letter) for words in self._words])
        else:
            elements = tuple([words.read(element, letter) for words, element in zip(self._words, elements, strict=True)])
        rest, missing = then.rest, then.missing
        for at, index, bound in self._orders:
            left, needed = bound(elements[at], before[at], self._waiting[robot])
            plain = self._heuristic.of(index, then.states[index], shown)
            if left > plain:
                rest += left - plain
            missing |= needed
        if rest == UNREACHABLE:
            return DEAD
        return self._number((robot, then.states, letter & then.asked, held & then.asked, elements, before), rest, missing)

    def _read_by_all(self, states: tuple[int, ...], shown: int, is_new: bool) -> _Shown | None:
        """Return what a letter of the team leads to; None where the task is lost."""
        if is_new:
            states = tuple(part.step(state, shown) for part, state in zip(self._parts, states, strict=True))
            if DEAD in states:
                return None
        rest = self._heuristic(states, shown)
        if rest == UNREACHABLE:
            return None
        asked = 0
        for part, state in zip(self._parts, states, strict=True):
            asked |= 0 if part.finished(state) else part.mask
        return _Shown(states, rest, self._heuristic.missing(states, shown), asked)

    def handed_over(self, number: int) -> int:
        """Return the state when a robot has landed and the next one has not begun; `DEAD` where some order is lost."""
        found = self._handed_over.get(number)
        if found is None:
            robot, states, own, held, elements, before = self._places[number]
            done = tuple(tuple(sorted((*those, element))) for those, element in zip(before, elements, strict=True))
            if all(self._is_kept(i, numbers, self._waiting[robot], finished=False) for i, numbers in enumerate(done)):
                found = self._number(
                    (robot + 1, states, _NOT_YET, held | own, (), done), self._rest[number], self._missing[number]
                )
            else:
                found = DEAD
            self._handed_over[number] = found
        return found

    def rest(self, number: int, robot: int, node: int) -> float:
        """Return a lower bound on the cost that is left with a robot at a node.

        Args:
            number: The state.
            robot: The robot that flies.
            node: Where it is.
        """
        return max(self._rest[number], self._heuristic.tree_bound(self._missing[number], robot, node))

    def is_accepting(self, number: int) -> bool:
        """Tell whether everything is done, in the order in which the robots were followed."""
        return all(part.accepting(state) for part, state in zip(self._parts, self._places[number][1], strict=True))

    def holds_in_every_order(self, number: int) -> bool:
        """Tell whether the words keep the tracked conjuncts in every order of the robots."""
        _, _, _, _, elements, before = self._places[number]
        pairs = enumerate(zip(before, elements, strict=True))
        return all(self._is_kept(i, tuple(sorted((*those, element))), 0, finished=True) for i, (those, element) in pairs)

    def _is_kept(self, index: int, numbers: tuple[int, ...], waiting: int, *, finished: bool) -> bool:
        words = self._words[index]
        if not finished and words.never_lost:
            return True
        key = (index, numbers, waiting & words.part.mask, finished)
        found = self._kept.get(key)
        if found is None:
            bad = words.failing_order(numbers, waiting=waiting, finished=finished)
            found = self._kept[key] = bad is None
        return found

    def _number(self, place: _Place, rest: float, missing: int) -> int:
        found = self._numbers.get(place)
        if found is None:
            found = self._numbers[place] = len(self._places)
            self._places.append(place)
            self._after.append({})
            self._rest.append(rest)
            self._missing.append(missing)
        return found
