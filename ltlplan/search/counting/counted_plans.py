"""Plans of teams whose robots are counted: paths, concurrent steps, and the robots that rest between these.

`stages` finds moves that may be made at the same time: within a stage the formula allows every order, and between stages robots wait. A course is a list of moves one after another. Moves are put into one stage for as long as all the orders in which their
letters can come, those of robots that do the same at one instant too, leave the conjuncts in states from which the rest of the
course does what is asked. A robot sets out for a move of the next stage when all that move in this one have arrived.
"""

from __future__ import annotations

import itertools
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

from ltlplan.search.counting.counting_propositions import Marks, States, Sums
from ltlplan.systems.transition_systems import TransitionSystem
from verify.data import Letter

Turn = tuple[int, int, int]
"""A robot's move in a plan: which robot, and its places in its path before and after that move."""
MOST_STEPS = 20_000
"""Steps of trying all orders of one stage's moves."""
_Shown = tuple[int, tuple[Sums, ...]]
"""One robot's move as the formula sees it: which robot, and the marks that it makes along the way."""
_Progress = tuple[tuple[int, ...], ...]
"""For each kind of move how many robots are at each of its letters."""


def stages(marks: Marks, begin: Sequence[Sums], turns: Sequence[_Shown]) -> list[tuple[int, ...]] | None:
    """Return turns, by index, in stages; None where even one after another they do not do what is asked.

    Args:
        marks: What the formula sees.
        begin: The marks that each robot makes at its start.
        turns: In an order that does what is asked.
    """
    first = marks.begin(_total(begin))
    if first is None or not _is_done_by(marks, {first}, begin, turns):
        return None
    found: list[tuple[int, ...]] = []
    held, states, at = begin, {first}, 0
    while at < len(turns):
        size, states = _longest(marks, states, held, turns[at:])
        held = _held_after(held, turns[at : at + size])
        found.append(tuple(range(at, at + size)))
        at += size
    return found


def _longest(marks: Marks, states: set[States], held: Sequence[Sums], turns: Sequence[_Shown]) -> tuple[int, set[States]]:
    """Return how many of the first turns can be made at the same time, and the states that this can lead to."""

    def possible(size: int) -> set[States] | None:
        after = _at_once(marks, states, held, turns[:size])
        done = after is not None and _is_done_by(marks, after, _held_after(held, turns[:size]), turns[size:])
        return after if done else None

    best = possible(1)
    assert best is not None  # the course does what is asked one turn after another
    size, step = 1, 1
    while step:
        more = possible(min(size + step, len(turns))) if size < len(turns) else None
        if more is not None:
            size, best, step = min(size + step, len(turns)), more, step * 2
        else:
            step = step // 2 if size < len(turns) else 0
    return size, best


def _held_after(held: Sequence[Sums], turns: Sequence[_Shown]) -> list[Sums]:
    """Return the marks that each robot makes after some turns."""
    last = {robot: shown[-1] for robot, shown in turns}
    return [last.get(robot, own) for robot, own in enumerate(held)]


def _is_done_by(marks: Marks, states: set[States], held: Sequence[Sums], turns: Sequence[_Shown]) -> bool:
    """Tell whether turns, one after another, lead from all these states to where everything is done."""
    now = list(held)
    for robot, way in turns:
        for shown in way:
            now[robot] = shown
            sums = _total(now)
            after = {marks.read(state, sums) for state in states}
            states = {state for state in after if state is not None}
            if None in after:
                return False
    return all(marks.accepting(state) for state in states)


def _at_once(marks: Marks, states: set[States], held: Sequence[Sums], turns: Sequence[_Shown]) -> set[States] | None:
    """Return the states that all orders of some robots' letters lead to; None where one loses the task, or they are too many."""
    ways: dict[int, tuple[Sums, ...]] = {}  # a robot makes its own turns one after another
    for robot, way in turns:
        ways[robot] = (*ways.get(robot, (held[robot],)), *way)
    kinds = Counter(ways.values())
    others = _total([own for robot, own in enumerate(held) if robot not in ways] or [(0,) * len(held[0])])
    return _in_all_orders(marks, states, _Team(tuple(kinds), tuple(kinds.values()), others))


