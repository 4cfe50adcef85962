"""Plans of teams whose robots are counted: paths, concurrent steps, and the robots that rest between these.

`stages` finds moves that may be made at the same time: within a stage the formula allows every order, and between stages robots wait. A course is a list of moves one after another. Moves are put into one stage for as long as all the orders in which their
letters can come, those of robots that do the same at one instant too, leave the conjuncts in states from which the rest of the
course does what is asked. A robot sets out for a move of the next stage when all that move in this one have arrived.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from ltlplan.search.counting.counting_propositions import ConjunctMarks, Marks, Sums
from ltlplan.search.counting.interleavings import Interleaved, in_all_orders, total
from ltlplan.systems.transition_systems import TransitionSystem

Turn = tuple[int, int, int]
"""A robot's move in a plan: which robot, and its places in its path before and after that move."""
_Shown = tuple[int, tuple[Sums, ...]]
"""One robot's move as the formula sees it: which robot, and the marks that it makes along the way."""


def keep(marks: Marks, begin: Sequence[Sums], turns: Sequence[_Shown]) -> bool:
    """Tell whether turns, one after another, do what is asked.

    Args:
        marks: What the formula sees.
        begin: The marks that each robot makes at its start.
        turns: In order.
    """
    return all(_Reader(conjunct, begin, turns).allows(0, 0) for conjunct in marks.conjuncts)


def stages(marks: Marks, begin: Sequence[Sums], turns: Sequence[_Shown]) -> list[tuple[int, ...]] | None:
    """Return turns, by index, in stages; None where even one after another they do not do what is asked.

    Args:
        marks: What the formula sees.
        begin: The marks that each robot makes at its start.
        turns: In an order that does what is asked.
    """
    readers = [_Reader(conjunct, begin, turns) for conjunct in marks.conjuncts]
    if not all(reader.allows(0, 0) for reader in readers):
        return None
    found: list[tuple[int, ...]] = []
    at = 0
    while at < len(turns):
        end = _end_of_stage(readers, at, len(turns))
        for reader in readers:
            reader.go_on(at, end)
        found.append(tuple(range(at, end)))
        at = end
    return found


def _end_of_stage(readers: Sequence[_Reader], at: int, count: int) -> int:
    """Return up to which turn all can be made at the same time."""
    size, step = 1, 1
    while step:
        more = min(at + size + step, count)
        if at + size < count and all(reader.allows(at, more) for reader in readers):
            size, step = more - at, step * 2
        else:
            step = step // 2 if at + size < count else 0
    return at + size


class _Reader:
    """One conjunct that reads turns, of which it sees only the marks that concern it: what it does not see changes nothing for it.

    Args:
        conjunct: The conjunct.
        begin: The marks that each robot makes at its start.
        turns: All of them.
    """

    def __init__(self, conjunct: ConjunctMarks, begin: Sequence[Sums], turns: Sequence[_Shown]) -> None:
        self._read, self._accepting = conjunct.read, conjunct.part.accepting
        self._held, self._turns = list(map(conjunct.cut, begin)), list[_Shown]()
        now = list(self._held)
        for robot, way in turns:
            letters = [now[robot], *map(conjunct.cut, way)]
            seen = [b for a, b in itertools.pairwise(letters) if a != b or not conjunct.part.repeats]
            self._turns.append((robot, tuple(seen)))
            now[robot] = letters[-1]
        self._states = {self._read(conjunct.part.initial, total(self._held))}

    def allows(self, at: int, end: int) -> bool:
        """Tell whether some turns at the same time, then all later ones one after another, do what is asked."""
        held = self._held_after(at, end)
        return bool(self._at_once(at, end, lambda state: self._is_done_by(state, held, end)))

    def go_on(self, at: int, end: int) -> None:
        """Make some turns at the same time."""
        self._states, self._held = self._at_once(at, end), self._held_after(at, end)

    def _is_done_by(self, state: int, held: Sequence[Sums], at: int) -> bool:
        """Tell whether the turns from some one on, one after another, lead from a state to where everything is done."""
        now, sums = list(held), total(held)
        for robot, way in self._turns[at:]:
            for shown in way:
                sums = tuple([all_of - old + new for all_of, old, new in zip(sums, now[robot], shown, strict=True)])
                now[robot], state = shown, self._read(state, sums)
        return self._accepting(state)

    def _held_after(self, at: int, end: int) -> list[Sums]:
        """Return the marks that each robot makes after some turns."""
        last = {robot: way[-1] for robot, way in self._turns[at:end] if way}
        return [last.get(robot, own) for robot, own in enumerate(self._held)]

    def _at_once(self, at: int, end: int, done: Callable[[int], bool] = lambda _: True) -> set[int]:
        """Return the states that all orders of some turns lead to; none where one will not do, or they are too many."""
        ways: dict[int, tuple[Sums, ...]] = {}  # a robot makes its own turns one after another
        for robot, way in self._turns[at:end]:
            if way:
                ways[robot] = (*ways.get(robot, (self._held[robot],)), *way)
        kinds = Counter(ways.values())
        others = [own for robot, own in enumerate(self._held) if robot not in ways] or [(0,) * len(self._held[0])]
        team = Interleaved(tuple(kinds), tuple(kinds.values()), total(others))
        return in_all_orders(self._read, self._states, team, done=done)


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
        task: The task that it was put in for, by number; None for moves that counts ask for.
    """

    robot: int
    path: tuple[int, ...]
    shown: tuple[Sums, ...]
    cost: float
    task: int | None = None


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


def may_crowd(systems: Sequence[TransitionSystem], plan: CountedPlan, rooms: Mapping[str, int]) -> bool:
    """Tell whether more robots come to a small region than it holds, at any times, so that waits may be needed for its sake.

    Args:
        systems: One for each robot.
        plan: Its paths.
        rooms: The number of robots that each small region holds.
    """
    ways = zip(systems, plan.paths, strict=True)
    come = Counter(region for system, path in ways for region in {r for node in path for r in system.nodes[node].regions})
    return any(come[region] > most for region, most in rooms.items())


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
