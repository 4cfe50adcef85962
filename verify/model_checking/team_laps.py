"""All words of a team that flies laps for ever, as one behaviour of the kind that `lassos` holds against a formula.

Laps of a team begin together: each starts on a common signal from a rest, so that two clocks never differ by more than they may.
At a seam one robot may already be in the next lap while another one is still in the last, and in between all may wait for as
long as they like. A state is the node of every robot and who is a lap ahead of the slowest; nodes are held together where their
spans, moved by the length of a lap for those who are ahead, overlap. A wait adds no state: whoever rests is at the instant at
which its lap ends, and may be there together with all others whose laps end then.

Under the reading `own` a robot is read at least once in each of its letters, and a letter that is held over the end of a lap counts
anew in the next, so that a robot that rests in `a` for ever shows `a` again and again.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

from verify.data.errors import BadInput
from verify.data.language.word import Letter
from verify.data.sections import TeamReading
from verify.logic.progression import OutOfBudget
from verify.logic.team_letters import Together
from verify.model_checking.reading_times import held_times
from verify.model_checking.robot_letters import RobotBehaviour
from verify.model_checking.team_graph import MAX_TOGETHER
from verify.model_checking.timeline import Timeline

Nodes = tuple[int, ...]


def require_common_laps(timelines: Mapping[str, Timeline]) -> None:
    """Reject a team whose laps do not begin and end together.

    Args:
        timelines: One for each robot, with cycles.

    Raises:
        BadInput: They do not.
    """
    first = next(iter(timelines.values()))
    for name, timeline in timelines.items():
        if (timeline.cycle, timeline.duration) != (first.cycle, first.duration):
            raise BadInput(
                f"{name}'s lap is not {first.robot}'s: the laps of a team begin and end together, whoever has arrived waiting for the "
                "others."
            )


@dataclass(frozen=True, slots=True)
class _State:
    """Nodes of all robots, with their progress in the lap.

    Attributes:
        nodes: Each robot's node.
        ahead: Bits: who is one lap ahead of the slowest. Never all of them.
        read: Bits, under `own`: whose present letter has been read in this lap.
    """

    nodes: Nodes
    ahead: int
    read: int


@dataclass(frozen=True, slots=True)
class Reading:
    """One position of a team's word.

    Attributes:
        robot: Index of the robot that is read; None for the letters of all.
        nodes: Node of every robot at that time.
        span: From when to when it can be read, in s, within the lap of the slowest.
    """

    robot: int | None
    nodes: Nodes
    span: tuple[Fraction, Fraction]


@dataclass(frozen=True, slots=True)
class TeamWords:
    """The words of a team.

    Attributes:
        names: The robots', by their index in readings.
        behaviour: One node for each reading, the letter being what is read; laps are the first robot's.
        readings: What each node is.
    """

    names: tuple[str, ...]
    behaviour: RobotBehaviour
    readings: tuple[Reading, ...]


def alone(robot: RobotBehaviour) -> TeamWords:
    """Return one robot's own behaviour as the words of a team."""
    readings = tuple(Reading(0, (node,), span) for node, span in enumerate(held_times(robot)))
    return TeamWords((robot.robot,), robot, readings)


@dataclass(frozen=True, slots=True)
class Lap:
    """Begin and end of the team's cycles.

    Attributes:
        start: End of the prefix, in s.
        stop: End of the first lap, in s.
        clock_error: How far two clocks may be apart, in s.
    """

    start: Fraction
    stop: Fraction
    clock_error: Fraction = Fraction(0)

    def __post_init__(self) -> None:
        """Reject laps that clocks cannot tell apart.

        Raises:
            BadInput: Two clocks may be half a lap apart.
        """
        if 2 * self.clock_error >= self.stop - self.start:
            raise BadInput(
                f"A clock error of {float(self.clock_error):g} s is half of a lap of {float(self.stop - self.start):g} s, or more: "
                "it could not be told which lap a robot is in. It must be less than half a lap."
            )


