"""Which moves of a team's cycles may be made at the same time: stages, between which robots wait for each other.

A lasso of the product is a list of moves one after another. Neighbouring moves are put into one stage for as long as every order in
which their letters can come, in every cycle anew, does what is asked. Between two stages robots wait where they are, as in plans that count.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from ltlplan.search.cycles.strong_components import components, graph_of
from ltlplan.search.cycles.team_readers import LetterReader, Reader
from ltlplan.search.cycles.team_system import NOBODY, SEAM, Nodes, TeamLetter, TeamSystem
from ltlplan.search.numbering import Numbers

MOST_PLACES = 20_000
"""Places that are looked at to tell whether every order will do."""


@dataclass(frozen=True, slots=True)
class Move:
    """One robot's way from where it rests to where it rests next, or what it does there.

    Attributes:
        robot: Which robot.
        way: Its nodes, the one where it begins first.
    """

    robot: int
    way: tuple[int, ...]


Stage = tuple[Move, ...]


@dataclass(frozen=True, slots=True)
class Course:
    """What a team does: stages once, then stages cycle by cycle.

    Attributes:
        begin: Each robot's node at the start.
        prefix: Stages before the first cycle.
        cycle: Stages of each cycle.
    """

    begin: Nodes
    prefix: tuple[Stage, ...]
    cycle: tuple[Stage, ...]


def staged(system: TeamSystem, readers: Sequence[Reader], course: Course, *, joint: bool) -> Course:
    """Return the course with as many moves at the same time as were found to do what is asked.

    Args:
        system: The team's.
        readers: The formula's conjuncts.
        course: One move a stage.
        joint: Whether changes at one instant show as one.
    """
    if any(reader.guesses for reader in readers):
        return course

    def will_do(prefix: Sequence[Stage], cycle: Sequence[Stage]) -> bool:
        return _every_order(system, readers, Course(course.begin, tuple(prefix), tuple(cycle)), joint=joint)

    if will_do(_all_at_once(course.prefix), _all_at_once(course.cycle)):
        return Course(course.begin, _all_at_once(course.prefix), _all_at_once(course.cycle))
    prefix, cycle = course.prefix, course.cycle
    cycle = _merged(cycle, lambda stages: will_do(prefix, stages))
    return Course(course.begin, _merged(prefix, lambda stages: will_do(stages, cycle)), cycle)


def _all_at_once(stages: tuple[Stage, ...]) -> tuple[Stage, ...]:
    return (tuple(itertools.chain(*stages)),) if stages else ()


def _merged(stages: tuple[Stage, ...], will_do: Callable[[tuple[Stage, ...]], bool]) -> tuple[Stage, ...]:
    at = 0
    while at + 1 < len(stages):
        more = (*stages[:at], (*stages[at], *stages[at + 1]), *stages[at + 2 :])
        if will_do(more):
            stages = more
        else:
            at += 1
    return stages


_Place = tuple[int, tuple[int, ...], Nodes, int, tuple[int, ...]]
"""Stage, how far each robot is in it, the robots' nodes, who moved last, and the conjuncts' states."""


def _every_order(system: TeamSystem, readers: Sequence[Reader], course: Course, *, joint: bool) -> bool:
    """Tell whether every order of a stage's letters, cycle by cycle, does what is asked."""
    stages = [_ways(stage, len(course.begin)) for stage in (*course.prefix, *course.cycle)]
    first = len(course.prefix)

    def read(states: tuple[int, ...], letter: TeamLetter) -> tuple[int, ...] | None:
        after: list[int] = []
        for reader, state in zip(readers, states, strict=True):
            if isinstance(reader, LetterReader) and reader.stays:
                after.append(int("held" in reader.seen(letter)))
                continue
            targets = tuple(reader.successors(state, letter))
            if not targets:
                return None
            after.append(targets[0])
        return tuple(after)

    begun = read(tuple(reader.initial for reader in readers), system.letter(course.begin, NOBODY))
    if begun is None:
        return False
    nobody = (0,) * len(course.begin)
    places: Numbers[_Place] = Numbers([(0, nobody, course.begin, NOBODY, begun)])
    edges: list[list[int]] = []
    for stage, done, nodes, mover, states in places.known:  # grows while it is walked
        found: list[int] = []
        for after in _following(stages, stage, done, nodes, mover, first, joint=joint):
            to, far, now, who = after
            if (now, who) != (nodes, mover):
                further = read(states, system.letter(now, who))
            else:  # nobody moves: the next stage begins, or the next cycle, in each of which all are read, those that rest, too
                further = states if to > stage else read(states, system.letter(now, SEAM))
            if further is None:
                return False
            found.append(places[to, far, now, who, further])
        if len(places) > MOST_PLACES:
            return False
        edges.append(found)
    return all(_comes_again(reader, k, places.known, edges) for k, reader in enumerate(readers))


def _comes_again(reader: Reader, k: int, order: Sequence[_Place], edges: Sequence[Sequence[int]]) -> bool:
    """Tell whether one conjunct accepts on every way that goes on for ever."""
    if isinstance(reader, LetterReader) and reader.stays:
        return all(order[place][4][k] for part in components(graph_of(edges)) for place in part)
    kept = [order[place][4][k] not in reader.accepting for place in range(len(order))]
    without = [[t for t in targets if kept[t]] if kept[place] else [] for place, targets in enumerate(edges)]
    return not components(graph_of(without))


def _ways(stage: Stage, robots: int) -> tuple[tuple[int, ...], ...]:
    """Return for each robot the nodes that it goes through in a stage, one after another."""
    return tuple(tuple(node for move in stage if move.robot == robot for node in move.way[1:]) for robot in range(robots))


# seven parameters: a place of the search, taken apart, and what it moves in
def _following(
    stages: Sequence[tuple[tuple[int, ...], ...]],
    stage: int,
    done: tuple[int, ...],
    nodes: Nodes,
    mover: int,
    first: int,
    *,
    joint: bool,
) -> Iterator[tuple[int, tuple[int, ...], Nodes, int]]:
    """Yield what can come next: a robot goes on, several at one instant, or the next stage begins."""
    if stage == len(stages):  # a cycle in which nobody moves
        yield stage, done, nodes, mover
        return
    ways = stages[stage]
    able = [robot for robot, way in enumerate(ways) if done[robot] < len(way)]
    if not able:
        after = stage + 1
        yield (first if after == len(stages) else after), (0,) * len(nodes), nodes, mover
        return
    for size in range(1, (len(able) if joint else 1) + 1):
        for movers in itertools.combinations(able, size):
            far, now = list(done), list(nodes)
            for robot in movers:
                now[robot] = ways[robot][done[robot]]
                far[robot] += 1
            yield stage, tuple(far), tuple(now), movers[0]