@dataclass(frozen=True, slots=True)
class _Team:
    """Robots that make letters one after another, in kinds that are alike.

    Attributes:
        ways: The letters of each kind's robots, that before the first move included.
        counts: How many there are of each.
        others: The marks that all other robots make.
    """

    ways: tuple[tuple[Sums, ...], ...]
    counts: tuple[int, ...]
    others: Sums


@dataclass(frozen=True, slots=True)
class _Wait:
    """No robot of kind `then` comes to its letter `due` before all robots of kind `first` have come to their letter `done`."""

    first: int
    done: int
    then: int
    due: int

    def allows(self, before: _Progress, after: _Progress) -> bool:
        """Tell whether what happens at one instant keeps it."""
        return sum(after[self.then][self.due :]) == sum(before[self.then][self.due :]) or not any(
            before[self.first][: self.done]
        )


def _in_all_orders(marks: Marks, states: set[States], team: _Team, waits: Sequence[_Wait] = ()) -> set[States] | None:
    """Return the states that all orders of a team's letters lead to; None where one loses the task, or they are too many."""
    start = tuple((count, *(0,) * (len(way) - 1)) for way, count in zip(team.ways, team.counts, strict=True))
    layers: dict[int, dict[_Progress, set[States]]] = defaultdict(dict)
    layers[0][start] = states
    last, steps = sum(count * (len(way) - 1) for way, count in zip(team.ways, team.counts, strict=True)), 0
    for depth in range(last):
        for progress, here in layers.pop(depth, {}).items():
            for after, shown in _further(team.ways, progress):
                if not all(wait.allows(progress, after) for wait in waits):
                    continue
                steps += len(here)
                if steps > MOST_STEPS:
                    return None
                sums = _total((team.others, *shown))
                read = {marks.read(state, sums) for state in here}
                if None in read:
                    return None
                reached = layers[_depth(after)].setdefault(after, set())
                reached |= {state for state in read if state is not None}
    return next(iter(layers[last].values()))


def _depth(progress: _Progress) -> int:
    return sum(place * count for counts in progress for place, count in enumerate(counts))


def _further(kinds: Sequence[tuple[Sums, ...]], progress: _Progress) -> Iterator[tuple[_Progress, tuple[Sums, ...]]]:
    """Yield what can follow when some robots, one at least, go on by one letter at one instant, with the marks that each kind makes then."""
    options = map(_options, kinds, progress)
    for chosen in itertools.islice(itertools.product(*options), 1, None):  # the first one is that nobody does
        after, shown = zip(*chosen, strict=True)
        yield after, shown


@lru_cache(maxsize=10_000)
def _options(way: tuple[Sums, ...], counts: tuple[int, ...]) -> list[tuple[tuple[int, ...], Sums]]:
    """Return what can follow for one kind, how many of which are at each of their letters; at first that nobody goes on."""
    found: list[tuple[tuple[int, ...], Sums]] = []
    for going in itertools.product(*(range(count + 1) for count in counts[:-1])):
        after = tuple(count - out + new for count, out, new in zip(counts, (*going, 0), (0, *going), strict=True))
        found.append((after, tuple(sum(a * m for a, m in zip(after, marks, strict=True)) for marks in zip(*way, strict=True))))
    return found


def _total(held: Sequence[Sums]) -> Sums:
    return tuple(map(sum, zip(*held, strict=True)))


@dataclass(frozen=True, slots=True)
class CountedPlan:
    """The robots' paths, and which robot waits for which others.

    Attributes:
        paths: Nodes of each robot's system.
        turns: Moves, in an order that satisfies the formula.
        stages: Turns, by index, that are made at the same time; those of one stage begin when all of the one before have ended.
        cost: Sum over the robots, or the highest cost of one.
        bound: No plan that makes one move after another costs less.
        reached: States that were seen.
        stays: Whether some robot stays for good where no other robot can wait for it.
    """

    paths: tuple[tuple[int, ...], ...]
    turns: tuple[Turn, ...]
    stages: tuple[tuple[int, ...], ...]
    cost: float
    bound: float
    reached: int
    stays: bool = False