def team_words(
    robots: Sequence[RobotBehaviour], lap: Lap, reading: TeamReading, budget: int, *, together: Together | None = None
) -> TeamWords:
    """Return all words of a team that flies laps.

    Args:
        robots: All that each robot may do; every one has laps.
        lap: When laps begin.
        reading: "own" reads one robot's letter at a time, "joint" what all show.
        budget: States of the team that may be met; silent steps may be 20 times as many.
        together: Puts marked letters together, under "joint"; None takes their union.

    Raises:
        OutOfBudget: There are more than `budget` readings, or more than 20 times as many silent steps.
    """
    graph = _Graph(robots, lap, reading, together)
    return _Words(graph, budget).all()


_Step = tuple[Reading | None, _State, bool]
"""What is read (None: something changes and nobody looks), where that leads, whether the first robot begins a lap."""


class _Graph:
    """The team's states and steps."""

    def __init__(
        self, robots: Sequence[RobotBehaviour], lap: Lap, reading: TeamReading, together: Together | None = None
    ) -> None:
        self.robots, self.reading, self.together = tuple(robots), reading, together
        length, error = lap.stop - lap.start, lap.clock_error
        spans = [[[(a - error + by, b + error + by) for a, b in r.spans] for r in robots] for by in (0, length)]
        ends = {t for shifted in spans for rows in shifted for span in rows for t in span}
        rank = {t: i for i, t in enumerate(sorted(ends))}
        self._low = [[[rank[a] for a, _ in rows] for rows in shifted] for shifted in spans]
        self._high = [[[rank[b] for _, b in rows] for rows in shifted] for shifted in spans]
        self._everyone = (1 << len(self.robots)) - 1

    def initial(self) -> Iterator[_State]:
        """Yield every way to begin."""
        for nodes in itertools.product(*(robot.initial for robot in self.robots)):
            if self._together(nodes, 0):
                yield _State(nodes, 0, 0)

    def letter(self, reading: Reading) -> Letter:
        """Return what is read."""
        if reading.robot is not None:
            return self.robots[reading.robot].letters[reading.nodes[reading.robot]]
        letters = (robot.letters[node] for robot, node in zip(self.robots, reading.nodes, strict=True))
        if self.together is not None:
            return self.together((letter, 1) for letter in letters)
        return frozenset[str]().union(*letters)

    def steps(self, state: _State) -> Iterator[_Step]:
        """Yield what can come next.

        Raises:
            OutOfBudget: Too many robots can change their letters at one instant.
        """
        if self.reading == "own":
            for r in range(len(self.robots)):
                yield self.read(state, r), _State(state.nodes, state.ahead, state.read | 1 << r), False
        else:
            yield self.read(state, None), state, False
        for r, robot in enumerate(self.robots):
            node = state.nodes[r]
            for target in robot.following[node]:
                lap, changed = (node, target) in robot.laps, robot.letters[target] != robot.letters[node]
                if changed and not lap and self.reading == "joint":
                    continue  # below, with others' changes at the same instant
                if (changed or lap) and self.reading == "own" and not state.read >> r & 1:
                    continue
                moved = self._moved(state, r, target, lap=lap, changed=changed)
                if moved is not None:
                    yield None, moved, lap and r == 0
        if self.reading == "joint":
            for nodes in self._changes(state):
                moved = _State(nodes, state.ahead, 0)
                yield self.read(moved, None), moved, False

    def _moved(self, state: _State, r: int, target: int, *, lap: bool, changed: bool) -> _State | None:
        """Return the state after one robot has moved on while all others stay; None where that cannot be."""
        ahead, read = state.ahead, state.read
        if lap:
            if ahead >> r & 1:
                return None  # two laps ahead of the slowest
            ahead |= 1 << r
        nodes = (*state.nodes[:r], target, *state.nodes[r + 1 :])
        low, high = self._span(nodes, ahead, r)
        for other in range(len(nodes)):
            if other != r:
                first, last = self._span(nodes, ahead, other)
                if first > high or low > last:
                    return None
        if ahead == self._everyone:
            ahead = 0
        return _State(nodes, ahead, read & ~(1 << r) if lap or changed else read)

    def _changes(self, state: _State) -> Iterator[Nodes]:
        """Yield where robots can be after some of them have changed their letters at one instant."""
        latest = min(self._span(state.nodes, state.ahead, r)[1] for r in range(len(self.robots)))
        options: list[tuple[int, ...]] = []
        for r, robot in enumerate(self.robots):
            node = state.nodes[r]
            shift = state.ahead >> r & 1
            changing = [
                target
                for target in robot.following[node]
                if robot.letters[target] != robot.letters[node]
                and (node, target) not in robot.laps
                and self._low[shift][r][target] <= latest
            ]
            options.append((node, *changing))
        if sum(len(choices) > 1 for choices in options) > MAX_TOGETHER:
            raise OutOfBudget(f"more than {MAX_TOGETHER} robots can change their letters at one instant")
        for nodes in itertools.product(*options):
            if nodes != state.nodes and self._together(nodes, state.ahead):
                yield nodes

    def _together(self, nodes: Nodes, ahead: int) -> bool:
        spans = [self._span(nodes, ahead, r) for r in range(len(nodes))]
        return max(low for low, _ in spans) <= min(high for _, high in spans)

    def _span(self, nodes: Nodes, ahead: int, r: int) -> tuple[int, int]:
        shift = ahead >> r & 1
        return self._low[shift][r][nodes[r]], self._high[shift][r][nodes[r]]

    def read(self, state: _State, robot: int | None) -> Reading:
        """Return what one robot shows in a state, or all."""
        spans = [r.spans[node] for r, node in zip(self.robots, state.nodes, strict=True)]
        slow = spans if robot is None else [spans[robot]]
        if robot is None and state.ahead:
            slow = [span for r, span in enumerate(spans) if not state.ahead >> r & 1]
        low, high = max(a for a, _ in slow), min(b for _, b in slow)
        return Reading(robot, state.nodes, (min(low, high), max(low, high)))


