"""A team word that breaks a formula, put together from flights of single robots.

`robots_apart` says which readings move the words on, and when. Here each robot gets a flight of its own that goes with them and
is read as seldom as it can be; the flights put side by side are the counterexample. It takes a time linear in the robots,
and is not always a shortest one.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction

from verify.data.errors import InternalError
from verify.data.language.word import Letter
from verify.model_checking.compositional.compositional_check import Moment, clock_of, find_schedule
from verify.model_checking.compositional.violation_automaton import BreakingWords
from verify.model_checking.robot_letters import RobotBehaviour
from verify.model_checking.team_graph import Observation

_Place = tuple[int, int, bool]
"""Index of a moment, node, and whether it has been read there."""


@dataclass(frozen=True, slots=True)
class _Action:
    """A robot goes on to a node, or is read at the one that it has come to."""

    moment: int
    node: int
    reads: bool


def broken_apart(
    robots: Sequence[RobotBehaviour], words: BreakingWords, *, timed: bool, clock_error: Fraction = Fraction(0), budget: int
) -> tuple[Observation, ...] | None:
    """Return the readings of a team word that breaks the formula; None where there is none.

    Args:
        robots: The team, with whole letters.
        words: What breaks the formula; has all letters of the robots, cut down to its propositions.
        timed: Whether the spans bind; otherwise only each robot's own order does.
        clock_error: How far each robot's clock may be off, in s.
        budget: Configurations that may be met.

    Raises:
        OutOfBudget: More were met.
        InternalError: The moves that were found are not those of any flights: a bug of ours.
    """
    schedule = find_schedule(robots, words, timed=timed, clock_error=clock_error, budget=budget)
    if schedule is None:
        return None
    clock = clock_of(robots, timed=timed, clock_error=clock_error)
    flights = [
        _Flight(robot, index, words, spans, schedule).actions()
        for index, (robot, spans) in enumerate(zip(robots, clock.spans, strict=True))
    ]
    nodes = [actions[0].node for actions in flights]
    rows = [actions[1:] for actions in flights]
    observations: list[Observation] = []
    at = [0] * len(robots)

    def act(index: int) -> None:
        action = rows[index][at[index]]
        at[index] += 1
        nodes[index] = action.node
        if action.reads:
            observations.append(Observation(index, robots[index].letters[action.node], tuple(nodes)))

    for moment, made in enumerate(schedule):
        if made.mover is not None:
            act(made.mover)
        for index, actions in enumerate(rows):
            while at[index] < len(actions) and actions[at[index]].moment == moment:
                act(index)
    return tuple(observations)


class _Flight:
    """One robot's way through all moments, with as few readings as can be."""

    def __init__(
        self, robot: RobotBehaviour, index: int, words: BreakingWords, spans: list[tuple[int, int]], schedule: list[Moment]
    ) -> None:
        number: dict[Letter, int] = {letter: i for i, letter in enumerate(words.letters)}
        self.robot = robot
        self.index = index
        self.words = words
        self.spans = spans
        self.schedule = schedule
        self.shown = [number[letter & words.normal.propositions] for letter in robot.letters]

    def actions(self) -> list[_Action]:
        """Return what it does in order; the first is where it begins."""
        came: dict[_Place, tuple[_Place | None, _Action | None]] = {}
        queue: deque[tuple[_Place, _Place | None, _Action | None]] = deque(
            ((0, node, False), None, _Action(0, node, reads=False)) for node in self.robot.initial
        )
        while queue:
            place, before, action = queue.popleft()
            if place in came:
                continue
            came[place] = before, action
            moment, node, read = place
            if read and moment + 1 == len(self.schedule) and node in self.robot.final:
                return _back(came, place)
            for after, done in self._next(place):
                if done is not None and done.reads:
                    queue.append((after, place, done))
                else:
                    queue.appendleft((after, place, done))
        raise InternalError(f"{self.robot.robot} has no flight that goes with a counterexample. This is a bug of ltlplan's.")

    def _next(self, place: _Place) -> Iterator[tuple[_Place, _Action | None]]:
        moment, node, read = place
        here = self.schedule[moment]
        if not read and self.words.free[here.state] >> self.shown[node] & 1:
            yield (moment, node, True), _Action(moment, node, reads=True)
        for target in self.robot.following[node]:
            if self._holds(target, here.rank):
                if self.robot.letters[target] == self.robot.letters[node]:
                    yield (moment, target, read), _Action(moment, target, reads=False)
                elif read:
                    yield (moment, target, False), _Action(moment, target, reads=False)
        if moment + 1 < len(self.schedule):
            following = self.schedule[moment + 1]
            if following.mover == self.index:
                if self.shown[node] == following.letter:
                    yield (moment + 1, node, True), _Action(moment + 1, node, reads=True)
            elif self._holds(node, following.rank):
                yield (moment + 1, node, read), None

    def _holds(self, node: int, rank: int) -> bool:
        low, high = self.spans[node]
        return low <= rank <= high


def _back(came: dict[_Place, tuple[_Place | None, _Action | None]], place: _Place) -> list[_Action]:
    actions: list[_Action] = []
    at: _Place | None = place
    while at is not None:
        at, action = came[at]
        if action is not None:
            actions.append(action)
    return actions[::-1]