@dataclass(frozen=True, slots=True)
class Flown:
    """One robot's move in a plan.

    Attributes:
        robot: Its number.
        path: Nodes of its system after the one that it leaves.
        shown: The marks that it makes on the way.
        cost: Of the way.
    """

    robot: int
    path: tuple[int, ...]
    shown: tuple[Sums, ...]
    cost: float


def in_stages(systems: Sequence[TransitionSystem], marks: Marks, moves: Sequence[Flown]) -> CountedPlan | None:
    """Return a plan in as few concurrent steps as its order allows; None where its moves, one after another, violate the formula.

    Args:
        systems: One for each robot.
        marks: The formula's propositions.
        moves: In order.

    Returns:
        The cost is the sum of the moves; the bound and the states are left at 0.
    """
    begin = [marks.of(system.robot, system.labels[system.initial]) for system in systems]
    found = stages(marks, begin, [(move.robot, move.shown) for move in moves])
    if found is None:
        return None
    paths: list[tuple[int, ...]] = [(system.initial,) for system in systems]
    turns: list[Turn] = []
    for move in moves:
        before = paths[move.robot]
        paths[move.robot] = (*before, *move.path)
        turns.append((move.robot, len(before), len(paths[move.robot])))
    return CountedPlan(tuple(paths), tuple(turns), tuple(found), sum(move.cost for move in moves), 0.0, 0)


def needed_waits(
    systems: Sequence[TransitionSystem], parts: Sequence[Marks], plan: CountedPlan
) -> list[tuple[int, int]] | None:
    """Return pairs of turns, by index, of which the second one begins when the first one has ended: no more than the formula needs.

    Robots that do the same wait for each other between their turns at first, and for nobody else. Where the formula does not hold in all
    orders that this leaves, all turns of a stage come before those of the next ones. Then waits are dropped one after another, where the
    formula holds without them (deordering: Baeckstroem, JAIR 1998). Each conjunct is looked at apart, by the changes that it sees. None says
    that not even stages could be tried within the budget.

    Args:
        systems: One for each robot.
        parts: The marks of each conjunct's propositions.
        plan: Its paths, turns and stages.
    """
    own: dict[int, list[int]] = defaultdict(list)
    for index, (robot, _, _) in enumerate(plan.turns):
        own[robot].append(index)
    letters = [tuple(system.labels[node] for node in path) for system, path in zip(systems, plan.paths, strict=True)]
    named = frozenset().union(*(part.named for part in parts))
    stage_of = {turn: number for number, stage in enumerate(plan.stages) for turn in stage}
    for staged in (False, True):
        alike: dict[object, list[int]] = defaultdict(list)
        for robot, indices in own.items():
            turns = tuple(plan.turns[index][1:] for index in indices)
            stage = tuple(stage_of[index] for index in indices) if staged else ()
            name = systems[robot].robot
            alike[letters[robot], turns, stage, name if name in named else ""].append(robot)
        kinds = list(alike.values())
        waits: dict[_Wait, list[tuple[int, int]]] = {}
        for (one, firsts), (other, thens) in itertools.product(enumerate(kinds), repeat=2):
            for i, j in itertools.product(own[firsts[0]], own[thens[0]]):
                at, to = own[firsts[0]].index(i), own[thens[0]].index(j)
                comes_first = stage_of[i] < stage_of[j] if staged else one == other and to == at + 1
                pairs = [(own[first][at], own[then][to]) for first in firsts for then in thens if first != then]
                if comes_first and pairs:
                    waits[_Wait(one, plan.turns[i][2] - 1, other, plan.turns[j][1])] = pairs
        seen = [_Seen(part, systems, letters, kinds) for part in parts]
        if all(part.holds(waits) for part in seen):
            kept = sorted(
                waits, key=lambda wait: (wait.first == wait.then, wait.due > 1)
            )  # those of others and at starts go first
            for wait in tuple(kept):
                left = [other for other in kept if other != wait]
                if all(part.holds(left) for part in seen):
                    kept = left
            return sorted(pair for wait in kept for pair in waits[wait])
    return None