class _Words:
    """The graph with silent steps removed: one node for each reading."""

    def __init__(self, graph: _Graph, budget: int) -> None:
        self.graph, self.budget = graph, budget
        self._index: dict[tuple[int | None, _State, bool], int] = {}
        self._order: list[tuple[Reading, _State, bool]] = []
        self._known: dict[_State, tuple[_Step, ...]] = {}
        self._silent = 0

    def all(self) -> TeamWords:
        """Follow every reading from the beginning on."""
        initial = tuple(dict.fromkeys(node for state in self.graph.initial() for node in self._first(state)))
        following: list[tuple[int, ...]] = []
        for _, state, _ in self._order:  # grows while it is walked
            following.append(tuple(self._after(state)))
        laps = {(a, b) for a, targets in enumerate(following) for b in targets if self._order[b][2]}
        readings = tuple(reading for reading, _, _ in self._order)
        behaviour = RobotBehaviour(
            "",
            tuple(self.graph.letter(reading) for reading in readings),
            tuple(reading.span for reading in readings),
            tuple(following),
            initial,
            frozenset(),
            frozenset(laps),
            (0,) * len(readings),
        )
        return TeamWords(tuple(robot.robot for robot in self.graph.robots), behaviour, readings)

    def _first(self, state: _State) -> list[int]:
        """Return the nodes that can be read first: what all show together is, before anything changes."""
        if self.graph.reading == "own":
            return self._after(state)
        return [self._number(self.graph.read(state, None), state, False)]

    def _after(self, state: _State) -> list[int]:
        """Return the nodes that can be read next: after any number of silent steps."""
        found: dict[int, None] = {}
        seen, stack = {(state, False)}, [(state, False)]
        while stack:
            here, lapped = stack.pop()
            steps = self._known.get(here)
            if steps is None:
                steps = self._known[here] = tuple(self.graph.steps(here))
            for reading, target, lap in steps:
                if reading is not None:
                    found[self._number(reading, target, lapped or lap)] = None
                elif (key := (target, lapped or lap)) not in seen:
                    self._silent += 1
                    seen.add(key)
                    stack.append(key)
            if self._silent > 20 * self.budget:
                raise OutOfBudget(f"more than {20 * self.budget} silent steps of the team")
        return sorted(found)

    def _number(self, reading: Reading, state: _State, lapped: bool) -> int:
        key = (reading.robot, state, lapped)
        if key not in self._index:
            if len(self._order) >= self.budget:
                raise OutOfBudget(f"more than {self.budget} readings of the team")
            self._index[key] = len(self._order)
            self._order.append((reading, state, lapped))
        return self._index[key]