class _Seen:
    """What one conjunct sees of a team: only the letters at which its marks change."""

    def __init__(
        self,
        marks: Marks,
        systems: Sequence[TransitionSystem],
        letters: Sequence[tuple[Letter, ...]],
        kinds: Sequence[Sequence[int]],
    ) -> None:
        self._marks = marks
        self._places: list[list[int]] = []
        shown = [[marks.of(system.robot, letter) for letter in way] for system, way in zip(systems, letters, strict=True)]
        ways: list[tuple[Sums, ...]] = []
        for robots in kinds:
            way = shown[robots[0]]
            changes = [0, *(int(a != b) for a, b in itertools.pairwise(way))]
            self._places.append(list(itertools.accumulate(changes)))
            ways.append(tuple(each for each, change in zip(way, [1, *changes[1:]], strict=True) if change))
        moving = {robot for robots in kinds for robot in robots}
        still = [way[0] for robot, way in enumerate(shown) if robot not in moving]
        self._team = _Team(tuple(ways), tuple(map(len, kinds)), _total(still or [(0,) * len(shown[0][0])]))
        first = marks.begin(_total([way[0] for way in shown]))
        self._begin = None if first is None else {first}

    def holds(self, waits: Iterable[_Wait]) -> bool:
        """Tell whether the conjunct holds in all orders that keep waits, as far as could be tried."""
        if self._begin is None:
            return False
        places = self._places
        own = [replace(wait, done=places[wait.first][wait.done], due=places[wait.then][wait.due - 1] + 1) for wait in waits]
        after = _in_all_orders(self._marks, self._begin, self._team, own)
        return after is not None and all(self._marks.accepting(state) for state in after)


def has_room(systems: Sequence[TransitionSystem], plan: CountedPlan, rooms: Mapping[str, int]) -> bool:
    """Tell whether small regions hold all robots that rest in them between two stages, and at the end.

    Args:
        systems: One for each robot.
        plan: Its stages.
        rooms: The number of robots that each small region holds.
    """
    return not rooms or all(
        _regions(systems, enumerate(after))[region] <= most for _, _, after in _rests(plan) for region, most in rooms.items()
    )


def paths_are_free(systems: Sequence[TransitionSystem], plan: CountedPlan, rooms: Mapping[str, int]) -> bool:
    """Tell whether small regions hold all robots that rest in them, and no robot flies through one that resting robots fill.

    Args:
        systems: One for each robot.
        plan: Its stages.
        rooms: The number of robots that each small region holds.
    """
    for at, stage, _ in _rests(plan):
        moving = {plan.turns[turn][0] for turn in stage}
        waiting = _regions(systems, ((robot, node) for robot, node in enumerate(at) if robot not in moving))
        for robot, before, after in (plan.turns[turn] for turn in stage):
            passed = _regions(systems, ((robot, node) for node in plan.paths[robot][before:after]))
            if any(waiting[region] >= rooms[region] for region in passed.keys() & rooms.keys()):
                return False
    return has_room(systems, plan, rooms)


def stays_apart(systems: Sequence[TransitionSystem], plan: CountedPlan, rooms: Mapping[str, int]) -> bool:
    """Tell whether no robot waits for another, and no small region has too many in it or just outside it in the end.

    Where to hover outside regions beside others, and to wait there, is not planned.

    Args:
        systems: One for each robot.
        plan: Its stages.
        rooms: The number of robots that each small region holds.
    """
    ends = Counter(system.nodes[path[-1]].place for system, path in zip(systems, plan.paths, strict=True))
    fits = all(ends[region] <= most for region, most in rooms.items())
    return fits and len(plan.stages) == 1 and paths_are_free(systems, plan, rooms)


def _rests(plan: CountedPlan) -> Iterator[tuple[Sequence[int], tuple[int, ...], Sequence[int]]]:
    """Yield each stage with the node of each robot before and after it."""
    at = tuple(path[0] for path in plan.paths)
    for stage in plan.stages:
        ends = {plan.turns[turn][0]: plan.turns[turn][2] for turn in stage}  # of several turns of one robot the last one
        after = tuple(plan.paths[robot][ends[robot] - 1] if robot in ends else node for robot, node in enumerate(at))
        yield at, stage, after
        at = after


def _regions(systems: Sequence[TransitionSystem], nodes: Iterable[tuple[int, int]]) -> Counter[str]:
    """Return how often each region occurs in the nodes of some robots."""
    return Counter(region for robot, node in nodes for region in systems[robot].nodes[node].regions)
